"""Drivers of a mechanism, and their motions: a value over time, with its first two derivatives.

A driver adds one equation  Phi(q) - c(t) = 0  per driven coordinate. Values are measured from the
design position [m or rad]; times are in seconds.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..caches import ByContent
from ..doors import offers
from ..errors import MechanismError
from ..input_checks import finite, finite_numbers, held, require_direction
from ..joints.base import Kind
from ..trajectory import Array

PACKAGE = __name__.removesuffix("mechanism.motions")
ROUNDED_TIME = 1e-12
"""Relative rounding by which a time may lie outside a motion's span."""


class Measure(Enum):
    """Quantity of a field of a motion; it sets the unit for a reader."""

    DRIVER = "driver units"
    DRIVER_RATE = "driver units per second"
    ANGLE = "an angle"
    FREQUENCY = "Hz"
    TIME = "s"
    TEXT = "text"


def measure(measure: Measure, **options: Any) -> Any:
    """Return a field of a motion [m or rad, rad, Hz, s]."""
    return field(metadata={"measure": measure}, **options)


@dataclass(frozen=True)
class Motion(ABC):
    """Base of the motions. Declaring one with a type registers it; case files name it."""

    type: ClassVar[str]
    registry: ClassVar[dict[str, type[Motion]]] = {}

    def __init_subclass__(cls) -> None:
        if "type" in cls.__dict__:
            Motion.registry[cls.type] = cls

    @staticmethod
    def types() -> Mapping[str, type[Motion]]:
        """Return the motions by type, those of extensions too."""
        for each in offers("motions").values():
            each.load()
        return Motion.registry

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the motion [s]."""
        return -math.inf, math.inf

    @abstractmethod
    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return value, velocity and acceleration at times t [s], each of t's shape."""


@dataclass(frozen=True)
class Ramp(Motion):
    """value = rate * t; rate in driver units per second."""

    type = "ramp"
    rate: float = measure(Measure.DRIVER_RATE)

    def __post_init__(self) -> None:
        require_finite("ramp", rate=self.rate)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        return self.rate * t, np.full_like(t, self.rate), np.zeros_like(t)


@dataclass(frozen=True)
class Sine(Motion):
    """value = amplitude * sin(2 pi frequency t + phase); frequency in Hz, phase an angle."""

    type = "sine"
    amplitude: float = measure(Measure.DRIVER)
    frequency: float = measure(Measure.FREQUENCY)
    phase: float = measure(Measure.ANGLE, default=0.0)

    def __post_init__(self) -> None:
        require_finite("sine", amplitude=self.amplitude, frequency=self.frequency, phase=self.phase)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        omega = 2.0 * math.pi * self.frequency
        s, c = np.sin(omega * t + self.phase), np.cos(omega * t + self.phase)
        return self.amplitude * s, self.amplitude * omega * c, -self.amplitude * omega**2 * s


@dataclass(frozen=True)
class Table(Motion):
    """Natural cubic spline through values at increasing times [s]: twice differentiable, for
    accelerations.

    Outside the table the end pieces continue.
    """

    type = "table"
    times: tuple[float, ...] = measure(Measure.TIME)
    values: tuple[float, ...] = measure(Measure.DRIVER)

    def __post_init__(self) -> None:
        for name in ("times", "values"):  # lists and arrays may change, motions do not
            given = getattr(self, name)
            object.__setattr__(
                self, name, held(f"table motion: {name}", given, None, "as many numbers as samples")
            )
        if len(self.times) != len(self.values) or len(self.times) < 2:
            raise MechanismError(
                f"table motion: {len(self.times)} times and {len(self.values)} values, expected as"
                " many of each, two or more; give a value for each time"
            )
        if not all(map(finite, (*self.times, *self.values))):
            raise MechanismError("table motion: a time or value is not finite; give numbers")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise MechanismError(
                "table motion: times do not increase; sort them and remove repeats"
            )

    @property
    def span(self) -> tuple[float, float]:
        return self.times[0], self.times[-1]

    @cached_property
    def _spline(self) -> Any:
        # slow to import, and rarely wanted
        from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

        return CubicSpline(self.times, self.values, bc_type="natural")

    @property
    def pieces(self) -> list[float]:
        """Coefficients of the cubic from each time on, the highest power first, one after the
        other.
        """
        return self._spline.c.T.ravel().tolist()

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        return self._spline(t), self._spline(t, 1), self._spline(t, 2)


@dataclass(frozen=True)
class Absolute(Motion):
    """A motion of a driver's absolute value, converted to values from design as in all other
    motions.
    """

    motion: Motion
    design: float

    @property
    def span(self) -> tuple[float, float]:
        return self.motion.span

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        value, velocity, acceleration = self.motion.at(t)
        return value - self.design, velocity, acceleration


@dataclass(frozen=True)
class Slowed(Motion):
    """A motion over times that are longer by a factor; a power of two keeps all digits."""

    motion: Motion
    factor: float

    @property
    def span(self) -> tuple[float, float]:
        first, last = sorted(self.factor * end for end in self.motion.span)
        return first, last

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        value, velocity, acceleration = self.motion.at(t / self.factor)
        return value, velocity / self.factor, acceleration / self.factor**2


def as_changes(motions: Mapping[str, Motion], design: Mapping[str, float]) -> dict[str, Motion]:
    """Return motions by driver as changes from the design values; `design` lists those that are not
    zero.
    """
    there = {
        name: motion
        for name, motion in motions.items()
        if name in design and not isinstance(motion, Absolute)
    }
    return {**motions, **{name: Absolute(motion, design[name]) for name, motion in there.items()}}


@dataclass(frozen=True, eq=False)
class Path(ByContent):
    """Motions of the drivers over time; drivers without a motion hold their design value.

    Two paths are equal if motions and times are, to the last bit. The times do not change.

    Attributes:
        motions: by driver name.
        times: of the samples, in the order wanted [s], shape (n,).
        design: values of drivers at the design position if not zero; for messages.
    """

    motions: Mapping[str, Motion]
    times: Array
    design: Mapping[str, float] = field(default_factory=dict[str, float])

    @cached_property
    def _content(self) -> tuple[Any, ...]:
        return tuple(self.motions.items()), self.times.tobytes(), tuple(self.design.items())

    @cached_property
    def is_builtin(self) -> bool:
        """Whether all motions are of this package with immutable numbers: equal ones then mean the
        same.
        """
        motions = (
            each.motion if isinstance(each, Absolute) else each for each in self.motions.values()
        )
        try:
            hash(self)
        except TypeError:  # a number given as an array
            return False
        return all(type(each).__module__.startswith(PACKAGE) for each in motions)

    def where(self, t: float) -> str:
        """Return the values of the moving drivers at time t, as text."""
        values = self.drive(list(self.motions), np.array([t]))[0, :, 0]
        named = zip(self.motions, values, strict=True)
        return ", ".join(
            f"{name} = {self.design.get(name, 0.0) + value:.9g}" for name, value in named
        )

    def end_message(self, here: float, wanted: float, last: float | None, reason: str) -> str:
        """Return the message of a motion that cannot reach a time: its limit, and the last reached
        sample, if any.
        """
        reached = (
            "no sample reached on this side"
            if last is None
            else f"last reachable sample at {self.where(last)}"
        )
        return (
            f"cannot be followed beyond {self.where(here)} (wanted {self.where(wanted)}): {reason};"
            f" {reached}; shorten the sweep or drive another coordinate"
        )

    def drive(self, names: Sequence[str], t: Array) -> Array:
        """Return value, velocity and acceleration of the drivers at times t, shape (3, names,
        *t.shape).
        """
        found = np.zeros((3, len(names), *t.shape), np.result_type(t, np.float64))
        for k, name in enumerate(names):
            if name in self.motions:
                found[:, k] = self.motions[name].at(t)
        return found

    def values(self, t: Array) -> Array:
        """Return the moving drivers' values from the design at times t, shape (drivers, n)."""
        found = np.array([motion.at(t)[0] for motion in self.motions.values()])
        return found.reshape(len(self.motions), len(t))

    def covers(self, t: float) -> bool:
        """Return whether all motions include time t, up to its rounding."""
        return all(_within(motion.span, t) for motion in self.motions.values())

    @cached_property
    def passes_design(self) -> bool:
        """Whether all drivers have their design values at time zero."""
        return self.covers(0.0) and bool(np.allclose(self.values(np.zeros(1)), 0.0, atol=1e-9))

    def lead_in(self, to: float) -> Path:
        """Return the straight path of all drivers from the design, at time zero, to their values at
        a time, at time one.
        """
        values = self.values(np.array([to]))[:, 0].tolist()
        return Path(
            {name: Ramp(value) for name, value in zip(self.motions, values, strict=True)},
            np.ones(1),
        )


def _within(span: tuple[float, float], t: float) -> bool:
    low, high = span
    rounding = ROUNDED_TIME * max(abs(t), *(abs(each) for each in span if math.isfinite(each)), 0.0)
    return low - rounding <= t <= high + rounding


def outwards(times: Array, start: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return indices of the samples at or after the start, and before it; nearest first, equal ones
    in order.
    """
    nearest = np.argsort(np.abs(times - start), kind="stable")
    after = times[nearest] >= start
    return nearest[after], nearest[~after]


def require_finite(who: str, **numbers: Any) -> None:
    """Refuse numbers of a motion that are not finite."""
    for name, value in numbers.items():
        if not finite(value):
            raise MechanismError(f"{who} motion: {name} is {value!r}; give a finite number")


@dataclass(frozen=True)
class Waypoints(Motion):
    """Twice differentiable motion through values at increasing times, with the same rate and
    without acceleration at each.

    Between two times it is a quintic, outside of them a ramp.

    Attributes:
        times: of the values [s].
        values: from the design [m or rad].
        rate: at each of the times [driver units per second].
    """

    times: tuple[float, ...]
    values: tuple[float, ...]
    rate: float

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return value, velocity and acceleration; they are exact at the times given."""
        times, values = np.array(self.times), np.array(self.values)
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1)
        lengths = np.append(np.diff(times), 1.0)
        surplus = np.append(np.diff(values) - self.rate * lengths[:-1], 0.0)[k]
        h, since = lengths[k], t - times[k]
        part = np.maximum(since / h, 0.0)
        rest = 1.0 - part
        return (
            values[k] + surplus * part**3 * (10.0 + part * (6.0 * part - 15.0)) + self.rate * since,
            self.rate + surplus * 30.0 * (part * rest) ** 2 / h,
            surplus * 60.0 * part * rest * (rest - part) / h**2,
        )


@dataclass(frozen=True)
class Driver:
    """Base of the drivers. Values are in radians if it turns, else in metres."""

    type: ClassVar[str]
    turns: ClassVar[bool] = False
    name: str


@dataclass(frozen=True)
class PointCoordinate(Driver):
    """Drives the coordinate of a point along a fixed global direction.

    Attributes:
        point: name of the driven point.
        direction: global direction, any length but zero [-].
        relative: the value is the change from the design position (default), else the coordinate
            itself [m]; see `Mechanism.design_value`.
    """

    type: ClassVar[str] = "point_coordinate"
    point: str
    direction: tuple[float, float, float]
    relative: bool = True

    def __post_init__(self) -> None:
        who = f"driver {self.name!r}: direction"
        direction = finite_numbers(who, self.direction, 3, Kind.DIRECTION.value)
        object.__setattr__(self, "direction", direction)
        require_direction(who, direction)


@dataclass(frozen=True)
class JointDriver(Driver):
    """Base of the drivers of a joint's own freedom: second body relative to first, zero at
    design.
    """

    freedom: ClassVar[str]
    joint: str
    relative: bool = True


@dataclass(frozen=True)
class JointAngle(JointDriver):
    """Drives the rotation of a joint's second body relative to its first, about the axis by the
    right hand [rad].
    """

    type: ClassVar[str] = "joint_angle"
    turns: ClassVar[bool] = True
    freedom: ClassVar[str] = "rotation"


@dataclass(frozen=True)
class JointDisplacement(JointDriver):
    """Drives the displacement of a joint's second body relative to its first, along the axis
    [m].
    """

    type: ClassVar[str] = "joint_displacement"
    freedom: ClassVar[str] = "translation"
