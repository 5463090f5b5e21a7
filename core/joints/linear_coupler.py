"""Linear coupler: a weighted sum of the coordinates of two or more joints stays zero, as of a
differential. 1 row between all of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from ..errors import MechanismError
from ..input_checks import plain, require_finite
from .coupler import Coupler
from .gear import Gear
from .polynomial import Polynomial
from .rack_pinion import RackPinion


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


def linear_relation(name: str, weights: Mapping[str, float], freedoms: Sequence[str]) -> Coupler:
    """Return the plainest coupler that keeps a weighted sum of coordinates at zero.

    Args:
        weights: by joint, not zero [by m or rad].
        freedoms: which coordinate of each joint.
    """
    if len(weights) > 2:
        return LinearCoupler(name, (*weights,), (*weights.values(),), freedoms=(*freedoms,))
    ((first, a), (second, b)), (one, other) = weights.items(), freedoms
    if one == other == "rotation":
        return Gear(name, (first, second), -b / a)
    if one == other:
        return Polynomial(name, (first, second), (0.0, -b / a), freedoms=(one, other))
    if one == "rotation":
        return RackPinion(name, (first, second), -a / b)
    return RackPinion(name, (second, first), -b / a)
