"""Screw joint: cylindrical, with the displacement tied to the rotation. 5 rows, 1 freedom."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .base import length
from .cylindrical import Cylindrical


@dataclass(frozen=True)
class Screw(Cylindrical):
    """Body j moves by the lead [m] per right-handed turn; left-handed threads: negative."""

    type = "screw"
    lead: float = length()

    @property
    def relations(self) -> Sequence[Mapping[str, float]]:
        return ({"translation": 1.0, "rotation": -self.lead / (2.0 * math.pi)},)
