"""What couples two joints: a relation between their coordinates. A new one is one file, as a new
joint is.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Self

from ..errors import MechanismError, Phrase
from ..input_checks import held, plain, require_finite
from .base import Kind, register

NUMBERS = (float, int, "float", "int")
"""What fields that are numbers are annotated with."""
ROUND_OFF = 1e-12
"""Part of a function's largest constant to which its value at zero is known: splines are solved
for.
"""


@dataclass(frozen=True)
class PiecewisePolynomial:
    """A function of a coordinate: polynomials, each from its start on, the first also before.

    Attributes:
        starts: as many as polynomials, increasing; their arguments count from these.
        powers: coefficients of each, the constant first, of one length.
    """

    starts: tuple[float, ...]
    powers: tuple[tuple[float, ...], ...]

    def at(self, x: float) -> tuple[float, float, float]:
        """Return the value and the first two derivatives at x."""
        k = max(bisect_right(self.starts, x) - 1, 0)
        value = slope = half_bend = 0.0
        for c in reversed(self.powers[k]):
            half_bend = slope + (x - self.starts[k]) * half_bend
            slope = value + (x - self.starts[k]) * slope
            value = c + (x - self.starts[k]) * value
        return value, slope, 2.0 * half_bend

    @property
    def knots(self) -> list[tuple[float, float]]:
        """Coordinates and values where polynomials meet; empty for one polynomial."""
        return [(x, row[0]) for x, row in zip(self.starts, self.powers, strict=True)][1:]

    def scaled(self, x: Any, y: Any) -> PiecewisePolynomial:
        """Return the function of a coordinate in units of x, with values times y."""
        powers = (tuple(c * x**k * y for k, c in enumerate(each)) for each in self.powers)
        return PiecewisePolynomial(tuple(start / x for start in self.starts), tuple(powers))


@dataclass(frozen=True)
class Coupler(ABC):
    """A relation between one coordinate each of axial joints, most often of two, which are zero at
    design.

    Attributes:
        count: number of its joints; None for two or more.
        joints: names of the joints.
        freedoms: which coordinate of each: "rotation" or "translation".

    Raises:
        MechanismError: one joint twice, or a weight that is zero or not finite.
    """

    type: ClassVar[str]
    count: ClassVar[int | None] = 2
    freedoms: ClassVar[tuple[str, ...]]
    registry: ClassVar[dict[str, type[Coupler]]] = {}

    name: str
    joints: tuple[str, ...]

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "type" in cls.__dict__:
            register(Coupler.registry, cls)

    def __post_init__(self) -> None:
        what = "two names" if self.count else "two names or more"
        joints = held(f"{self}: joints", self.joints, self.count, what)
        object.__setattr__(self, "joints", tuple(joints))
        if len(joints) < 2:
            raise MechanismError(f"{self}: joints: found {len(joints)}, expected {what}")
        if again := next((each for each in joints if joints.count(each) > 1), None):
            raise MechanismError(f"{self}: couples {again!r} with itself; give different joints")
        for each in fields(self):
            if each.type in NUMBERS:
                object.__setattr__(self, each.name, plain(getattr(self, each.name)))
                require_finite(
                    f"{self}: {each.name}",
                    (getattr(self, each.name),),
                    "a finite number other than zero",
                )
        self.check()

    def check(self) -> None:
        """Refuse weights that lock or lose a joint.

        Raises:
            MechanismError: a weight is zero or not finite.
        """
        if not all(weight and math.isfinite(weight) for weight in self.weights):
            given = {
                each.name: getattr(self, each.name)
                for each in fields(self)
                if each.name not in ("name", "joints")
            }
            raise MechanismError(
                f"{self}: {', '.join(f'{name} = {value}' for name, value in given.items())} would"
                " lock or lose a joint; give a finite number other than zero"
            )

    def __str__(self) -> str:
        return f"joint {self.name!r} ({self.type})"

    @property
    def notes(self) -> Sequence[str | Phrase]:
        """Remarks on its numbers for a reader of results: intended, or a mistake."""
        return ()

    def scaled(self, factor: float) -> Self:
        """The same coupler with all lengths multiplied by the factor."""
        lengths = [each.name for each in fields(self) if each.metadata.get("kind") is Kind.LENGTH]
        return replace(self, **{name: factor * getattr(self, name) for name in lengths})

    @property
    def terms(self) -> tuple[tuple[str, str, float], ...]:
        """Joint, freedom and weight of the coordinates."""
        return tuple(zip(self.joints, self.freedoms, self.weights, strict=True))

    @property
    def curve(self) -> PiecewisePolynomial | None:
        """A function of the second coordinate that is added to the weighted sum; None for a linear
        relation.
        """
        return None

    @property
    @abstractmethod
    def weights(self) -> tuple[float, ...]:
        """Weights of the coordinates [m, rad]; the sum, with that of `curve`, stays zero."""


@dataclass(frozen=True)
class Follower(Coupler):
    """The first joint (driven) follows a function of the second one's coordinate. With a value
    other than zero at zero the design is open, and the motion begins where it is closed.

    Attributes:
        freedoms: which coordinate of each joint, where a joint has several.
    """

    freedoms: tuple[str, str] = field(default=("rotation", "rotation"), kw_only=True)  # pyright: ignore[reportIncompatibleVariableOverride]

    def check(self) -> None:
        object.__setattr__(self, "freedoms", tuple(self.freedoms))

    @property
    @abstractmethod
    def function(self) -> PiecewisePolynomial:
        """The function [m or rad, of m or rad]."""

    @abstractmethod
    def in_units(self, length: float, angle: float) -> Self:
        """Return the coupler with coordinates multiplied, lengths [m] and angles [rad] each by a
        factor.
        """

    @abstractmethod
    def counted_from(self, driven: float, driving: float) -> Self:
        """Return the coupler with coordinates that count from other values [m or rad]."""

    def scaled(self, factor: float) -> Self:
        return self.in_units(factor, 1.0)

    @property
    def notes(self) -> Sequence[str | Phrase]:
        function = self.function
        offset = function.at(0.0)[0]
        if abs(offset) <= ROUND_OFF * max(abs(row[0]) for row in function.powers):
            return ()
        turns = self.freedoms[0] == "rotation"
        found = (f"{offset:.10g} rad",) if turns else (offset,)
        how = "assembled from there, so the design position is another than the given one"
        return (
            Phrase(f"{self}: {self.joints[0]!r} begins at ", *found, f", zero as given: {how}"),
        )

    @property
    def _slope(self) -> float | None:
        """The slope of a line through zero; None of another function."""
        (constant, *rest), *others = self.function.powers
        if others or constant or any(rest[1:]):
            return None
        return rest[0] if rest else 0.0

    @property
    def weights(self) -> tuple[float, float]:
        return 1.0, -(self._slope or 0.0)

    @property
    def curve(self) -> PiecewisePolynomial | None:
        return self.function.scaled(1.0, -1.0) if self._slope is None else None
