"""Random closed loops of every joint type, and the families that drive them. They close by
construction: both bodies of a joint are at the design position.

Random joints close a random tree of bodies until as many freedoms remain as there are drivers. A
joint is accepted only if all its rows are independent of the earlier rows, by a basis of the
remaining motions. The reference is followed from the design.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import Field, replace
from typing import Any

import numpy as np

from .....algebra import triple
from .....case.case import TIME
from .....case.joint_probe import make_fitting
from .....errors import MechanismError
from .....joints import AxialJoint, Coupler, Gear, Joint, Kind, RackPinion, Revolute, Translational
from .....mechanism.mechanism import GROUND, Body, Mechanism, Point
from .....mechanism.motions import Absolute, Driver, Motion, PointCoordinate, Sine
from .....trajectory import Array
from ...truth.fold import first_fold
from ...truth.rows import Poses, Rows
from .base import (
    OWN_DRIVERS,
    Rng,
    Specimen,
    as_case,
    bodies,
    direction,
    family,
    own_drivers,
    power,
    sign,
    swept,
    unit_vector,
)
from .linkages import any_plane, flat_plane, polar

LARGEST = 30
# Joint types for the tree, and for the loop closures. Types with five freedoms carry no body.
CARRIERS = (
    "revolute", "spherical", "universal", "translational", "cylindrical", "screw",
    "constant_velocity", "planar", "fixed", "inline", "orientation_lock", "revolute_spherical",
)  # fmt: skip
CLOSERS = (*CARRIERS, "distance", "distance", "in_plane", "parallel_axes", "perpendicular_axes")
# Smallest trusted singular value. A joint or driver below it is not accepted.
SOUND = 0.02


@family(
    f"random closed loops of 3 to {LARGEST} bodies, all joint types, gears and racks, 1 or 2"
    " drivers",
    samples=81,
)
def loops(rng: Rng, samples: int) -> Specimen:
    """Return a loop, driven far enough for a dead centre in every second specimen."""
    mechanism, reach = random_mechanism(rng, lambda: bodies(rng, LARGEST))
    motions: dict[str, Motion] = {d.name: Sine(0.1 * reach, 0.7) for d in mechanism.drivers[1:]}
    name = f"loop of {len(mechanism.bodies)} bodies"
    return swept(name, mechanism, None, -reach, reach, samples, motions=motions)


MOST_FOLDED, DRIVERS = 4, 3
# The search for a fold ends after this multiple of the reach. Over one reach, the rates at design
# would turn or shift something by 0.3 to 1 [rad or m].
FARTHER = 5.0
# Distance from a sample to the fold ahead of it, and from this sample to the next, as fractions of
# the distance from the design to the fold [powers of ten].
BEFORE, STEP = (-4.0, -0.3), (-1.0, 0.7)


@family(
    f"random closed mechanisms of 1 to {MOST_FOLDED} bodies, all joint types, gears and racks, 1 to"
    f" {DRIVERS} drivers that move at once, in 2 to 4 samples: most have one sample 1e-4 to 0.5 of"
    " the way before a fold, and the next one far beyond it",
    samples=2,
)
def folds(rng: Rng, samples: int) -> Specimen:
    """Return a sweep past the first fold, if there is one; the other drivers swing. The motion
    turns back between two samples, where another assembly may continue.
    """
    mechanism, reach = random_mechanism(rng, lambda: int(rng.integers(1, MOST_FOLDED + 1)), DRIVERS)
    driver, stop = mechanism.drivers[0].name, FARTHER * reach
    motions: dict[str, Motion] = {}
    for other in mechanism.drivers[1:]:
        amplitude, turns = float(rng.uniform(-1.0, 1.0)), float(rng.uniform(0.05, 0.3))
        motions[other.name] = Sine(amplitude * reach, turns / reach)
    fold = first_fold(as_case(mechanism, driver, np.array([stop]), motions=motions), stop)
    last = stop if fold is None else fold * (1.0 - power(rng, *BEFORE))
    step = (last if fold is None else fold) * power(rng, *STEP)
    name = f"mechanism of {len(mechanism.bodies)} bodies, {len(mechanism.drivers)} drivers"
    first = last - (samples - 2) * step
    return swept(name, mechanism, None, first, last + step, samples, motions=motions)


MOST_STARTED = 5
# Excursion of the drivers in a second, as a fraction of the reach: few motions meet a fold.
EXCURSION = 0.3
# Below this slope of the sine at the design [-], the excursion grows with the square of time.
TURNING = 0.1
DIGITS = ("exact", "rounded", "typed")
"""Precision of the design value: to the last bit, up to rounding, or with six digits."""


@family(
    "two-link arms whose tip goes round the base, with a rack that counts the turns, and random"
    f" closed mechanisms of 1 to {MOST_STARTED} bodies; 1 to {DRIVERS} absolute drivers on sines"
    " that pass the design values at time zero: exactly, up to rounding, or as typed with six"
    " digits; times around zero, after it or before it",
    samples=41,
)
def starts(rng: Rng, samples: int) -> Specimen:
    """Return an arm or a closed mechanism, swept over time by absolute drivers. The last bits of
    numbers must not decide the result.
    """
    digits = str(rng.choice(DIGITS))
    mechanism, motions = (_arm if rng.random() < 0.5 else _closed_mechanism)(rng, digits)
    first, last = ((-1.0, 1.0), (0.2, 1.0), (-1.0, -0.2))[int(rng.integers(3))]
    name = f"{digits} start, {mechanism.name}, {len(mechanism.drivers)} drivers"
    times = np.linspace(first, last, samples)
    return Specimen(name, as_case(mechanism, TIME, times, motions=motions))


def _closed_mechanism(rng: Rng, digits: str) -> tuple[Mechanism, dict[str, Motion]]:
    """Return a random closed mechanism; its drivers swing by a part of its reach."""
    found, reach = random_mechanism(rng, lambda: int(rng.integers(1, MOST_STARTED + 1)), DRIVERS)
    mechanism = replace(found, drivers=[replace(each, relative=False) for each in found.drivers])
    return mechanism, {
        driver.name: _sine(rng, mechanism.design_value(driver.name), EXCURSION * reach, digits)
        for driver in mechanism.drivers
    }


def _arm(rng: Rng, digits: str) -> tuple[Mechanism, dict[str, Motion]]:
    """Return two links and their motion; the tip circles the base once a second.

    A straight path of the drivers from the design to a later sample passes near the base, and may
    end in the other assembly, in another turn, or at no pose.
    """
    origin, exact = np.zeros(3), digits == "exact"
    plane = flat_plane(rng, origin) if exact else any_plane(rng, origin)
    first, second = rng.uniform(0.3, 1.0, 2)
    least, most = abs(first - second), first + second
    radius = float(least + rng.uniform(0.2, 0.8) * (most - least))
    angle = 0.0 if exact else float(rng.uniform(-np.pi, np.pi))
    bend = np.arccos((first**2 + radius**2 - second**2) / (2.0 * first * radius))
    elbow = angle + bend * sign(rng)
    at = plane.point(polar(first, elbow))
    tip = plane.point(polar(radius, angle))
    side = triple(plane.normal)
    mechanism = Mechanism(
        "two-link arm",
        [Body("upper"), Body("lower"), Body("rack")],
        [
            Revolute("base", GROUND, "upper", point=plane.point(0j), axis=side),
            Revolute("elbow", "upper", "lower", point=at, axis=side),
            Translational("guide", GROUND, "rack", point=side, axis=plane.direction(1.0 + 0j)),
        ],
        [Point("tip", "lower", tip), Point("on_rack", "rack", side)],
        [
            PointCoordinate("x", "tip", plane.direction(1.0 + 0j), relative=False),
            PointCoordinate("y", "tip", plane.direction(1j), relative=False),
        ],
        [RackPinion("turns", ("base", "guide"), 0.1)],
    )
    phases = {"x": angle + np.pi / 2.0, "y": angle}
    return mechanism, {
        name: _motion(mechanism.design_value(name), radius, 1.0, phase, digits)
        for name, phase in phases.items()
    }


def _sine(rng: Rng, design: float, excursion: float, digits: str) -> Motion:
    """Return a sine with the design value at time zero.

    It moves by about the excursion in the first second.
    """
    if not design:
        turns = 0 if digits == "exact" else int(rng.integers(-2, 3))
        phase, amplitude = np.pi * turns, excursion
    elif digits == "exact":  # the sine of this phase is exactly one
        phase, amplitude = np.pi / 2.0, design
    else:
        phase = float(rng.uniform(0.2, np.pi - 0.2)) * sign(rng)
        amplitude = design / np.sin(phase)
    slope, part = abs(float(np.cos(phase))), excursion / abs(amplitude)
    turn = part / slope if slope > TURNING else np.sqrt(2.0 * part)
    frequency = min(float(turn), 1.0) * float(rng.uniform(0.3, 1.0)) / (2.0 * np.pi)
    return _motion(design, float(amplitude), frequency, phase, digits)


def _motion(design: float, amplitude: float, frequency: float, phase: float, digits: str) -> Motion:
    """Return a sine of absolute values, as a case file reads it."""
    numbers = amplitude, frequency, phase
    sine = Sine(*(float(f"{x:.6g}") for x in numbers) if digits == "typed" else numbers)
    return Absolute(sine, design) if design else sine


def random_mechanism(rng: Rng, count: Callable[[], int], most: int = 2) -> tuple[Mechanism, float]:
    """Return a random mechanism that can be closed, and the reach of its drivers.

    Args:
        count: returns a number of bodies.
        most: largest number of drivers.
    """
    while (found := _Builder(rng, count(), most).built()) is None:
        pass
    return found


class _Builder:
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
        self.left = 1  # freedoms that no further part may take

    def built(self) -> tuple[Mechanism, float] | None:
        """Return the mechanism and the reach of its drivers; None if it cannot be closed."""
        for body in self.bodies:
            parent = str(self.rng.choice(list(self.places)))
            away = self.rng.uniform(0.3, 0.6) * direction(self.rng)
            self.places[body.name] = self.places[parent] + away
        for k, body in enumerate(self.bodies):
            place, before = self.places[body.name], [*self.places][: k + 1]
            nearest = min(before, key=lambda name: np.linalg.norm(self.places[name] - place))
            while not self._join(str(self.rng.choice(CARRIERS)), nearest, body.name):
                pass
        self.left, tries = int(self.rng.integers(1, self.most + 1)), 0
        while self.motions.shape[1] > self.left:
            if (tries := tries + 1) > 40 * len(self.bodies):
                return None
            if tries % 9 == 0 and self._couple():
                continue
            one, other = self.rng.choice(list(self.places), 2, replace=False)
            self._join(str(self.rng.choice(CLOSERS)), str(one), str(other))
        return self._driven() if self.motions.shape[1] == self.left else None

    def _mechanism(
        self,
        joints: Sequence[Joint],
        drivers: Sequence[Driver] = (),
        couplers: Sequence[Coupler] = (),
    ) -> Mechanism:
        """Return the mechanism of these joints, always with the same points, so that the unknowns
        stay the same.
        """
        points = [Point(f"p_{b.name}", b.name, triple(self.places[b.name])) for b in self.bodies]
        return Mechanism("loop", self.bodies, joints, points, drivers, couplers)

    def _rows(self, mechanism: Mechanism, drop: int = 0) -> Array:
        """Return rows of unit length, translations in metres, without the first `drop` rows."""
        rows = Rows(mechanism)
        found: Array = rows.jacobian(Poses.design(len(self.bodies), 1))[0][drop:]
        found[:, np.arange(found.shape[1]) % 6 < 3] /= rows.unit
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    def _take(self, rows: Array) -> bool:
        """Remove rows from the remaining motions; return whether they were accepted.

        All rows must be independent, and enough motions must remain.
        """
        if self.motions.shape[1] - len(rows) < self.left:
            return False
        _, sizes, basis = np.linalg.svd(rows @ self.motions)
        if len(rows) and sizes[-1] < SOUND:
            return False
        self.motions = self.motions @ basis[len(rows) :].T
        return True

    def _join(self, kind: str, one: str, other: str) -> bool:
        """Add a joint of random geometry; return whether it was accepted."""
        rng = self.rng
        middle = 0.5 * (self.places[one] + self.places[other])
        ends = tuple(triple(self.places[name] + 0.2 * direction(rng)) for name in (one, other))
        h = direction(rng)
        across = unit_vector(np.cross(h, direction(rng)))
        second = across if kind != "constant_velocity" else np.cos(0.5) * h + np.sin(0.5) * across
        values: dict[Any, Any] = {
            Kind.POSITION: triple(middle + 0.1 * direction(rng)),
            Kind.POSITIONS: ends,
            Kind.DIRECTION: triple(h),
            Kind.DIRECTIONS: (triple(h), triple(second)),
            Kind.LENGTH: float(rng.uniform(0.02, 0.2)),
        }
        given = {"name": f"{kind}_{len(self.joints) + 1}", "i": one, "j": other}

        def value(field: Field[Any]) -> Any:
            return values[field.metadata["kind"]]

        try:
            joint = make_fitting(Joint.registry[kind], given, [value])
        except MechanismError:
            return False
        if accepted := self._take(self._rows(self._mechanism([joint]))):
            self.joints.append(joint)
        return accepted

    def _couple(self) -> bool:
        """Add a gear or a rack between two coordinates of joints; return whether one was added."""
        axial = [joint for joint in self.joints if isinstance(joint, AxialJoint)]
        turning, sliding = (
            [joint.name for joint in axial if freedom in joint.freedoms] for freedom in OWN_DRIVERS
        )
        seconds = sliding if self.rng.random() < 0.5 and sliding else turning
        if not turning or not seconds:
            return False
        pair = str(self.rng.choice(turning)), str(self.rng.choice(seconds))
        if pair[0] == pair[1]:
            return False
        name, size = f"coupler_{len(self.couplers) + 1}", float(self.rng.uniform(0.3, 1.5))
        gears = seconds is turning
        coupler = Gear(name, pair, size) if gears else RackPinion(name, pair, 0.2 * size)
        joined = [joint for joint in self.joints if joint.name in pair]
        rows = sum(joint.rows for joint in joined)
        if accepted := self._take(self._rows(self._mechanism(joined, couplers=[coupler]), rows)):
            self.couplers.append(coupler)
        return accepted

    def _driven(self) -> tuple[Mechanism, float] | None:
        """Return the mechanism with drivers of its remaining freedoms, and the reach of the
        drivers.

        The rates at design turn or shift something by 0.3 to 1 over the reach [rad or m].
        """
        axial = [joint for joint in self.joints if isinstance(joint, AxialJoint)]
        drivers = [driver for joint in axial for driver in own_drivers(joint)]
        drivers += [
            PointCoordinate(f"shift_{b.name}", f"p_{b.name}", triple(direction(self.rng)))
            for b in self.bodies[:3]
        ]
        carried = sum(joint.rows for joint in axial)
        rows = self._rows(self._mechanism(axial, drivers), carried) @ self.motions
        taken: list[int] = []
        for k in self.rng.permutation(len(drivers)):
            trial = [*taken, int(k)]
            if len(taken) < self.left and np.linalg.svd(rows[trial], compute_uv=False)[-1] > SOUND:
                taken = trial
        if len(taken) < self.left:
            return None
        rates = self.motions @ np.linalg.pinv(rows[taken])
        found = self._mechanism(self.joints, [drivers[k] for k in taken], self.couplers)
        reach = float(self.rng.uniform(0.3, 1.0) / np.abs(rates).max())
        driven = [d.point for d in found.drivers if isinstance(d, PointCoordinate)]
        shown = {*driven, *(f"p_{body.name}" for body in self.bodies[-3:])}
        points = [point for point in found.points if point.name in shown]
        return replace(found, points=points), reach
