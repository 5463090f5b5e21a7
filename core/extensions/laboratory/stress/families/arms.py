"""Arms driven at every joint: their poses are products of rotations, for any number of bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .....algebra import triple
from .....joints import AxialJoint, Cylindrical, Fixed, Joint, Revolute, Screw, Translational
from .....mechanism.mechanism import GROUND, Body, Mechanism, Point
from .....mechanism.motions import Driver, JointDriver, Motion, Ramp, Sine
from ...truth.motion import Motion as Closed
from ...truth.rows import NO_ARM, PI, Poses, Real, about, extended, unit
from .base import Rng, Specimen, bodies, direction, family, own_drivers, swept

KINDS: Sequence[type[Joint]] = (Revolute, Revolute, Translational, Cylindrical, Screw, Fixed)
LARGEST = 30


@family(
    f"trees of 3 to {LARGEST} bodies on hinges, slides, cylinders and screws, every freedom driven;"
    " forward kinematics",
    samples=41,
)
def arms(rng: Rng, samples: int) -> Specimen:
    """Return a random tree or chain with joints 0.1 to 0.3 m apart, whose drivers all move at once,
    each with another motion.
    """
    count = bodies(rng, LARGEST)
    mechanism, motions = random_arm(rng, count)
    name = f"arm of {count} bodies and {len(mechanism.drivers)} drivers"
    return swept(name, mechanism, forward(mechanism), -2.0, 2.0, samples, motions=motions)


def random_arm(
    rng: Rng, count: int, kinds: Sequence[type[Joint]] = KINDS
) -> tuple[Mechanism, dict[str, Motion]]:
    """Return a tree or chain, and the motions of all drivers but the first, which turns."""
    chain = rng.random() < 0.3
    parts, joints, drivers = list[Body](), list[Joint](), list[Driver]()
    motions = dict[str, Motion]()
    ends: dict[str, Any] = {GROUND: np.zeros(3)}
    for k in range(count):
        parent = list(ends)[-1 if chain else int(rng.integers(len(ends)))]
        name, place = f"b{k + 1}", ends[parent] + rng.uniform(0.1, 0.3) * direction(rng)
        kind = Revolute if not drivers else kinds[int(rng.integers(len(kinds)))]
        given: dict[str, Any] = {"point": triple(place)}
        if issubclass(kind, AxialJoint):
            given["axis"] = triple(direction(rng))
        if kind is Screw:
            given["lead"] = float(rng.uniform(-0.2, 0.2))
        joint = kind(f"j{k + 1}", parent, name, **given)
        parts.append(Body(name))
        joints.append(joint)
        ends[name] = place
        # the rotation of a screw determines its translation
        for driver in own_drivers(joint)[: 1 if kind is Screw else None]:
            size = 1.0 if driver.turns else 0.1
            if rng.random() < 0.5:
                swing = float(size * rng.uniform(0.2, 1.0))
                motions[driver.name] = Sine(swing, float(rng.uniform(0.1, 0.5)))
            else:
                motions[driver.name] = Ramp(float(size * rng.uniform(-1.0, 1.0)))
            drivers.append(driver)
    del motions[drivers[0].name]
    ends.pop(GROUND)
    points = [
        Point(f"tip_{name}", name, triple(ends[name] + 0.1 * direction(rng)))
        for name in list(ends)[-3:]
    ]
    return Mechanism("arm", parts, joints, points, drivers), motions


def forward(mechanism: Mechanism) -> Closed:
    """Return the closed form of a tree; the joints must be ordered from parents to children."""

    def motion(drives: Real) -> Mapping[str, tuple[Real, Real, Real]]:
        values = {
            (d.joint, d.freedom): x
            for d, x in zip(mechanism.drivers, drives, strict=True)
            if isinstance(d, JointDriver)
        }
        zero = np.zeros_like(drives[0])
        still = np.stack([zero, zero, zero])
        found = {GROUND: (np.stack([zero + 1.0, *still]), NO_ARM, still)}
        for joint in mechanism.joints:
            q, at, come = found[joint.i]
            given: Any = joint
            place = extended(given.point)
            turn, shift = (
                values.get((joint.name, freedom), zero) for freedom in ("rotation", "translation")
            )
            if isinstance(joint, Screw):
                shift = extended(joint.lead) * turn / (2.0 * PI)
            h = unit(getattr(joint, "axis", (0.0, 0.0, 1.0)))
            along = h[:, None] * shift
            arm = (place - at)[:, None] + along
            swing = np.einsum("abn,bn->an", Poses(arm[None], q[None]).turned[0], arm)
            found[joint.j] = _product(q, about(h, turn)), place, come + along + swing
        del found[GROUND]
        return found

    return motion


def _product(p: Real, q: Real) -> Real:
    """Return the rotation q followed by p, in the axes at design, shape (4, n)."""
    a, b = p[1:], q[1:]
    vector = p[0] * b + q[0] * a + np.cross(a, b, axis=0)
    return np.concatenate([(p[0] * q[0] - (a * b).sum(axis=0))[None], vector])
