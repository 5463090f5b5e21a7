"""Measured curves as people write them: titles with separators, rows of units, heads of two
rows, remarks, the head again, equal rows at an event, empty cells.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.extensions.hardpoints.suspension import Side
from kincheck.core.extensions.measured.reference_curve import CurveOptions, with_curve

from ...support.case_texts import refused
from ...support.suspension_files import strut_of_table

TRAVEL = np.arange(-50, 51, 10)
TOE = 0.3e-4 * TRAVEL**2 - 0.011 * TRAVEL
CAMBER = 0.1e-4 * TRAVEL**2 - 0.023 * TRAVEL
FORCE = 3000 + 20 * TRAVEL


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    return strut_of_table(tmp_path_factory.mktemp("car"), "0.05:11")


def rows(sep=",", decimal="."):
    values = zip(TRAVEL, TOE, CAMBER, FORCE, strict=True)
    texts = (f"{x} {toe:.5f} {camber:.5f} {fz}" for x, toe, camber, fz in values)
    return [text.replace(".", decimal).replace(" ", sep) for text in texts]


HEAD = "Wheel travel [mm],Toe [deg],Camber [deg],Fz [N]"
LAYOUTS = {
    "title with separators": [
        "K&C rig 4711;Falcon",
        "Wheel travel;Toe left;Camber left;Fz",
        "mm;deg;deg;N",
        *rows(";", ","),
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


LEFT_OUT = {
    "title with separators": "line 1 (K&C rig 4711, Falcon)",
    "settings above": (
        "line 1 (Rig, 4711), line 2 (Spring rate, 30, N/mm), line 3 (Tyre, 205, 55, 16)"
    ),
    "groups above": "line 1 (Wheel, Left, Load)",
    "remarks": "line 6 (damper warm), line 14 (end of test)",
    "remarks behind": "line 6 (stick-slip)",
    "head again": f"line 7 ({HEAD.replace(',', ', ')})",
    "units again": "line 7 (Wheel travel, Toe, Camber, Fz), line 8 (mm, deg, deg, N)",
    "equal rows": "line 6 (equal to line 5), line 7 (equal to line 5)",
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
    left_out = " ".join(note for note in notes if "left out the rows" in note)
    assert left_out.endswith(LEFT_OUT.get(kind, ""))
    assert bool(left_out) == (kind in LEFT_OUT)


def test_empty_curve_cell_is_nan(tmp_path, car):
    lines = [HEAD, *rows()]
    lines[3] = lines[3].replace(f"{TOE[2]:.5f}", "")
    case, _ = curve(tmp_path, car, lines)
    assert [*np.flatnonzero(np.isnan(case.reference["toe"].position))] == [2]
    assert np.isfinite(case.reference["camber"].position).all()


def test_empty_curve_cell_is_interpolated(tmp_path, car):
    """On a grid of its own, a column has the rows that have a number in it."""
    lines = [HEAD, *rows()]
    lines[5] = lines[5].replace(f"{TOE[4]:.5f}", "")
    shift = 0.4  # mm
    for k, x in enumerate(TRAVEL, 1):
        lines[k] = lines[k].replace(str(x), str(x + shift), 1)
    case, _ = curve(tmp_path, car, lines)
    toe = case.reference["toe"]
    slope = 0.6e-4 * TRAVEL[4] - 0.011
    assert np.degrees(toe.position[4]) == pytest.approx(TOE[4] - shift * slope, abs=1e-3)
    assert toe.uncertainty["position"][4] > 0.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({3: "x,1,2,3"}, "column Wheel travel"),
        ({3: ",0.1,0.2,3"}, "no driver value"),
        ({3: "Steer [mm],Toe [deg],Camber [deg],Fz [N]"}, "not the head"),
        ({3: "-30,0,47,1,5,2400"}, "complete the row"),
        (
            {k: f"{TRAVEL[k - 1]},,0.1,1" for k in range(1, 12)},
            "0 numbers in column ... expected some",
        ),
    ],
)
def test_damaged_curve_row_is_refused(tmp_path, car, change, words):
    lines = [change.get(k, line) for k, line in enumerate([HEAD, *rows()])]
    refused(lambda: curve(tmp_path, car, lines), words)


def test_right_wheel_takes_right_columns(tmp_path, car):
    (toe,) = [each for each in car.outputs if each.name == "toe"]
    toe = replace(toe, vehicle=replace(toe.vehicle, side=Side.RIGHT))
    lines = ["Wheel travel [mm],Toe left [deg],Toe right [deg]"]
    lines += [f"{x},9.9,{y:.5f}" for x, y in zip(TRAVEL, TOE, strict=True)]
    case, _ = curve(tmp_path, replace(car, outputs=(toe,)), lines)
    np.testing.assert_allclose(np.degrees(case.reference["toe"].position), TOE, atol=1e-5)
