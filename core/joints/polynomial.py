"""Polynomial: one joint's coordinate is a polynomial of another's, as knees and cams have it. 1 row
between two joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from ..errors import MechanismError, Phrase
from ..input_checks import plain, require_finite
from .coupler import Coupler

HIGHEST = 4
"""Highest power, as in MuJoCo's joint equality."""


@dataclass(frozen=True)
class Polynomial(Coupler):
    """The first joint (driven) follows c0 + c1 y + ... + c4 y^4 of the second one's coordinate y.

    Attributes:
        coefficients: one to five, the constant first [m or rad of the first joint, by powers of
            the second one's m or rad]. With a constant other than zero the design is open, and
            the motion begins where it is closed.
        freedoms: which coordinate of each joint, where a joint has several.

    Raises:
        MechanismError: no or more than five coefficients, one that is not finite, or all zero
            beyond the constant.
    """

    type = "polynomial"
    coefficients: tuple[float, ...]
    freedoms: tuple[str, str] = field(default=("rotation", "rotation"), kw_only=True)  # pyright: ignore[reportIncompatibleVariableOverride]

    def check(self) -> None:
        expected = f"one to {HIGHEST + 1} finite numbers, the constant first"
        try:
            numbers = tuple(plain(each) for each in self.coefficients)
        except TypeError:
            numbers = ()
        if not 0 < len(numbers) <= HIGHEST + 1:
            raise MechanismError(
                f"{self}: coefficients: found {self.coefficients}, expected {expected}"
            )
        require_finite(f"{self}: coefficients", numbers, expected)
        if not any(numbers[1:]):
            raise MechanismError(
                f"{self}: coefficients = {list(numbers)} would lock {self.joints[0]!r}, expected"
                " one beyond the constant; use a fixed joint, or give another coefficient"
            )
        object.__setattr__(self, "coefficients", numbers)
        object.__setattr__(self, "freedoms", tuple(self.freedoms))

    def scaled(self, factor: float) -> Self:
        return self.in_units(factor, 1.0)

    def in_units(self, length: float, angle: float) -> Self:
        """Return the coupler with coordinates multiplied, lengths [m] and angles [rad] each by a
        factor.
        """
        driven, driving = (length if each == "translation" else angle for each in self.freedoms)
        return replace(
            self,
            coefficients=tuple(c * driven / driving**k for k, c in enumerate(self.coefficients)),
        )

    @property
    def notes(self) -> Sequence[str | Phrase]:
        offset = self.coefficients[0]
        if not offset:
            return ()
        turns = self.freedoms[0] == "rotation"
        found = (f"{offset:.10g} rad",) if turns else (offset,)
        how = "assembled from there, so the design position is another than the given one"
        return (
            Phrase(f"{self}: {self.joints[0]!r} begins at ", *found, f", zero as given: {how}"),
        )

    @property
    def weights(self) -> tuple[float, float]:
        return 1.0, -self.coefficients[1] if len(self.coefficients) > 1 else 0.0

    @property
    def curve(self) -> tuple[float, ...]:
        """Minus the coefficients, without the linear one, which is a weight; empty for a line
        through zero.
        """
        if not any(c for k, c in enumerate(self.coefficients) if k != 1):
            return ()
        return tuple(0.0 if k == 1 else -c for k, c in enumerate(self.coefficients))
