"""Wheels of the templates on rods, solved without the native engine."""

from pathlib import Path

import numpy as np
from kincheck.adapters.native import Native
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.harness.compare import output_series

from ..oracles.rods import Carrier, rotation
from .mechanisms import Y, Z

DATA = Path(__file__).parents[1] / "data" / "hardpoints"
# Round-off of a Newton step and of products of metre-sized numbers; quotients by the travel lose a
# digit.
CLOSE = 1e-13
ARMS = {
    "lca": (("lca_front", "lca_outer"), ("lca_rear", "lca_outer")),
    "uca": (("uca_front", "uca_outer"), ("uca_rear", "uca_outer")),
}


TIE_ROD = (("tierod_inner", "tierod_outer"),)
RODS = {
    "mcpherson": (*ARMS["lca"], *TIE_ROD),
    "double_wishbone": (*ARMS["lca"], *ARMS["uca"], *TIE_ROD),
    "five_link": tuple(
        (f"{link}_inner", f"{link}_outer")
        for link in ("upper_front", "upper_rear", "lower_front", "lower_rear", "tierod")
    ),
    "three_link": (("upper_inner", "upper_outer"), ("lower_inner", "lower_outer")),
    "semi_trailing_arm": (),
}


RODS["reduced_double_wishbone"] = RODS["double_wishbone"]


BALLS = {"three_link": ("arm_pivot",), "semi_trailing_arm": ("arm_inner", "arm_outer")}


def solved(case):
    engine = Native()
    trajectory = engine.solve(engine.build(case), case, 1e-12)
    assert trajectory.solved.all(), trajectory.message
    return {
        output.name: output_series(case, output, trajectory).position for output in case.outputs
    }


def carrier_of(name, at):
    line = ("strut_upper", "strut_lower") if name == "mcpherson" else None
    return Carrier(
        at["wheel_center"],
        [(at[inner], at[outer]) for inner, outer in RODS[name]],
        line and [at[role] for role in line],
        [at[role] for role in BALLS.get(name, ())],
    )


def turn_about(axis, start, now):
    """Angle between two directions, seen along an axis."""
    axis = axis / np.linalg.norm(axis)
    flat = [a - (a @ axis) * axis for a in (start, now)]
    return np.arctan2(axis @ np.cross(*flat), flat[0] @ flat[1])


def arm_rate(carrier, at, arm, point):
    """Velocity of a point of an arm now, and its place: the arm turns as its ball tells."""
    front, rear, ball = (np.array(at[f"{arm}_{end}"]) for end in ("front", "rear", "outer"))
    axis = (front - rear) / np.linalg.norm(front - rear)
    start, now = ball - rear, carrier.at(ball) - rear
    flat = now - (now @ axis) * axis
    angle = turn_about(axis, start, now)
    place = rear + rotation(angle * axis) @ (np.array(at[point]) - rear)
    moving = carrier.velocity(carrier.at(ball))
    rate = axis @ np.cross(now, moving) / (flat @ flat)
    return place, rate * np.cross(axis, place - rear)


def expected(name, at, travel, spin=Y):
    """Outputs at a wheel travel, by their definitions."""
    carrier = carrier_of(name, at).go(travel)
    center, s = carrier.at(at["wheel_center"]), carrier.direction(spin)
    radius = np.linalg.norm(np.subtract(at["wheel_center"], at["wheel_contact"]))
    rise = np.array([0.0, 0.0, 1.0]) - s[2] * s
    contact = center - radius * rise / np.linalg.norm(rise)
    vy, vz = carrier.velocity(contact)[1:]
    values = {
        "toe": np.arctan2(s[0], s[1]),
        "camber": -np.arcsin(s[2]),
        "half_track_change": contact[1] - at["wheel_contact"][1],
        "roll_center_height": contact[1] * vy / vz,
        "jacking_coefficient": vy / vz,
    }
    for role in TEMPLATES[name].watched:
        values |= dict(zip((f"{role}.{axis}" for axis in "xyz"), carrier.at(at[role]), strict=True))
    if name not in ("mcpherson", "double_wishbone"):
        ends = carrier.at(at["spring_lower"]), np.array(at["spring_upper"])
        moving = carrier.velocity(ends[0])
    elif name == "mcpherson":
        ends = carrier.at(at["strut_lower"]), np.array(at["strut_upper"])
        moving = carrier.velocity(ends[0])
    else:
        place, moving = arm_rate(carrier, at, "lca", "spring_lower")
        ends = place, np.array(at["spring_upper"])
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    values["spring_ratio"] = along @ moving
    if name not in BALLS:
        if name == "five_link":
            low, axis = carrier.steering()
        else:
            low = carrier.at(at["lca_outer"])
            axis = (ends[1] if name == "mcpherson" else carrier.at(at["uca_outer"])) - low
        x, y, z = axis
        values |= {"caster": np.arctan2(-x, z), "kingpin_inclination": np.arctan2(-y, z)}
        meets = low + (contact[2] - low[2]) / z * axis - contact
        heading = np.cross(s, Z)
        heading = heading / np.linalg.norm(heading)
        values |= {
            "mechanical_trail": meets @ heading,
            "scrub_radius": meets @ np.cross(heading, Z),
        }
    return values
