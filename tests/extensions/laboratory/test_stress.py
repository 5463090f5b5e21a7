"""Families of stress runs, the native engine in them, and verdicts on motions and forces."""

import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import KincheckError, Outcome, SolveError, cases, clear_caches
from kincheck.adapters import engine
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.extensions.laboratory.stress.families import FAMILIES, Family, Specimen
from kincheck.core.extensions.laboratory.stress.families.base import as_case
from kincheck.core.extensions.laboratory.stress.families.linkages import (
    any_plane,
    crank_rocker,
    four_bar,
)
from kincheck.core.extensions.laboratory.stress.reduction import judge as judge_file
from kincheck.core.extensions.laboratory.stress.reduction import reduce_case, round_geometry
from kincheck.core.extensions.laboratory.stress.report import report
from kincheck.core.extensions.laboratory.stress.run import specimen, specimens, stress
from kincheck.core.extensions.laboratory.stress.verdicts import (
    Verdict,
    judge_answer,
    once,
    refused_description,
    with_numpy_executor,
)
from kincheck.core.extensions.laboratory.truth.forces import known_forces
from kincheck.core.extensions.laboratory.truth.motion import Reach, follow_motion
from kincheck.core.failures import FailureKind
from kincheck.core.harness.execution import Answer, Failure, Pair
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.joints import AxialJoint
from kincheck.core.joints.base import unit

from ...support.engine_faults import changed
from ...support.fakes import Fake, native_but, raising
from ...support.loaded_slider_crank import GRAVITY, case_of, loaded

NATIVE = engine("native")
# Of a family whose specimens are of one kind, few show it.
FEWER = {"loops": 3, "folds": 3}
STRESS_FILES = sorted((Path(__file__).parents[2] / "data" / "stress").glob("*.toml"))


@pytest.mark.nightly
def test_stress_corner_beside_small_loop():
    """A corner that is turned round between two samples; stepped over where one sigma is asked for
    all blocks of the rows.
    """
    rng = np.random.default_rng(164)
    samples = int(rng.choice([2, 3, 4, 5, 7]))
    made = FAMILIES["corners"].specimen(rng, samples)
    case = made.case
    assert "beside a loop of 0.014" in made.name
    found = judge_answer(
        made, case, made.truth(case), once(Pair(case, with_numpy_executor(NATIVE), made.tol))
    )
    assert found.counts[Verdict.RIGHT] == samples


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", FAMILIES)
def test_stress_specimens_repeat_and_save(name, tmp_path):
    """The same numbers for the same seed, every kind of each family among them; a case file says
    all of them.
    """
    for number in range(FEWER.get(name, 12)):
        one, again = (
            FAMILIES[name].specimen(np.random.default_rng([4, number]), 6) for _ in range(2)
        )
        assert one.name == again.name
        case = one.case
        if isinstance(case, KincheckError):  # the description is refused before there is a case
            assert one.truth is None
            continue
        assert case.mechanism == again.case.mechanism
        assert np.ptp(case.sweep.path.values(case.sweep.path.times), axis=1).max() > 0.0
        file = tmp_path / f"{number}.toml"
        file.write_text(case_text(case, ["a comment"]), "utf-8")
        read = load_case(file)
        assert (read.mechanism, read.outputs) == (case.mechanism, case.outputs)
        assert (read.sweep.motions, read.sweep.rate) == (case.sweep.motions, case.sweep.rate)
        assert (read.sweep.values == case.sweep.values).all()


@pytest.mark.parametrize("samples", [32, pytest.param(160, marks=pytest.mark.nightly)])
def test_native_engine_never_silently_wrong(samples):
    """All families; the share of each in a run. Compiled: without machine code is
    another test.
    """
    found, _ = stress([*FAMILIES.values()], [NATIVE], samples=samples, seed=0)
    assert [cell.family for cell in found.cells] == [*FAMILIES]
    for verdict in (Verdict.SILENTLY_WRONG, Verdict.UNSUPPORTED):
        assert not [cell.family for cell in found.cells if cell.samples[verdict]]
    assert sum(sum(cell.samples.values()) for cell in found.cells) > samples - len(FAMILIES)
    assert all(proof.proved == proof.tried and proof.worst < 1e-2 for proof in found.proofs)
    tables = {section.title: section.rows for section in report(found).sections}
    assert tables["Proof of the truth at random samples"] == [
        [each.family, str(each.tried), str(each.proved), f"{each.worst:.1e}", ""]
        for each in found.proofs
    ]


def test_only_rounding_contradictions_are_accepted():
    found, _ = stress([FAMILIES["redundant"]], [NATIVE], samples=160, seed=0)
    accepted = [each for each in found.acceptances if each.accepted]
    assert accepted
    assert all(each.tilt < 1e-8 for each in accepted)
    refused = min((each.tilt for each in found.acceptances if not each.accepted), default=None)
    last = max(accepted, key=lambda each: each.tilt)
    tables = {section.title: section.rows for section in report(found).sections}
    assert tables["Contradictory hinges"] == [
        [
            last.engine,
            f"{last.tilt:.1e} rad",
            "never" if refused is None else f"{refused:.1e} rad",
            f"{last.told:.1e} of {last.unavoidable:.1e} m" if last.unavoidable else "no residual",
        ]
    ]


def test_error_bounded_over_thousand_turns():
    made = specimen(FAMILIES["drift"], 0, 0, 4001)
    assert made.case is not None
    assert made.truth is not None
    answer = once(Pair(made.case, NATIVE, 1e-12))
    assert isinstance(answer, Answer)
    error = (
        np.abs(answer.outputs["C.x"].position - made.truth.points["C"][0][:, 0])
        / made.truth.bounds["C"][0]
    )
    first, last = float(error[:400].max()), float(error[-400:].max())  # a hundred turns each
    assert 0.0 < last < 2.0 * first < 0.1


@pytest.mark.nightly
def test_numpy_solver_in_singular_family():
    found, _ = stress(
        [FAMILIES["singular"]], [with_numpy_executor(NATIVE)], samples=6, seed=0, prove=False
    )
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] == 0


@pytest.mark.by_day(2)
@pytest.mark.parametrize("file", [*STRESS_FILES], ids=lambda file: file.stem)
def test_former_silent_errors_stay_fixed(file):
    """The smallest mechanisms found so far, a sample each."""
    assert judge_file(load_case(file), NATIVE, 1e-12).counts[Verdict.SILENTLY_WRONG] == 0


def test_failing_family_leaves_other_families():
    def defective(rng, samples):
        raise KincheckError("cannot be made")

    families = [Family("defective", "", defective), FAMILIES["offset"]]
    found, _ = stress(families, [NATIVE], samples=20, seed=0, prove=False)
    assert found.unfinished == {"defective": "cannot be made"}
    assert [cell.family for cell in found.cells] == ["offset"]


def test_failed_proofs_are_counted(monkeypatch):
    def refused(truth, sample):
        raise SolveError("singular at the design")

    monkeypatch.setattr(
        "kincheck.core.extensions.laboratory.stress.run.distance_from_proof", refused
    )
    found, _ = stress([FAMILIES["hardpoints"]], [NATIVE], samples=12, seed=0)
    (proofs,) = found.proofs
    assert proofs.tried > proofs.proved == 0
    assert "singular at the design" in proofs.reasons[0]


@pytest.mark.nightly
def test_starts_family_finds_rounded_starts(monkeypatch):
    """A tolerance of zero is the old rule: rounded and typed motions then start elsewhere."""
    made = specimens(FAMILIES["starts"], 1, 80)  # once, with their references
    monkeypatch.setattr("kincheck.core.extensions.laboratory.stress.run.specimens", lambda *_: made)
    found, _ = stress([FAMILIES["starts"]], [NATIVE], samples=80, seed=1, prove=False)
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] == 0
    assert found.cells[0].samples[Verdict.RIGHT] > 66
    monkeypatch.setattr("kincheck.core.kinematics.compiled.routes.TYPED", 0.0)
    clear_caches()
    found, _ = stress([FAMILIES["starts"]], [NATIVE], samples=80, seed=1, prove=False)
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] > 6


# Verdicts on the answers of a stress run


ROUNDING = frozenset({FailureKind.BELOW_ROUNDING})


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(8)
    mechanism, _ = four_bar(any_plane(rng), *crank_rocker(rng), "rod")
    return as_case(mechanism, "turn", np.linspace(-1.0, 1.0, 5))


@pytest.fixture(scope="module")
def truth(case):
    return follow_motion(case)


def fake(change=lambda motion: motion, failures=()):
    """An engine that answers with the native motion, changed."""

    def answer(found, case):
        points = {name: change(motion) for name, motion in found.points.items()}
        solved = np.isfinite([motion.position for motion in points.values()]).all(axis=(0, 2))
        return replace(found, points=points, solved=solved, failures=failures)

    return native_but(answer)


def judge(case, truth, engine, **about):
    return judge_answer(
        Specimen("one", case, **about), case, truth, once(Pair(case, engine, 1e-12))
    )


def moved(by, quantity="position", samples=slice(None)):
    def change(motion):
        values = getattr(motion, quantity).copy()
        values[samples] += by
        return replace(motion, **{quantity: values})

    return change


def test_verdict_on_right_answer(case, truth):
    found = judge(case, truth, NATIVE)
    assert found.counts[Verdict.RIGHT] == 5
    *motion, force = found.worst
    assert all(0.0 < ratio < 0.1 for ratio in motion)
    assert force is None


@pytest.mark.parametrize(
    ("quantity", "by"), [("position", 1e-12), ("velocity", 1e-10), ("acceleration", 1e-9)]
)
def test_verdict_on_error_beyond_round_off(case, truth, quantity, by):
    found = judge(case, truth, fake(moved(by, quantity, slice(1, 3))))
    assert list(found.verdicts == Verdict.SILENTLY_WRONG) == [False, True, True, False, False]
    assert found.elsewhere == 0
    assert found.first(Verdict.SILENTLY_WRONG) == 1


def test_verdict_on_other_assembly(case, truth):
    assert judge(case, truth, fake(moved(0.1))).elsewhere == 5


def test_verdict_on_answer_beyond_reach(case, truth):
    beyond = replace(truth, reach=np.array([Reach.BEYOND, *[Reach.REACHED] * 4]))
    found = judge(case, beyond, NATIVE)
    assert (found.counts[Verdict.SILENTLY_WRONG], found.elsewhere) == (1, 1)
    assert (
        judge(case, None, NATIVE, reasons=frozenset(FailureKind)).counts[Verdict.SILENTLY_WRONG]
        == 5
    )


def test_verdict_on_unknown_truth(case, truth):
    unknown = replace(truth, reach=np.array([*[Reach.REACHED] * 4, Reach.UNKNOWN]))
    assert judge(case, unknown, fake(moved(0.1))).counts == {
        **dict.fromkeys(Verdict, 0),
        Verdict.SILENTLY_WRONG: 4,
        Verdict.UNJUDGED: 1,
    }


@pytest.mark.parametrize(
    ("singular", "failures", "about", "right"),
    [
        (False, [FailureKind.SINGULAR_AHEAD], {}, 0),  # there is none
        (True, [FailureKind.SINGULAR_AHEAD], {}, 2),
        (True, [], {}, 0),  # which names no cause
        (True, [FailureKind.TOO_MANY_PARTS], {}, 0),
        (False, [FailureKind.BELOW_ROUNDING], {"reasons": ROUNDING, "excused": True}, 2),
        # it can be solved, and is no excuse
        (False, [FailureKind.BELOW_ROUNDING], {"reasons": ROUNDING}, 0),
        (False, [FailureKind.FREE], {"reasons": ROUNDING, "excused": True}, 0),
    ],
    ids=[
        *("no singular pose", "singular pose", "no cause", "other cause", "excused", "no excuse"),
        "other reason",
    ],
)
def test_verdict_on_refusal_by_reason(case, truth, singular, failures, about, right):
    truth = replace(truth, singular=np.array([singular] * 2 + [False] * 3))
    found = judge(case, truth, fake(moved(np.nan, samples=slice(0, 2)), failures), **about)
    assert found.counts[Verdict.REFUSED_RIGHTLY] == right
    assert found.counts[Verdict.REFUSED_WRONGLY] == 2 - right
    assert found.counts[Verdict.RIGHT] == 3


def test_verdict_on_errors_and_crashes(case):
    free = SolveError("a body can turn", FailureKind.FREE)
    reasons = frozenset({FailureKind.FREE})
    refusing = Fake("native", raising(free))
    assert judge(case, None, refusing, reasons=reasons).counts[Verdict.REFUSED_RIGHTLY] == 5
    one = Specimen("one", case, None, reasons=reasons)
    for outcome, verdict in (
        (Outcome.CRASHED, Verdict.REFUSED_WRONGLY),
        (Outcome.UNSUPPORTED, Verdict.UNSUPPORTED),
    ):
        failure = Failure(outcome, "free", kind=FailureKind.FREE)
        assert judge_answer(one, case, None, failure).counts[verdict] == 5
    for refused, verdict in (
        (Specimen("one", free, None, reasons=reasons), Verdict.REFUSED_RIGHTLY),
        (Specimen("one", SolveError("odd"), None, reasons=reasons), Verdict.REFUSED_WRONGLY),
        (Specimen("one", free), Verdict.REFUSED_WRONGLY),
    ):
        assert refused_description(refused, 3).counts[verdict] == 3


def test_verdict_on_unreported_contradiction(case, truth):
    answer = once(Pair(case, NATIVE, 1e-12))
    assert isinstance(answer, Answer)
    one, violated = (
        Specimen("one", case, tilt=0.0),
        replace(truth, violated=np.array([0.0, 1e-10, 0.0, 0.0, 0.0])),
    )
    told = replace(answer, details={"redundant_residual": 5e-11})
    assert judge_answer(one, case, violated, answer).counts[Verdict.SILENTLY_WRONG] == 1
    assert judge_answer(one, case, violated, told).counts[Verdict.SILENTLY_WRONG] == 0


# Forces in the stress run: what is right, and every kind of mistake found


demand = importlib.import_module("kincheck.core.kinematics.forces.equations")
FORCES = FAMILIES["forces"]
# Numbers of specimens: a hinge twice, a four-bar of four hinges, a fast arm, a driven slide.
TWICE, FOUR_BAR, SPINNING, SLIDING = 21, 4, 5, 12
INTERPRETED = with_numpy_executor(NativeEngine())


@pytest.fixture(scope="module")
def made():
    """Two specimens with redundant rows, and the native answers."""
    found = {}
    for number in (TWICE, FOUR_BAR):
        one = specimen(FORCES, 0, number, 3)
        found[number] = one, INTERPRETED.solve(INTERPRETED.build(one.case), one.case, 1e-12)
    return found


class Changed:
    """The native answer with other forces."""

    def __init__(self, trajectory, change):
        self.trajectory, self.change = trajectory, change

    def __getattr__(self, name):
        return getattr(INTERPRETED, name)

    def solve(self, model, case, tol):
        return changed(self.trajectory, forces=self.change(self.trajectory.forces))


def verdicts(made, number, change=lambda forces: forces):
    one, trajectory = made[number]
    answer = once(Pair(one.case, Changed(trajectory, change), 1e-12))
    return judge_answer(one.specimen, one.case, one.truth, answer)


def joints(forces, change):
    return replace(forces, joints={name: change(each) for name, each in forces.joints.items()})


@pytest.mark.parametrize("number", [TWICE, FOUR_BAR])
def test_verdict_on_right_forces(made, number):
    found = verdicts(made, number)
    assert found.counts[Verdict.RIGHT] == len(found.verdicts)
    assert 0.0 < found.worst[3] < 0.1


def test_known_forces_determined_and_undetermined(made):
    for one, _ in made.values():
        known = known_forces(one.case, one.truth).values()
        assert any(each.determined.all() for each in known)
        assert any(each.undetermined.all() for each in known)
        assert not any((each.determined & each.undetermined).any() for each in known)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        (
            lambda f: replace(f, drivers={name: 1.001 * x for name, x in f.drivers.items()}),
            Verdict.WRONG_FORCE,
        ),
        (
            lambda f: joints(f, lambda each: replace(each, moment=each.moment + 1e-3)),
            Verdict.WRONG_FORCE,
        ),
        (
            lambda f: joints(f, lambda each: replace(each, free=0.0 * each.free)),
            Verdict.UNDETERMINED_FORCE,
        ),
        (
            lambda f: replace(f, drivers={name: np.nan * x for name, x in f.drivers.items()}),
            Verdict.MISSING_FORCE,
        ),
    ],
    ids=["drivers", "moments", "undetermined", "missing"],
)
def test_force_mistakes_are_named(made, change, verdict):
    found = verdicts(made, FOUR_BAR, change)
    assert found.counts[verdict] == len(found.verdicts)


def judge_specimen(number):
    one = specimen(FORCES, 0, number, 3)
    return judge_answer(one.specimen, one.case, one.truth, once(Pair(one.case, INTERPRETED, 1e-12)))


def test_missing_gyroscopic_moment_is_found(monkeypatch):
    """No gyroscopic moment."""
    monkeypatch.setattr(
        demand,
        "spin_change",
        lambda body, at: at.poses[body.name].turn(
            demand.inertia_of(body) @ demand.spin_of(body, at)[1]
        ),
    )
    assert judge_specimen(SPINNING).counts[Verdict.WRONG_FORCE] > 0


def test_force_of_offset_drive_is_judged(monkeypatch):
    """Its force acts at the internal origin of the second body."""
    right = AxialJoint.measured

    def wrong(self, freedom, i, j):
        P, h = vec(self.point), unit(self.axis)
        if freedom == "rotation":
            return right(self, freedom, i, j)
        return p.Dot20(h, ZERO, ZERO, i.arm(P) - j.arm(P))

    monkeypatch.setattr(AxialJoint, "measured", wrong)
    assert judge_specimen(SLIDING).counts[Verdict.WRONG_FORCE] == 3


def test_engine_without_forces_is_unjudged(made):
    found = verdicts(made, FOUR_BAR, lambda forces: None)
    assert found.counts[Verdict.UNSUPPORTED] == len(found.verdicts)


def test_force_case_is_rejudged_and_rounded(made):
    one, trajectory = made[FOUR_BAR]
    engine = Changed(
        trajectory, lambda f: joints(f, lambda each: replace(each, force=2.0 * each.force))
    )
    assert judge_file(one.case, engine, 1e-12).counts[Verdict.WRONG_FORCE] == len(
        one.case.sweep.values
    )
    short = round_geometry(one.case, 9)
    assert short is not None
    assert short.forces == one.case.forces


def test_reduced_case_keeps_relevant_parts():
    """What concerns the crank's pin alone is a crank on its pivot, with numbers of one digit."""
    found, _ = reduce_case(
        cases.load("rssr"), lambda case: "crank_pin_y" in [each.name for each in case.outputs]
    )
    mechanism = found.mechanism
    assert [each.name for each in mechanism.bodies] == ["crank"]
    assert [(each.name, each.position) for each in mechanism.points] == [
        ("crank_pin", (1.0, 0.0, 0.0))
    ]
    assert [each.name for each in found.outputs] == ["crank_pin_y"]


def test_reduction_drops_loads_of_removed_parts():
    """The two forces on the slider go; the others keep a case as it is."""
    case = case_of(loaded())

    def still(smaller):
        return any(each.name == "clock" for each in smaller.mechanism.forces)

    small, _ = reduce_case(case, still)
    assert [each.name for each in small.mechanism.forces] == ["clock"]
    assert [each.name for each in small.mechanism.moving] == ["crank"]
    assert small.mechanism.body("crank").mass == 2.0
    assert small.mechanism.gravity == GRAVITY
