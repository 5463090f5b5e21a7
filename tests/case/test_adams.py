"""Single joints against ADAMS: recorded motion put into the joints' equations must satisfy them as
far as it was printed.

Positions, velocities and accelerations of a body that hangs on one joint come from elsewhere
(source and licence in the data file). No dynamics is needed: phi, rows . v - nu and rows . a -
gamma of the right joint vanish, those of a wrong one don't. The other body is the ground: what
gamma says of two turning bodies is for test_joints and test_primitives.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from kincheck.core import (
    Cylindrical,
    Distance,
    Revolute,
    RevoluteSpherical,
    Spherical,
    Translational,
    Universal,
)
from kincheck.core.algebra import ZERO, Quat, Vec3
from kincheck.core.joints import Attachment
from kincheck.core.primitives.base import GROUND_POSE, GROUND_TWIST, Pose, Twist

from ..oracles import naive

CASES = json.loads(
    (Path(__file__).parents[1] / "data" / "adams_single_joints.json").read_text(encoding="utf-8")
)["cases"]
NAMES = ("joint", "ground", "body")
STYLES = {
    "native": lambda primitive: (primitive,),
    "paper": lambda primitive: primitive.paper_form(),
    "conventional": lambda primitive: primitive.conventional_form(),
}

# The data have six significant digits, trailing zeros left out.
DIGITS = 6
# The decks name no integrator, and ADAMS' default holds the constraints on positions alone (index
# 3): velocities and accelerations satisfy theirs no better than it integrates. Measured, as parts
# of the largest of a case: 1.3e-5 and 1.1e-4.
INTEGRATED = {"velocity": 2e-5, "acceleration": 2e-4}
# A wrong joint has to be wrong beyond doubt: by this many limits, in its positions already.
BEYOND_DOUBT = 100.0

POSE, VELOCITY, ACCELERATION = slice(0, 7), slice(7, 13), slice(13, 19)


def axes(case):
    """The axes x, y, z of the joint frame, global."""
    p = np.array(case["frame"])
    return tuple(map(tuple, naive.Body(np.zeros(3), p / np.linalg.norm(p)).A.T))


def right(case):
    """The joint of a case: revolute, prismatic and cylindrical along z; universal with x on the
    ground and y on the body.
    """
    if case["joint"] == "distance":
        return Distance(*NAMES, (case["ground_point"], case["body_point"]), case["length"])
    if case["joint"] == "revolute_spherical":
        return RevoluteSpherical(*NAMES, (case["ground_point"], case["body_point"]), case["axis"])
    if case["joint"] == "spherical":
        return Spherical(*NAMES, case["point"])
    x, y, z = axes(case)
    if case["joint"] == "universal":
        return Universal(*NAMES, case["point"], (x, y))
    kinds = {"revolute": Revolute, "translational": Translational, "cylindrical": Cylindrical}
    return kinds[case["joint"]](*NAMES, case["point"], z)


class Replay:
    """The motion of a case as lanes, shape (19, samples): position, Euler parameters, v, w, vdot,
    wdot; design is at t = 0.
    """

    def __init__(self, name, style="native"):
        self.case = CASES[name]
        self.numbers = np.array(self.case["samples"]).T[1:]
        self.origin, self.style = Vec3(*self.numbers[:3, 0]), STYLES[style]
        e0, *e = self.numbers[3:7, 0] / np.linalg.norm(self.numbers[3:7, 0])
        self.back_to_design = Quat(e0, Vec3(*e)).conjugate()

    def primitives(self, joint):
        at = {"ground": Attachment(ZERO), "body": Attachment(self.origin)}
        composed = joint.primitives(at[joint.i], at[joint.j])
        return [form for each in composed for form in self.style(each)]

    def residuals(self, joint, numbers):
        """phi, rows . v - nu and rows . a - gamma: shape (3, rows, samples)."""
        position, p, v, w, v_t, w_t = np.split(numbers, [3, 7, 10, 13, 16])
        e0, *e = p / np.sqrt((p * p).sum(axis=0))
        pose = Pose.of(Vec3(*position) - self.origin, Quat(e0, Vec3(*e)) * self.back_to_design)
        v, w, v_t, w_t = (Vec3(*each) for each in (v, w, v_t, w_t))
        first = joint.i == "body"
        poses = (pose, GROUND_POSE) if first else (GROUND_POSE, pose)
        phi, phi_t, phi_tt = [], [], []
        for primitive in self.primitives(joint):
            here = pose.A.T if primitive.body_axes else None
            turning, rising = (w, w_t) if here is None else (here @ w, here @ w_t)
            moving = Twist(v, turning)
            rows = [
                (row.ri, row.pi) if first else (row.rj, row.pj) for row in primitive.rows(*poses)
            ]
            gamma = primitive.gamma(
                *poses, *((moving, GROUND_TWIST) if first else (GROUND_TWIST, moving))
            )
            phi += primitive.phi(*poses)
            phi_t += [
                r @ v + pi @ turning - nu
                for (r, pi), nu in zip(rows, primitive.nu(*poses), strict=True)
            ]
            phi_tt += [
                r @ v_t + pi @ rising - each for (r, pi), each in zip(rows, gamma, strict=True)
            ]
        return np.array(
            [
                [np.broadcast_to(each, numbers.shape[1:]) for each in order]
                for order in (phi, phi_t, phi_tt)
            ]
        )

    @property
    def uncertainty(self):
        """How far each number may be off: half a unit of its last digit, and what the integrator
        adds.
        """
        size = np.abs(self.numbers)
        printed = (
            0.5
            * 10.0 ** (np.floor(np.log10(np.where(size > 0.0, size, 1.0))) - (DIGITS - 1))
            * (size > 0.0)
        )
        for part, share in (
            (VELOCITY, INTEGRATED["velocity"]),
            (ACCELERATION, INTEGRATED["acceleration"]),
        ):
            largest = [size[part][:3].max(), size[part][3:].max()]  # of the shift and of the turn
            printed[part] += share * np.repeat(largest, 3)[:, None]
        return printed

    def limits(self, joint):
        """The residuals that such numbers can leave: the changes made by each of them, summed;
        shape (3, rows, samples).
        """
        exact = self.residuals(joint, self.numbers)
        changes = np.zeros_like(exact)
        for k, off in enumerate(self.uncertainty):
            moved = self.numbers.copy()
            moved[k] += off
            changes += np.abs(self.residuals(joint, moved) - exact)
        # beside what is printed as zero there is round-off of numbers up to some hundred metres
        return changes + 1e-13

    def worst(self, joint):
        """The largest residuals of phi, velocity and acceleration, in limits."""
        return (np.abs(self.residuals(joint, self.numbers)) / self.limits(joint)).max(axis=(1, 2))


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("name", CASES)
def test_recorded_motion_satisfies_the_joint(name, style):
    replay = Replay(name, style)
    assert replay.worst(right(replay.case)) == pytest.approx([0.0, 0.0, 0.0], abs=1.0)


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(
    "name", [name for name, case in CASES.items() if case["joint"] != "revolute_spherical"]
)
def test_the_joint_seen_from_the_body(name, style):
    """With the body as the first one; a revolute-spherical joint would be another, with its hinge
    on the body.
    """
    replay = Replay(name, style)
    assert replay.worst(right(replay.case).reversed()) == pytest.approx([0.0, 0.0, 0.0], abs=1.0)


def wrong_joints(case):
    """Joints of the same type with other axes or points, and of types that leave less."""
    if case["joint"] in ("distance", "revolute_spherical"):
        ends = (case["ground_point"], case["body_point"])
        yield (
            "its points exchanged",
            type(right(case))(*NAMES, ends[::-1], *([case["axis"]] if "axis" in case else [])),
        )
        yield "a ball at its end", Spherical(*NAMES, ends[1])
        if case["joint"] == "distance":
            yield "a millimetre longer", Distance(*NAMES, ends, case["length"] + 1e-3)
        else:
            yield "along x", RevoluteSpherical(*NAMES, ends, (1.0, 0.0, 0.0))
            yield "along y", RevoluteSpherical(*NAMES, ends, (0.0, 1.0, 0.0))
        return
    at, (x, y, z) = case["point"], axes(case)
    if case["joint"] in ("revolute", "translational", "cylindrical"):
        yield "along x", type(right(case))(*NAMES, at, x)
        yield "along y", type(right(case))(*NAMES, at, y)
    if case["joint"] in ("translational", "cylindrical"):
        yield "a revolute", Revolute(*NAMES, at, z)
    if case["joint"] in ("revolute", "cylindrical"):
        yield "a slider", Translational(*NAMES, at, z)
    if case["joint"] == "universal":
        yield "its axes exchanged", Universal(*NAMES, at, (y, x))
        yield "a revolute along x", Revolute(*NAMES, at, x)
        yield "a revolute along y", Revolute(*NAMES, at, y)
    if case["joint"] == "spherical":
        yield "elsewhere", Spherical(*NAMES, tuple(np.add(at, (0.0, 0.0, 1e-3))))
        for letter, axis in zip("xyz", (x, y, z), strict=True):
            yield f"a revolute along {letter}", Revolute(*NAMES, at, axis)
        for letters, pair in (("xy", (x, y)), ("yz", (y, z)), ("zx", (z, x))):
            yield f"a universal along {letters}", Universal(*NAMES, at, pair)


BLIND = {
    # the swing is about the joint frame's y, or about one of the two axes: what allows that is
    # right here
    "Spherical_Case01": {"a revolute along y", "a universal along xy", "a universal along yz"},
    "Universal_Case01": {"its axes exchanged", "a revolute along x"},
    "Universal_Case02": {"its axes exchanged", "a revolute along y"},
    # the body does not slide, or only falls, or rests
    "Cylindrical_Case01": {"a slider"},
    "Cylindrical_Case02": {"a revolute"},
    "Prismatic_Case03": {"along x", "along y", "a revolute"},
}
"""What a case cannot tell from its own joint; every other wrong joint must be found out."""

WRONG = [(name, what) for name, case in CASES.items() for what, _ in wrong_joints(case)]


@pytest.mark.parametrize(("name", "what"), WRONG)
def test_recorded_motion_finds_out_a_wrong_joint(name, what):
    replay = Replay(name)
    joint = dict(wrong_joints(replay.case))[what]
    phi, phi_t, phi_tt = replay.worst(joint)
    if what in BLIND.get(name, ()):
        assert max(phi, phi_t, phi_tt) <= 1.0
    else:
        assert phi > BEYOND_DOUBT


def test_blind_sides_are_of_joints_that_are_tried():
    assert {(name, what) for name, found in BLIND.items() for what in found} <= set(WRONG)
