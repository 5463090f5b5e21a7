"""References of a case file: columns, dialects, files that may be opened; and grids of their own:
matched, interpolated, rounded, shorter, and judged.
"""

import hashlib
import math

import numpy as np
import pytest
from kincheck import CaseError, Outcome
from kincheck.adapters.native import Native
from kincheck.core.case.curves import (
    Printed,
    bound_rounding,
    interpolate,
    is_set,
    match_rows,
    slopes,
)
from kincheck.core.case.io import reference_samples
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.notes import notes
from kincheck.core.harness.compare import Curve, deviation
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.run import run
from scipy.interpolate import CubicSpline

from ..support.case_texts import BASE, BY_FILE, CSV, INLINE, complains, edited, write
from ..support.examples import examples

UNITS, PRINTED, WRONG_UNITS, IN_GERMAN, IN_CSV, NO_TABLES = examples(
    __file__, "units", "printed", "wrong_units", "in_german", "in_csv", "no_tables"
)

GERMAN = "push;tip_x;tip_x.velocity\n-0,1;1,4;2,0\n0,0;1,5;2,0\n0,1;1,6;2,0\n"
DIALECTS = {
    "comments": CSV,
    "semicolons": GERMAN.replace(",", "."),
    "decimal commas": GERMAN,
    "tabs": GERMAN.replace(";", "\t"),
    "trailing separators": GERMAN.replace("\n", ";;\n"),
    "a line sep=": "sep=;\r\n" + GERMAN.replace("\n", "\r\n"),
    "a title": "Rig 3, left;;\n\n" + GERMAN,
    "Windows-1252": ("# geprüft\n" + GERMAN).encode("cp1252"),
    "UTF-16": ("Prüfstand\n" + GERMAN).encode("utf-16"),
    "quotes": GERMAN.replace("tip_x;", '"tip_x";').replace("1,4", '"1,4"'),
}


@pytest.mark.parametrize("kind", DIALECTS)
def test_reference_dialects(tmp_path, kind):
    text = DIALECTS[kind]
    write(tmp_path, text, "tip.csv")
    series = load_case(write(tmp_path, BASE + BY_FILE)).reference["tip_x"]
    assert series.position.tolist() == [1.4, 1.5, 1.6]
    assert series.velocity.tolist() == [2.0, 2.0, 2.0]


def test_recording_table_with_gaps(tmp_path):
    """And lines above them, to a last one; without gaps, an empty cell is a fault."""
    text = "run 3\nversion=1\nendheader\ntime\ta\tb\n0\t1.5\n1\tNaN\t2\n"
    file = write(tmp_path, text, "run.sto")
    table = reference_samples.read_table(file, None, "--sheet", above="endheader")
    samples = reference_samples.samples_of(table, gaps=True)
    expected = [[0.0, 1.5, np.nan], [1.0, np.nan, 2.0]]
    np.testing.assert_array_equal(samples.numbers, expected)
    assert samples.places == ["line 5", "line 6"]
    with pytest.raises(CaseError, match="line 5: found 2 numbers, expected 3"):
        reference_samples.samples_of(table)


def test_output_without_reference(tmp_path):
    more = '\n[outputs.tip_y]\npoint = "tip"\ncomponent = "y"\n'
    case = load_case(write(tmp_path, BASE + more + INLINE))
    assert [output.name for output in case.outputs] == ["tip_x", "tip_y"]
    assert list(case.reference) == ["tip_x"]


REFERENCES = [
    *((GERMAN.replace(old, new), said) for old, new, said in IN_GERMAN),
    *((CSV.replace(old, new), said) for old, new, said in IN_CSV),
    *NO_TABLES,
]


@pytest.mark.parametrize(("text", "fragments"), REFERENCES)
def test_broken_reference_is_refused(tmp_path, text, fragments):
    write(tmp_path, text, "tip.csv")
    complains(write(tmp_path, BASE + BY_FILE), f"tip.csv ... {fragments}")


def test_absolute_reference_path_is_refused(tmp_path):
    name = write(tmp_path, CSV, "tip.csv").as_posix()
    complains(
        write(tmp_path, BASE + BY_FILE.replace("tip.csv", name)), "reference.file ... give its name"
    )


def test_reference_below_folder_is_read(tmp_path):
    (tmp_path / "data").mkdir()
    write(tmp_path / "data", CSV, "tip.csv")
    assert load_case(write(tmp_path, BASE + BY_FILE.replace("tip.csv", "data/tip.csv"))).reference


@pytest.mark.parametrize("at", ["", 'at = "reference"'])
@pytest.mark.parametrize("kind", UNITS)
def test_reference_column_units(tmp_path, kind, at):
    """They go before those of the case file, also for samples taken from the reference."""
    rows = "-100, 1400, 2000\n0, 1500, 2000\n100, 1600, 2000\n"
    write(tmp_path, f"{UNITS[kind]}\n{rows}", "tip.csv")
    base = edited(("start = -0.1\nstop = 0.1\nsteps = 3", at)) if at else BASE
    case = load_case(write(tmp_path, base + BY_FILE))
    assert case.sweep.values.tolist() == [-0.1, 0.0, 0.1]
    assert case.reference["tip_x"].position.tolist() == [1.4, 1.5, 1.6]
    assert case.reference["tip_x"].velocity.tolist() == [2.0, 2.0, 2.0]
    assert case.origin
    assert case.origin.units == {"push": "mm", "tip_x": "mm"}


def test_inline_reference_column_units(tmp_path):
    text = INLINE.replace('"push", "tip_x"', '"push [cm]", "tip_x [m]"').replace(
        "0.1, 1.", "10, 1."
    )
    case = load_case(write(tmp_path, BASE + text))
    assert case.reference["tip_x"].position.tolist() == [1.4, 1.5, 1.6]


@pytest.mark.parametrize(
    ("head", "fragments"),
    WRONG_UNITS,
)
def test_wrong_column_unit_is_refused(tmp_path, head, fragments):
    write(tmp_path, f"{head}\n-0.1, 1.4\n0, 1.5\n0.1, 1.6\n", "tip.csv")
    complains(write(tmp_path, BASE + BY_FILE), f"tip.csv ... {fragments}")


CRANK = """
schema = "kincheck-case/1"
name = "crank"
source = "made up for this test"
truth = "third_party_data"
[units]
length = "mm"
[bodies.crank]
[joints.pin]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[points.tip]
body = "crank"
position = [100, 0, 0]
[drivers.turn]
type = "joint_angle"
joint = "pin"
[sweep]
driver = "turn"
SWEEP
[outputs.x]
point = "tip"
component = "x"
atol = ATOL
why = "repeatability of the rig"
[outputs.y]
point = "tip"
component = "y"
atol = ATOL
why = "repeatability of the rig"
[reference]
file = "rig.csv"
citation = "a rig that was made up for this test"
"""
EVEN = "start = -1.0\nstop = 1.0\nsteps = 21"
AT = 'at = "reference"'


def crank_text(sweep=EVEN, atol="1e-6"):
    return CRANK.replace("SWEEP", sweep).replace("ATOL", atol)


def crank_file(folder, rows, sweep=EVEN, atol="1e-6", form="{:.6f}"):
    lines = ["turn,x,y", *(",".join(map(form.format, row)) for row in rows)]
    write(folder, "\n".join(lines) + "\n", "rig.csv")
    return write(folder, crank_text(sweep, atol))


def crank_case(*arguments, **options):
    return load_case(crank_file(*arguments, **options))


def curve(t):
    return [(each, 100.0 * math.cos(each), 100.0 * math.sin(each)) for each in t]


def judged(case):
    (record,) = run([case], [Native()], tol=1e-12).records
    return record


GRID = np.linspace(-1.0, 1.0, 21)
OWN = np.linspace(-1.03, 1.021, 53)
"""Driver values of a rig: none is at a sample."""


def test_reference_on_own_grid(tmp_path):
    case = crank_case(tmp_path, curve(OWN))
    record = judged(case)
    assert record.outcome is Outcome.PASS
    assert record.validated
    off = record.errors["x"].position
    # 1e-6 mm are asked; half of the sixth digit, 5e-7 mm, and 40 nrad of the driver's are more
    assert 1e-9 + 5e-10 < off.tolerance < 2e-7
    assert record.evidence.limits.keys() == {"x", "y"}
    # between rows, the spline has up to 1.97 times the half unit of a row, at its ends
    for part in ("printed to 8 digits: 9.", "driver values printed to 7", "between 53 rows"):
        assert part in record.evidence.limits["x"]
    assert record.evidence.units == {"turn": "rad", "x": "mm", "y": "mm"}
    digest = hashlib.sha256((tmp_path / "rig.csv").read_bytes()).hexdigest()
    assert (record.evidence.of, record.evidence.sha256) == ("rig.csv", digest)
    grid = "53 rows on a grid of their own, interpolated at 21 of 21 samples"
    assert record.evidence.grid == grid
    assert f"the reference has {grid}" in notes(case)
    results = run([case], [Native()], tol=1e-12)
    assert from_json(to_json(results)).records[0].evidence == record.evidence


@pytest.mark.parametrize(("reach", "beyond"), [(1.0, ""), (1.1, "2 rows"), (2.0, "19 rows")])
def test_reference_rows_beyond_sweep(tmp_path, reach, beyond):
    rows = np.linspace(-reach, reach, 41) + 1e-3
    grid = judged(crank_case(tmp_path, curve(rows))).evidence.grid
    if beyond:
        assert f"; {beyond} beyond the sweep not compared: widen it, or take" in grid
    else:
        assert "beyond" not in grid


@pytest.mark.parametrize("sweep", [EVEN, AT])
@pytest.mark.parametrize("noise", [0.0, 0.004])
@pytest.mark.parametrize("first", [0, 20])
def test_shifted_reference_fails(tmp_path, sweep, noise, first):
    """As measured: own grid, shorter than the sweep, noisy, and six digits."""
    rng = np.random.default_rng(7)
    rows = np.array(curve(OWN[first:]))
    rows[:, 1:] += rng.normal(scale=noise / 4.0, size=rows[:, 1:].shape)
    atol = "0.01" if noise else "1e-4"
    right = judged(crank_case(tmp_path, rows, sweep, atol, "{:.6g}"))
    assert right.outcome is Outcome.PASS
    tolerance = max(each.position.tolerance for each in right.errors.values())
    assert tolerance < (3e-5 if noise else 2e-6)
    rows[:, 2] += 2e3 * tolerance
    wrong = judged(crank_case(tmp_path, rows, sweep, atol, "{:.6g}"))
    assert wrong.outcome is Outcome.FAIL
    assert "y: position is off by" in wrong.message


def test_shorter_reference_is_compared(tmp_path):
    case = crank_case(tmp_path, curve(GRID[3:18:2]), form="{:.17g}")
    assert np.flatnonzero(np.isfinite(case.reference["x"].position)).tolist() == [*range(3, 18, 2)]
    assert case.reference["x"].uncertainty == {}
    assert case.origin.grid == "rows for 8 of 21 samples"
    record = judged(case)
    assert record.outcome is Outcome.PASS
    assert "third-party data has no value at 13 of 21 samples" in record.message
    wrong = np.array(curve(GRID[3:18:2]))
    wrong[2, 1] += 1e-3
    failed = judged(crank_case(tmp_path, wrong, form="{:.17g}"))
    assert failed.errors["x"].position.worst_step == 7


def test_sweep_at_unordered_reference(tmp_path):
    """Up and down, as a rig measures hysteresis; one value twice."""
    t = np.array([0.0, 0.31, 0.72, 0.9, 0.72, -0.2, -0.55])
    case = crank_case(tmp_path, curve(t), AT, form="{:.17g}")
    assert case.sweep.values.tolist() == t.tolist()
    record = judged(case)
    assert record.outcome is Outcome.PASS
    assert record.errors["y"].position.max_abs < 1e-15


def test_reversed_reference_rows(tmp_path):
    case = crank_case(tmp_path, curve(GRID)[::-1], form="{:.17g}")
    assert judged(case).outcome is Outcome.PASS
    assert case.origin.grid == ""


def test_rounded_reference_on_grid(tmp_path):
    rows = np.array(curve(GRID))
    case = crank_case(tmp_path, rows, atol="1e-9", form="{:.6g}")
    assert judged(case).outcome is Outcome.PASS
    half = case.reference["x"].uncertainty["position"]
    assert half[0] == pytest.approx(5e-8)  # of 54.0302 mm
    assert half[10] == pytest.approx(5e-7)  # of 100 mm
    rows[0, 1] += 2e-4
    off = judged(crank_case(tmp_path, rows, atol="1e-9", form="{:.6g}"))
    assert off.outcome is Outcome.FAIL
    assert off.errors["x"].position.worst_step == 0


WRONG = {
    "few rows": (
        curve(OWN[:3]),
        EVEN,
        "rig.csv ... line 4 ... -0.951115 rad ... nearest is -1 rad",
    ),
    "beyond the sweep": (
        curve(OWN + 5.0),
        EVEN,
        "driver values from 3.97 rad to ... -1 rad to 1 rad",
    ),
    "twice": (curve([*OWN, OWN[7]]), EVEN, "line 55 ... driver value ... twice ... at = "),
    "steps": (curve(OWN), AT + "\nsteps = 3", "sweep.steps ... beside at ... remove steps or at"),
    "no steps": (curve(OWN), "start = 1\nstop = 2", 'sweep.steps ... missing ... at = "reference"'),
    "at": (curve(OWN), 'at = "rig"', "sweep.at ... 'rig' ... \"reference\""),
}


@pytest.mark.parametrize(("rows", "sweep", "fragments"), WRONG.values(), ids=WRONG)
def test_wrong_reference_grid_is_refused(tmp_path, rows, sweep, fragments):
    complains(crank_file(tmp_path, rows, sweep), fragments)


def test_sweep_at_missing_reference(tmp_path):
    text = crank_text(AT).partition("[reference]")[0]
    complains(write(tmp_path, text), "sweep.at ... no [reference]")


@pytest.mark.parametrize(
    ("texts", "half"),
    PRINTED,
)
def test_half_unit_of_printed_digits(texts, half):
    np.testing.assert_allclose(printed(texts)[1], half, rtol=1e-9)


def printed(texts, **options):
    """Return numbers, and half a unit of the last digit of each."""
    column, numbers = Printed(), texts.split()
    for text in numbers:
        column.add(text)
    values = np.array(numbers, dtype=float)
    return values, column.half(values, **options)


def test_half_units_of_single_numbers():
    _, half = printed("9.7361 10.0332 200 0.00 0.0 0 1.2e+01 nan", alone=True)
    assert half[:-1] == pytest.approx([5e-5, 5e-5, 0.05, 5e-3, 5e-5, 5e-5, 5e-3])
    assert printed("0.123457 0.5 -12.35", alone=True)[1] == pytest.approx([5e-7, 5e-5, 5e-3])


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        ("0.0625 0.125 0.1875 0.25", True),
        ("0.01 0.02 0.03 0.02 0.01", True),
        ("0 0.143 0.286 0.429 0.571 0.714", False),  # sevenths
        ("0 5.73 11.46 17.19 22.92 28.65", False),  # tenths of a radian, in degrees
        (" ".join(f"{5.72957795 * k:.6g}" for k in range(21)), False),
        (" ".join(f"{k * k * 0.2:g}" for k in range(12)), True),
        ("-80 -65 -5 0 10 15 20 35 40 50", True),
        ("0.25 0.5 1.75 2 3 3.25 3.5 4 5 5.25", True),
        ("-79.9 -65.2 -5.1 1.1 2.2 3.4 5.6 7.8 9.9 10.1", False),
        ("1.2345e60 3.5e60 4e60", False),
    ],
)
def test_driver_values_that_somebody_set(texts, expected):
    assert is_set(*printed(texts)) == expected


def stripped(decimals):
    """Return the writer of a spreadsheet that rounds to some decimals."""
    return lambda value: repr(round(float(value), decimals)).removesuffix(".0")


WRITERS = {
    **{f"{n} decimals": (f"{{:.{n}f}}".format, n, 0) for n in (0, 1, 2, 3, 5)},
    **{f"{n} decimals without zeros": (stripped(n), n, 0) for n in (1, 2, 3, 4)},
    **{f"{n} digits": (f"{{:.{n}g}}".format, 0, n) for n in (2, 3, 4, 6)},
    **{f"{n} digits, exponent": (f"{{:.{n - 1}e}}".format, 0, n) for n in (2, 3, 5)},
}
"""By name, the writer, its decimals or else its digits."""
ARM = np.array([97.31, 11.7])


def rounded(folder, form, grid, shifts):
    """Return the verdict on the rounded curve of a tip at `ARM`, shifted in y."""
    cos, sin = np.cos(grid), np.sin(grid)
    x, y = ARM[0] * cos - ARM[1] * sin, ARM[0] * sin + ARM[1] * cos + shifts
    rows = zip(map("{:.17g}".format, grid), map(form, x), map(form, y), strict=True)
    crank_file(folder, rows, form="{}")
    text = edited(("100, 0, 0", "97.31, 11.7, 0"), base=crank_text())
    return judged(load_case(write(folder, text)))


@pytest.mark.by_day(3)
@pytest.mark.parametrize(("form", "decimals", "digits"), WRITERS.values(), ids=WRITERS)
def test_rightly_rounded_curve_passes(form, decimals, digits, tmp_path):
    """And one that is off by a whole unit of a last digit fails, in one row or in all."""
    assert rounded(tmp_path, form, GRID, 0.0).outcome is Outcome.PASS
    assert rounded(tmp_path, form, OWN, 0.0).outcome is Outcome.PASS
    place = 2 - digits if digits else -decimals  # numbers of the last rows have two whole digits
    shift = 1.01 * 10.0**place
    for row in (0, 20):
        off = rounded(tmp_path, form, GRID, np.where(np.arange(21) == row, shift, 0.0))
        assert off.outcome is Outcome.FAIL, off.message
        assert off.errors["y"].position.worst_step == row
    assert rounded(tmp_path, form, GRID, shift).outcome is Outcome.FAIL


@pytest.mark.parametrize("count", [4, 7, 30, 400])
def test_spline_rounding_bound(count):
    """Against the splines of rows of nothing and one, and the whole matrix of weights."""
    rng = np.random.default_rng(count)
    x = np.arange(count) + rng.uniform(-0.3, 0.3, count)
    half = rng.uniform(0.5, 1.0, count)
    at = rng.uniform(x[0], x[-1], 50)
    within = at > 1.0
    weights = np.abs(CubicSpline(x, np.eye(count))(at))
    expected = np.where(within, weights @ half, 0.0)
    assert bound_rounding(x, half, at, within) == pytest.approx(expected, rel=1e-9)


VELOCITIES = """
[reference]
columns = ["driver", "x", "x.velocity", "x.acceleration"]
rows = ROWS
citation = "made up"
"""


@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_reference_rates_have_own_digits(name, tmp_path):
    text = crank_text().partition("[reference]")[0]
    rows = [
        [t, round(100 * math.cos(t), 3), round(-100 * math.sin(t), 1), round(-100 * math.cos(t))]
        for t in GRID.tolist()
    ]

    def verdict():
        file = write(tmp_path, text + VELOCITIES.replace("ROWS", repr(rows)))
        return judged(load_case(file))

    assert verdict().outcome is Outcome.PASS
    rows[3][2 + (name == "acceleration")] += 0.1 if name == "velocity" else 1
    off = verdict()
    assert off.outcome is Outcome.FAIL
    assert f"x: {name} is off" in off.message


@pytest.mark.parametrize(("truth", "half"), [("closed_form", 0.0), ("third_party_data", 0.05)])
def test_closed_form_rows_are_exact(truth, half, tmp_path):
    """A wrong result would pass as the rounding of 1.0 and 0.0; data may be printed so."""
    text = crank_text().partition("[reference]")[0]
    rows = '[reference]\nrows = [[0.0, 99.9]]\ncolumns = ["turn", "x"]\ncitation = "made up"\n'
    case = load_case(write(tmp_path, text.replace("third_party_data", truth) + rows))
    known = case.reference["x"].uncertainty.get("position", np.zeros(1))
    assert known.max() == pytest.approx(half / 1000.0)
    assert judged(case).outcome is Outcome.FAIL


def test_column_of_all_digits_is_exact(tmp_path):
    """Zeros, constants and even numbers of a file of all digits are no rounded ones."""
    rows = [(t, x, 0.5 + k) for k, (t, x, _) in enumerate(curve(GRID))]
    case = crank_case(tmp_path, rows, form="{:.17g}")
    assert case.reference["x"].uncertainty == case.reference["y"].uncertainty == {}


def test_reference_of_few_digits_is_noted(tmp_path):
    rows = curve(GRID)
    told = [note for note in notes(crank_case(tmp_path, rows, form="{:.0e}")) if "too few" in note]
    assert [note.partition(": ")[0] for note in told] == ["x"]  # 100 mm, known to 50 mm
    assert not any("too few" in note for note in notes(crank_case(tmp_path, rows, form="{:.2e}")))


def test_rows_match_driver_values():
    at = np.array([0.0, 0.1, 0.2, 0.3])
    assert match_rows(at, at, 1e-12).tolist() == [0, 1, 2, 3]
    assert match_rows(np.array([0.3, 0.1]), at, 1e-12).tolist() == [-1, 1, -1, 0]
    assert match_rows(np.array([0.3, 0.11]), at, 1e-12) is None
    assert match_rows(np.array([0.3, 0.3]), at, 1e-12) is None


@pytest.mark.parametrize("count", [4, 5, 9, 30])
def test_interpolation_error_bound(count):
    jitter = np.random.default_rng(count).uniform(-0.3, 0.3, count)
    x = 2.0 * (np.arange(count) + jitter) / count
    at = np.linspace(x[0], x[-1], 101)
    found, error = interpolate(x, np.sin(3.0 * x), at)
    assert (np.abs(found - np.sin(3.0 * at)) <= error + 1e-12).all()
    if count == 30:
        assert error.max() < 1e-2


def test_slopes_ignore_noise():
    x = np.repeat(np.linspace(0.0, 1.0, 101), 2) + np.tile([0.0, 1e-9], 101)
    noise = np.tile([0.0, 1e-3], 101)
    assert slopes(x, 2.0 * x + noise, np.array([0.0, 0.503, 1.0])).max() < 2.2


def test_deviation_counts_in_tolerances():
    known = Curve(np.zeros(2), half=np.array([0.0, 2.0]))
    for values, atol, worst in (
        ([1.0, 2.0], 0.5, (0, 1.0, 0.5, False)),
        ([0.0, 2.0], 0.0, (1, 2.0, 2.0, True)),
    ):
        off = deviation(Curve(np.array(values), atol), known)
        assert (off.worst_step, off.max_abs, off.tolerance, off.within) == worst
