"""Arms driven at every joint: their poses are products of rotations, for any number of bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ....algebra import triple
from ....joints import AxialJoint, Cylindrical, Fixed, Joint, Revolute, Screw, Translational
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point
from ....mechanism.motions import Driver, JointAngle, JointDisplacement, Motion, Ramp, Sine
from ...truth.motion import Motion as Closed
from ...truth.rows import PI, Poses, Real, extended, unit
from .base import Rng, Specimen, bodies, direction, family, swept

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
        joint = _joint(kind, rng, f"j{k + 1}", parent, name, triple(place))
        parts.append(Body(name))
        joints.append(joint)
        ends[name] = place
        # the rotation of a screw determines its translation
        for freedom in joint.freedoms[:1] if kind is Screw else joint.freedoms:
            of = JointAngle if freedom == "rotation" else JointDisplacement
            drivers.append(of(f"{joint.name}_{freedom}", joint.name))
            size = 1.0 if freedom == "rotation" else 0.1
            swings = rng.random() < 0.5
            motions[drivers[-1].name] = (
                Sine(float(size * rng.uniform(0.2, 1.0)), float(rng.uniform(0.1, 0.5)))
                if swings
                else Ramp(float(size * rng.uniform(-1.0, 1.0)))
            )
    del motions[drivers[0].name]
    ends.pop(GROUND)
    points = [
        Point(f"tip_{name}", name, triple(ends[name] + 0.1 * direction(rng)))
        for name in list(ends)[-3:]
    ]
    return Mechanism("arm", parts, joints, points, drivers), motions


def _joint(
    kind: type[Joint],
    rng: Rng,
    name: str,
    parent: str,
    child: str,
    place: tuple[float, float, float],
) -> Joint:
    given: dict[str, Any] = {"point": place}
    if issubclass(kind, AxialJoint):
        given["axis"] = triple(direction(rng))
    if kind is Screw:
        given["lead"] = float(rng.uniform(-0.2, 0.2))
    return kind(name, parent, child, **given)


def forward(mechanism: Mechanism) -> Closed:
    """Return the closed form of a tree; the joints must be ordered from parents to children."""

    def motion(drives: Real) -> Mapping[str, tuple[Real, Real, Real]]:
        values = {
            (d.joint, d.freedom): x
            for d, x in zip(mechanism.drivers, drives, strict=True)
            if isinstance(d, _DRIVEN)
        }
        n, zero = drives.shape[1], np.zeros_like(drives[0])
        still = np.stack([zero + 1.0, zero, zero, zero])
        found: dict[str, tuple[Real, Real, Real]] = {
            GROUND: (still, extended(np.zeros(3)), np.zeros((3, n), dtype=np.longdouble))
        }
        for joint in mechanism.joints:
            q, at, come = found[joint.i]
            given: Any = joint
            place = extended(given.point)
            turn, shift = (
                values.get((joint.name, "rotation"), zero),
                values.get((joint.name, "translation"), zero),
            )
            if isinstance(joint, Screw):
                shift = extended(joint.lead) * turn / (2.0 * PI)
            h = (
                unit(extended(given.axis))
                if isinstance(joint, AxialJoint)
                else extended((0.0, 0.0, 1.0))
            )
            along = h[:, None] * shift
            carried = come + along + _swing(q, (place - at)[:, None] + along)
            found[joint.j] = (
                _product(
                    q, np.concatenate([np.cos(turn / 2)[None], h[:, None] * np.sin(turn / 2)])
                ),
                place,
                carried,
            )
        del found[GROUND]
        return found

    return motion


_DRIVEN = (JointAngle, JointDisplacement)


def _swing(q: Real, a: Real) -> Real:
    """Return (R - 1) a, shape (3, n)."""
    return np.einsum("abn,bn->an", Poses(a[None], q[None]).turned[0], a)


def _product(p: Real, q: Real) -> Real:
    """Return the rotation q followed by p, in the axes at design, shape (4, n)."""
    a, b = p[1:], q[1:]
    vector = p[0] * b + q[0] * a + np.cross(a, b, axis=0)
    return np.concatenate([(p[0] * q[0] - (a * b).sum(axis=0))[None], vector])
