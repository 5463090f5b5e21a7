"""Places of a mechanism: search by name, and groups of coincident positions."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ...case.case import MARKER
from ...errors import remedy
from ...joints import Kind
from ...kinematics import kinds, load_places, places
from ...mechanism.dimension import Dimension
from ...mechanism.mechanism import Mechanism

# Closer positions are one hardpoint [m]: hardpoints are measured to a micrometre at best.
SAME = 1e-6
_BODIES, _LOADS = "bodies.", ("bodies.", "forces.")


class PlaceError(ValueError):
    """Error for a name without a place, or with several; the message states the remedy."""


class Geometry:
    """The places of a mechanism.

    Attributes:
        values: value of each place [SI], markers included.
        kinds: kind of each place: a position, direction or length, or a number of a load.
        dimensions: dimensions of the numbers of loads.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        loads = load_places(mechanism)
        self.values = places(mechanism) | {name: each.value for name, each in loads.items()}
        self.dimensions: dict[str, Dimension] = {
            name: each.dimension for name, each in loads.items() if each.dimension is not None
        }
        self.kinds = kinds(mechanism) | {
            name: Kind.NUMBER if name in self.dimensions else Kind.POSITION for name in loads
        }

    @property
    def named(self) -> list[str]:
        """Places known to the user: all except the places of markers."""
        return [place for place in self.values if not place.startswith(f"points.{MARKER}")]

    def find(self, name: str) -> str:
        """Return the place of a name.

        The name of a joint or point stands for its only position. If there is no such name, it may
        be the name of a body or force element.

        Raises:
            PlaceError: no place matches, or several places match.
        """
        if name in self.named:
            return name
        matching = [
            place
            for place in self.named
            if self.kinds[place] is Kind.POSITION
            and (place.startswith(f"{name}.") or place.partition(".")[2].startswith(f"{name}."))
        ]
        found = [each for each in matching if not each.startswith(_LOADS)] or matching
        if not found:
            raise PlaceError(
                "expected a position, direction, length, mass or load of the case;"
                f" {remedy(name, self.named)}"
            )
        if any(place not in self.together(found[0]) for place in found):
            raise PlaceError(
                f"which may be {' or '.join(found)}, expected one place; write it in full"
            )
        return found[0]

    def together(self, place: str) -> tuple[str, ...]:
        """Return the place and, if it is a position, all other positions at this point at design.

        A centre of mass moves alone.
        """
        if self.kinds[place] is not Kind.POSITION or place.startswith(_BODIES):
            return (place,)
        here = self.values[place]
        return tuple(
            each
            for each in self.named
            if self.kinds[each] is Kind.POSITION
            and not each.startswith(_BODIES)
            and math.dist(here, self.values[each]) <= SAME
        )

    def with_markers(self, moved: Iterable[str]) -> tuple[str, ...]:
        """Return places, with the places of the markers beside any points among them."""
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
