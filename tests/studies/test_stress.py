"""Stress: outcomes, families, reduction, and a run of six hundred samples of the native engine."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck.adapters import engine
from kincheck.core import solve
from kincheck.core.caches import clear_caches
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.case_writer import case_text
from kincheck.core.errors import KincheckError, SolveError
from kincheck.core.failures import FailureKind
from kincheck.core.harness.execution import Answer, Failure, Pair
from kincheck.core.harness.record import Outcome
from kincheck.core.studies.stress.families import Family, Specimen
from kincheck.core.studies.stress.families.base import as_case
from kincheck.core.studies.stress.families.dimensions import crank_rocker
from kincheck.core.studies.stress.families.planar import any_plane, four_bar
from kincheck.core.studies.stress.reproducers import judge as judge_file
from kincheck.core.studies.stress.run import specimen, specimens, stress
from kincheck.core.studies.stress.shrink import fewer_samples, reduced, rounded
from kincheck.core.studies.stress.solving import interpreted, once
from kincheck.core.studies.stress.truth.reference_motion import Reach, followed
from kincheck.core.studies.stress.verdicts import Verdict, described_wrong, judged
from kincheck.core.trajectory import PointMotion

NATIVE = engine("native")
FAMILIES = Family.registry
ROUNDING = frozenset({FailureKind.BELOW_ROUNDING})


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(8)
    return as_case(
        four_bar(any_plane(rng), *crank_rocker(rng), "rod"), "turn", np.linspace(-1.0, 1.0, 5)
    )


@pytest.fixture(scope="module")
def truth(case):
    return followed(case)


class Fake:
    """An engine that answers with the native motion, changed."""

    name, mode, loop, settings = "native", "projection", "python", {}

    def __init__(self, change=lambda motion: motion, failures=(), fails=None):
        self.change, self.failures, self.fails = change, failures, fails

    def version(self):
        return "1"

    def unsupported(self, case):
        return None

    def build(self, case):
        if self.fails:
            raise self.fails
        return solve(case.mechanism, case.sweep.driver, case.sweep.values)

    def solve(self, model, case, tol):
        points = {name: self.change(motion) for name, motion in model.points.items()}
        solved = np.isfinite([motion.position for motion in points.values()]).all(axis=(0, 2))
        return replace(model, points=points, solved=solved, failures=self.failures)


def judge(case, truth, engine, **about):
    return judged(
        Specimen("one", lambda: case, **about), case, truth, once(Pair(case, engine, 1e-12))
    )


def moved(by, quantity="position", samples=slice(None)):
    def change(motion):
        values = getattr(motion, quantity).copy()
        values[samples] += by
        return replace(motion, **{quantity: values})

    return change


# Outcomes


def test_a_right_answer_is_right(case, truth):
    found = judge(case, truth, NATIVE)
    assert found.counts[Verdict.RIGHT] == 5
    *motion, force = found.worst
    assert all(0.0 < ratio < 0.1 for ratio in motion)
    assert force is None


@pytest.mark.parametrize(
    ("quantity", "by"), [("position", 1e-12), ("velocity", 1e-10), ("acceleration", 1e-9)]
)
def test_an_error_beyond_round_off_is_silently_wrong(case, truth, quantity, by):
    found = judge(case, truth, Fake(moved(by, quantity, slice(1, 3))))
    assert list(found.verdicts == Verdict.SILENTLY_WRONG) == [False, True, True, False, False]
    assert found.elsewhere == 0
    assert found.first(Verdict.SILENTLY_WRONG) == 1


def test_another_assembly_is_told_from_a_lack_of_digits(case, truth):
    assert judge(case, truth, Fake(moved(0.1))).elsewhere == 5


def test_an_answer_where_there_is_none_is_silently_wrong(case, truth):
    beyond = replace(truth, reach=np.array([Reach.BEYOND, *[Reach.REACHED] * 4]))
    found = judge(case, beyond, NATIVE)
    assert (found.counts[Verdict.SILENTLY_WRONG], found.elsewhere) == (1, 1)
    assert (
        judge(case, None, NATIVE, reasons=frozenset(FailureKind)).counts[Verdict.SILENTLY_WRONG]
        == 5
    )


def test_what_the_truth_does_not_know_is_not_judged(case, truth):
    unknown = replace(truth, reach=np.array([*[Reach.REACHED] * 4, Reach.UNKNOWN]))
    assert judge(case, unknown, Fake(moved(0.1))).counts == {
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
)
def test_a_refusal_is_as_right_as_its_reason(case, truth, singular, failures, about, right):
    truth = replace(truth, singular=np.array([singular] * 2 + [False] * 3))
    found = judge(case, truth, Fake(moved(np.nan, samples=slice(0, 2)), failures), **about)
    assert found.counts[Verdict.REFUSED_RIGHTLY] == right
    assert found.counts[Verdict.REFUSED_WRONGLY] == 2 - right
    assert found.counts[Verdict.RIGHT] == 3


def test_errors_are_refusals_and_crashes_are_never_right(case):
    free = SolveError("a body can turn", FailureKind.FREE)
    reasons = frozenset({FailureKind.FREE})
    assert judge(case, None, Fake(fails=free), reasons=reasons).counts[Verdict.REFUSED_RIGHTLY] == 5
    one = Specimen("one", lambda: case, None, reasons=reasons)
    for outcome, verdict in (
        (Outcome.CRASHED, Verdict.REFUSED_WRONGLY),
        (Outcome.UNSUPPORTED, Verdict.UNSUPPORTED),
    ):
        failure = Failure(outcome, "free", kind=FailureKind.FREE)
        assert judged(one, case, None, failure).counts[verdict] == 5
    assert described_wrong(one, 3, free).counts[Verdict.REFUSED_RIGHTLY] == 3
    assert described_wrong(one, 3, SolveError("odd")).counts[Verdict.REFUSED_WRONGLY] == 3
    assert (
        described_wrong(Specimen("one", lambda: case), 3, free).counts[Verdict.REFUSED_WRONGLY] == 3
    )


def test_a_contradiction_must_be_told(case, truth):
    answer = once(Pair(case, NATIVE, 1e-12))
    assert isinstance(answer, Answer)
    one, violated = (
        Specimen("one", lambda: case, reported=True),
        replace(truth, violated=np.array([0.0, 1e-10, 0.0, 0.0, 0.0])),
    )
    told = replace(answer, details={"redundant_residual": 5e-11})
    assert judged(one, case, violated, answer).counts[Verdict.SILENTLY_WRONG] == 1
    assert judged(one, case, violated, told).counts[Verdict.SILENTLY_WRONG] == 0


# Families


def test_a_small_loop_hides_no_corner_of_the_large_one():
    """A corner that is turned round between two samples; stepped over where one sigma is asked for
    all blocks of the rows.
    """
    rng = np.random.default_rng(164)
    samples = int(rng.choice([2, 3, 4, 5, 7]))
    made = FAMILIES["corners"].specimen(rng, samples)
    assert dict(made.facts)["ratio"] == pytest.approx(0.014, rel=0.05)
    case = made.describe()
    found = judged(made, case, made.truth(case), once(Pair(case, interpreted(NATIVE), made.tol)))
    assert found.counts[Verdict.RIGHT] == samples


@pytest.mark.parametrize("name", FAMILIES)
def test_specimens_are_made_again_and_can_be_saved(name, tmp_path):
    """The same numbers for the same seed; and a case file says all of them."""
    for number in range(2):
        one, again = (
            FAMILIES[name].specimen(np.random.default_rng([4, number]), 6) for _ in range(2)
        )
        assert one.name == again.name
        try:
            case = one.describe()
        except KincheckError:  # a description that makes no sense is refused before there is a case
            assert one.truth is None
            continue
        assert case.mechanism == again.describe().mechanism
        file = tmp_path / f"{number}.toml"
        file.write_text(case_text(case, ["a comment"]), encoding="utf-8")
        read = load_case(file)
        assert (read.mechanism, read.outputs, read.sweep.motions) == (
            case.mechanism,
            case.outputs,
            case.sweep.motions,
        )
        assert (read.sweep.values == case.sweep.values).all()
        assert read.sweep.rate == case.sweep.rate


def test_no_family_is_silently_wrong_in_the_native_engine():
    """All families; the share of each in a run of 160 samples. Compiled: without machine code is
    another test.
    """
    found, _ = stress([*FAMILIES.values()], [NATIVE], samples=160, seed=0)
    assert [cell.family for cell in found.cells] == [*FAMILIES]
    assert {cell.family: cell.samples[Verdict.SILENTLY_WRONG] for cell in found.cells} == {
        cell.family: 0 for cell in found.cells
    }
    assert {cell.family: cell.samples[Verdict.UNSUPPORTED] for cell in found.cells} == {
        cell.family: 0 for cell in found.cells
    }
    assert sum(sum(cell.samples.values()) for cell in found.cells) > 144
    assert all(proof.proved == proof.tried and proof.worst < 1e-2 for proof in found.proofs)
    accepted = [each for each in found.acceptances if each.accepted]
    assert accepted
    assert all(each.tilt < 1e-8 for each in accepted)


def test_errors_do_not_grow_over_a_thousand_turns():
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


def test_nothing_nearly_singular_is_silently_wrong_without_machine_code():
    found, _ = stress(
        [FAMILIES["singular"]], [interpreted(NATIVE)], samples=12, seed=0, prove=False
    )
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] == 0


@pytest.mark.parametrize(
    "name",
    [
        "four_bar_in_one_step",
        "kite",
        "loop_of_four_bodies",
        "loop_of_eight_bodies",
        "platform_nearly_singular",
    ],
)
def test_what_was_silently_wrong_is_so_no_longer(name):
    """The smallest mechanisms found so far, a sample each."""
    file = Path(__file__).parents[1] / "data" / "stress" / f"{name}.toml"
    assert judge_file(load_case(file), NATIVE, 1e-12).counts[Verdict.SILENTLY_WRONG] == 0


# Reduction


def test_a_bad_case_is_made_small():
    """Bad is whatever has a crank longer than 0.1 m that is turned by more than 0.3 rad."""
    rng = np.random.default_rng(8)
    case = as_case(
        four_bar(any_plane(rng), *crank_rocker(rng), "revolutes"),
        "turn",
        np.linspace(-1.0, 1.0, 41),
    )

    def bad(case):
        pivot = case.mechanism.joint("pivot").point
        pins = [
            joint
            for joint in case.mechanism.joints
            if "crank" in joint.bodies and joint.name != "pivot"
        ]
        long = any(
            np.linalg.norm(np.subtract(getattr(pin, "point", pivot), pivot)) > 0.1 for pin in pins
        )
        return long and np.abs(case.sweep.values).max() > 0.3

    few = fewer_samples(case, 3, bad)
    assert len(few.sweep.values) == 1
    small, words = reduced(few, bad)
    assert bad(small)
    assert words
    assert len(small.mechanism.points) == 1
    assert len(str(small.mechanism.joint("pivot").point[0])) < 8


def test_a_case_that_cannot_be_judged_is_no_smaller_one(case):
    def bad(other):
        if other is not case:
            raise KincheckError("cannot be judged")
        return True

    assert fewer_samples(case, 0, bad) is case
    assert reduced(case, bad) == (case, [])


def test_rounding_keeps_names_and_shapes(case):
    short = rounded(case, 2)
    assert short is not None
    assert [j.name for j in short.mechanism.joints] == [j.name for j in case.mechanism.joints]
    assert short.mechanism != case.mechanism
    assert isinstance(solve(short.mechanism, "turn", [0.1]).points["C"], PointMotion)


def test_a_family_that_cannot_be_run_costs_no_other(monkeypatch):
    def defective(rng, samples):
        raise KincheckError("cannot be made")

    monkeypatch.setattr(FAMILIES["units"], "specimen", defective, raising=False)
    found, _ = stress(
        [FAMILIES["units"], FAMILIES["offset"]], [NATIVE], samples=20, seed=0, prove=False
    )
    assert found.unfinished == {"units": "cannot be made"}
    assert [cell.family for cell in found.cells] == ["offset"]


def test_what_cannot_be_proved_is_counted(monkeypatch):
    def refused(truth, sample):
        raise SolveError("singular at the design")

    monkeypatch.setattr("kincheck.core.studies.stress.run.distance_from_proof", refused)
    found, _ = stress([FAMILIES["hardpoints"]], [NATIVE], samples=12, seed=0)
    (proofs,) = found.proofs
    assert proofs.tried > proofs.proved == 0
    assert "singular at the design" in proofs.reasons[0]


def test_the_family_of_starts_finds_a_start_that_rounding_decides(monkeypatch):
    """A tolerance of zero is the old rule: rounded and typed motions then start elsewhere."""
    made = specimens(FAMILIES["starts"], 1, 80)  # once, with their references
    monkeypatch.setattr("kincheck.core.studies.stress.run.specimens", lambda *_: made)
    found, _ = stress([FAMILIES["starts"]], [NATIVE], samples=80, seed=1, prove=False)
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] == 0
    assert found.cells[0].samples[Verdict.RIGHT] > 66
    monkeypatch.setattr("kincheck.core.kinematics.compiled.motion_start.TYPED", 0.0)
    clear_caches()
    found, _ = stress([FAMILIES["starts"]], [NATIVE], samples=80, seed=1, prove=False)
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] > 6
