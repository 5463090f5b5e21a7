"""Polynomial: one joint's coordinate is a polynomial of another's, as knees and cams have it. 1 row
between two joints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from numpy.polynomial import Polynomial as Powers

from ..errors import MechanismError
from ..input_checks import plain, require_finite
from .coupler import Follower, PiecewisePolynomial

HIGHEST = 4
"""Highest power, as in MuJoCo's joint equality."""


@dataclass(frozen=True)
class Polynomial(Follower):
    """The first joint (driven) follows c0 + c1 y + ... + c4 y^4 of the second one's coordinate y.

    Attributes:
        coefficients: one to five, the constant first [m or rad of the first joint, by powers of
            the second one's m or rad].

    Raises:
        MechanismError: no or more than five coefficients, one that is not finite, or all zero
            beyond the constant.
    """

    type = "polynomial"
    coefficients: tuple[float, ...]

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
        super().check()

    def in_units(self, length: float, angle: float) -> Self:
        driven, driving = (length if each == "translation" else angle for each in self.freedoms)
        return replace(
            self,
            coefficients=tuple(c * driven / driving**k for k, c in enumerate(self.coefficients)),
        )

    def counted_from(self, driven: float, driving: float) -> Self:
        moved = Powers(self.coefficients)(Powers((driving, 1.0))) - driven
        return replace(self, coefficients=(*moved.coef.tolist(),))

    @property
    def function(self) -> PiecewisePolynomial:
        return PiecewisePolynomial((0.0,), (self.coefficients,))
