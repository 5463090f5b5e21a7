"""Numbers of a run on the terminal and on its page, against its JSON."""

import io
import json

import msgspec
import pytest
from kincheck.core.harness.record import Deviations, Results, Seconds, to_json
from kincheck.core.report.table import print_outputs
from msgspec.structs import replace

from ..support.printed import Terminal, assert_printed, assert_row, blocks, cells_of, coloured
from ..support.strut_results import ACCOUNT, GRID, results, series
from .page import report

MOTIONS = ("position", "velocity", "acceleration")
LABELS = {"half_track_change": "half-track change", "wheelbase_change": "wheel-base change"}


@pytest.fixture
def shown(tmp_path, monkeypatch):
    """The results as JSON, the text on a narrow terminal, and the page: numbers that are all
    different, an output that was not compared, and one of a force.
    """
    run = results("closed_form")
    native, one, two = run.records
    found = one.errors["wheelbase_change"]
    assert found.position
    assert found.velocity
    errors = {
        "half_track_change": one.errors["half_track_change"],
        "wheelbase_change": replace(
            found,
            position=replace(
                found.position, max_abs=2.46e-10, worst_step=7, tolerance=3e-9, within=True
            ),
            velocity=replace(found.velocity, max_abs=1234.5, worst_step=9, within=False),
        ),
        "load": Deviations(
            position=replace(found.position, max_abs=0.125, worst_step=3),
            velocity=None,
            acceleration=None,
        ),
        "bare": Deviations(position=None, velocity=None, acceleration=None, reason="no reference"),
    }
    load = replace(series(GRID), unit="N")
    one = replace(
        one,
        errors=errors,
        outputs={**one.outputs, "load": load, "bare": series(GRID)},
        residual_max=None,
        rank=19,
        dof=2,
        iterations=654,
        solved=20,
        seconds=Seconds(build=0.5, first=1.5, warm=0.75),
        us_per_step=123456.0,
    )
    run = replace(run, records=[native, one, two])
    text = io.StringIO()
    monkeypatch.setenv("COLUMNS", "40")
    print_outputs(run, text)
    return json.loads(to_json(run)), text.getvalue(), report(run, tmp_path)


def deviations_of(record):
    """Return name, motion and deviation of everything that was compared."""
    return [
        (name, motion, errors[motion])
        for name, errors in record["errors"].items()
        for motion in MOTIONS
        if errors[motion]
    ]


def ratio(deviation):
    return deviation["max_abs"] / deviation["tolerance"]


def answered(found):
    return [record for record in found["records"] if record["outcome"] != "unavailable"]


def test_page_deviations_equal_json(shown):
    found, _, page = shown
    rows = page.rows("Largest deviations")
    units = {
        name: each["unit"] for record in answered(found) for name, each in record["outputs"].items()
    }
    names = sorted(units, key=lambda name: units[name] not in ("N", "N m"))  # forces first
    expected = [
        (name, [record for record in answered(found) if name in record["errors"]]) for name in names
    ]
    assert len(rows) == sum(len(records) for _, records in expected)
    for name, records in expected:
        for k, record in enumerate(records):
            row = rows.pop(0)
            cells = row[1:] if k == 0 else row
            assert k or row[0] == LABELS.get(name, name)
            values, errors = [record["engine"]], record["errors"][name]
            for motion in MOTIONS:
                each = errors[motion]
                *at, tolerance = cells[len(values)].split("at"), cells[len(values) + 1]
                assert_row(*at, [each["max_abs"], each["worst_step"]] if each else [None])
                assert_printed(tolerance, each and each["tolerance"])
                values += [each, each]
            assert cells[0] == record["engine"]
            assert cells[7:] == ["closed form" if errors["position"] else errors["reason"]]


def test_page_engines_equal_json(shown):
    found, _, page = shown
    rows = page.rows("Engines")
    for (engine, outcome, *cells), record in zip(rows, found["records"], strict=True):
        assert engine == record["engine"]
        assert outcome.split()[1] == record["outcome"]
        if record["outcome"] == "unavailable":
            assert cells[-1] == record["message"]
            continue
        seconds = record["seconds"]
        keys = ("rank", "dof", "iterations", "residual_max")
        values = [record["version"], record["loop"], f"{record['solved']}/{record['samples']}"]
        values += [record[key] for key in keys] + [seconds[k] for k in ("build", "first", "warm")]
        assert_row(cells, [*values, record["us_per_step"]])


def test_overview_errors_equal_json(shown):
    found, _, page = shown
    ((_, *cells),) = page.rows("Overview")
    for text, record in zip(cells, answered(found), strict=False):
        *_, size, unit, times, _, _, time, _ = text.replace("only", "only ").split()
        worst = max(deviations_of(record), key=lambda each: ratio(each[2]))
        name, _, position = max(
            (each for each in deviations_of(record) if each[1] == "position"),
            key=lambda each: ratio(each[2]),
        )
        assert unit == record["outputs"][name]["unit"]
        values = [position["max_abs"], ratio(worst[2]), record["us_per_step"]]
        assert_row([size, times, time], values)
    largest = max(
        (each for record in answered(found) for each in deviations_of(record)),
        key=lambda each: ratio(each[2]),
    )
    head = " ".join(page.text[: page.text.index("Overview")].split())
    assert f"output {LABELS[largest[0]]} ({largest[1]}), at" in head
    assert f"(sample {largest[2]['worst_step']} of 0…{len(GRID) - 1})" in head
    assert_printed(head.partition(" × tolerance")[0].split()[-1], ratio(largest[2]))
    error = head.partition("Error ")[2].split()
    assert_row([error[0], error[3]], [largest[2]["max_abs"], largest[2]["tolerance"]])
    assert (error[1].strip(","), error[4].strip(",")) == ("m/s", "m/s")


def test_page_freedom_and_programs_equal_json(shown):
    found, _, page = shown
    a = found["records"][0]["details"]["dof_account"]
    assert a == ACCOUNT
    coordinates, equations, rank, dof, redundant = page.rows("Degrees of freedom")
    assert_row(coordinates[1:], [a["coordinates"], a["moving_coordinates"]])
    assert_row(equations[1:], [a["equations"], a["rows"]])
    assert_row(rank[1:], ["not checked", a["rank"]])
    own = f"{a['moving_coordinates']} - {a['rank']} = {a['dof']}"
    assert_row(dof[1:], [a["paper"], own])
    assert_row(redundant[1:], ["not seen", "none"])
    for name, size in found["records"][0]["details"]["program"].items():
        assert_row(page.rows("Program size")[0], [name, size["operations"], size["flops"]])


def test_terminal_errors_equal_json(shown):
    """Two digits of an error, one of its tolerance; those out of tolerance first, then lengths."""
    found, text, _ = shown
    rows = blocks(text, "  ")
    for record in answered(found):
        for name, errors in record["errors"].items():
            title, block = rows.pop(0)
            assert title == name
            cells = cells_of(block, ["value", "velocity", "acceleration", "unit"])
            expected = [
                f"{each['max_abs']:.1e} of {each['tolerance']:.0e}" if each else "–"
                for each in (errors[motion] for motion in MOTIONS)
            ]
            assert cells == [*expected, record["outputs"][name]["unit"]]
    heads = ["outcome", *(f"error {unit}" for unit in ("m", "m/s", "m/s²")), "us/step"]
    for (engine, block), record in zip(rows, found["records"], strict=True):
        expected = []
        for motion in MOTIONS:
            mine = [
                (each["within"], record["outputs"][name]["unit"], each["max_abs"])
                for name, which, each in deviations_of(record)
                if which == motion
            ]
            off = [each for each in mine if not each[0]] or mine
            _, unit, size = max(
                [each for each in off if each[1] == "m"] or off,
                key=lambda each: each[2],
                default=(True, "m", None),
            )
            text = "–" if size is None else f"{size:.1e}"
            expected.append(text if unit == "m" else f"{text} [{unit}]")
        assert engine == record["engine"]
        outcome, *errors, time = cells_of(block, heads)
        assert (outcome, errors) == (record["outcome"], expected)
        us = record["us_per_step"]
        assert time == ("–" if us is None else f"{us:.0f}" if us > 999.5 else f"{us:.3g}")


def test_terminal_marks_deviations_red(shown, monkeypatch):
    found, _, _ = shown
    results = msgspec.convert(found, Results)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("NO_COLOR", raising=False)
    screen = Terminal()
    print_outputs(results, screen)
    off = [
        f"{each['max_abs']:.1e} of {each['tolerance']:.0e}"
        for record in answered(found)
        for _, _, each in deviations_of(record)
        if not each["within"]
    ]
    assert coloured(screen.getvalue()) == {
        "red": [*off, "fail", "6.0e-09", "1.2e+03"],
        "green": ["pass"],
    }
