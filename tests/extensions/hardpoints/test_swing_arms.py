"""Instant centres and swing arms against the drawn construction: normals to two velocities of the
independent solution of rods and lines.
"""

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.extensions.hardpoints.suspension import SWING_ARMS
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

from ...support.rods_of_templates import carrier_of, solved

CLOSE = 1e-10
VIEWS = {"front": 1, "side": 0}
"""Numbers of the first axis of a view."""


def drawn(carrier, center, axis):
    """The instant centre in a view from the centre, where the normals of two points meet."""
    normals, right = [], []
    for up, along in ((0.0, 0.0), (0.21, -0.34)):
        place = np.array(center)
        place[[axis, 2]] += along, up
        v = carrier.velocity(place)[[axis, 2]]
        normals.append(v)
        right.append(v @ [along, up])
    return np.linalg.solve(normals, right)


def expected(name, at, travel):
    carrier = carrier_of(name, at).go(travel)
    center, spin = carrier.at(at["wheel_center"]), carrier.direction((0.0, 1.0, 0.0))
    radius = at["wheel_center"][2] - at["wheel_contact"][2]
    contact = center[2] - radius * np.sqrt(1.0 - spin[2] ** 2)
    values = {}
    for view, axis in VIEWS.items():
        along, up = drawn(carrier, center, axis)
        inward = -along  # inboard, rearward
        values[f"{view}_view_swing_arm"] = np.sign(inward) * np.hypot(along, up)
        values[f"{view}_view_swing_angle"] = np.arctan(up / inward)
        values[f"{view}_view_instant_center_z"] = center[2] + up - contact
        place = "y" if view == "front" else "x"
        values[f"{view}_view_instant_center_{place}"] = along + (axis == 1) * center[1]
    return values


@pytest.mark.parametrize("axes", ["forward,left,up", "forward,right,up"])
@pytest.mark.parametrize("name", ["double_wishbone", "mcpherson", "five_link"])
def test_instant_centers_equal_drawn(tmp_path, name, axes):
    file, at = tmp_path / "car.csv", TEMPLATES[name].sample
    file.write_text(sample_table(TEMPLATES[name]).replace("forward,left,up", axes))
    side = "right" if "right" in axes else None
    case = load(file, Supplied(travel="0.04:3", swing_arms=True, side=side))
    found = solved(case)
    for k, travel in enumerate(case.sweep.values):
        true = expected(name, at, travel)
        assert true.keys() == {each.type for each in SWING_ARMS}
        assert {key: found[key][k] for key in true} == pytest.approx(true, rel=CLOSE, abs=CLOSE)


def test_planar_arms_meet(tmp_path):
    """Level pivots across the car: the front view's arms, produced, meet 3 m from the wheel."""
    at = {role: (x, y, z) for role, (x, y, z) in TEMPLATES["double_wishbone"].sample.items()}
    meet = np.array([-2.4, 0.5])
    for arm, height in (("uca", 0.3), ("lca", 0.1)):
        outer = np.array([0.6, height])
        inner = outer + 0.15 * (meet - outer)
        at[f"{arm}_outer"] = (0.0, *outer)
        at |= {f"{arm}_{end}": (x, *inner) for end, x in (("front", 0.1), ("rear", -0.1))}
    outer = np.array([0.58, 0.15])
    at |= {"tierod_outer": (0.12, *outer), "tierod_inner": (0.12, *(outer + 0.2 * (meet - outer)))}
    at |= {"wheel_center": (0.0, 0.6, 0.2), "wheel_contact": (0.0, 0.6, 0.0)}
    file = tmp_path / "planar.csv"
    lines = [f"{role},{','.join(map(repr, map(float, place)))}" for role, place in at.items()]
    file.write_text("# template: double_wishbone\nname,x,y,z\n" + "\n".join(lines))
    told = {"units": "m", "axes": "forward,left,up", "travel": "0.01:3", "swing_arms": True}
    found = {name: values[1] for name, values in solved(load(file, Supplied(**told))).items()}
    assert found["front_view_instant_center_y"] == pytest.approx(-2.4, abs=CLOSE)
    assert found["front_view_instant_center_z"] == pytest.approx(0.5, abs=CLOSE)
    assert found["front_view_swing_arm"] == pytest.approx(np.hypot(3.0, 0.3), abs=CLOSE)
    assert found["front_view_swing_angle"] == pytest.approx(np.arctan2(0.3, 3.0), abs=CLOSE)
    assert np.isnan(found["side_view_swing_arm"])  # it is endless
    assert found["side_view_swing_angle"] == pytest.approx(0.0, abs=CLOSE)


def test_swing_arms_need_the_option(tmp_path):
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES["mcpherson"]))
    names = {each.type for each in SWING_ARMS}
    assert not names & {output.name for output in load(file).outputs}
    axle = {output.name for output in load(file, Supplied(axle="heave", swing_arms=True)).outputs}
    assert {f"{side}_{name}" for side in ("left", "right") for name in names} <= axle
