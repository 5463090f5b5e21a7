"""Random closed loops of every joint type. They close by construction: both bodies of a joint are
at the design position.

Random joints close a random tree of bodies until as many freedoms remain as there are drivers. A
joint is accepted only if all its rows are independent of the earlier rows, by a basis of the
remaining motions. The reference is followed from the design.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import MISSING, fields, replace
from functools import partial
from typing import Any

import numpy as np

from ....algebra import triple
from ....errors import MechanismError
from ....joints import AxialJoint, Coupler, Gear, Joint, Kind, RackPinion
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point
from ....mechanism.motions import (
    Driver,
    JointAngle,
    JointDisplacement,
    Motion,
    PointCoordinate,
    Sine,
)
from ....trajectory import Array
from ...truth.rows import Poses, Rows
from .base import Family, Rng, Specimen, as_case, bodies, direction

LARGEST = 30
# Joint types for the tree, and for the loop closures. Types with five freedoms carry no body.
CARRIERS = (
    "revolute", "spherical", "universal", "translational", "cylindrical", "screw",
    "constant_velocity", "planar", "fixed", "inline", "orientation_lock", "revolute_spherical",
)  # fmt: skip
CLOSERS = (*CARRIERS, "distance", "distance", "in_plane", "parallel_axes", "perpendicular_axes")
# Smallest trusted singular value. A joint or driver below it is not accepted.
SOUND = 0.02


class Loops(Family):
    """Mechanisms of any topology."""

    name = "loops"
    about = (
        f"random closed loops of 3 to {LARGEST} bodies, all joint types, gears and racks, 1 or 2"
        " drivers"
    )
    samples = 81

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a loop, driven far enough for a dead centre in every second specimen."""
        mechanism, reach = random_mechanism(rng, lambda: bodies(rng, LARGEST))
        count = len(mechanism.bodies)
        motions: dict[str, Motion] = {d.name: Sine(0.1 * reach, 0.7) for d in mechanism.drivers[1:]}
        values = np.linspace(-reach, reach, samples)
        return Specimen(
            f"loop of {count} bodies",
            partial(as_case, mechanism, mechanism.drivers[0].name, values, motions=motions),
            facts=(("bodies", count),),
        )


def random_mechanism(rng: Rng, count: Callable[[], int], most: int = 2) -> tuple[Mechanism, float]:
    """Return a random mechanism that can be closed, and the reach of its drivers.

    Args:
        count: returns a number of bodies.
        most: largest number of drivers.
    """
    while (found := Builder(rng, count(), most).built()) is None:
        pass
    return found


class Builder:
    """Builder of one random mechanism.

    Args:
        count: number of bodies.
        most: largest number of drivers.
    """

    def __init__(self, rng: Rng, count: int, most: int = 2) -> None:
        self.rng, self.most = rng, most
        self.places = {GROUND: np.zeros(3)}
        self.bodies = [Body(f"b{k + 1}") for k in range(count)]
        self.joints: list[Joint] = []
        self.couplers: list[Coupler] = []
        self.motions: Array = np.eye(6 * count)

    def built(self) -> tuple[Mechanism, float] | None:
        """Return the mechanism and the reach of its drivers; None if it cannot be closed."""
        for body in self.bodies:
            parent = str(self.rng.choice(list(self.places)))
            self.places[body.name] = self.places[parent] + self.rng.uniform(0.3, 0.6) * direction(
                self.rng
            )
        for body in self.bodies:
            near = [name for name in self.places if name != body.name]
            nearest = sorted(
                near,
                key=lambda name: float(np.linalg.norm(self.places[name] - self.places[body.name])),
            )
            before = [
                name for name in nearest if name == GROUND or int(name[1:]) < int(body.name[1:])
            ]
            while not self._join(str(self.rng.choice(CARRIERS)), before[0], body.name):
                pass
        drivers, tries = int(self.rng.integers(1, self.most + 1)), 0
        while self.freedoms > drivers:
            if (tries := tries + 1) > 40 * len(self.bodies):
                return None
            if tries % 9 == 0 and self._couple(drivers):
                continue
            one, other = self.rng.choice(list(self.places), 2, replace=False)
            self._join(str(self.rng.choice(CLOSERS)), str(one), str(other), drivers)
        return self._driven(drivers) if self.freedoms == drivers else None

    @property
    def freedoms(self) -> int:
        """Number of remaining freedoms."""
        return self.motions.shape[1]

    def _mechanism(
        self,
        joints: Sequence[Joint],
        drivers: Sequence[Driver] = (),
        couplers: Sequence[Coupler] = (),
    ) -> Mechanism:
        """Return the mechanism of these joints, always with the same points, so that the unknowns
        stay the same.
        """
        points = [
            Point(f"p_{name}", name, triple(self.places[name]))
            for name in self.places
            if name != GROUND
        ]
        return Mechanism("loop", self.bodies, joints, points, drivers, couplers)

    def _rows(self, mechanism: Mechanism, drop: int = 0) -> Array:
        """Return rows of unit length, translations in metres, without the first `drop` rows."""
        rows = Rows(mechanism)
        found: Array = rows.jacobian(Poses.design(len(self.bodies), 1))[0][drop:]
        found[:, np.arange(found.shape[1]) % 6 < 3] /= rows.unit
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    def _take(self, rows: Array, leave: int) -> bool:
        """Remove rows from the remaining motions; return whether they were accepted.

        All rows must be independent, and at least `leave` motions must remain.
        """
        if self.freedoms - len(rows) < leave:
            return False
        _, sizes, basis = np.linalg.svd(rows @ self.motions)
        if len(rows) and sizes[-1] < SOUND:
            return False
        self.motions = self.motions @ basis[len(rows) :].T
        return True

    def _join(self, kind: str, one: str, other: str, leave: int = 1) -> bool:
        joint = self._joint(kind, one, other)
        if joint is None or not self._take(self._rows(self._mechanism([joint])), leave):
            return False
        self.joints.append(joint)
        return True

    def _joint(self, kind: str, one: str, other: str) -> Joint | None:
        rng, cls = self.rng, Joint.registry[kind]
        middle = 0.5 * (self.places[one] + self.places[other])
        ends = tuple(triple(self.places[name] + 0.2 * direction(rng)) for name in (one, other))
        h = direction(rng)
        across = np.cross(h, direction(rng))
        across = across / np.linalg.norm(across)
        second = across if kind != "constant_velocity" else np.cos(0.5) * h + np.sin(0.5) * across
        values: dict[Any, Any] = {
            Kind.POSITION: triple(middle + 0.1 * direction(rng)),
            Kind.POSITIONS: ends,
            Kind.DIRECTION: triple(h),
            Kind.DIRECTIONS: (triple(h), triple(second)),
            Kind.LENGTH: float(rng.uniform(0.02, 0.2)),
        }
        required = [
            f for f in fields(cls) if f.default is MISSING and f.name not in ("name", "i", "j")
        ]
        try:
            return cls(
                f"{kind}_{len(self.joints) + 1}",
                one,
                other,
                **{f.name: values[f.metadata["kind"]] for f in required},
            )
        except MechanismError:
            return None

    def _couple(self, leave: int) -> bool:
        """Add a gear or a rack between two coordinates of joints; return whether one was added."""
        axial = [
            (joint, freedom)
            for joint in self.joints
            if isinstance(joint, AxialJoint)
            for freedom in joint.freedoms
        ]
        turning = [joint.name for joint, freedom in axial if freedom == "rotation"]
        sliding = [joint.name for joint, freedom in axial if freedom == "translation"]
        seconds = sliding if self.rng.random() < 0.5 and sliding else turning
        if not turning or not seconds:
            return False
        pair = str(self.rng.choice(turning)), str(self.rng.choice(seconds))
        if pair[0] == pair[1]:
            return False
        name, size = f"coupler_{len(self.couplers) + 1}", float(self.rng.uniform(0.3, 1.5))
        coupler = (
            Gear(name, pair, size) if seconds is turning else RackPinion(name, pair, 0.2 * size)
        )
        joined = [joint for joint in self.joints if joint.name in pair]
        rows = sum(joint.rows for joint in joined)
        whole = self._rows(self._mechanism(joined, couplers=[coupler]))
        if not self._take(whole[rows:], leave):
            return False
        self.couplers.append(coupler)
        return True

    def _driven(self, count: int) -> tuple[Mechanism, float] | None:
        """Return the mechanism with drivers of its remaining freedoms, and the reach of the
        drivers.

        The rates at design turn or shift something by 0.3 to 1 over the reach [rad or m].
        """
        drivers: list[Driver] = []
        for joint in self.joints:
            if isinstance(joint, AxialJoint):
                of = {"rotation": JointAngle, "translation": JointDisplacement}
                drivers += [
                    of[f](f"{joint.name}_{f}", joint.name) for f in joint.freedoms if f in of
                ]
        drivers += [
            PointCoordinate(f"shift_{b.name}", f"p_{b.name}", triple(direction(self.rng)))
            for b in self.bodies[:3]
        ]
        needed = [
            joint
            for joint in self.joints
            if any(getattr(d, "joint", "") == joint.name for d in drivers)
        ]
        rows = (
            self._rows(self._mechanism(needed, drivers), sum(joint.rows for joint in needed))
            @ self.motions
        )
        order = self.rng.permutation(len(drivers))
        taken: list[int] = []
        for k in order:
            trial = [*taken, int(k)]
            if len(taken) < count and np.linalg.svd(rows[trial], compute_uv=False)[-1] > SOUND:
                taken = trial
        if len(taken) < count:
            return None
        rates = self.motions @ np.linalg.pinv(rows[taken])
        found = self._mechanism(self.joints, [drivers[k] for k in taken], self.couplers)
        reach = float(self.rng.uniform(0.3, 1.0) / np.abs(rates).max())
        driven = [d.point for d in found.drivers if isinstance(d, PointCoordinate)]
        shown = {*driven, *(f"p_{body.name}" for body in self.bodies[-3:])}
        points = [point for point in found.points if point.name in shown]
        return replace(found, points=points), reach
