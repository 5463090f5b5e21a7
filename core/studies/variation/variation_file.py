"""Reader of variation files, schema kincheck-vary/1: TOML or JSON to a `Variation` of a case."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from ...case.case import Case
from ...case.io.document import fault, join, read_tables, shown, typed
from ...errors import unknown
from ...joints import Kind
from ...mechanism.drivers import PointCoordinate
from ...trajectory import Array
from .coordinate_reader import CoordinateReader
from .correlations import Correlation, problem_of
from .file_units import FileUnits, unit_of_offsets
from .limits import read_limits
from .modes import Mode
from .places import Geometry, PlaceError, Variable
from .variation import Coordinate, Variation
from .variation_schema import SCHEMA, CorrelationKeys, HardpointKeys, LineKeys, VaryKeys, VaryUnits

_Named = TypeVar("_Named")

LARGEST_FILE = 1_000_000
# Case files give directions to about five digits; with a larger error, the direction is not along
# the line.
ALONG = 1e-4


def read_variation(path: str | Path, case: Case) -> Variation:
    """Read the variation of a case from a file, in SI units.

    Raises:
        CaseError: the file is unreadable, inconsistent, or does not fit the case; the message names
            file, key and remedy.
    """
    file = Path(path)
    advice = "hardpoints and their tolerances need far less"
    tables = read_tables(file, LARGEST_FILE, advice, SCHEMA)
    return _Reader(file, typed(file, "", tables, VaryKeys), case).variation()


@dataclass(frozen=True, eq=False)
class _Block:
    """Coordinates of one hardpoint, each with its index in it, and what they move."""

    moved: Variable
    coordinates: list[tuple[int, Coordinate]]


class _Reader:
    def __init__(self, file: Path, keys: VaryKeys, case: Case) -> None:
        self.file, self.keys, self.case = file, keys, case
        self.units = typed(file, "units", keys.units, VaryUnits)
        self.geometry = Geometry(case)

    def variation(self) -> Variation:
        blocks = {name: self._block(name, table) for name, table in self.keys.hardpoints.items()}
        self._check_owners({name: block.moved for name, block in blocks.items()})
        coordinates = [each for block in blocks.values() for _, each in block.coordinates]
        if not coordinates:
            raise fault(
                self.file, "hardpoints", "nothing varies, expected an offset other than 0; give one"
            )
        moves: dict[str, Array] = {}
        column = 0
        for block in blocks.values():
            for number, _ in block.coordinates:
                for place, each in block.moved.moves.items():
                    still = np.zeros((len(each), len(coordinates)))
                    moves.setdefault(place, still)[:, column] = each[:, number]
                column += 1
        for name, table in self.keys.lines.items():
            self._line(join("lines", name), table, moves)
        self._check_drivers(moves)
        values = self.geometry.values
        units = FileUnits.of(self.units, self.case)
        return Variation(
            self.keys.mode,
            tuple(coordinates),
            {place: len(values[place]) for place in moves},
            np.array([number for place in moves for number in values[place]]),
            np.concatenate(list(moves.values())),
            read_correlations(self.file, self.keys, [each.name for each in coordinates]),
            limits=read_limits(self.file, self.keys.limits, self.case, units),
            units=units,
        )

    def _block(self, name: str, table: object) -> _Block:
        key = join("hardpoints", name)
        keys = typed(self.file, key, table, HardpointKeys)
        moved = self._found(join(key, "at"), keys.at, self.geometry.variable)
        if keys.only is not None:
            moved = self._only(join(key, "only"), moved, keys.only)
        dimension = self.geometry.dimensions.get(moved.name)
        unit, scale = unit_of_offsets(self.file, key, self.units, moved.kind, dimension)
        reader = CoordinateReader(self.file, key, name, self.keys.mode, unit, scale)
        coordinates = reader.read(keys, len(moved.numbers))
        if dimension is not None:
            value = self.geometry.values[moved.name][0]
            for _, each in coordinates:
                reader.require_physical(value, each, dimension)
        return _Block(moved, coordinates)

    def _only(self, key: str, moved: Variable, names: Sequence[str]) -> Variable:
        chosen = [self._found(key, each, self.geometry.find) for each in names]
        there = [place for place in self.geometry.named if place in moved.moves]
        for each in chosen:
            if each not in there:
                at = f"does not follow {moved.name}" if moved.row else f"is not at {moved.name}"
                problem = f"found {shown(each)}, which {at} at design; expected some of"
                raise fault(self.file, key, f"{problem} {', '.join(there)}; correct the list")
        return self.geometry.only(moved, chosen)

    def _check_owners(self, blocks: Mapping[str, Variable]) -> None:
        """Refuse what two hardpoints move, unless both are rows of a table, whose moves add up."""
        owners: dict[str, tuple[str, Variable]] = {}
        for name, each in blocks.items():
            for place in each.moves:
                owner, other = owners.setdefault(place, (name, each))
                rows = each.row and other.row and each.name != other.name
                if owner != name and not rows:
                    problem = f"moves {place}, as does hardpoints.{owner}, expected one of them to"
                    raise fault(self.file, join("hardpoints", name), f"{problem}; give one `only`")

    def _found(self, key: str, name: str, find: Callable[[str], _Named]) -> _Named:
        try:
            return find(name)
        except PlaceError as error:
            raise fault(self.file, key, f"found {shown(name)}, {error}") from None

    def _line(self, key: str, table: object, moves: dict[str, Array]) -> None:
        """Let a direction follow the two positions on its line; unvaried ends are fixed."""
        keys = typed(self.file, key, table, LineKeys)
        find = self.geometry.find
        axis = self._found(join(key, "axis"), keys.axis, find)
        ends = [self._found(join(key, "through"), each, find) for each in keys.through]
        for each, wanted, place in (
            ("axis", Kind.DIRECTION, axis),
            *(("through", Kind.POSITION, end) for end in ends),
        ):
            if (kind := self.geometry.kinds[place]) is not wanted:
                raise fault(
                    self.file,
                    join(key, each),
                    f"found {place}, {kind.value}, expected {wanted.value}; name another",
                )
        direction = np.array(self.geometry.values[axis])
        way = np.subtract(self.geometry.values[ends[1]], self.geometry.values[ends[0]])
        long = float(np.linalg.norm(way))
        cosine = float(direction @ way) / (long * float(np.linalg.norm(direction))) if long else 0.0
        if math.sqrt(max(0.0, 1.0 - cosine * cosine)) > ALONG:
            problem = (
                f"found {axis}, which does not go through {ends[0]} and {ends[1]} at design,"
                " expected the line between them"
            )
            raise fault(self.file, join(key, "through"), f"{problem}; correct the names")
        still = np.zeros((3, len(next(iter(moves.values()))[0])))
        follows = moves.get(ends[1], still) - moves.get(ends[0], still)
        follows *= math.copysign(float(np.linalg.norm(direction)) / long, cosine)
        # the rows of a table move their axes by themselves
        if axis in moves and not np.allclose(moves[axis], follows, rtol=0.0, atol=ALONG):
            raise fault(
                self.file,
                join(key, "axis"),
                f"found {axis}, which varies by itself, expected one that follows; leave out one",
            )
        if follows.any():
            moves.setdefault(axis, follows)

    def _check_drivers(self, moves: Mapping[str, Array]) -> None:
        """Refuse a driver by the absolute position of a varied point, as drivers start at each
        variant's design.
        """
        for name in self.case.sweep.path.motions:
            driver = self.case.mechanism.driver(name)
            if (
                isinstance(driver, PointCoordinate)
                and not driver.relative
                and f"points.{driver.point}.position" in moves
            ):
                problem = (
                    f"driver {name!r} of the case gives the absolute position of {driver.point!r},"
                    " which varies"
                )
                raise fault(
                    self.file,
                    "hardpoints",
                    f"{problem}, expected relative = true; drive it so, or leave the point",
                )


def read_correlations(
    file: Path, keys: VaryKeys, coordinates: Sequence[str]
) -> tuple[Correlation, ...]:
    """Return the correlations of the file.

    Args:
        coordinates: names of the varied coordinates.

    Raises:
        CaseError: nothing is drawn, a coordinate does not vary or is named twice, or a matrix is
            no correlation matrix.
    """
    if keys.correlations and keys.mode is not Mode.MONTE_CARLO:
        raise fault(
            file,
            "correlations",
            f"found some, expected none, for {keys.mode} draws nothing; leave them out, or set mode"
            ' = "monte_carlo"',
        )
    found: list[Correlation] = []
    owners: dict[str, str] = {}
    for name, table in keys.correlations.items():
        key = join("correlations", name)
        each = typed(file, key, table, CorrelationKeys)
        for coordinate in each.coordinates:
            if coordinate not in coordinates:
                what = unknown("coordinate that varies", coordinate, coordinates)
                raise fault(file, join(key, "coordinates"), what)
            if (owner := owners.get(coordinate)) is not None:
                raise fault(
                    file,
                    join(key, "coordinates"),
                    f"found {coordinate!r} here and in correlations.{owner}, expected each"
                    " coordinate once; write one matrix of all that correlate",
                )
            owners[coordinate] = name
        if problem := problem_of(each.matrix, each.coordinates):
            raise fault(file, join(key, "matrix"), problem)
        rows = tuple(coordinates.index(one) for one in each.coordinates)
        found.append(Correlation(rows, np.array(each.matrix, dtype=np.float64)))
    return tuple(found)
