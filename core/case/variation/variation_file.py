"""What varies, from a file: schema kincheck-vary/1, TOML or JSON, onto a `Variation` of a case.

Reference. Keys in brackets may be left out.

    schema = "kincheck-vary/1"
    mode                 "monte_carlo": drawn, as many as --samples says
                         "grid": every combination of all values "one_at_a_time": the nominal
                         design, then each coordinate by itself at each of its values
    [units]              length = "m" or "mm", needed where a position or length varies: no unit is safe to guess
                         (angle) = "rad" or "deg", of directions
    [hardpoints.NAME]    at: a position, direction or length of the case: "joints.tie_rod.points.0", "joints.hinge.axis",
                         "joints.rod.length", "points.wheel_center.position"; or the name of a joint
                         or point that has one position only: "ball". Every place of the case that
                         is there at design moves along, so that a ball and the rod that ends in it
                         stay together; markers that show how a wheel turns go with its centre.
                         (only) = ["joints.ball.point", ...]: just these of them sigma, or
                         half_width, or values: a number for all three coordinates or three numbers;
                         0 does not vary monte_carlo: sigma (normal) or half_width (uniform) grid:
                         values = [-1, 0, 1], offsets for each coordinate, or three such lists; or
                         half_width and steps, so many values from -half_width to half_width
                         one_at_a_time: values, or half_width (both ends; with steps, as in a grid),
                         or sigma (both sides) offsets are along the case's axes; those of a
                         direction, taken at length one, are angles
    [lines.NAME]         axis = "joints.strut_slide.axis", through = ["strut_foot", "strut_top"]: a direction that goes on through
                         two positions as they vary; named like `at`. Other directions stay as they
                         are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta

from ...joints import Kind
from ...mechanism.drivers import PointCoordinate
from ...trajectory import Array
from ..case import Case
from ..io.document import fault, join, parse, read_text, shown, typed
from .places import Geometry, PlaceError
from .variation import Coordinate, Law, Mode, Variation

SCHEMA = "kincheck-vary/1"
LARGEST_FILE = 1_000_000
MOST_STEPS = 10_000
# Directions in case files are written to five digits or so: a line that is off by more is another
# one.
ALONG = 1e-4

Text = Annotated[str, Meta(min_length=1, description="a text that is not empty")]
Size = Annotated[float, Meta(ge=0.0)]
# a list, not a tuple: converting to a number or a tuple of constrained numbers, msgspec 0.22
# crashes
Sizes = Annotated[
    Size | Annotated[list[Size], Meta(min_length=3, max_length=3)],
    Meta(description="a number that is not negative, or three [x, y, z]"),
]
Offsets = Annotated[
    list[float | list[float]],
    Meta(description="a list of offsets, or three such [[x, ...], [y, ...], [z, ...]]"),
]
Steps = Annotated[
    int, Meta(ge=2, le=MOST_STEPS, description=f"a whole number of values, 2 to {MOST_STEPS}")
]


class VaryKeys(msgspec.Struct, forbid_unknown_fields=True):
    """The tables of the file."""

    schema: Annotated[str, Meta(description=f'"{SCHEMA}"')]
    mode: Annotated[Mode, Meta(description=f"one of {', '.join(Mode)}")]
    hardpoints: Annotated[
        dict[str, Any], Meta(min_length=1, description="a table of at least one hardpoint")
    ]
    units: Annotated[dict[str, Any], Meta(description="a table")] = {}
    lines: Annotated[dict[str, Any], Meta(description="a table")] = {}


class VaryUnits(msgspec.Struct, forbid_unknown_fields=True):
    """[units] of the offsets."""

    length: Annotated[Literal["m", "mm"], Meta(description='"m" or "mm"')] | None = None
    angle: Annotated[Literal["rad", "deg"], Meta(description='"rad" or "deg"')] = "rad"


class HardpointKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[hardpoints.NAME]."""

    at: Text
    only: (
        Annotated[tuple[Text, ...], Meta(min_length=1, description="a list of places of the case")]
        | None
    ) = None
    sigma: Sizes | None = None
    half_width: Sizes | None = None
    values: Offsets | None = None
    steps: Steps | None = None


class LineKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[lines.NAME]."""

    axis: Text
    through: Annotated[
        tuple[Text, Text], Meta(description='two names ["first position", "second position"]')
    ]


_TAKES: Mapping[Mode, tuple[frozenset[str], ...]] = {
    Mode.MONTE_CARLO: (frozenset({"sigma"}), frozenset({"half_width"})),
    Mode.GRID: (frozenset({"values"}), frozenset({"half_width", "steps"})),
    Mode.ONE_AT_A_TIME: tuple(
        map(frozenset, ({"values"}, {"half_width"}, {"half_width", "steps"}, {"sigma"}))
    ),
}


def read_variation(path: str | Path, case: Case) -> Variation:
    """What the file varies of a case, in SI units.

    Raises:
        CaseError: the file cannot be read, does not make sense, or does not fit the case; it names
            file, key and remedy.
    """
    file = Path(path)
    tables = parse(
        file, read_text(file, LARGEST_FILE, "hardpoints and their tolerances need far less")
    )
    if tables.get("schema") != SCHEMA:
        found = shown(tables["schema"]) if "schema" in tables else "none"
        raise fault(
            file, "schema", f'found {found}, expected "{SCHEMA}"; write schema = "{SCHEMA}"'
        )
    return _Reader(file, typed(file, "", tables, VaryKeys), case).variation()


@dataclass(frozen=True, eq=False)
class _Block:
    """The coordinates of one hardpoint: the places that take over their offsets, and what of
    them.
    """

    places: Mapping[str, float]
    coordinates: list[tuple[int, Coordinate]]


class _Reader:
    def __init__(self, file: Path, keys: VaryKeys, case: Case) -> None:
        self.file, self.keys, self.case = file, keys, case
        self.units = typed(file, "units", keys.units, VaryUnits)
        self.geometry = Geometry(case.mechanism)

    def variation(self) -> Variation:
        blocks = {name: self._block(name, table) for name, table in self.keys.hardpoints.items()}
        owners: dict[str, str] = {}
        for name, block in blocks.items():
            for place in block.places:
                if owner := owners.get(place):
                    problem = (
                        f"moves {place}, as does hardpoints.{owner}, expected one of them to; give"
                        " one `only`"
                    )
                    raise fault(self.file, join("hardpoints", name), problem)
                owners[place] = name
        coordinates = [each for block in blocks.values() for _, each in block.coordinates]
        if not coordinates:
            raise fault(
                self.file, "hardpoints", "nothing varies, expected an offset other than 0; give one"
            )
        moves: dict[str, Array] = {}
        column = 0
        for block in blocks.values():
            for row, _ in block.coordinates:
                for place, factor in block.places.items():
                    size = len(self.geometry.values[place])
                    moves.setdefault(place, np.zeros((size, len(coordinates))))[row, column] = (
                        factor
                    )
                column += 1
        for name, table in self.keys.lines.items():
            self._line(join("lines", name), table, moves)
        self._check_drivers(moves)
        values = self.geometry.values
        return Variation(
            self.keys.mode,
            tuple(coordinates),
            {place: len(values[place]) for place in moves},
            np.array([number for place in moves for number in values[place]]),
            np.concatenate(list(moves.values())),
        )

    def _block(self, name: str, table: object) -> _Block:
        key = join("hardpoints", name)
        keys = typed(self.file, key, table, HardpointKeys)
        place = self._found(join(key, "at"), keys.at)
        kind = self.geometry.kinds[place]
        together = self.geometry.together(place)
        if keys.only is not None:
            chosen = [self._found(join(key, "only"), each) for each in keys.only]
            for each in chosen:
                if each not in together:
                    problem = (
                        f"found {shown(each)}, which is not at {place} at design; expected some of"
                        f" {', '.join(together)}"
                    )
                    raise fault(self.file, join(key, "only"), f"{problem}; correct the list")
            together = tuple(chosen)
        length = math.hypot(*self.geometry.values[place])
        factor = length if kind is Kind.DIRECTION else 1.0
        moved = self.geometry.with_markers(together) if kind is Kind.POSITION else together
        return _Block(dict.fromkeys(moved, factor), self._coordinates(key, name, keys, kind))

    def _found(self, key: str, name: str) -> str:
        try:
            return self.geometry.find(name)
        except PlaceError as error:
            raise fault(self.file, key, f"found {shown(name)}, {error}") from None

    def _coordinates(
        self, key: str, name: str, keys: HardpointKeys, kind: Kind
    ) -> list[tuple[int, Coordinate]]:
        given: frozenset[str] = frozenset(
            each
            for each in ("sigma", "half_width", "values", "steps")
            if getattr(keys, each) is not None
        )
        if given not in _TAKES[self.keys.mode]:
            there = " and ".join(sorted(given)) or "none of them"
            choices = ", or ".join(" and ".join(sorted(each)) for each in _TAKES[self.keys.mode])
            raise fault(
                self.file,
                key,
                f"found {there}, expected for {self.keys.mode}: {choices}; correct the keys",
            )
        unit, scale = self._unit(key, kind)
        axes = ("",) if kind is Kind.LENGTH else ("x", "y", "z")
        law = Law.NORMAL if keys.sigma is not None else Law.UNIFORM
        found: list[tuple[int, Coordinate]] = []
        if keys.values is not None:
            for row, offsets in enumerate(self._lists(join(key, "values"), keys.values, len(axes))):
                found += self._listed(
                    row, name, axes[row], unit, tuple(scale * offset for offset in offsets)
                )
            return found
        sizes = keys.sigma if keys.sigma is not None else keys.half_width
        if isinstance(sizes, list) and len(axes) == 1:
            raise fault(
                self.file,
                key,
                f"found {shown(sizes)}, expected one number, for it is a length; give one",
            )
        for row, size in enumerate(
            sizes if isinstance(sizes, list) else [sizes or 0.0] * len(axes)
        ):
            if size == 0.0:
                continue
            if self.keys.mode is Mode.MONTE_CARLO:
                found.append((row, Coordinate(name, axes[row], unit, law, scale * size)))
            else:
                values = tuple((scale * size * np.linspace(-1.0, 1.0, keys.steps or 2)).tolist())
                found += self._listed(row, name, axes[row], unit, values)
        return found

    def _listed(
        self, row: int, name: str, axis: str, unit: str, values: tuple[float, ...]
    ) -> list[tuple[int, Coordinate]]:
        """The coordinate with its values; one at a time, the nominal design is there already."""
        if self.keys.mode is Mode.ONE_AT_A_TIME:
            values = tuple(value for value in values if value)
        if not any(values):
            return []
        return [(row, Coordinate(name, axis, unit, Law.VALUES, max(map(abs, values)), values))]

    def _lists(self, key: str, given: list[float | list[float]], count: int) -> list[list[float]]:
        """The offsets of each coordinate: the same for all of them, or a list each."""
        flat: list[float] = [each for each in given if not isinstance(each, list)]
        lists = [each for each in given if isinstance(each, list)]
        found: list[list[float]] = [flat] * count if len(flat) == len(given) else lists
        if len(found) != count or (flat and lists) or not all(found):
            expected = "a list of offsets" + (
                ", or three of them" if count == 3 else ", for it is a length"
            )
            raise fault(
                self.file, key, f"found {shown(given)}, expected {expected}; correct the lists"
            )
        if any(len(set(each)) < len(each) for each in found):
            raise fault(self.file, key, "found an offset twice, expected each once; remove one")
        return found

    def _unit(self, key: str, kind: Kind) -> tuple[str, float]:
        """The SI unit of the offsets, and what the file's are in it."""
        if kind is Kind.DIRECTION:
            return "rad", math.radians(1.0) if self.units.angle == "deg" else 1.0
        if self.units.length is None:
            raise fault(
                self.file,
                "units.length",
                f'missing, expected "m" or "mm" for {key}; say which unit it is in',
            )
        return "m", 1e-3 if self.units.length == "mm" else 1.0

    def _line(self, key: str, table: object, moves: dict[str, Array]) -> None:
        """Let a direction follow the two positions it goes through; it stays as long as it is where
        only one end of it varies.
        """
        keys = typed(self.file, key, table, LineKeys)
        axis = self._found(join(key, "axis"), keys.axis)
        ends = [self._found(join(key, "through"), each) for each in keys.through]
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
        if axis in moves:
            raise fault(
                self.file,
                join(key, "axis"),
                f"found {axis}, which varies by itself, expected one that follows; leave out one",
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
        if follows.any():
            moves[axis] = math.copysign(float(np.linalg.norm(direction)) / long, cosine) * follows

    def _check_drivers(self, moves: Mapping[str, Array]) -> None:
        """Drivers are measured from each variant's own design, which an absolute value of a point
        that varies would not be.
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
