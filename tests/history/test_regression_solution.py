"""What a report tells besides errors and times: dof, rank, residuals, units, values that are null
now, pairs that are missing.
"""

import re

import pytest
from kincheck import Outcome
from kincheck.core.history.findings import WHY, Kind
from kincheck.core.report.regressions import to_markdown
from kincheck.core.trajectory import QUANTITIES
from msgspec.structs import replace

from ..support.history_runs import (
    FIRST,
    changed,
    keep,
    keep_changed,
    nights,
    records,
    report,
    reported,
)
from ..support.printed import junit_messages


def of_output(output="x", **changes):
    """A change of outputs: of one of them."""

    def change(outputs):
        values = {
            name: each(getattr(outputs[output], name)) if callable(each) else each
            for name, each in changes.items()
        }
        return outputs | {output: replace(outputs[output], **values)}

    return {"outputs": change}


def without(*samples):
    """A series that has null at these samples."""
    return lambda values: [None if k in samples else value for k, value in enumerate(values)]


TOLD = {
    "dof": ({"dof": 1}, {"dof": 2}, Kind.FREEDOM, "dof 1 → 2"),
    "rank": ({"rank": 17}, {"rank": 16}, Kind.RANK, "rank 17 → 16"),
    "residual": (
        {"residual_max": 5e-16},
        {"residual_max": 1e-8},
        Kind.RESIDUAL,
        "largest residual 5e-16 → 1e-8 (×2e7)",
    ),
    "residual of zero": (
        {"residual_max": 0.0},
        {"residual_max": 1e-12},
        Kind.RESIDUAL,
        "largest residual 0 → 1e-12",
    ),
    "three digits": (
        {"residual_max": 1e-15},
        {"residual_max": 1e-12},
        Kind.RESIDUAL,
        "largest residual 1e-15 → 1e-12 (×1e",
    ),
    "no residual": (
        {"residual_max": 5e-16},
        {"residual_max": None, "reasons": {"residual_max": "not asked"}},
        Kind.GONE,
        "residual_max has no value now, 5e-16 before: not asked",
    ),
    "unit": ({}, of_output(unit="rad"), Kind.UNIT, "x: unit m → rad"),
    "sense": ({}, of_output(sense="to the left"), Kind.UNIT, "x: sense none → to the left"),
    "velocity": (
        {},
        of_output(velocity=without(4), reason="it is undefined there"),
        Kind.GONE,
        "x velocity has no value at 1 of 9 samples that had one, first at angle = ",
    ),
    "all velocities, unjudged": (
        {"errors": {}},
        {"errors": {}} | of_output(velocity=None, reason="the engine gives none"),
        Kind.GONE,
        "x velocity has no value at 9 of 9 samples that had one, first at angle = ",
    ),
}


@pytest.mark.parametrize("what", TOLD)
def test_solution_changes_are_in_every_format(path, tmp_path, capsys, what):
    before, now, kind, message = TOLD[what]
    keep_changed(path, **before)
    keep_changed(path, **{**before, **now})
    found = reported(path)
    (finding,) = found.findings
    assert (finding.kind, finding.case, finding.engine) == (kind, *FIRST)
    assert finding.message.startswith(message)
    assert found.regressed is kind.regression is (kind is not Kind.RANK)
    assert report(path, "--out", tmp_path) == kind.regression
    capsys.readouterr()
    title = f"{kind.capitalize()} (1): {WHY[kind]}"
    assert title in (tmp_path / "regressions.md").read_text("utf-8")
    page = (tmp_path / "report.html").read_text("utf-8")
    assert f"{kind.capitalize()} (1)</b>: " in page
    assert message in page
    assert message in (tmp_path / "regressions.json").read_text("utf-8")
    failures = junit_messages((tmp_path / "junit.xml").read_text(), "failure")
    assert [each.startswith(f"{kind}: {message}") for each in failures] == [True] * kind.regression


@pytest.mark.parametrize(
    ("before", "now"),
    [
        ({"residual_max": 1e-17}, {"residual_max": 1e-14}),
        ({"residual_max": 0.0}, {"residual_max": 2e-16}),
        ({"residual_max": 2e-16}, {"residual_max": 1.9e-13}),
        ({"residual_max": 1e-9}, {"residual_max": 1e-16}),
        (
            {"dof": None, "rank": None, "residual_max": None},
            {"dof": 1, "rank": 3, "residual_max": 1e-16},
        ),
    ],
    ids=["rounding", "the last place", "less than three digits", "better", "nothing known before"],
)
def test_meaningless_changes_are_not_reported(path, before, now):
    keep_changed(path, **before)
    keep_changed(path, **now)
    assert reported(path).findings == []


def test_lost_samples_are_reported_once(path):
    keep(path, records())
    all_null = {name: without(7, 8) for name in ("position", "velocity", "acceleration")}

    def fewer(outputs):
        return {name: of_output(name, **all_null)["outputs"](outputs)[name] for name in outputs}

    keep_changed(path, outputs=fewer, solved=7)
    assert [each.kind for each in reported(path, against="1").findings] == [Kind.LOST]

    def one_more(outputs):
        return of_output(velocity=without(3))["outputs"](fewer(outputs))

    keep_changed(path, outputs=one_more, solved=7)
    found = reported(path, against="1").findings
    assert [each.kind for each in found] == [Kind.LOST, Kind.GONE]
    assert " at 1 of 9 samples " in found[1].message


# Pairs that are missing


def test_missing_pairs_are_failures_on_request(path, tmp_path, capsys):
    nights(path, 2)
    keep(path, [each for each in records() if each.case == "first" and each.engine == "native"])
    assert report(path) == 0
    said = capsys.readouterr().out
    assert "nothing regressed; 3 not in this run" in said
    assert "| mujoco | first, second | in run 2, by the same command |" in said
    assert report(path, "--missing-is-failure", "--out", tmp_path) == 1
    said = capsys.readouterr().out
    assert said.startswith("## run 3 against run 2 (last green): 3 not in this run")
    assert "**Not in this run (3): " in said
    assert "<details open>" in (tmp_path / "report.html").read_text("utf-8")
    text = (tmp_path / "junit.xml").read_text("utf-8")
    assert re.findall(r'name="(\w+)" tests="\d+" failures="(\d)"', text) == [
        ("first", "1"),
        ("second", "2"),
    ]


def test_pair_of_last_run_is_missing(path, capsys):
    keep(path, records()[:2])
    keep_changed(path, case="second", outcome=Outcome.FAIL)
    keep(path, records()[:2])
    found = reported(path)
    assert found.against.number == 2
    assert {(each.kind, each.case, each.engine, each.message) for each in found.findings} == {
        (Kind.ABSENT, "second", "native", "in run 2, by the same command"),
        (Kind.LOST, "second", "mujoco", "not in this run, and not good before: new failure"),
    }
    assert report(path) == 1, "a failure does not go with its case"
    assert report(path, "--missing-is-failure") == 1
    capsys.readouterr()


def test_changed_command_has_no_missing_pairs(path, capsys):
    keep(path, records()[:2])
    keep(path, [replace(each, case="mine") for each in records()], command="kincheck run mine.toml")
    keep(path, records()[:2])
    assert report(path, "--missing-is-failure") == 0
    assert "not in this run" not in capsys.readouterr().out


def test_missing_pairs_without_baseline(path, capsys):
    keep_changed(path, outcome=Outcome.FAIL)
    keep(path, records()[:2])
    assert report(path) == 0
    assert "nothing regressed; 1 fixed; 2 not in this run" in capsys.readouterr().out
    assert report(path, "--missing-is-failure") == 1


@pytest.mark.parametrize(
    ("version", "told"),
    [
        ("4.1.0", "the values differ since mujoco 4.0.0 → 4.1.0"),
        ("4.0.0", "the case, its solution or its assembly has changed"),
    ],
)
def test_changed_values_name_the_version(path, version, told):
    nights(path, 1)
    none = dict.fromkeys(QUANTITIES)
    unjudged = {"errors": lambda errors: errors | {"x": replace(errors["x"], **none)}}
    outputs = of_output(position=lambda values: [x + 1e-3 for x in values])
    now = changed(records(), **unjudged, **outputs, version=version)
    keep(path, now, engines={"native": "0.1.0", "mujoco": version})
    page = to_markdown(reported(path))
    assert "Other values (1): " in page
    assert told in page


def test_failed_values_are_no_other_motion(path):
    """An error that is out of tolerance is a failure, whatever caused it."""
    nights(path, 1)
    far = {**of_output(position=lambda values: [x + 1e-3 for x in values])}

    def failed(errors):
        off = replace(errors["x"].position, max_abs=1e-3, within=False)
        return errors | {"x": replace(errors["x"], position=off)}

    keep_changed(path, **far, errors=failed, outcome=Outcome.FAIL, message="x is off")
    assert [each.kind for each in reported(path).findings] == [Kind.FAILURE]


def test_long_message_is_folded(path, capsys):
    nights(path, 1)
    message = "\n".join(f"line {k}" for k in range(50))
    keep_changed(path, outcome=Outcome.ERROR, message=message)
    json, page = path.with_name("r.json"), path.with_name("report.html")
    report(path, "--json", json, "--out", path.parent)
    shown = capsys.readouterr().out
    assert "46 lines more, all in the JSON" in shown
    assert "line 3 " not in shown
    assert all(f"line {k}\\n" in json.read_text() for k in range(49))
    assert page.read_text().count("<summary>more</summary>") >= 1
