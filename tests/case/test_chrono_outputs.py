"""Suspension outputs of Project Chrono's models, against an independent solution of
rods and lines.
"""

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from scipy.optimize import brentq

from ..oracles.rods import rotation
from ..support.rods_of_templates import CLOSE, DATA, expected, solved


def test_static_angles_of_chrono(tmp_path):
    """Chrono turns the spindle of a left wheel by minus toe about z after minus camber about x."""
    file = tmp_path / "strut.json"
    text = (DATA / "chrono_macpherson_strut.json").read_text()
    for key, value in (("Toe", "0.5"), ("Camber", "-2")):
        text = text.replace(f'"{key} Angle (deg)": 0', f'"{key} Angle (deg)": {value}')
    file.write_text(text)
    turn = rotation([0, 0, np.radians(-0.5)]) @ rotation([np.radians(2.0), 0, 0])
    x, y, z = turn @ (0.0, 1.0, 0.0)
    found = solved(load(file, Supplied(travel="0.02:3")))
    assert found["toe"][1] == pytest.approx(np.arctan2(x, y), abs=1e-15)
    assert found["camber"][1] == pytest.approx(np.arcsin(-z), abs=1e-15)


def test_chrono_strut_with_a_radius():
    """Toe, camber and half track from 40-digit centres and spin axes; see test_hardpoints."""
    case = load(
        DATA / "chrono_macpherson_strut.json", Supplied(travel="0.07:15", wheel_radius="0.4")
    )
    rows = [
        line.split(",")
        for line in (DATA / "chrono_sweeps.csv").read_text().splitlines()
        if line.startswith("chrono_macpherson_strut,")
    ]
    truth = np.array([row[1:] for row in rows], dtype=float)
    center, s = truth[:, 1:4], truth[:, 4:]
    level = np.hypot(s[:, 0], s[:, 1])
    found = solved(case)
    track = center[:, 1] + 0.4 * s[:, 1] * s[:, 2] / level
    assert np.abs(found["toe"] - np.arctan2(s[:, 0], s[:, 1])).max() < 1e-14
    assert np.abs(found["camber"] - np.arctan2(-s[:, 2], level)).max() < 1e-14
    assert np.abs(found["half_track_change"] - (track - track[7])).max() < 1e-14


def test_chrono_semi_trailing_arm():
    """A turn about one line: the angle of each travel by scipy's root, all else by rotation."""
    case = load(
        DATA / "chrono_semi_trailing_arm.json", Supplied(travel="0.1:9", wheel_radius="0.45")
    )
    found = solved(case)
    pivot, outer, wheel = (
        np.array(each) for each in ([0.42, 0.6, -0.05], [0.5, 0.9, 0.0], [0.0, 1.1, 0.0])
    )
    low, high = np.array([0.3, 0.8, 0.0]), np.array([0.3, 0.8, 0.4])
    axis = (outer - pivot) / np.linalg.norm(outer - pivot)
    for k, travel in enumerate(case.sweep.values):

        def height(angle, travel=travel):
            return (pivot + rotation(angle * axis) @ (wheel - pivot))[2] - travel

        angle = brentq(height, -0.5, 0.5, xtol=1e-15, rtol=1e-15)
        turn = rotation(angle * axis)
        center, s, spring = (
            pivot + turn @ (wheel - pivot),
            turn @ (0.0, 1.0, 0.0),
            pivot + turn @ (low - pivot),
        )
        rise = np.array([0.0, 0.0, 1.0]) - s[2] * s
        contact = center - 0.45 * rise / np.linalg.norm(rise)
        per_turn = [np.cross(axis, each - pivot) for each in (center, contact, spring)]
        _, vy, vz = per_turn[1]
        true = {
            "wheel_center.x": center[0],
            "wheel_center.y": center[1],
            "toe": np.arctan2(s[0], s[1]),
            "camber": -np.arcsin(s[2]),
            "half_track_change": contact[1] - 1.1,
            "roll_center_height": contact[1] * vy / vz,
            "spring_ratio": (high - spring)
            @ per_turn[2]
            / np.linalg.norm(high - spring)
            / per_turn[0][2],
        }
        assert {name: found[name][k] for name in true} == pytest.approx(true, abs=1e-13)


def test_chrono_three_link():
    case = load(DATA / "chrono_three_link.json", Supplied(travel="0.08:9", wheel_radius="0.45"))
    at = {
        "arm_pivot": (0.7, 0.9, 0.0),
        "upper_inner": (-0.1, 0.2, 0.4),
        "upper_outer": (-0.1, 0.9, 0.1),
        "lower_inner": (-0.1, 0.2, 0.3),
        "lower_outer": (-0.1, 0.9, 0.0),
        "wheel_center": (0.0, 1.1, 0.0),
        "wheel_contact": (0.0, 1.1, -0.45),
        "spring_lower": (0.3, 0.9, 0.0),
        "spring_upper": (0.3, 0.9, 0.4),
    }
    found = solved(case)
    for k, travel in enumerate(case.sweep.values):
        true = expected("three_link", at, travel)
        assert {name: found[name][k] for name in true} == pytest.approx(true, abs=CLOSE)


def test_chrono_reduced_double_wishbone(tmp_path):
    """The wheel moves as with arms of mass; the damper is on the knuckle."""
    text = (DATA / "chrono_double_wishbone.json").read_text()
    file = tmp_path / "reduced.json"
    shock = text.index('"Shock"')
    tail = text[shock:].replace("Location Arm", "Location Upright")
    file.write_text(text[:shock].replace('"DoubleWishbone"', '"DoubleWishboneReduced"') + tail)
    found, whole = (
        solved(load(each, Supplied(travel="0.07:15", wheel_radius="0.4")))
        for each in (file, DATA / "chrono_double_wishbone.json")
    )
    assert "damper_ratio" in found
    assert "spring_ratio" not in found
    for name in found.keys() - {"damper_ratio", "damper_ratio.per_travel"}:
        assert np.abs(found[name] - whole[name]).max() < 1e-12
