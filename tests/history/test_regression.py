"""Regressions: of times and motions, and their formats."""

import math
import random

import msgspec
import pytest
from kincheck import Outcome
from kincheck.core.cli.main import main
from kincheck.core.harness.record import OutputSeries, Seconds, to_json
from kincheck.core.history.findings import Kind, Regressions
from kincheck.core.history.store import Store
from kincheck.core.report.junit import to_regression_junit
from kincheck.core.report.regressions import headline, print_regressions, rows, to_markdown
from msgspec.structs import replace

from ..support.history_runs import (
    FACTS,
    FIRST,
    RESULTS,
    changed,
    keep,
    keep_changed,
    kinds,
    nights,
    records,
    report,
    reported,
    times,
    worse,
)
from ..support.printed import Terminal, coloured, junit_tests


def timed(record, factor):
    """The record with a time so many times as long."""
    return replace(record, seconds=times(factor)["seconds"](record.seconds))


# False alarms


def test_noise_is_no_regression(path):
    noise = random.Random(943745)
    for _ in range(20):
        keep(path, records(noise=noise), calibration_seconds=0.02 * noise.uniform(0.8, 1.25))
    for run in range(2, 21):
        for against in ("last-green", "1"):
            found = reported(path, str(run), against)
            assert (found.findings, found.steps, found.regressed) == ([], [], False)


def test_slow_machine_is_no_regression(path):
    nights(path, 8)
    keep(path, [timed(each, 4.0) for each in records()], calibration_seconds=0.08)
    assert kinds(reported(path)) == []
    waiting = [
        replace(each, seconds=replace(each.seconds, warm=0.04, waited=0.03)) for each in records()
    ]
    keep(path, waiting)
    assert kinds(reported(path)) == []


def test_scattered_times_widen_limit(path):
    noise = random.Random(1)
    for _ in range(10):
        keep(path, [timed(each, noise.choice((1.0, 2.0))) for each in records()])
    keep_changed(path, **times(3.0))
    found = reported(path)
    assert found.time_limit > 3.0
    assert kinds(found) == []


@pytest.mark.parametrize("warm", [4e-5, 9e-5])
def test_microseconds_are_no_regression(path, warm):
    """From 20 us: the excess is below the floor, then above it."""
    quick = [
        replace(each, seconds=Seconds(build=0.1, first=0.1, warm=2e-5, waited=0.0, compare=0.1))
        for each in records()
    ]
    for _ in range(6):
        keep(path, quick)
    keep(path, changed(quick, **times(warm / 2e-5)))
    assert kinds(reported(path)) == ([] if warm < 7e-5 else [(Kind.SLOWER, *FIRST)])


def test_growing_round_off_is_no_drift(path):
    nights(path, 3)
    keep_changed(path, **worse(1e-4))
    keep_changed(path, **worse(1.8e-3))  # from 5e-17 to 9e-16 m
    assert kinds(reported(path)) == []


def test_calibrated_times_on_changed_processor(path):
    nights(path, 6)
    keep(path, changed(records(), **times(3.0)), processor="another", calibration_seconds=0.06)
    slower = [each.engine + each.case for each in reported(path).findings]
    assert slower == []
    quick = [timed(each, 0.25) for each in records()]
    keep(path, changed(quick, **times(4.0)), processor="another", calibration_seconds=0.005)
    assert kinds(reported(path, against="6")) == [(Kind.SLOWER, *FIRST)]  # 10 ms, as before


# Planted


PLANTED = {
    "error": (worse(20.0), Kind.DRIFTED, "x position error 5e-13 → 1e-11 m (×20, tolerance 1e-9)"),
    "time": (times(2.0), Kind.SLOWER, " → 20 ms a sweep (×2: by the spread"),
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
                e | {"y": replace(e["y"], acceleration=None, reason="the engine gives none")}
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
    keep_changed(path, **changes)
    found = reported(path)
    assert found.regressed
    (finding,) = [each for each in found.findings if each.kind is kind]
    assert (finding.case, finding.engine) == FIRST
    assert message in finding.message
    assert {(each.case, each.engine) for each in found.findings} == {FIRST}


def test_changed_engine_version_is_named(path):
    nights(path, 2)
    newer = [
        replace(each, version="4.1.0") if each.engine == "mujoco" else each for each in records()
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


def test_changed_tolerance_is_reported(path):
    nights(path, 1)

    def loosened(errors):
        return errors | {
            "x": replace(errors["x"], position=replace(errors["x"].position, tolerance=1e-6))
        }

    keep_changed(path, errors=loosened)
    (finding,) = reported(path).findings
    assert (finding.kind, finding.message) == (Kind.TOLERANCE, "x position: 1e-9 → 1e-6 m")


def test_changed_reference_is_reported(tmp_path, capsys):
    """Somebody has edited the table beside the case, by less than any tolerance or by more."""
    files = [tmp_path / name for name in ("before.json", "now.json")]
    truth = RESULTS.references["first"]["x"]
    edited = [truth.position[0] + 1e-10, *truth.position[1:]]
    references = {
        **RESULTS.references,
        "first": (RESULTS.references["first"] | {"x": replace(truth, position=edited)}),
    }
    for file, changes in zip(files, ({}, {"references": references}), strict=True):
        file.write_bytes(to_json(replace(RESULTS, run={**FACTS, "started": file.name}, **changes)))
    assert main(f"report {files[0]} --against {files[0]}".split()) == 0
    assert "Reference changed" not in capsys.readouterr().out
    assert main(f"report {files[1]} --against {files[0]}".split()) == 0
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
    keep_changed(path, case="second", **worse(500.0))
    assert [each.case + each.output for each in reported(path).loose] == [
        "firstx",
        "firsty",
        "secondy",
    ]


# What a regression report is written as: Markdown, JSON, JUnit and a page, from one comparison


def test_report_writes_every_format(path, tmp_path, capsys):
    nights(path, 6)
    keep_changed(path, **worse(20.0), message="<script>alert(1)</script> | *x*")
    out = tmp_path / "report"
    assert report(path, "--out", out) == 1
    text = (out / "regressions.md").read_text()
    assert capsys.readouterr().out == text
    found = msgspec.json.decode((out / "regressions.json").read_bytes(), type=Regressions)
    assert found == reported(path)
    assert found.findings[0].since == 7
    page = (out / "report.html").read_text()
    assert page.index("1 less accurate") < page.index('id="overview"')
    assert "x position error 5e-13 → 1e-11 m" in page
    assert "case-0-trend-time" in page
    tests = junit_tests((out / "junit.xml").read_text())
    assert [name for name, found in tests.items() if found] == ["first.mujoco.projection x"]
    assert len(tests) == 8


def test_regression_junit_keeps_skips(path):
    nights(path, 6)
    made = changed(
        changed(records(), **times(2.0)),
        case="second",
        outcome=Outcome.UNAVAILABLE,
        message="not installed",
        seconds=None,
    )
    keep(
        path,
        changed(made, case="first", engine="native", outcome=Outcome.CRASHED, message="signal 11"),
    )
    found = reported(path)
    with Store(path) as store:
        text = to_regression_junit(store.results(7), found)
    kinds = {name: [kind for kind, _ in found] for name, found in junit_tests(text).items()}
    assert [name for name, found in kinds.items() if found == ["failure"]] == [
        "first.mujoco.projection slower",
        "second.mujoco.projection lost",
    ]
    assert b'name="first" tests="5" failures="1" errors="2" skipped="0"' in text
    assert b'name="second" tests="5" failures="1" errors="0" skipped="2"' in text


def test_regression_markdown_escapes_and_folds(path):
    nights(path, 1)
    message = "</details> | `x` @team"
    keep(path, [replace(each, outcome=Outcome.ERROR, message=message) for each in records()])
    text = to_markdown(reported(path))
    assert (
        "| native, mujoco | first, second | pass → error: &lt;/details&gt; \\| \\`x\\` @\u2060team"
        in text
    )
    assert text.startswith("## run 2 against run 1 (last green): 4 new failures\n")


def test_unavailable_pairs_are_not_right(path):
    first, *others = records()
    gone = [replace(each, outcome=Outcome.UNAVAILABLE) for each in others]
    keep(path, [first, *gone])
    assert f": all 1 right, {len(others)} unavailable or unsupported;" in headline(reported(path))


def test_terminal_report_has_no_markup(path, capsys, monkeypatch):
    nights(path, 6)
    keep(path, changed(records(), **worse(20.0), message="<script> | *x*")[:-1])
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")  # no colours
    monkeypatch.setenv("COLUMNS", "200")
    assert report(path) == 1
    shown = capsys.readouterr().out
    for mark in ("<details>", "<summary>", "## ", "| ", "**", "&lt;"):
        assert mark not in shown
    found = reported(path)
    assert shown.startswith(headline(found))
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    print_regressions(found, screen := Terminal())
    kinds = dict.fromkeys(each.kind for each in found.findings)
    red = [kind for kind in kinds if found.fails(kind)]
    assert len(red) == 1 < len(kinds)
    assert [line.split(" (")[0] for line in coloured(screen.getvalue())["red"]] == red
    for row in rows(found.findings):
        assert row.engine in shown
        assert row.where in shown
        assert " ".join(row.what.split()) in " ".join(shown.split())


# A motion that is another than it was is reported: where there is no reference nothing else would


SERIES = OutputSeries(
    position=[0.0, 0.5, None], velocity=[1.0, 1.0, None], acceleration=None, unit="m"
)
DRIVER = {"turn": [0.0, 0.5, 1.0]}


def night(path, unjudged=True, driver=DRIVER, **values):
    """A run in which the first pair has that output, judged by nothing unless said otherwise."""
    outputs = {"y": replace(SERIES, **values)}
    errors = {"errors": {}} if unjudged else {}
    keep_changed(path, driver=driver, outputs=outputs, **errors)


def found_after(path, **now):
    night(path, unjudged=now.get("unjudged", True))
    night(path, **now)
    found = reported(path, against="1")
    return kinds(found), [each.message for each in found.findings], found


@pytest.mark.parametrize(
    ("motion", "values", "size"),
    [("position", [0.0, -0.5, None], "1 m "), ("velocity", [1.0, 1.001, None], "1e-3 m/s ")],
)
def test_changed_values_are_reported_moved(path, motion, values, size):
    moved, messages, found = found_after(path, **{motion: values})
    assert moved == [(Kind.MOVED, *FIRST)]
    assert found.regressed
    assert f"y {motion} differs by up to {size}" in messages[0]


@pytest.mark.parametrize("off", [1e-6, 0.0])
def test_large_forces_hide_no_motion(path, off):
    """Of an output without a standard, the scale is that of the outputs of its unit."""
    for moved in (0.0, off):
        force = OutputSeries(position=[9e5, 1e6, 0.0], velocity=None, acceleration=None, unit="N")
        y = replace(SERIES, position=[0.0, 0.5 + moved, None])
        outputs = {"y": y, "load": force}
        keep_changed(path, driver=DRIVER, outputs=outputs, errors={})
    assert kinds(reported(path, against="1")) == [(Kind.MOVED, *FIRST)] * (off > 0.0)


def test_round_off_is_no_motion(path):
    moved, messages, _ = found_after(
        path, position=[0.0, 0.5 + 1e-10, None], velocity=[1.0, None, 2.0]
    )
    assert moved == [(Kind.GONE, *FIRST)]
    assert messages == [
        "y velocity has no value at 1 of 2 samples that had one, first at turn = 0.5: no reason is"
        " given"
    ]


@pytest.mark.parametrize(("off", "count"), [(1.9e-9, 0), (2.1e-9, 1)])
def test_values_within_tolerances_are_no_motion(path, off, count):
    moved, *_ = found_after(path, unjudged=False, position=[0.0, 0.5 + off, None])
    assert moved == [(Kind.MOVED, *FIRST)] * count


@pytest.mark.parametrize(
    ("driver", "count"),
    [
        ({"turn": [0.0, 0.25, 0.5]}, 1),
        ({"push": DRIVER["turn"]}, 1),
        ({"turn": [0.0, math.nextafter(0.5, 1.0), 1.0]}, 0),
    ],
    ids=["values", "name", "last digit"],
)
def test_changed_sweep_is_reported(path, driver, count):
    moved, messages, _ = found_after(path, driver=driver)
    assert moved == [(Kind.MOVED, *FIRST)] * count
    assert messages == ["solved at other values of the drivers than before"] * count


def test_fewer_samples_are_reported_lost(path):
    keep(path, records())
    keep_changed(path, solved=2, samples=2)
    (finding,) = reported(path, against="1").findings
    assert finding.kind is Kind.LOST
    assert finding.message == "2 of 2 samples solved, 9 of 9 before"


def test_grown_error_is_reported_as_drift(path):
    keep_changed(path, driver=DRIVER, outputs={"x": SERIES})
    keep_changed(path, driver=DRIVER, outputs={"x": SERIES}, **worse(20.0))
    assert [each.kind for each in reported(path, against="1").findings] == [Kind.DRIFTED]
