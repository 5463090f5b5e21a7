"""Reader of variation files, schema kincheck-vary/1: TOML or JSON to a `Variation` of a case."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ...case.case import Case, Quantity
from ...case.io.document import decimal, fault, read_tables, shown, typed
from ...case.io.lines import join
from ...case.io.table import read_unit
from ...case.units import ANGLES, LENGTHS, RADIAN
from ...errors import KincheckError, remedy, unknown
from ...joints import Kind
from ...mechanism.body import ANGLE, LENGTH, Dimension
from ...mechanism.motions import PointCoordinate
from ...trajectory import PER_TIME, QUANTITIES, Array
from .results import in_units
from .study_choices import Mode
from .variation import Coordinate, Correlation, FileUnits, Law, Limit, Variation, problem_of
from .variation_schema import (
    SCHEMA,
    CorrelationKeys,
    HardpointKeys,
    LimitKeys,
    LineKeys,
    VaryKeys,
    VaryUnits,
)
from .varied_places import Geometry, Moves, PlaceError, Variable, by_place


def unit_of_offsets(
    file: Path, key: str, units: VaryUnits, kind: Kind, dimension: Dimension | None
) -> tuple[str, float]:
    """Return the SI unit of the offsets of a place, and the file's unit in this unit.

    Raises:
        CaseError: the file names no unit of length, and needs one.
    """
    needed = ANGLE if kind is Kind.DIRECTION else dimension or LENGTH
    if needed.length and units.length is None:
        raise fault(
            file,
            "units.length",
            f'missing, expected "m" or "mm" for {key}. Say which unit it is in.',
        )
    length = LENGTHS[units.length or "m"]
    angle = RADIAN if units.angle is None else ANGLES[units.angle]
    size = angle.power(length.power(1.0, needed.length), needed.angle)
    return str(needed), size


_EXPECTED = (
    "expected OUTPUT:LOW:HIGH, one number of which may be missing, such as camber:-1.5:1.5"
    " or toe:-2:2deg"
)
# A number or none, and a unit or none.
_LIMIT = re.compile(r"([-+\u2212]?[\d.]*(?:[eE][-+]?\d+)?)\s*([^\d\s.].*)?")


def read_limits(
    file: Path, tables: Mapping[str, Any], case: Case, units: FileUnits
) -> tuple[Limit, ...]:
    """Return the limits of a variation file.

    Raises:
        CaseError: there is no such output, or the limits make no sense.
    """
    found: list[Limit] = []
    for name, table in tables.items():
        key = join("limits", name)
        keys = typed(file, key, table, LimitKeys)
        try:
            found.append(limit_of(case, units, name, keys.low, keys.high))
        except ValueError as error:
            raise fault(file, key, str(error)) from None
    return tuple(found)


def limits_of_texts(texts: Iterable[str], case: Case, units: FileUnits) -> tuple[Limit, ...]:
    """Return the limits in texts OUTPUT:LOW:HIGH, in the units of a variation file or a stated one.

    Raises:
        KincheckError: a text has another form, there is no such output, or the limits make no
            sense.
    """
    found: list[Limit] = []
    for text in texts:
        name, *numbers = text.rsplit(":", 2)
        parts = [_LIMIT.fullmatch(each.strip()) for each in numbers]
        stated = {part[2] for part in parts if part and part[2]}
        try:
            low, high = (decimal(part[1]) if part and part[1] else None for part in parts)
            if None in parts or len(stated) > 1:
                raise ValueError
        except ValueError:
            raise KincheckError(f"--limit: found {text!r}, {_EXPECTED}. Correct it.") from None
        try:
            found.append(limit_of(case, units, name, low, high, *stated))
        except ValueError as error:
            raise KincheckError(f"--limit {text}: {error}") from None
    return tuple(found)


def limit_of(
    case: Case,
    units: FileUnits,
    name: str,
    low: float | None,
    high: float | None,
    stated: str = "",
) -> Limit:
    """Return the limits of an output, converted to SI.

    Args:
        stated: unit of both numbers, if it is not that of the file.

    Raises:
        ValueError: there is no such output, or the limits make no sense.
    """
    output, derivative = _find_output(case, name)
    unit = output.unit + PER_TIME[derivative]
    shown_unit, size = in_units(unit, LENGTHS[units.length], ANGLES[units.angle])
    if stated:
        known, expected = read_unit(stated), read_unit(unit)
        if known is None or expected is None or known[1] != expected[1]:
            raise ValueError(f"found the unit {stated!r}, expected one such as {shown_unit}")
        size = known[0](1.0)
    numbers = [each for each in (low, high) if each is not None]
    if not numbers:
        raise ValueError("found neither low nor high, expected one limit at least. Give one.")
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"found {numbers}, expected finite numbers. Leave out what has no limit.")
    if len(numbers) == 2 and numbers[0] >= numbers[1]:
        raise ValueError(
            f"found low = {numbers[0]:g} and high = {numbers[1]:g}, expected low below high."
            " Correct them."
        )
    return Limit(
        name,
        -math.inf if low is None else size * low,
        math.inf if high is None else size * high,
    )


def _find_output(case: Case, name: str) -> tuple[Quantity, int]:
    """Return the output and the order of the time derivative of a name."""
    known = {output.name: output for output in case.outputs}
    base, _, quantity = name.rpartition(".")
    derivative = QUANTITIES.index(quantity) if quantity in QUANTITIES[1:] else 0
    if name in known:
        return known[name], 0
    if not derivative or base not in known:
        raise ValueError(f"there is no output {name!r} of the case; {remedy(name, known)}")
    output = known[base]
    if derivative >= output.orders:
        raise ValueError(f"output {base!r} has no {quantity}. Limit its value.")
    return output, derivative


# A normal offset exceeds this number of standard deviations about once in a thousand million draws.
FARTHEST = 6.0

_BOTH = frozenset(("sigma", "half_width"))
_DRAWN: Mapping[str | None, Sequence[frozenset[str]]] = {
    None: (frozenset({"sigma"}), frozenset({"half_width"})),
    Law.NORMAL: (frozenset({"sigma"}),),
    Law.UNIFORM: (frozenset({"half_width"}),),
    Law.TRUNCATED_NORMAL: (_BOTH,),
    Law.TRIANGULAR: (frozenset({"half_width"}),),
}
_LISTED: Mapping[Mode, Sequence[frozenset[str]]] = {
    Mode.GRID: (frozenset({"values"}), frozenset({"half_width", "steps"})),
    Mode.ONE_AT_A_TIME: tuple(
        map(frozenset, ({"values"}, {"half_width"}, {"half_width", "steps"}, {"sigma"}))
    ),
}


@dataclass(frozen=True)
class CoordinateReader:
    """Reads the coordinates of a hardpoint.

    Attributes:
        key: key of the hardpoint in the file.
        name: name of the hardpoint.
        unit, scale: SI unit of the offsets, and the file's unit in this unit.
    """

    file: Path
    key: str
    name: str
    mode: Mode
    unit: str
    scale: float

    def read(self, keys: HardpointKeys, count: int) -> list[tuple[int, Coordinate]]:
        """Return the varied coordinates, each with its index in the hardpoint.

        Args:
            count: number of coordinates: one, or three for a position or direction.

        Raises:
            CaseError: keys are missing or superfluous, or a value makes no sense.
        """
        self._check_keys(keys)
        axes = ("",) if count == 1 else ("x", "y", "z")
        if keys.values is not None:
            lists = self._lists(keys.values, count)
            return [
                each
                for row, offsets in enumerate(lists)
                for each in self._listed_coordinate(
                    row, axes[row], [self.scale * x for x in offsets]
                )
            ]
        sigma, half_width = self._sizes(keys.sigma, count), self._sizes(keys.half_width, count)
        law = Law.UNIFORM if keys.sigma is None else Law.NORMAL
        if keys.distribution is not None:
            law = Law(keys.distribution)
        found: list[tuple[int, Coordinate]] = []
        for row, axis in enumerate(axes):
            sizes = [self.scale * each[row] for each in (sigma, half_width) if each]
            if 0.0 in sizes:
                continue
            if self.mode is Mode.MONTE_CARLO:
                bound = sizes[1] if law is Law.TRUNCATED_NORMAL else 0.0
                each = Coordinate(self.name, axis, self.unit, law, sizes[0], bound=bound)
                found.append((row, each))
            else:
                steps = sizes[0] * np.linspace(-1.0, 1.0, keys.steps or 2)
                found += self._listed_coordinate(row, axis, steps.tolist())
        return found

    def require_physical(self, value: float, each: Coordinate, dimension: Dimension) -> None:
        """Raise CaseError if a mass or another size of a load may become negative.

        Args:
            value: value at the nominal design [SI].
        """
        if each.law is Law.VALUES:
            lowest = min(each.values)
        else:
            lowest = -(FARTHEST if each.law is Law.NORMAL else 1.0) * (each.bound or each.scale)
        if dimension is ANGLE or value + lowest >= 0.0:
            return
        remedy = "vary it less"
        if each.law is Law.NORMAL:
            remedy += ', or give distribution = "truncated_normal" with a half_width'
        raise self._fault(
            f"found offsets down to {lowest:g} {self.unit} from {value:g} {self.unit}, expected"
            f" zero or more of every variant; {remedy}"
        )

    def _check_keys(self, keys: HardpointKeys) -> None:
        given = frozenset(
            each
            for each in ("sigma", "half_width", "values", "steps")
            if getattr(keys, each) is not None
        )
        if keys.distribution is not None and self.mode is not Mode.MONTE_CARLO:
            raise fault(
                self.file,
                join(self.key, "distribution"),
                f"found {shown(keys.distribution)}, expected none, for {self.mode} draws"
                " nothing. Leave it out.",
            )
        takes = _LISTED.get(self.mode) or _DRAWN[keys.distribution]
        if given in takes:
            return
        there = " and ".join(sorted(given)) or "none of them"
        choices = ", or ".join(" and ".join(sorted(each)) for each in takes)
        what = self.mode if keys.distribution is None else f"distribution {keys.distribution}"
        if keys.distribution is None and given == _BOTH:
            choices += ', or both with distribution = "truncated_normal"'
        raise self._fault(f"found {there}, expected for {what}: {choices}. Correct the keys.")

    def _sizes(self, given: float | list[float] | None, count: int) -> list[float]:
        """Return the size of the offsets of each coordinate; empty if the file gives none."""
        if given is None:
            return []
        if not isinstance(given, list):
            return [given] * count
        if count == 1:
            raise self._fault(
                f"found {shown(given)}, expected one number, for it is {self._single}. Give one."
            )
        return given

    def _listed_coordinate(
        self, row: int, axis: str, values: Sequence[float]
    ) -> list[tuple[int, Coordinate]]:
        """Return the coordinate with its values.

        One at a time, the values omit zero: it is the nominal design.
        """
        if self.mode is Mode.ONE_AT_A_TIME:
            values = [value for value in values if value]
        if not any(values):
            return []
        largest = max(map(abs, values))
        return [(row, Coordinate(self.name, axis, self.unit, Law.VALUES, largest, tuple(values)))]

    def _lists(self, given: list[float | list[float]], count: int) -> list[list[float]]:
        """Return the offsets of each coordinate: one list for all, or a list for each."""
        key = join(self.key, "values")
        flat: list[float] = [each for each in given if not isinstance(each, list)]
        lists = [each for each in given if isinstance(each, list)]
        found: list[list[float]] = [flat] * count if len(flat) == len(given) else lists
        if len(found) != count or (flat and lists) or not all(found):
            expected = "a list of offsets" + (
                ", or three of them" if count == 3 else f", for it is {self._single}"
            )
            what = f"found {shown(given)}, expected {expected}"
            raise fault(self.file, key, f"{what}. Correct the lists.")
        if any(len(set(each)) < len(each) for each in found):
            raise fault(self.file, key, "found an offset twice, expected each once. Remove one.")
        return found

    @property
    def _single(self) -> str:
        return "a length" if self.unit == "m" else "a number"

    def _fault(self, problem: str) -> Exception:
        return fault(self.file, self.key, problem)


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
                self.file,
                "hardpoints",
                "nothing varies, expected an offset other than 0. Give one.",
            )
        moves = by_place(
            [each.moved.columns[k] for each in blocks.values() for k, _ in each.coordinates]
        )
        for name, table in self.keys.lines.items():
            self._line(join("lines", name), table, moves)
        self._check_drivers(moves)
        units = FileUnits(
            self.units.length or self.case.length_unit, self.units.angle or self.case.angle_unit
        )
        return Variation(
            **vars(Moves.of(self.geometry.values, moves)),
            mode=self.keys.mode,
            coordinates=tuple(coordinates),
            correlations=read_correlations(
                self.file, self.keys, [each.name for each in coordinates]
            ),
            limits=read_limits(self.file, self.keys.limits, self.case, units),
            units=units,
        )

    def _block(self, name: str, table: object) -> _Block:
        key = join("hardpoints", name)
        keys = typed(self.file, key, table, HardpointKeys)
        moved = self._find(join(key, "at"), keys.at, self.geometry.variable)
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
        chosen = [self._find(key, each, self.geometry.find) for each in names]
        there = [place for place in self.geometry.named if place in moved.moves]
        for each in chosen:
            if each not in there:
                at = f"does not follow {moved.name}" if moved.row else f"is not at {moved.name}"
                problem = f"found {shown(each)}, which {at} at design; expected some of"
                raise fault(self.file, key, f"{problem} {', '.join(there)}. Correct the list.")
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
                    raise fault(self.file, join("hardpoints", name), f"{problem}. Give one `only`.")

    def _find(self, key: str, name: str, find: Callable[[str], _Named]) -> _Named:
        try:
            return find(name)
        except PlaceError as error:
            raise fault(self.file, key, f"found {shown(name)}, {error}") from None

    def _line(self, key: str, table: object, moves: dict[str, Array]) -> None:
        """Let a direction follow the two positions on its line; unvaried ends are fixed."""
        keys = typed(self.file, key, table, LineKeys)
        find = self.geometry.find
        axis = self._find(join(key, "axis"), keys.axis, find)
        ends = [self._find(join(key, "through"), each, find) for each in keys.through]
        for each, wanted, place in (
            ("axis", Kind.DIRECTION, axis),
            *(("through", Kind.POSITION, end) for end in ends),
        ):
            if (kind := self.geometry.kinds[place]) is not wanted:
                raise fault(
                    self.file,
                    join(key, each),
                    f"found {place}, {kind.value}, expected {wanted.value}. Name another.",
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
            raise fault(self.file, join(key, "through"), f"{problem}. Correct the names.")
        still = np.zeros((3, len(next(iter(moves.values()))[0])))
        follows = moves.get(ends[1], still) - moves.get(ends[0], still)
        follows *= math.copysign(float(np.linalg.norm(direction)) / long, cosine)
        # the rows of a table move their axes by themselves
        if axis in moves and not np.allclose(moves[axis], follows, rtol=0.0, atol=ALONG):
            raise fault(
                self.file,
                join(key, "axis"),
                f"found {axis}, which varies by itself, expected one that follows. Leave out one.",
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
                    f"{problem}, expected relative = true. Drive it so, or leave the point.",
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
            f"found some, expected none, for {keys.mode} draws nothing. Leave them out, or set mode"
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
                    " coordinate once. Write one matrix of all that correlate.",
                )
            owners[coordinate] = name
        if problem := problem_of(each.matrix, each.coordinates):
            raise fault(file, join(key, "matrix"), problem)
        rows = tuple(coordinates.index(one) for one in each.coordinates)
        found.append(Correlation(rows, np.array(each.matrix, dtype=np.float64)))
    return tuple(found)
