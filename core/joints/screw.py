"""Screw joint: cylindrical, with the displacement tied to the rotation. 5 rows, 1 freedom."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .base import length
from .cylindrical import Cylindrical


@dataclass(frozen=True)
class Screw(Cylindrical):
    """Body j moves along the axis by the lead [m] in one right-handed turn; a negative lead is a
    left-handed thread.
    """

    type = "screw"
    lead: float = length()

    @property
    def relations(self) -> Sequence[Mapping[str, float]]:
        return ({"translation": 1.0, "rotation": -self.lead / (2.0 * math.pi)},)
