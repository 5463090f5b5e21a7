"""Motions of drivers as formulas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import MechanismError
from ...mechanism.motions import Measure, Motion, measure, require_finite
from ...trajectory import Array
from .formula import jet_of


@dataclass(frozen=True)
class Formula(Motion):
    """value = offset + scale * formula, which is over TIME in units of `second`, as Adams has it.

    SIN, COS, SQRT, STEP, POLY and SHF are known; 30D is an angle in degrees.
    """

    type = "formula"
    formula: str = measure(Measure.TEXT)
    scale: float = measure(Measure.DRIVER, default=1.0)
    offset: float = measure(Measure.DRIVER, default=0.0)
    second: float = measure(Measure.TIME, default=1.0)

    def __post_init__(self) -> None:
        require_finite("formula", scale=self.scale, offset=self.offset, second=self.second)
        if not self.second > 0.0:
            raise MechanismError(f"formula motion: second is {self.second!r}; give a positive time")
        try:
            jet_of(self.formula, np.zeros(1))
        except MechanismError as error:
            raise MechanismError(f"formula motion: {error}; in {self.formula!r}") from None

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        found, rate = jet_of(self.formula, t / self.second), self.scale / self.second
        return self.offset + self.scale * found.x, rate * found.v, rate / self.second * found.a
