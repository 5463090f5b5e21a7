"""Families of stress runs, and the native engine in them."""

from pathlib import Path

import numpy as np
import pytest
from kincheck.adapters import engine
from kincheck.core.caches import clear_caches
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.errors import KincheckError, SolveError
from kincheck.core.harness.execution import Answer, Pair
from kincheck.core.studies.stress.families import FAMILIES, Family
from kincheck.core.studies.stress.reduction import judge as judge_file
from kincheck.core.studies.stress.report import report
from kincheck.core.studies.stress.run import specimen, specimens, stress
from kincheck.core.studies.stress.solving import interpreted, once
from kincheck.core.studies.stress.verdicts import Verdict, judged

NATIVE = engine("native")


def test_corner_beside_small_loop_is_followed():
    """A corner that is turned round between two samples; stepped over where one sigma is asked for
    all blocks of the rows.
    """
    rng = np.random.default_rng(164)
    samples = int(rng.choice([2, 3, 4, 5, 7]))
    made = FAMILIES["corners"].specimen(rng, samples)
    case = made.case
    assert "beside a loop of 0.014" in made.name
    found = judged(made, case, made.truth(case), once(Pair(case, interpreted(NATIVE), made.tol)))
    assert found.counts[Verdict.RIGHT] == samples


@pytest.mark.parametrize("name", FAMILIES)
def test_specimens_repeat_and_save_as_files(name, tmp_path):
    """The same numbers for the same seed, every kind of each family among them; a case file says
    all of them.
    """
    for number in range(12):
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
    tables = {section.title: section.rows for section in report(found).sections}
    assert tables["Proof of the truth at random samples"] == [
        [each.family, str(each.tried), str(each.proved), f"{each.worst:.1e}", ""]
        for each in found.proofs
    ]


def test_contradictions_of_rounding_only_are_accepted():
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


def test_numpy_solver_in_singular_family():
    found, _ = stress([FAMILIES["singular"]], [interpreted(NATIVE)], samples=6, seed=0, prove=False)
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
def test_former_silent_errors_stay_fixed(name):
    """The smallest mechanisms found so far, a sample each."""
    file = Path(__file__).parents[1] / "data" / "stress" / f"{name}.toml"
    assert judge_file(load_case(file), NATIVE, 1e-12).counts[Verdict.SILENTLY_WRONG] == 0


def test_failing_family_costs_no_other():
    def defective(rng, samples):
        raise KincheckError("cannot be made")

    families = [Family("defective", "", defective), FAMILIES["offset"]]
    found, _ = stress(families, [NATIVE], samples=20, seed=0, prove=False)
    assert found.unfinished == {"defective": "cannot be made"}
    assert [cell.family for cell in found.cells] == ["offset"]


def test_failed_proofs_are_counted(monkeypatch):
    def refused(truth, sample):
        raise SolveError("singular at the design")

    monkeypatch.setattr("kincheck.core.studies.stress.run.distance_from_proof", refused)
    found, _ = stress([FAMILIES["hardpoints"]], [NATIVE], samples=12, seed=0)
    (proofs,) = found.proofs
    assert proofs.tried > proofs.proved == 0
    assert "singular at the design" in proofs.reasons[0]


def test_starts_family_finds_rounded_starts(monkeypatch):
    """A tolerance of zero is the old rule: rounded and typed motions then start elsewhere."""
    made = specimens(FAMILIES["starts"], 1, 80)  # once, with their references
    monkeypatch.setattr("kincheck.core.studies.stress.run.specimens", lambda *_: made)
    found, _ = stress([FAMILIES["starts"]], [NATIVE], samples=80, seed=1, prove=False)
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] == 0
    assert found.cells[0].samples[Verdict.RIGHT] > 66
    monkeypatch.setattr("kincheck.core.kinematics.compiled.routes.TYPED", 0.0)
    clear_caches()
    found, _ = stress([FAMILIES["starts"]], [NATIVE], samples=80, seed=1, prove=False)
    assert found.cells[0].samples[Verdict.SILENTLY_WRONG] > 6
