"""Contradictions between engines, and outputs that are held."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import Outcome, adapters, cases
from kincheck.core.case.case import Series
from kincheck.core.harness.execution import Attempt, Failure, attempt
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.mechanism.motions import Waypoints
from kincheck.core.report.report import headline

from ..support.examples import examples
from ..support.fakes import (
    RADIUS,
    SAMPLES,
    Fake,
    at,
    crank,
    exact,
    off,
    raising,
    record_of,
    run_case,
    solution,
)

(RESIDUALS,) = examples(__file__, "residuals")

TOL = 1e-12
ENDS = "cannot be followed beyond here: there is a singular pose ahead"


def reaching(samples, message=ENDS, **changed):
    """An answer that reaches these samples only."""

    def answer(case):
        solved = np.isin(np.arange(SAMPLES), [*samples])
        p, v, a = (np.where(solved[:, None], each, np.nan) for each in exact(case))
        found = solution(
            case, solved=solved, message=message, position=p, velocity=v, acceleration=a
        )
        return replace(found, **changed) if changed else found

    return answer


def pair(native, engine, case=None):
    """Records of the native engine and another."""
    return run_case(
        case or crank(reference=False), Fake("native", answer=native), Fake(answer=engine)
    ).records


def test_engine_values_beyond_native_reach_fail():
    native, fake = pair(reaching(range(7)), solution)
    assert native.outcome is Outcome.FAIL
    assert fake.outcome is Outcome.FAIL
    tip = RADIUS * np.array([np.cos(0.75) - 1.0, np.sin(0.75)])
    assert (
        fake.message
        == "values at 2 of 9 samples that native cannot reach, first at sample 7 (angle = 0.75): x"
        f" = {tip[0]:.6g} m, y = {tip[1]:.6g} m; native: 7 of 9 samples solved: {ENDS}"
    )
    # where both have values they are compared all the same
    assert fake.errors["x"].position.within
    assert fake.errors["x"].contradicted == 2


def test_baseline_contradicts_engine_values():
    native = Fake("native", answer=reaching(range(7)))
    fake = record_of(Fake(), crank(reference=False), baseline=native)
    assert (fake.outcome, "that native cannot reach" in fake.message) == (Outcome.FAIL, True)


def test_different_ends_name_longer_motion():
    _, further = pair(reaching(range(4)), reaching(range(6), "ends here"))
    assert further.outcome is Outcome.FAIL
    assert further.message.startswith(
        "6 of 9 samples solved: ends here; values at 2 of 9 samples that native cannot reach"
    )
    _, shorter = pair(reaching(range(6)), reaching(range(4), "ends here"))
    assert (
        shorter.message == "4 of 9 samples solved: ends here; native has values at 2 of the others"
    )
    _, alike = pair(reaching(range(6)), reaching(range(6), "ends here"))
    assert alike.message == "6 of 9 samples solved: ends here"


def test_contradiction_and_deviation_share_message():
    _, fake = pair(reaching(range(7)), off("position", at(2, 1, 9.0)))
    assert "that native cannot reach" in fake.message
    assert "y: position is off by" in fake.message


def test_native_reaching_nothing_contradicts_every_value():
    _, fake = pair(reaching([]), solution)
    assert (fake.outcome, fake.errors["x"].contradicted) == (Outcome.FAIL, SAMPLES)


def test_reference_gap_leaves_native_judge():
    case = crank()
    short = np.where(np.arange(SAMPLES) < 7, 1.0, np.nan)
    for name, series in case.reference.items():
        case.reference[name] = Series(
            *(short * each for each in (series.position, series.velocity, series.acceleration))
        )
    native, fake = pair(solution, solution, case)
    assert [native.outcome, fake.outcome] == [Outcome.PASS, Outcome.PASS]
    assert "not judged: position: closed form has no value at 2 of 9 samples; " in fake.message
    # native refuses what the reference does not have
    _, fake = pair(reaching(range(7)), solution, case)
    assert (fake.outcome, "values at 2 of 9 samples that native cannot reach" in fake.message) == (
        Outcome.FAIL,
        True,
    )
    alone = record_of(Fake(), case, baseline=Fake("native", answer=reaching(range(7))))
    assert alone.outcome is Outcome.FAIL


def test_reference_overrules_native_refusal():
    """Native refuses samples that the closed form has: native is wrong there, and the others are
    not.
    """
    case = crank()
    case.reference["y"] = Series(case.reference["y"].position)  # the rates of y are native's
    native, fake = pair(reaching(range(7)), solution, case)
    assert [native.outcome, fake.outcome] == [Outcome.FAIL, Outcome.PASS]
    assert "velocity: native has no value at 2 of 9 samples" in fake.message


@pytest.mark.parametrize("outcome", [Outcome.ERROR, Outcome.TIMEOUT, Outcome.CRASHED])
def test_failed_native_judges_nothing(outcome):
    def solver(pairs):
        for index, each in enumerate(pairs):
            if each.engine.name == "native":
                yield index, Attempt(None, Failure(outcome, "it went down"))
            else:
                yield index, attempt(each)

    native, fake = run_case(crank(reference=False), Fake("native"), Fake(), solver=solver).records
    assert native.outcome is outcome
    why = (
        f"the case has no reference, and the native engine has no answer ({outcome}: it went down)"
    )
    assert (fake.outcome, fake.message) == (Outcome.UNJUDGED, why)


# Residuals


def leaving(residual, **changed):
    return Fake(answer=lambda case: replace(solution(case), residual=residual), **changed)


def test_residual_above_tolerance_fails():
    fake = record_of(leaving(1e-6))
    assert fake.outcome is Outcome.FAIL
    assert fake.message.startswith(
        "the residual of samples that the engine calls solved is 1e-06, tolerance 1e-12"
    )
    assert "1 of 1 comparisons has a residual above the tolerance" in headline(
        run_case(crank(), leaving(1e-6))
    )


@pytest.mark.parametrize(
    ("residual", "options", "engine"),
    RESIDUALS.values(),
    ids=RESIDUALS,
)
def test_residual_within_tolerance_passes(residual, options, engine):
    given = {"tol": TOL, **options}
    assert run([crank()], [leaving(residual, **engine)], **given).records[0].outcome is Outcome.PASS


def test_residual_fails_uncompared_pair():
    fake = record_of(leaving(1e-6), crank(reference=False))
    assert fake.outcome is Outcome.FAIL


@pytest.mark.parametrize("name", ["mujoco", "pinocchio", "exudyn"])
def test_simulators_keep_residual_promise(name):
    engine = adapters.engine(name)
    if engine.version() is None:
        pytest.skip(f"{name} is not installed")
    record = record_of(engine, cases.load("chrono_macpherson"), tol=1e-9)
    assert record.outcome is Outcome.PASS, record.message


# What native says of samples beside singular poses


def test_uncertain_samples_contradict_no_engine():
    others = [k for k in range(SAMPLES) if k != 4]
    uncertain = reaching(
        others, "refused at angle = 0: so near a singular pose", details={"uncertain_samples": [4]}
    )
    native, fake = pair(uncertain, solution)
    assert [native.outcome, fake.outcome] == [Outcome.FAIL, Outcome.PASS]
    assert "not judged: position: native has no value at 1 of 9 samples" in fake.message
    assert fake.message.endswith(
        "native: 8 of 9 samples solved: refused at angle = 0: so near a singular pose"
    )


def test_contradictions_are_written_read_and_resumed():
    results = run_case(crank(reference=False), Fake("native", answer=reaching(range(7))), Fake())
    read = from_json(to_json(results))
    assert read == results
    assert "contradict" in headline(results)
    engines = [Fake("native", answer=raising(AssertionError("not again"))), Fake()]
    again = run_case(crank(reference=False), *engines, made=read.records[:1])
    assert again.records[1].message == results.records[1].message


def test_waypoints_interpolate_smoothly():
    motion = Waypoints((0.0, 1.0, 1.5), (0.2, -0.3, 0.4), 0.05)
    assert np.array_equal(motion.at(np.array(motion.times)), [motion.values, [0.05] * 3, [0.0] * 3])
    t, h = np.array([-0.5, 0.0, 0.3, 0.999999, 1.0, 1.3, 1.5, 2.0]), 1e-6
    (x, v, a), before, after = (motion.at(t + step) for step in (0.0, -h, h))
    assert np.abs((after[0] - before[0]) / (2 * h) - v).max() < 1e-8
    assert np.abs((after[1] - before[1]) / (2 * h) - a).max() < 1e-3
    assert x[0] == 0.2 - 0.025
