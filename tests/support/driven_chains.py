"""Chains of bodies that are driven at every freedom, and what free-body diagrams say of them."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from kincheck import (
    GROUND,
    Body,
    Cylindrical,
    Gear,
    Joint,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    Polynomial,
    RackPinion,
    Revolute,
    Screw,
    Spline,
    Translational,
)
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.joints import Coupler, Follower
from kincheck.core.joints.base import unit
from kincheck.core.mechanism.motions import Motion, Path

from ..oracles import free_bodies
from .loads import random_inertia
from .splines import through

GRAVITY = (0.7, -2.0, -9.3)
TIMES = np.array([0.0, 0.35, -0.8, 1.7])
LEAD = 0.7
SLOW = 1e-8
"""Of a motion that is followed at rest: its inertia forces are below round-off."""
DRIVES = {"rotation": JointAngle, "translation": JointDisplacement}


@dataclass(frozen=True)
class Swing(Motion):
    """Zero at time zero, where rate and acceleration are not."""

    size: float
    pace: float

    def at(self, t):
        s, c = np.sin(self.pace * t), np.cos(self.pace * t)
        x, v, a = s + 0.5 * (1.0 - c), c + 0.5 * s, 0.5 * c - s
        return self.size * x, self.size * self.pace * v, self.size * self.pace**2 * a


@dataclass(frozen=True)
class Following(Motion):
    """A polynomial of another motion, or the spline through points."""

    of: Motion
    law: tuple[Any, ...]

    def at(self, t):
        y, v, a = self.of.at(t)
        value, slope, bend = np.vectorize(function(self.law))(y)
        return value, slope * v, slope * a + bend * v * v


def function(law):
    """Value and derivatives of a polynomial, or of the spline through points."""
    if not isinstance(law[0], float):
        return through(law)
    value = np.polynomial.Polynomial(law)
    return lambda x: (value(x), value.deriv(1)(x), value.deriv(2)(x))


@dataclass(frozen=True)
class Link:
    """A joint type, whether the body that it carries comes first, and the coordinate that a screw
    takes its motion from.
    """

    kind: type[Joint]
    flipped: bool = False
    screws_by: str = "rotation"


@dataclass(frozen=True)
class Coupling:
    """A coupler type between two coordinates, each the number of a link and a freedom: the driven
    is law(driving), a polynomial or a spline; the driver is at either.
    """

    kind: type[Coupler]
    driven: tuple[int, str]
    driving: tuple[int, str]
    law: tuple[Any, ...]
    drive_driven: bool = False

    @property
    def coupler(self):
        one, other = (f"j{link}" for link, _ in (self.driven, self.driving))
        if issubclass(self.kind, Follower):
            freedoms = self.driven[1], self.driving[1]
            return self.kind("coupler", (one, other), self.law, freedoms=freedoms)
        pair = (other, one) if self.kind is RackPinion else (one, other)
        return self.kind("coupler", pair, self.law[1])


@dataclass(frozen=True)
class Chain:
    """A mechanism, its drivers' motions, and those of all coordinates by joint and freedom."""

    mechanism: Mechanism
    path: Path
    coordinates: dict[tuple[str, str], Motion]
    coupling: Coupling | None

    def by_hand(self, t):
        """Wrenches of joints and efforts of drivers at a time."""
        moved = {name: motion.at(np.float64(t)) for name, motion in self.coordinates.items()}
        loads = []
        if self.coupling is not None:
            one, other = (
                (f"j{link}", freedom)
                for link, freedom in (self.coupling.driven, self.coupling.driving)
            )
            slope = function(self.coupling.law)(moved[other][0])[1]
            loads = [{one: 1.0, other: -slope}]
        return free_bodies.forces(self.mechanism, moved, loads)


def deviation(made, found):
    """The largest difference of forces from those by hand, as a part of the largest."""
    differences, size = [], 0.0
    for k, t in enumerate(made.path.times):
        hand = made.by_hand(t)
        pairs = [
            (np.concatenate([found.joints[name].force[k], found.joints[name].moment[k]]), wrench)
            for name, wrench in hand.joints.items()
        ]
        pairs += [(found.drivers[name][k], effort) for name, effort in hand.drivers.items()]
        differences += [np.abs(one - other).max() for one, other in pairs]
        size = max([size, *(np.abs(other).max() for _, other in pairs)])
    return max(differences) / size


def direction(rng):
    found = rng.normal(size=3)
    return found / np.linalg.norm(found)


def heavy(rng, name, near):
    """A body with a frame of its own, somewhere near."""
    inertia = tuple(random_inertia(rng))
    q = rng.normal(size=4)
    return Body(
        name,
        tuple(near + 0.3 * rng.normal(size=3)),
        tuple(q / np.linalg.norm(q)),
        mass=float(rng.uniform(1.0, 5.0)),
        center_of_mass=tuple(near + 0.2 * rng.normal(size=3)),
        inertia=inertia,
    )


def chain(links, coupling=None, *, seed=0, size=1.0, slow=1.0, origin=(0.1, -0.2, 0.3)):
    """A chain from the ground, driven at every freedom but one per coupling.

    Args:
        size: of the motions [rad, and 0.4 m each].
        slow: factor on all rates; the poses stay the same.
    """
    rng = np.random.default_rng(seed)
    at, previous = np.array(origin), GROUND
    joints, bodies, points, drivers = [], [], [], []
    coordinates, motions = {}, {}
    for k, link in enumerate(links, 1):
        name, body = f"j{k}", f"b{k}"
        at = at + 0.4 * direction(rng)
        given = {"point": tuple(at), "axis": tuple(rng.uniform(0.5, 3.0) * direction(rng))}
        if link.kind is Screw:
            given["lead"] = LEAD
        pair = (body, previous) if link.flipped else (previous, body)
        joints.append(link.kind(name, *pair, **given))
        bodies.append(heavy(rng, body, at))
        previous = body

        def swing(length):
            return Swing(length * size * rng.uniform(0.7, 1.3), slow * rng.uniform(1.0, 2.0))

        for freedom in link.kind.freedoms if link.kind is not Screw else (link.screws_by,):
            motion = swing(1.0 if freedom == "rotation" else 0.4)
            coordinates[name, freedom] = motion
            if freedom in DRIVES:
                drivers.append(DRIVES[freedom](f"{name} {freedom}", name))
            else:
                way = free_bodies.across(free_bodies.axis_of(joints[-1])[1])
                point = f"{name} {freedom}"
                points.append(Point(point, body, tuple(at)))
                along = way[freedom == "translation y"] * (-1.0 if link.flipped else 1.0)
                drivers.append(PointCoordinate(point, point, tuple(along)))
            motions[drivers[-1].name] = motion
    couplers = []
    if coupling is not None:
        couplers = [coupling.coupler]
        one, other = (f"j{link}" for link, _ in (coupling.driven, coupling.driving))
        one, other = (one, coupling.driven[1]), (other, coupling.driving[1])
        coordinates[one] = Following(coordinates[other], coupling.law)
        kept, gone = (one, other) if coupling.drive_driven else (other, one)
        motions[" ".join(kept)] = coordinates[kept]
        del motions[" ".join(gone)]
        drivers = [each for each in drivers if each.name in motions]
    for k, link in enumerate(links, 1):
        if link.kind is Screw:
            law = (0.0, LEAD / (2.0 * math.pi))
            known, rest = ("rotation", "translation"), law
            if link.screws_by == "translation":
                known, rest = ("translation", "rotation"), (0.0, 1.0 / law[1])
            coordinates[f"j{k}", known[1]] = Following(coordinates[f"j{k}", known[0]], rest)
    mechanism = Mechanism("chain", bodies, joints, points, drivers, couplers, gravity=GRAVITY)
    return Chain(mechanism, Path(motions, TIMES / slow), coordinates, coupling)


def pushed_slide(link):
    """A slide on the ground, moved at a point beside its axis; a cylinder, at a point on it."""
    made = chain([link, Link(Revolute)], seed=3)
    (joint, _), along = made.mechanism.joints, (0.5, -1.0, 2.0)
    aside = 0.0 if "rotation" in joint.freedoms else 0.3
    at = tuple(np.array(joint.point) + aside * np.array([1.0, 2.0, -1.0]))
    sign = -1.0 if link.flipped else 1.0
    share = sign * free_bodies.axis_of(joint)[1] @ np.array(along) / np.linalg.norm(along)
    point, push = Point("handle", "b1", at), PointCoordinate("push", "handle", along)
    old = "j1 translation"
    drivers = [push if driver.name == old else driver for driver in made.mechanism.drivers]
    motions = dict(made.path.motions)
    motions["push"] = Following(motions.pop(old), (0.0, float(share)))
    mechanism = replace(made.mechanism, points=[point], drivers=drivers)
    return replace(made, mechanism=mechanism, path=Path(motions, made.path.times))


T, R = "translation", "rotation"
LAW = (0.0, 0.9, 0.15, -0.05, 0.02)
POINTS = ((-1.3, -0.9), (-0.6, -0.7), (-0.1, -0.2), (0.0, 0.0), (0.4, 0.7), (0.9, 0.8))
SLIDE, HINGE, CYLINDER = Link(Translational), Link(Revolute), Link(Cylindrical)
COUPLINGS = {
    "gear": (HINGE, HINGE, Coupling(Gear, (2, R), (3, R), (0.0, -0.8))),
    "gear of cylinders": (CYLINDER, CYLINDER, Coupling(Gear, (2, R), (3, R), (0.0, 1.7))),
    "rack": (SLIDE, HINGE, Coupling(RackPinion, (2, T), (3, R), (0.0, 0.3))),
    "rack of cylinders": (CYLINDER, CYLINDER, Coupling(RackPinion, (2, T), (3, R), (0.0, -0.3))),
    "rack that is a screw": (
        Link(Screw, screws_by=T),
        HINGE,
        Coupling(RackPinion, (2, T), (3, R), (0.0, 0.3)),
    ),
}
"""By name: the driven link, the driving one and the coupling."""
for one in (T, R):
    for other in (T, R):
        by = Coupling(Polynomial, (2, one), (3, other), LAW)
        screws = Link(Screw, screws_by=one), Link(Screw, screws_by=other)
        of = {T: SLIDE, R: HINGE}
        COUPLINGS[f"polynomial, {one} by {other}"] = (of[one], of[other], by)
        COUPLINGS[f"polynomial of cylinders, {one} by {other}"] = (CYLINDER, CYLINDER, by)
        COUPLINGS[f"polynomial of screws, {one} by {other}"] = (*screws, by)
        by = replace(by, kind=Spline, law=POINTS)
        COUPLINGS[f"spline, {one} by {other}"] = (of[one], of[other], by)
turned = Link(Revolute, flipped=True), replace(by, driven=(2, T), driving=(3, R))
COUPLINGS["spline by a turned hinge"] = (SLIDE, *turned)


def at_origins(self, freedom, i, j):
    """Slides between the internal origins of the bodies, not at the joint's point."""
    P, h = vec(self.point), unit(self.axis)
    between = p.Dot20(h, ZERO, ZERO, i.arm(P) - j.arm(P))
    return between if freedom == "translation" else p.DrivenAngle(h)
