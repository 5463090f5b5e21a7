"""Places of a mechanism's geometry: search by name, and groups of coincident positions."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ...errors import remedy
from ...joints import Kind
from ...kinematics import kinds, places
from ...mechanism.mechanism import Mechanism
from ..case import MARKER

# Positions closer than this are one hardpoint [m]: tables are measured to a micrometre at best.
SAME = 1e-6


class PlaceError(ValueError):
    """Error for a name of no place, or of several; the message states the remedy."""


class Geometry:
    """The places of a mechanism.

    Attributes:
        values: value of each place [m or -], markers included.
        kinds: kind of each place.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.values = places(mechanism)
        self.kinds = kinds(mechanism)

    @property
    def named(self) -> list[str]:
        """Places known to the user: all except those of markers."""
        return [place for place in self.values if not place.startswith(f"points.{MARKER}")]

    def find(self, name: str) -> str:
        """Return the place of a name, or the only position of the joint or point of that name.

        Raises:
            PlaceError: no place matches, or several do.
        """
        if name in self.named:
            return name
        found = [
            place
            for place in self.named
            if self.kinds[place] is Kind.POSITION
            and (place.startswith(f"{name}.") or place.partition(".")[2].startswith(f"{name}."))
        ]
        if not found:
            raise PlaceError(
                f"expected a position, direction or length of the case; {remedy(name, self.named)}"
            )
        if any(place not in self.together(found[0]) for place in found):
            raise PlaceError(
                f"which may be {' or '.join(found)}, expected one place; write it in full"
            )
        return found[0]

    def together(self, place: str) -> tuple[str, ...]:
        """Return the place and, if a position, every other position at this point at design."""
        if self.kinds[place] is not Kind.POSITION:
            return (place,)
        here = self.values[place]
        return tuple(
            each
            for each in self.named
            if self.kinds[each] is Kind.POSITION and math.dist(here, self.values[each]) <= SAME
        )

    def with_markers(self, moved: Iterable[str]) -> tuple[str, ...]:
        """Return places, and those of the markers beside points among them."""
        found = [*moved]
        for place in self.values:
            if place.startswith(f"points.{MARKER}"):
                center = (
                    place.removeprefix(f"points.{MARKER}")
                    .removesuffix(".position")
                    .rpartition(".")[0]
                )
                if f"points.{center}.position" in found:
                    found.append(place)
        return tuple(found)
