"""Derivatives by wheel travel at every sample of a combined sweep: other drivers are held."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters import engine
from kincheck.core.case.held import held_case
from kincheck.core.case.io.case_file import load_case
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.harness.execution import Answer, Pair, attempt
from kincheck.core.mechanism.motions import Waypoints

from ...oracles.rods import Carrier

AT = TEMPLATES["double_wishbone"].sample


WHEEL_RADIUS, WHEELBASE, HEIGHT, SHARE = 0.228, 1.55, 0.3, 0.6


RODS = [
    ("lca_front", "lca_outer"),
    ("lca_rear", "lca_outer"),
    ("uca_front", "uca_outer"),
    ("uca_rear", "uca_outer"),
    ("tierod_inner", "tierod_outer"),
]


def arm(name):
    front, rear = (np.array(AT[f"{name}_{end}"]) for end in ("front", "rear"))
    return f"""
[bodies.{name}]
[joints.{name}_pivot]
type = "revolute"
bodies = ["ground", "{name}"]
point = {rear.tolist()}
axis = {(front - rear).tolist()}
[joints.{name}_ball]
type = "spherical"
bodies = ["{name}", "knuckle"]
point = {[*AT[f"{name}_outer"]]}
"""


CASE = f"""
schema = "kincheck-case/1"
name = "steered"
source = "made up"
[bodies.knuckle]
[bodies.rack]
{arm("lca")}{arm("uca")}
[joints.slide]
type = "translational"
bodies = ["ground", "rack"]
point = {[*AT["tierod_inner"]]}
axis = [0, 1, 0]
[joints.tie]
type = "distance"
bodies = ["rack", "knuckle"]
points = [{[*AT["tierod_inner"]]}, {[*AT["tierod_outer"]]}]
[points.wheel_center]
body = "knuckle"
position = {[*AT["wheel_center"]]}
[drivers.rack]
type = "joint_displacement"
joint = "slide"
[drivers.stroke]
type = "point_coordinate"
point = "wheel_center"
direction = [0, 0, 1]
[suspension]
convention = "iso8855"
side = "left"
forward = [1, 0, 0]
up = [0, 0, 1]
axle = "front"
wheel_radius = {WHEEL_RADIUS}
wheelbase = {WHEELBASE}
cg_height = {HEIGHT}
brake_share = {SHARE}
[outputs]
toe.type = "toe"
rc.type = "roll_center_height"
dive.type = "anti_dive"
"""


RAMP = '[drivers.rack.motion]\ntype = "ramp"\nrate = 0.01\n'


SINE = '[drivers.stroke.motion]\ntype = "sine"\namplitude = 0.02\nfrequency = 1.0\n'


TIME = "[sweep]\nstart = -1.0\nstop = 1.0\nsteps = 9\n"


STROKE = '[sweep]\ndriver = "stroke"\nstart = -0.03\nstop = 0.04\nsteps = 8\nrate = 0.1\n'


SWEEPS = {
    "both": f'{RAMP}[drivers.stroke.motion]\ntype = "ramp"\nrate = 0.02\n{TIME}',
    # at the quarters of its period the wheel stands still
    "sine": RAMP + SINE + TIME,
    "rack alone": '[sweep]\ndriver = "rack"\nstart = -0.02\nstop = 0.02\nsteps = 9\n',
    "rack, late": '[sweep]\ndriver = "rack"\nstart = 0.005\nstop = 0.02\nsteps = 4\n',
    "stroke swept": RAMP + STROKE,
    "one sample": f"{RAMP}{SINE}[sweep]\nstart = 0.3\nstop = 0.3\nsteps = 1\n",
}


def case_of(folder, sweep):
    file = folder / "case.toml"
    file.write_text(CASE + sweep)
    return load_case(file)


def answer(case, name, mode="projection"):
    found = attempt(Pair(case, engine(name, mode), 1e-12, timed=False)).result
    assert isinstance(found, Answer), found
    return found


def toe_of(carrier):
    s = carrier.direction((0.0, 1.0, 0.0))
    return np.arctan2(s[0], s[1])


def expected(rack, stroke):
    """Toe by travel, roll centre and anti-dive of five rods, the inner end of one displaced."""
    moved = {4: (0.0, rack, 0.0)}
    carrier = Carrier(AT["wheel_center"], [(AT[a], AT[b]) for a, b in RODS])
    for part in (0.25, 0.5, 0.75, 1.0):
        carrier.go(part * stroke, {4: (0.0, part * rack, 0.0)})
    center, s = carrier.at(AT["wheel_center"]), carrier.direction((0.0, 1.0, 0.0))
    rise = np.array([0.0, 0.0, 1.0]) - s[2] * s
    contact = center - WHEEL_RADIUS * rise / np.linalg.norm(rise)
    vx, vy, vz = carrier.velocity(contact, moved)
    _, w = carrier.twist(moved)
    s_t = np.cross(w, s)
    return {
        "toe": toe_of(carrier),
        "toe.per_travel": (s[1] * s_t[0] - s[0] * s_t[1]) / (s[0] ** 2 + s[1] ** 2),
        "rc": contact[1] * vy / vz,
        "dive": SHARE * WHEELBASE / HEIGHT * vx / vz,
    }


@pytest.mark.parametrize("kind", SWEEPS)
def test_derivatives_by_travel_at_every_sample(tmp_path, kind):
    case = case_of(tmp_path, SWEEPS[kind])
    found = answer(case, "native")
    assert found.message == ""
    path = case.sweep.path
    rack, stroke = path.drive(["rack", "stroke"], path.times)[0]
    for k in range(len(path.times)):
        true = expected(rack[k], stroke[k])
        assert {name: found.outputs[name].position[k] for name in true} == pytest.approx(
            true, abs=1e-12
        )
    assert found.outputs["rc"].velocity is None


def test_slope_without_travel_driver(tmp_path):
    """A reference point of the same carrier is no driver of travel unless it is named."""
    data_path = case_of(tmp_path, SWEEPS["both"])
    assert data_path.outputs[0].vehicle.travel == ("stroke",)
    alone = case_of(tmp_path, STROKE)
    assert alone.outputs[0].vehicle.travel == ()


def test_missing_derivative_has_reason(tmp_path):
    """A pose that the other path does not find has no derivative, and the reason is given."""
    case = case_of(tmp_path, SWEEPS["both"])

    class Elsewhere(type(engine("native"))):
        def solve(self, model, case, tol):
            found = super().solve(model, case, tol)
            if any(isinstance(each, Waypoints) for each in case.sweep.motions.values()):
                points = {
                    name: replace(motion, position=motion.position + 1.0)
                    for name, motion in found.points.items()
                }
                found = replace(found, points=points)
            return found

    found = attempt(Pair(case, Elsewhere(), 1e-12, timed=False)).result
    assert "no derivative by stroke at 9 of 9 samples: another assembly" in found.message
    assert np.isnan(found.outputs["rc"].position).all()
    assert np.isfinite(found.outputs["toe"].position).all()


def test_held_path_keeps_sweep_values(tmp_path):
    case = case_of(tmp_path, SWEEPS["sine"])
    path, again = case.sweep.path, held_case(case, ["stroke"]).sweep.path
    names = ["rack", "stroke"]
    assert np.array_equal(path.times, again.times)
    value, rate, second = again.drive(names, again.times)
    assert np.array_equal(value, path.drive(names, path.times)[0])
    assert not rate[0].any()
    assert (rate[1] > 0.0).all()
    assert not second.any()
