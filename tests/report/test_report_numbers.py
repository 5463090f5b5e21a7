"""Numbers of a run on the terminal and on its page: all are different, so that none may stand for
another.
"""

import io

import pytest
from kincheck.core.harness.record import Deviations, Seconds
from kincheck.core.report.table import print_outputs, print_table
from msgspec.structs import replace

from ..support.examples import examples
from ..support.printed import Terminal, coloured
from ..support.strut_results import GRID, results, series
from .page import report

TERMINAL, PAGE = examples(__file__, "terminal", "page")


@pytest.fixture
def run():
    """Results with an output that was not compared, and one of a force."""
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
                found.position, max_abs=2.46e-8, worst_step=7, tolerance=3e-7, within=True
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
    return replace(run, records=[native, one, two])


@pytest.mark.parametrize("heading", PAGE)
def test_page_numbers(run, tmp_path, heading):
    rows = [[" ".join(cell.split()) for cell in row] for row in report(run, tmp_path).rows(heading)]
    assert "\n".join(" | ".join(row) for row in rows).rstrip(" |") == PAGE[heading]


def test_page_headline_numbers(run, tmp_path):
    head = report(run, tmp_path).words.partition("Overview")[0]
    assert (
        "Worst: engine one on case strut, output wheel-base change (velocity), at wheel travel"
        " −10 mm (sample 9 of 0…20): 1.23e11 × tolerance. Error 1234 m/s, tolerance 1e-8 m/s,"
        " against closed form." in head
    )


def test_terminal_numbers(run, monkeypatch):
    """Two digits of an error, one of its tolerance; those out of tolerance first, then lengths."""
    monkeypatch.setenv("COLUMNS", "40")
    print_outputs(run, text := io.StringIO())
    assert [line.rstrip() for line in text.getvalue().splitlines()] == TERMINAL.splitlines()


def test_terminal_marks_deviations_red(run, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("NO_COLOR", raising=False)
    screen = Terminal()
    print_outputs(run, screen)
    off = ["6.0e-09 of 1e-09", "1.2e+03 of 1e-08", "1.2e-01 of 1e-09"]
    assert coloured(screen.getvalue()) == {
        "red": [*off, "fail", "6.0e-09", "1.2e+03"],
        "green": ["pass"],
    }


@pytest.mark.parametrize(
    ("time", "printed"), [(0.5071, "0.507"), (999.4, "999"), (999.6, "1000"), (1504.2, "1504")]
)
def test_table_times_have_three_digits(time, printed, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    whole = results()
    timed = [replace(each, us_per_step=time) for each in whole.records[:1]]
    print_table(replace(whole, records=timed), text := io.StringIO())
    (line,) = (line for line in text.getvalue().splitlines() if line.startswith("strut "))
    assert f" {printed} " in line
