"""Linear coupler: a weighted sum of the coordinates of two or more joints stays zero, as of a
differential. 1 row between all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

from ..errors import MechanismError
from ..input_checks import plain, require_finite
from .coupler import Coupler


@dataclass(frozen=True)
class LinearCoupler(Coupler):
    """The sum of the factors times the joints' coordinates stays zero.

    Attributes:
        factors: one for each joint, not zero [by m or rad of its coordinate].
        freedoms: which coordinate of each joint; rotations unless given.

    Raises:
        MechanismError: as many factors or freedoms as joints are not given, or a factor is zero or
            not finite.
    """

    type = "linear_coupler"
    count = None
    factors: tuple[float, ...]
    freedoms: tuple[str, ...] = field(default=(), kw_only=True)  # pyright: ignore[reportIncompatibleVariableOverride]

    def check(self) -> None:
        wanted = len(self.joints)
        object.__setattr__(self, "freedoms", tuple(self.freedoms) or ("rotation",) * wanted)
        factors = tuple(plain(each) for each in self.factors)
        object.__setattr__(self, "factors", factors)
        for what, given in (("factors", factors), ("freedoms", self.freedoms)):
            if len(given) != wanted:
                raise MechanismError(
                    f"{self}: {what}: found {len(given)}, expected {wanted}, one for each joint"
                )
        require_finite(f"{self}: factors", factors, "finite numbers other than zero")
        super().check()

    def scaled(self, factor: float) -> Self:
        return self.in_units(factor, 1.0)

    def in_units(self, length: float, angle: float) -> Self:
        """Return the coupler with coordinates multiplied, lengths [m] and angles [rad] each by a
        factor.
        """
        units = [length if each == "translation" else angle for each in self.freedoms]
        return replace(
            self, factors=tuple(k / unit for k, unit in zip(self.factors, units, strict=True))
        )

    @property
    def weights(self) -> tuple[float, ...]:
        return self.factors
