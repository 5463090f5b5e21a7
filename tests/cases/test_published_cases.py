"""Built-in cases against published values and differences of their own positions."""

import csv
from decimal import Decimal

import numpy as np
import pytest
from kincheck import cases
from kincheck.cases import jet, rssr, spatial_slider_crank

# Round-off of the closed forms, some dozen operations in double precision, is 1e-15 of the numbers
# they pass through.
ROUND_OFF = 1e-13

# Published values


def test_spatial_slider_crank_iftomm_benchmark():
    """IFToMM benchmark 'Spatial rigid slider-crank mechanism' (Masoudi and McPhee), at the start,
    with the crank at 6 rad/s.
    """
    motion = spatial_slider_crank.motion(jet.steady(np.zeros(1), 6.0))
    position, velocity = (
        {point: [j.x[0] for j in xyz] for point, xyz in motion.items()},
        {p: [j.v[0] for j in q] for p, q in motion.items()},
    )
    assert position["slider"] == pytest.approx([0.2, 0.0, 0.0], abs=1e-15)
    assert velocity["slider"] == pytest.approx([0.24, 0.0, 0.0], abs=1e-15)
    assert velocity["conrod_centre"] == pytest.approx([0.12, -0.24, 0.0], abs=1e-15)
    # the conrod's angular velocity, published as (1.92, -0.96, 0.48), shows in the point off its
    # line
    arm = np.subtract(position["conrod_side"], position["conrod_centre"])
    turning = np.cross([1.92, -0.96, 0.48], arm)
    assert np.subtract(velocity["conrod_side"], velocity["conrod_centre"]) == pytest.approx(
        turning, abs=1e-15
    )


def test_spatial_slider_crank_full_turn():
    """Slider x [m] and its derivatives at crank angles [deg], 6 rad/s: the closed form evaluated to
    50 digits with mpmath.
    """
    table = {
        45: (0.2386152935169978746, 0.31293248220898394129, -0.23970545635230388215),
        180: (0.28, -0.17142857142857142857, -1.3392419825072886297),
        315: (0.18522915888766953838, -0.036647713244260374687, 2.4114982994909980202),
    }
    slider, _, _ = spatial_slider_crank.motion(jet.steady(np.radians([*table]), 6.0))["slider"]
    assert np.stack([slider.x, slider.v, slider.a], axis=1) == pytest.approx(
        np.array([*table.values()]), abs=ROUND_OFF
    )


def test_rssr_published_table():
    """Rocker angle [deg] at crank angles [deg], a = 1, b = 4, L = 5.5, O = (2, 1, 3).

    Formula of Hartenberg and Denavit (1964, ch. 12) in its arctangent form, evaluated to 50 digits
    with mpmath.
    """
    table = {
        0: 348.94609687978577331,
        90: -357.01449399425346206,
        195: 325.86625177583580752,
        330: 337.09754271028875053,
    }
    _, y, z = rssr.motion(jet.steady(np.radians([*table]), 1.0))["rocker_pin"]
    found = np.degrees(np.arctan2(z.x - 3.0, y.x - 1.0)) % 360
    assert found == pytest.approx(np.array([*table.values()]) % 360, abs=360 * ROUND_OFF)


def slope(x, h):
    """First derivative by seven-point central differences, of sixth order in h."""
    return (-x[:-6] + 9 * x[1:-5] - 45 * x[2:-4] + 45 * x[4:-2] - 9 * x[5:-1] + x[6:]) / (60 * h)


def test_mcpherson_derivatives_equal_differences():
    for series in cases.load("mcpherson_strut").reference.values():
        assert series.velocity is not None
        assert series.acceleration is not None
        for values, derivative in (
            (series.position, series.velocity),
            (series.velocity, series.acceleration),
        ):
            # with 2 mm the differences are off by 3e-11 (seen), so with 1 mm by 2^-6 of that, 5e-13
            assert derivative[3:-3] == pytest.approx(slope(values, 1e-3), abs=1e-12, rel=0)


def test_mcpherson_samples_are_decimal_millimetres():
    lines = [
        line
        for line in (cases.FOLDER / "mcpherson_strut.csv").read_text().splitlines()
        if not line.startswith("#")
    ]
    strokes = [Decimal(row["stroke"]) for row in csv.DictReader(lines)]
    assert strokes == [Decimal(k) / 1000 for k in range(-80, 81)]
