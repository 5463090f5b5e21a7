"""Measured curves as people write them: titles with separators, rows of units, heads of two
rows, remarks, the head again, equal rows at an event, empty cells.
"""

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.reference_curve import CurveOptions, with_curve
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.errors import CaseError

from ..support.rods_of_templates import solved

TRAVEL = np.arange(-50, 51, 10)
TOE = 0.3e-4 * TRAVEL**2 - 0.011 * TRAVEL
CAMBER = 0.1e-4 * TRAVEL**2 - 0.023 * TRAVEL
FORCE = 3000 + 20 * TRAVEL


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    file = tmp_path_factory.mktemp("car") / "car.csv"
    file.write_text(sample_table(TEMPLATES["mcpherson"]))
    return load(file, Supplied(travel="0.05:11"))


def row(k, sep=",", comma=False):
    cells = [str(TRAVEL[k]), f"{TOE[k]:.5f}", f"{CAMBER[k]:.5f}", str(FORCE[k])]
    return sep.join(cell.replace(".", ",") if comma else cell for cell in cells)


def rows(**form):
    return [row(k, **form) for k in range(len(TRAVEL))]


HEAD = "Wheel travel [mm],Toe [deg],Camber [deg],Fz [N]"
LAYOUTS = {
    "title with separators": [
        "K&C rig 4711;Falcon",
        "Wheel travel;Toe left;Camber left;Fz",
        "mm;deg;deg;N",
        *rows(sep=";", comma=True),
    ],
    "settings above": ["Rig,4711", "Spring rate,30,N/mm", "Tyre,205,55,16", "", HEAD, *rows()],
    "unknown unit": ["Wheel travel,Toe,Camber,Fz", "mm,deg,deg,daN?", *rows()],
    "groups above": ["Wheel,Left,,Load", "travel [mm],toe [deg],camber [deg],Fz [N]", *rows()],
    "groups": ["Wheel travel,Toe,Camber,Fz", ",Left,Left,", "mm,deg,deg,N", *rows()],
    "remarks": [HEAD, *rows()[:4], "damper warm", *rows()[4:], "end of test,,,"],
    "remarks behind": [HEAD, *rows()[:4], f"{rows()[4]},stick-slip", *rows()[5:]],
    "head again": [HEAD, *rows()[:4], "", HEAD, *rows()[4:]],
    "units again": [
        *["Wheel travel,Toe,Camber,Fz", "mm,deg,deg,N", *rows()[:4]],
        *["Wheel travel,Toe,Camber,Fz", "mm,deg,deg,N", *rows()[4:]],
    ],
    "equal rows": [HEAD, *rows()[:4], rows()[3], rows()[3], *rows()[4:]],
    "right columns beside": [
        f"{HEAD},Toe right [deg]".replace("Toe [", "Toe left ["),
        *(f"{each},9.9" for each in rows()),
    ],
}


def curve(folder, car, lines):
    file = folder / "rig.csv"
    file.write_text("\n".join(lines) + "\n")
    return with_curve(car, file, CurveOptions())


@pytest.mark.parametrize("kind", LAYOUTS)
def test_curve_layout_is_read(tmp_path, car, kind):
    case, notes = curve(tmp_path, car, LAYOUTS[kind])
    assert case.reference.keys() == {"toe", "camber"}
    np.testing.assert_allclose(case.sweep.values, 1e-3 * TRAVEL, atol=1e-15)
    for name, values in (("toe", TOE), ("camber", CAMBER)):
        found = np.degrees(case.reference[name].position)
        np.testing.assert_allclose(found, np.round(values, 5), atol=1e-12)
    left_out = " ".join(notes)
    assert ("left out the rows" in left_out) == (
        kind in ("remarks", "head again", "units again", "equal rows")
    )


def test_empty_curve_cell_is_nan(tmp_path, car):
    lines = [HEAD, *rows()]
    lines[3] = lines[3].replace(f"{TOE[2]:.5f}", "")
    case, _ = curve(tmp_path, car, lines)
    toe = case.reference["toe"].position
    assert [*np.flatnonzero(np.isnan(toe))] == [2]
    assert np.isfinite(case.reference["camber"].position).all()


def test_empty_curve_cell_is_interpolated(tmp_path, car):
    """On a grid of its own, a column has the rows that have a number in it."""
    lines = [
        HEAD,
        *(each.replace(str(x), str(x + 1), 1) for each, x in zip(rows(), TRAVEL, strict=True)),
    ]
    lines[5] = lines[5].replace(f"{TOE[4]:.5f}", "")
    case, _ = curve(tmp_path, car, lines)
    near = TOE[4] - (0.6e-4 * TRAVEL[4] - 0.011)
    assert np.degrees(case.reference["toe"].position[4]) == pytest.approx(near, abs=1e-3)
    assert case.reference["toe"].uncertainty["position"][4] > 0.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({3: "x,1,2,3"}, "column Wheel travel"),
        ({3: ",0.1,0.2,3"}, "no driver value"),
        ({3: "Steer [mm],Toe [deg],Camber [deg],Fz [N]"}, "not the head"),
        ({3: "-30,0,47,1,5,2400"}, "complete the row"),
        ({k: f"{TRAVEL[k - 1]},,0.1,1" for k in range(1, 12)}, "0 numbers in column"),
    ],
)
def test_damaged_curve_row_is_refused(tmp_path, car, change, words):
    lines = [HEAD, *rows()]
    for k, line in change.items():
        lines[k] = line
    with pytest.raises(CaseError, match=words):
        curve(tmp_path, car, lines)


def test_right_wheel_takes_right_columns(tmp_path, car):
    file = tmp_path / "right.csv"
    text = sample_table(TEMPLATES["mcpherson"])
    head, *points = text.split("meaning\n")
    mirrored = [each.split(",") for each in "".join(points).splitlines()]
    lines = [",".join([name, x, f"-{y}", *rest]) for name, x, y, *rest in mirrored]
    file.write_text(head + "meaning\n" + "\n".join(lines))
    right = load(file, Supplied(travel="0.05:11"))
    lines = ["Wheel travel [mm],Toe left [deg],Toe right [deg]"]
    lines += [f"{x},9.9,{toe:.5f}" for x, toe in zip(TRAVEL, TOE, strict=True)]
    case, _ = curve(tmp_path, right, lines)
    np.testing.assert_allclose(np.degrees(case.reference["toe"].position), TOE, atol=1e-5)


@pytest.mark.parametrize("decimals", range(6))
@pytest.mark.parametrize("samples", [11, 17])
def test_rounded_curve_is_within_digits(tmp_path, car, decimals, samples):
    """The curve of the case itself, at its samples and between rows, is off by the rounding."""
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES["mcpherson"]))
    fine = load(file, Supplied(travel=f"0.05:{samples}"))
    toe = np.degrees(solved(car)["toe"])
    lines = ["Wheel travel [mm],Toe [deg]"]
    lines += [f"{x},{y:.{decimals}f}" for x, y in zip(TRAVEL, toe, strict=True)]
    case, _ = curve(tmp_path, fine, lines)
    known = case.reference["toe"]
    off = np.abs(solved(fine)["toe"] - known.position)
    assert (off <= known.uncertainty["position"] + 1e-12).all()
