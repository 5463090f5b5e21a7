"""Where most engines agree with each other and not with native, it is native that is suspected."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters import engine
from kincheck.core.case.case import Series
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.harness.record import Outcome, from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.report.junit import to_junit
from kincheck.core.report.report import headline, write_report
from kincheck.core.report.table import messages, to_markdown
from kincheck.core.trajectory import Trajectory

from ..support.engine_faults import changed
from ..support.engine_forces import force_case
from ..support.fakes import Fake, crank, off
from ..support.loaded import loaded

ATOL = 1e-9
WRONG = Fake("native", off("velocity", lambda v: -v))
OTHERS = [Fake(name) for name in ("one", "two", "three")]


def shifted(name, part):
    """An engine with its positions off by a part of the tolerance."""
    return Fake(name, off("position", lambda p: p + part * ATOL))


def suspected(engines, case=None):
    results = run([case or crank(reference=False)], engines, tol=1e-12)
    return results, results.suspects.get("crank")


def test_native_against_all_others_is_suspected():
    results, found = suspected([WRONG, *OTHERS])
    assert found is not None
    assert (found.subject, found.engines) == ("native", ["one", "two", "three"])
    assert {*found.outputs} == {"x", "y"}
    assert found.outputs["x"] == ["velocity"]
    assert "3 of 3 other engines agree with each other within 0 m/s (one, two, three)" in (
        found.message
    )
    assert "native differs by" in found.message
    assert "suspect native" in found.message
    assert "x (velocity): native with the other sign" in found.message
    outcomes = [record.outcome for record in results.records]
    assert outcomes == [Outcome.UNJUDGED, *[Outcome.FAIL] * 3]
    assert from_json(to_json(results)) == results


def test_native_is_suspected_once_on_every_surface(tmp_path):
    results, _ = suspected([WRONG, *OTHERS])
    assert [outcome for _, outcome, _ in messages(results)] == [Outcome.UNJUDGED]
    assert to_markdown(results).count("Suspect: crank: 3 of 3 other engines agree") == 1
    assert "Fail: crank" not in to_markdown(results)
    assert headline(results).endswith("; suspect native in crank")
    write_report(results, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert page.count("3 of 3 other engines agree with each other") == 1
    assert "Worst: engine" not in page
    junit = to_junit(results).decode()
    assert junit.count("suspect: 3 of 3 other engines") == 1
    assert junit.count("suspect native rather than the engine") == 6


def test_native_outside_the_run_is_suspected():
    """It is the standard without a record."""
    results = run([crank(reference=False)], OTHERS, tol=1e-12, baseline=WRONG)
    assert results.suspects["crank"].subject == "native"
    assert "with the other sign" in results.suspects["crank"].message


@pytest.mark.parametrize(
    "engines",
    [
        [WRONG, OTHERS[0]],
        [WRONG, OTHERS[0], Fake("wrong too", off("velocity", lambda v: 2.0 * v))],
        [WRONG, *OTHERS[:2], Fake("as native", off("velocity", lambda v: -v))],
        [Fake("native"), Fake("mujoco", WRONG.answer), Fake("mujoco-default", WRONG.answer)],
        [Fake("native"), Fake("one", WRONG.answer), *OTHERS[1:]],
    ],
    ids=["one other", "three answers", "two against two", "variants", "one astray"],
)
def test_without_a_majority_nobody_is_suspected(engines):
    results, found = suspected(engines)
    assert found is None
    assert any(outcome is Outcome.FAIL for _, outcome, _ in messages(results))


def test_majority_suspects_native():
    odd = Fake("odd", off("velocity", lambda v: 3.0 * v))
    results, found = suspected([WRONG, *OTHERS, odd])
    assert found.engines == ["one", "two", "three"]
    assert "3 of 4 other engines agree" in found.message
    assert {name for name, outcome, _ in messages(results) if outcome is Outcome.FAIL} == {"odd"}


def test_modes_of_one_simulator_count_once():
    twice = [Fake("one"), Fake("one", mode="simulate")]
    assert suspected([WRONG, *twice])[1] is None
    assert suspected([WRONG, *twice, OTHERS[1]])[1].engines == ["one", "two"]


def test_agreement_is_within_the_sum_of_tolerances():
    """Engines at three and at less than five tolerances from native agree; at six they do not."""
    native = Fake("native")
    assert suspected([native, shifted("one", 3.0), shifted("two", 4.9)])[1] is not None
    assert suspected([native, shifted("one", 3.0), shifted("two", 6.0)])[1] is None
    assert suspected([native, shifted("one", 0.9), shifted("two", 0.8)])[1] is None


def test_suspect_keeps_other_faults_of_engines():
    """Its residual, or another output, is no fault of native."""

    def unconverged(case):
        found = OTHERS[0].answer(case)
        return Trajectory(found.points, found.solved, found.iterations, 1e-3)

    def also_accelerations(case):
        return off("acceleration", lambda a: 1.1 * a)(case)

    for answer in (unconverged, also_accelerations):
        results, found = suspected([WRONG, *OTHERS, Fake("odd", answer)])
        assert found.engines == ["one", "two", "three", "odd"]
        assert [name for name, outcome, _ in messages(results) if outcome is Outcome.FAIL] == [
            "odd"
        ]


def test_reference_clears_native():
    """All pass by the reference, except native."""
    results, found = suspected([WRONG, *OTHERS], crank())
    assert found is None
    assert [record.outcome for record in results.records][1:] == [Outcome.PASS] * 3


def test_native_is_suspected_beside_position_reference():
    case = crank()
    case = replace(case, reference={k: Series(each.position) for k, each in case.reference.items()})
    results, found = suspected([WRONG, *OTHERS], case)
    assert found.subject == "native"
    assert results.records[0].outcome is Outcome.PASS


class OtherMoments(NativeEngine):
    """The native engine with a moment of a thousandth of the force added to every reaction."""

    def solve(self, model, case, tol):
        found = super().solve(model, case, tol)
        joints = {
            name: replace(each, moment=each.moment + 1e-3 * np.roll(each.force, 1, axis=1))
            for name, each in found.forces.joints.items()
        }
        return changed(found, forces=replace(found.forces, joints=joints))


def test_simulators_suspect_native_moments():
    case = force_case(loaded(), [0.0, 0.25, 0.5])
    case = replace(case, outputs=tuple(replace(each, atol=1e-7) for each in case.outputs))
    simulators = [engine(name) for name in ("mujoco", "pinocchio", "exudyn")]
    results = run([case], [OtherMoments(), *simulators], tol=1e-12)
    found = results.suspects[case.name]
    assert found.engines == ["mujoco", "pinocchio", "exudyn"]
    assert all(" joint_moment " in name for name in found.outputs)
    assert found.difference > 1e-3
