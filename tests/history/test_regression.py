"""Regression reports: what is planted in a history is reported and named, what is noise is not."""

import random

import msgspec
import pytest
from kincheck.core.cli import main
from kincheck.core.harness.record import Outcome, Seconds, to_json
from kincheck.core.history.findings import Kind
from kincheck.core.report.regressions import to_markdown

from ..support.nights import FACTS, RESULTS, changed, keep, nights, records, reported, times, worse


def kinds(found):
    return [(each.kind, each.case, each.engine) for each in found.findings]


FIRST = ("first", "mujoco")


# False alarms


def test_quiet_and_noisy_nights_are_not_reported(path):
    noise = random.Random(943745)
    for _ in range(20):
        keep(path, records(noise=noise), calibration_seconds=0.02 * noise.uniform(0.8, 1.25))
    for run in range(2, 21):
        for against in ("last-green", "1"):
            found = reported(path, str(run), against)
            assert (found.findings, found.steps, found.regressed) == ([], [], False)


def test_one_slow_machine_is_no_slow_engine(path):
    nights(path, 8)
    slow = [
        msgspec.structs.replace(each, seconds=msgspec.structs.replace(each.seconds, warm=0.04))
        for each in records()
    ]
    keep(path, slow, calibration_seconds=0.08)
    assert kinds(reported(path)) == []
    waiting = [
        msgspec.structs.replace(
            each, seconds=msgspec.structs.replace(each.seconds, warm=0.04, waited=0.03)
        )
        for each in records()
    ]
    keep(path, waiting)
    assert kinds(reported(path)) == []


def test_scattered_times_widen_the_limit(path):
    noise = random.Random(1)
    for _ in range(10):
        keep(
            path,
            [
                changed(
                    [each], case=each.case, engine=each.engine, **times(noise.choice((1.0, 2.0)))
                )[0]
                for each in records()
            ],
        )
    keep(path, changed(records(), **times(3.0)))
    found = reported(path)
    assert found.time_limit > 3.0
    assert kinds(found) == []


@pytest.mark.parametrize("warm", [4e-5, 9e-5])
def test_microseconds_are_no_regression(path, warm):
    """From 20 us: the excess is below the floor, then above it."""
    quick = [
        msgspec.structs.replace(
            each, seconds=Seconds(build=0.1, first=0.1, warm=2e-5, waited=0.0, compare=0.1)
        )
        for each in records()
    ]
    for _ in range(6):
        keep(path, quick)
    keep(path, changed(quick, **times(warm / 2e-5)))
    assert kinds(reported(path)) == ([] if warm < 7e-5 else [(Kind.SLOWER, *FIRST)])


def test_round_off_that_grows_is_no_drift(path):
    nights(path, 3)
    keep(path, changed(records(), **worse(1e-4)))
    keep(path, changed(records(), **worse(1.8e-3)))  # from 5e-17 to 9e-16 m
    assert kinds(reported(path)) == []


def test_other_processor_compares_calibrated_times(path):
    nights(path, 6)
    keep(path, changed(records(), **times(3.0)), processor="another", calibration_seconds=0.06)
    slower = [each.engine + each.case for each in reported(path).findings]
    assert slower == []
    quick = [
        changed([each], case=each.case, engine=each.engine, **times(0.25))[0] for each in records()
    ]
    keep(path, changed(quick, **times(4.0)), processor="another", calibration_seconds=0.005)
    assert kinds(reported(path, against="6")) == [(Kind.SLOWER, *FIRST)]  # 10 ms, as before


# Planted


PLANTED = {
    "error": (worse(20.0), Kind.DRIFTED, "x position error 5e-13 → 1e-11 m (×20, tolerance 1e-9)"),
    "time": (times(2.0), Kind.SLOWER, " → 20 ms a sweep (×2; by the spread"),
    "phase": (
        {
            "outcome": Outcome.ERROR,
            "message": "no licence",
            "seconds": Seconds(build=0.1, first=0.05),
        },
        Kind.LOST,
        "warm, compare no longer reached: error: no licence",
    ),
    "acceleration": (
        {
            "errors": lambda e: (
                e
                | {
                    "y": msgspec.structs.replace(
                        e["y"], acceleration=None, reason="the engine gives none"
                    )
                }
            )
        },
        Kind.LOST,
        "y: acceleration no longer compared: the engine gives none",
    ),
    "samples": ({"solved": 7}, Kind.LOST, "7 of 9 samples solved, 9 before"),
    "validation": (
        {"truth": "consensus_only"},
        Kind.LOST,
        "no longer validated: judged against consensus only, before closed form",
    ),
    "failure": (
        {"outcome": Outcome.FAIL, "message": "x is off"},
        Kind.FAILURE,
        "pass → fail: x is off",
    ),
    "engine": (
        {"outcome": Outcome.UNAVAILABLE, "message": "not installed", "seconds": None},
        Kind.LOST,
        "no longer reached: unavailable",
    ),
}


@pytest.mark.parametrize("what", PLANTED)
def test_planted_regressions_are_reported(path, what):
    changes, kind, message = PLANTED[what]
    nights(path, 8)
    keep(path, changed(records(), **changes))
    found = reported(path)
    assert found.regressed
    (finding,) = [each for each in found.findings if each.kind is kind]
    assert (finding.case, finding.engine) == FIRST
    assert message in finding.message
    assert {(each.case, each.engine) for each in found.findings} == {FIRST}


def test_a_changed_engine_version_is_named(path):
    nights(path, 2)
    newer = [
        msgspec.structs.replace(each, version="4.1.0") if each.engine == "mujoco" else each
        for each in records()
    ]
    keep(path, changed(newer, **worse(20.0)), numpy="2.1.0")
    found = reported(path)
    changes = [(each.what, each.before, each.now) for each in found.changes]
    assert changes[:2] == [("mujoco", "4.0.0", "4.1.0"), ("numpy", "2.0.0", "2.1.0")]
    assert [each[0] for each in changes[2:]] == ["commit"]
    text = to_markdown(found)
    assert text.startswith(
        "## run 3 against run 2 (last green): 1 less accurate; mujoco 4.0.0 → 4.1.0, numpy 2.0.0 →"
        " 2.1.0\n"
    )
    (step,) = found.steps
    assert (step.first, step.last, step.quantity, step.output) == (3, 2, "position", "x")
    assert [str(each) for each in step.changes[:1]] == ["mujoco 4.0.0 → 4.1.0"]


def test_fixed_added_absent_are_no_regressions(path):
    broken = changed(records(), outcome=Outcome.CRASHED, message="signal 11")
    keep(path, broken[:3])
    keep(path, records()[:2] + records()[3:])
    found = reported(path, against="1")
    assert kinds(found) == [
        (Kind.FIXED, *FIRST),
        (Kind.ADDED, "second", "mujoco"),
        (Kind.ABSENT, "second", "native"),
    ]
    assert not found.regressed


def test_a_changed_tolerance_is_said(path):
    nights(path, 1)

    def loosened(errors):
        return errors | {
            "x": msgspec.structs.replace(
                errors["x"], position=msgspec.structs.replace(errors["x"].position, tolerance=1e-6)
            )
        }

    keep(path, changed(records(), errors=loosened))
    (finding,) = reported(path).findings
    assert (finding.kind, finding.message) == (Kind.TOLERANCE, "x position: 1e-9 → 1e-6")


def test_changed_reference_is_reported(tmp_path, capsys):
    """Somebody has edited the table beside the case, by less than any tolerance or by more."""
    files = [tmp_path / name for name in ("before.json", "now.json")]
    truth = RESULTS.references["first"]["x"]
    edited = [truth.position[0] + 1e-10, *truth.position[1:]]
    references = {
        **RESULTS.references,
        "first": (
            RESULTS.references["first"] | {"x": msgspec.structs.replace(truth, position=edited)}
        ),
    }
    for file, changes in zip(files, ({}, {"references": references}), strict=True):
        file.write_bytes(
            to_json(
                msgspec.structs.replace(RESULTS, run={**FACTS, "started": file.name}, **changes)
            )
        )
    assert main.main(f"report {files[0]} --against {files[0]}".split()) == 0
    assert "Reference changed" not in capsys.readouterr().out
    assert main.main(f"report {files[1]} --against {files[0]}".split()) == 0
    said = capsys.readouterr().out
    assert "Reference changed (2): results are judged by other reference values" in said
    assert (
        "| native, mujoco | first | x position differs by up to 1e-10 m from its earlier values |"
        in said
    )


def test_loose_tolerances_are_named(path):
    nights(path, 9)
    assert reported(path).loose == []
    nights(path, 1)
    assert [(each.case, each.output, each.runs) for each in reported(path).loose] == [
        ("first", "x", 10),
        ("first", "y", 10),
        ("second", "x", 10),
        ("second", "y", 10),
    ]
    # 1e-9 over ten times 5e-13
    assert reported(path).loose[0].factor == pytest.approx(200.0, rel=1e-3)
    keep(path, changed(records(), case="second", **worse(500.0)))
    assert [each.case + each.output for each in reported(path).loose] == [
        "firstx",
        "firsty",
        "secondy",
    ]
