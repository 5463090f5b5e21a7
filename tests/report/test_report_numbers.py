"""Numbers of a run on the terminal and on its page: all are different, so that none may stand for
another.
"""

import io

import pytest
from kincheck.core.harness.record import Deviations, Seconds
from kincheck.core.report.table import print_outputs, print_table
from msgspec.structs import replace

from ..support.printed import Terminal, coloured
from ..support.strut_results import GRID, results, series
from .page import report

PAGE = {
    "Overview": """\
strut closed form | ✓ pass validated, positions only2e-17 m 2e-8 × tol 12.5 µs | \
✗ fail 0.125 N 1.23e11 × tol 1.23e5 µs | ○ unavailable""",
    "Largest deviations": """\
load | one | 0.125 at 3 | 1e-9 | – | – | – | – | closed form
half-track change | native | 2e-17 at 8 | 1e-9 | 2.08e-17 at 5 | 1e-8 | – | – | closed form
one | 6e-9 at 2 | 1e-9 | 6e-9 at 5 | 1e-8 | – | – | closed form
wheel-base change | native | 2e-17 at 8 | 1e-9 | 2.08e-17 at 5 | 1e-8 | – | – | closed form
one | 2.46e-8 at 7 | 3e-7 | 1234 at 9 | 1e-8 | – | – | closed form
bare | one | – | – | – | – | – | – | no reference""",
    "Engines": """\
native | ✓ pass | 1.2.3 | python | 21/21 | 17 | 1 | 321 | 3.21e-14 | 0.125 | 0.25 | 0.0625 | 12.5
one | ✗ fail | 1.2.3 | python | 20/21 | 19 | 2 | 654 | – | 0.5 | 1.5 | 0.75 | 1.23e5
two | ○ unavailable | – | python | two is not installed""",
    "Degrees of freedom": """\
coordinates | 35 | 18
equations | 34 | 17
numerical rank | not checked | 17
degrees of freedom | 35 − 34 = 1 | 18 − 17 = 1
redundant rows | not seen | none""",
    "Program size": "newton | 7231 | 6702",
}
TERMINAL = """\
strut · native
  half_track_change
    value 2.0e-17 of 1e-09
    velocity 2.1e-17 of 1e-08
    acceleration –  unit m
  wheelbase_change
    value 2.0e-17 of 1e-09
    velocity 2.1e-17 of 1e-08
    acceleration –  unit m
strut · one
  half_track_change
    value 6.0e-09 of 1e-09
    velocity 6.0e-09 of 1e-08
    acceleration –  unit m
  wheelbase_change
    value 2.5e-08 of 3e-07
    velocity 1.2e+03 of 1e-08
    acceleration –  unit m
  load
    value 1.2e-01 of 1e-09  velocity –
    acceleration –  unit N
  bare
    value –  velocity –  acceleration –
    unit m
–: strut · native: half_track_change, wheelbase_change: acceleration: none
–: strut · one: half_track_change, wheelbase_change: acceleration: none
–: strut · one: bare: no reference
strut · native: 1.2.3, projection, loop:
python; 21 of 21 samples; residual
3.21e-14; rank 17; dof 1; iterations
321; us/sample 12.5; build 0.125 s;
first 0.25 s; warm 0.0625 s; reference
A. Uthor: Struts (strut.csv
aaaaaaaaaaaa)
strut · one: 1.2.3, projection, loop:
python; 20 of 21 samples; rank 19; dof
2; iterations 654; us/sample 1.23e5;
build 0.5 s; first 1.5 s; warm 0.75 s;
reference A. Uthor: Struts (strut.csv
aaaaaaaaaaaa)
strut  native: closed form (validated);
one, two: closed form
  native
    outcome pass  error m 2.0e-17
    error m/s 2.1e-17  error m/s² –
    us/step 12.5
  one
    outcome fail  error m 6.0e-09
    error m/s 1.2e+03  error m/s² –
    us/step 123456
  two
    outcome unavailable  error m –
    error m/s –  error m/s² –  us/step –
fail: strut · one: half_track_change: too far off
unavailable: two: not installed
1 pass, 1 fail, 1 unavailable
"""


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
