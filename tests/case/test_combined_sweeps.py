"""Both wheels travel while the rack moves: toe, Ackermann, roll centre and anti-values of an axle
against distances alone.
"""

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError

from ..oracles.distances import Carrier, turn
from .test_axle import RODS, WHEELBASE, answer

CG_HEIGHT, SHARE = 0.3, 0.6
CAR = {
    "wheelbase": str(WHEELBASE),
    "cg_height": str(CG_HEIGHT),
    "brake_share": str(SHARE),
    "drive_share": "1",
}
# Distances are solved to 1e-13 of their squares; quotients of differences lose the rest.
POSE, RATE = 1e-11, 1e-8


def table(folder, name="double_wishbone"):
    file = folder / f"{name}.csv"
    file.write_text(sample_table(TEMPLATES[name]))
    return file


class Wheel:
    """A wheel of either side, where left is 1 and right -1."""

    def __init__(self, side, travel, rack):
        at = {
            role: np.array(place) * (1.0, side, 1.0)
            for role, place in TEMPLATES["double_wishbone"].sample.items()
        }
        carrier = Carrier(at["wheel_center"], [(at[p], at[q]) for p, q in RODS["double_wishbone"]])
        pose = carrier.pose(travel, rack)
        self.s = turn(pose[3:]) @ (0.0, side, 0.0)
        radius = np.linalg.norm(at["wheel_center"] - at["wheel_contact"])
        rise = np.array([0.0, 0.0, 1.0]) - self.s[2] * self.s
        center = carrier.at(pose, at["wheel_center"])
        self.contact = center - radius * rise / np.linalg.norm(rise)
        self.v, self.v_center = carrier.velocities(pose, travel, rack, self.contact, center)
        # to the left, of the horizontal line in the wheel plane
        self.steer = np.arctan(-self.s[0] / self.s[1])


def expected(motion, position, travel, rack):
    a, b = Wheel(1, travel, rack), Wheel(-1, travel if motion == "heave" else -travel, rack)
    lines = np.array([a.v[1:], b.v[1:]])
    y, z = np.linalg.solve(lines, [a.v[1:] @ a.contact[1:], b.v[1:] @ b.contact[1:]])
    road = a.contact - b.contact
    normal = np.array([-road[2], road[1]]) / np.hypot(*road[1:])
    pose = {
        "left_toe": np.arctan2(a.s[0], a.s[1]),
        "right_toe": np.arctan2(b.s[0], -b.s[1]),
        "track": road[1],
    }
    if min(a.steer * b.steer, abs(a.steer) - 0.01, abs(b.steer) - 0.01) > 0.0:
        pose["ackermann"] = WHEELBASE / road[1] * (1 / np.tan(b.steer) - 1 / np.tan(a.steer))
        pose["ackermann"] = float(pose["ackermann"])
    rate = {
        "axle_roll_center_height": ((y, z) - a.contact[1:]) @ normal,
        "axle_roll_center_offset": y,
    }
    for side, wheel in (("left", a), ("right", b)):
        slope = SHARE * WHEELBASE / CG_HEIGHT * wheel.v[0] / wheel.v[2]
        if position == "front":
            rate[f"{side}_anti_dive"] = slope
        else:
            rate[f"{side}_anti_lift"] = -slope
            squat = -WHEELBASE / CG_HEIGHT * wheel.v_center[0] / wheel.v_center[2]
            rate[f"{side}_anti_squat"] = squat
    return pose, rate


@pytest.mark.parametrize(("motion", "position"), [("heave", "front"), ("roll", "rear")])
def test_an_axle_that_steers_while_it_travels(tmp_path, motion, position):
    said = Supplied(axle=motion, travel="0.03:3", rack="-0.02:0.03", position=position, **CAR)
    case = load(table(tmp_path), said)
    found = answer(case)
    for k, travel in enumerate(case.sweep.values):
        pose, rate = expected(motion, position, travel, 0.005 + travel * 0.025 / 0.03)
        assert {each: found[each][k] for each in pose} == pytest.approx(pose, abs=POSE, rel=1e-8)
        assert {each: found[each][k] for each in rate} == pytest.approx(rate, abs=RATE, rel=1e-8)
    assert np.isfinite(found["ackermann"]).any()


def test_without_data_of_the_vehicle_there_are_no_anti_values(tmp_path):
    names = {each.name for each in load(table(tmp_path)).outputs}
    assert not [name for name in names if "anti" in name]
    said = Supplied(position="front", wheelbase="2.6", cg_height="0.5")
    names = {each.name for each in load(table(tmp_path), said).outputs}
    assert "wheelbase_change" in names
    assert not [name for name in names if "anti" in name]


FAULTS = {
    "position": ({"position": "frnt"}, ["--position", "'frnt'", "'front'"]),
    "height": ({"cg_height": "half"}, ["--cg-height", "'half'", "metres"]),
    "negative height": ({"cg_height": "-0.5"}, ["--cg-height", "-0.5 m"]),
    "percent": ({"brake_share": "60"}, ["--brake-share", "'60'", "0 to 1"]),
    "no share": ({"drive_share": "all"}, ["--drive-share", "'all'", "0 to 1"]),
    "rack": ({"rack": "40"}, ["--rack", "'40'", "up to 1 m"]),
    "words": ({"rack": "left"}, ["--rack", "'left'", "START:STOP"]),
    "rack twice": ({"rack": "0.04", "axle": "steer"}, ["--rack", "beside --axle steer"]),
    "travel in mm": ({"travel": "50"}, ["--travel", "'50'", "up to 1 m"]),
    "nowhere": ({"travel": "0.1:0.1:5"}, ["--travel", "'0.1:0.1:5'"]),
    "backwards": ({"travel": "-0.05"}, ["--travel", "'-0.05'"]),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_faults_of_options(tmp_path, kind):
    supplied, fragments = FAULTS[kind]
    with pytest.raises(CaseError) as caught:
        load(table(tmp_path), Supplied(**supplied))
    assert [each for each in fragments if each not in str(caught.value)] == [], caught.value


def test_a_rack_needs_a_tie_rod(tmp_path):
    with pytest.raises(CaseError, match=r"--rack: found a travel, but .*three_link has no tie rod"):
        load(table(tmp_path, "three_link"), Supplied(rack="0.02"))


def test_options_reach_the_case(tmp_path, capsys):
    options = ["--rack=0.02", "--position=front", "--wheelbase=2.6", "--cg-height=0.5"]
    options += ["--brake-share=0.6", "--drive-share=0.4", "--travel=-0.02:0.03:3"]
    out = tmp_path / "case.toml"
    assert main(["import", str(table(tmp_path)), *options, "--out", str(out)]) == 0
    text = out.read_text()
    for part in ("brake_share = 0.6", "drive_share = 0.4", "cg_height = 0.5", "anti_dive"):
        assert part in text, text
