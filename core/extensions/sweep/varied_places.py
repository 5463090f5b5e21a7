"""What varies by itself in a case: hardpoints with all that follows them, directions, numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from ...case.case import MARKER, Case
from ...errors import remedy
from ...joints import Kind
from ...kinematics import kinds, load_places, places
from ...mechanism.body import Dimension
from ...trajectory import Array

# Closer positions are one hardpoint [m]: hardpoints are measured to a micrometre at best.
SAME = 1e-6
_BODIES, _LOADS = "bodies.", ("bodies.", "forces.")


class PlaceError(ValueError):
    """Error for a name of nothing that varies, or of several; the message states the remedy."""


@dataclass(frozen=True, eq=False)
class Variable:
    """Something that varies by itself, and the places that follow it.

    Attributes:
        name: of the row of the table, or of the first place.
        kind: a position, direction or length, or a number of a load.
        moves: derivatives of the numbers of each place by its own numbers, shape (numbers of the
            place, own numbers): three or one. Those of a direction are angles.
        row: whether it is a row of a table of hardpoints.
    """

    name: str
    kind: Kind
    moves: Mapping[str, Array]
    row: bool = False

    @property
    def numbers(self) -> list[str]:
        """Names of its own numbers: with the axis, x, y or z, unless there is one alone."""
        alone = self.kind in (Kind.LENGTH, Kind.NUMBER)
        return [self.name] if alone else [f"{self.name} {axis}" for axis in "xyz"]

    @property
    def columns(self) -> list[dict[str, Array]]:
        """Derivatives of the numbers of each place that follows, by each of its own numbers."""
        count = range(len(self.numbers))
        return [{place: each[:, k] for place, each in self.moves.items()} for k in count]

    @property
    def places(self) -> list[str]:
        """The places that follow, without those of markers."""
        return [place for place in self.moves if not place.startswith(f"points.{MARKER}")]


def by_place(columns: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Return derivatives of places, each by the numbers of all columns, shape (numbers of the
    place, columns), from those by each column, shape (numbers of the place,).
    """
    found: dict[str, Array] = {}
    for k, column in enumerate(columns):
        for place, each in column.items():
            found.setdefault(place, np.zeros((len(each), len(columns))))[:, k] = each
    return found


@dataclass(frozen=True, eq=False)
class Moves:
    """Numbers of varied places that follow offsets: nominal + moves @ offsets.

    Attributes:
        places: names of the varied places (see `kinematics.formulation.parameters.places`), each
            with its count of numbers.
        nominal: numbers of the varied places at the nominal design [m or -], shape (numbers,).
        moves: changes of these numbers per unit offset, shape (numbers, offsets).
    """

    places: Mapping[str, int]
    nominal: Array
    moves: Array

    @staticmethod
    def of(values: Mapping[str, Sequence[float]], moves: Mapping[str, Array]) -> Moves:
        """Return the moves of places with these values, from their derivatives by place."""
        sizes = {place: len(values[place]) for place in moves}
        nominal = np.array([number for place in moves for number in values[place]], dtype=float)
        return Moves(sizes, nominal, np.concatenate([*moves.values()]))

    def geometry(self, offsets: Array) -> Array:
        """Return numbers of the varied places, shape (numbers, V), from offsets, shape
        (offsets, V).

        The sum is computed term by term, as the rounding of a matrix product may depend on the
        number of columns and on the machine.
        """
        found = np.repeat(self.nominal[:, None], offsets.shape[1], axis=1)
        for number, offset in np.argwhere(self.moves).tolist():
            found[number] += self.moves[number, offset] * offsets[offset]
        return found

    def values(self, offsets: Array) -> dict[str, tuple[float, ...]]:
        """Return the value of each varied place of one variant, by offsets of shape (offsets,)."""
        numbers = iter(self.geometry(offsets[:, None])[:, 0].tolist())
        return {place: tuple(islice(numbers, count)) for place, count in self.places.items()}


class Geometry:
    """The places of a case, and what moves them.

    Attributes:
        values: value of each place [SI], markers included.
        kinds: kind of each place: a position, direction or length, or a number of a load.
        dimensions: dimensions of the numbers of loads.
    """

    def __init__(self, case: Case) -> None:
        loads = load_places(case.mechanism)
        self.values = places(case.mechanism) | {name: each.value for name, each in loads.items()}
        self.dimensions: dict[str, Dimension] = {
            name: each.dimension for name, each in loads.items() if each.dimension is not None
        }
        self.kinds = kinds(case.mechanism) | {
            name: Kind.NUMBER if name in self.dimensions else Kind.POSITION for name in loads
        }
        self.rows = {
            each.name: Variable(each.name, Kind.POSITION, each.moves, row=True)
            for each in case.hardpoints
        }
        roles = {role: self.rows[each.name] for each in case.hardpoints for role in each.roles}
        self._by_name = roles | self.rows

    @cached_property
    def named(self) -> list[str]:
        """Places known to the user: all except the places of markers."""
        return [place for place in self.values if not place.startswith(f"points.{MARKER}")]

    @property
    def variables(self) -> list[Variable]:
        """All variables of the geometry, each once: the rows of a table; without a table the
        positions, those at one point together, the directions and the lengths.
        """
        if self.rows:
            return list(self.rows.values())
        of_motion = [place for place in self.named if not place.startswith(_LOADS)]
        first = dict.fromkeys(self.together(place)[0] for place in of_motion)
        return [self.variable(place) for place in first]

    def variable(self, name: str) -> Variable:
        """Return the variable of a name: a row of a table or its role in the template, or a place
        as for `find`. A position that follows a row alone stands for the row.

        Raises:
            PlaceError: nothing matches, or several things match.
        """
        if (row := self._by_name.get(name)) is not None:
            if not row.moves:
                raise PlaceError(
                    "which nothing of the case follows, expected another row. Leave it."
                )
            return row
        place = self.find(name)
        kind, value = self.kinds[place], self.values[place]
        if kind is not Kind.POSITION:
            scale = math.hypot(*value) if kind is Kind.DIRECTION else 1.0
            return Variable(place, kind, {place: scale * np.eye(len(value))})
        movers = [each for each in self.rows.values() if place in each.moves]
        if len(movers) > 1:
            rows = " and ".join(each.name for each in movers)
            raise PlaceError(f"which follows from {rows}, expected one of these. Name it.")
        if movers:
            return movers[0]
        together = self.together(place)
        moved = dict.fromkeys(self.with_markers(together), np.eye(3))
        return Variable(together[0], kind, moved)

    def moves(self, variables: Sequence[Variable]) -> dict[str, Array]:
        """Return the derivatives of each place without loads by all numbers of the variables, shape
        (numbers of the place, numbers of the variables).
        """
        found = by_place([column for each in variables for column in each.columns])
        return {place: each for place, each in found.items() if not place.startswith(_LOADS)}

    def only(self, whole: Variable, chosen: Iterable[str]) -> Variable:
        """Return a variable that moves the chosen places alone, with the markers beside them."""
        kept = self.with_markers(chosen)
        return replace(whole, moves={place: whole.moves[place] for place in kept})

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
            what = "a position, direction, length, mass or load of the case"
            rows = "a row of the table, or " if self.rows else ""
            known = [*self.rows, *self.named]
            raise PlaceError(f"expected {rows}{what}; {remedy(name, known)}")
        if any(place not in self.together(found[0]) for place in found):
            raise PlaceError(
                f"which may be {' or '.join(found)}, expected one place. Write it in full."
            )
        return found[0]

    def together(self, place: str) -> tuple[str, ...]:
        """Return the place and, if it is a position, all other positions at this point at design.

        A centre of mass moves alone.
        """
        if self.kinds[place] is not Kind.POSITION or place.startswith(_BODIES):
            return (place,)
        names, at = self._positions
        apart = np.linalg.norm(at - np.array(self.values[place]), axis=1)
        return tuple(names[k] for k in np.flatnonzero(apart <= SAME).tolist())

    @cached_property
    def _positions(self) -> tuple[list[str], Array]:
        """The places of positions, and their values, shape (places, 3)."""
        names = [
            each
            for each in self.named
            if self.kinds[each] is Kind.POSITION and not each.startswith(_BODIES)
        ]
        return names, np.array([self.values[each] for each in names])

    def with_markers(self, moved: Iterable[str]) -> tuple[str, ...]:
        """Return places, with the places of the markers beside any points among them."""
        found = [*moved]
        return (*found, *(marker for each in found for marker in self._markers.get(each, ())))

    @cached_property
    def _markers(self) -> dict[str, list[str]]:
        """The places of markers, by the place of the point that they are named after."""
        found: dict[str, list[str]] = {}
        head = f"points.{MARKER}"
        for place in self.values:
            if place.startswith(head):
                center = place.removeprefix(head).removesuffix(".position").rpartition(".")[0]
                found.setdefault(f"points.{center}.position", []).append(place)
        return found
