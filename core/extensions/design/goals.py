"""Goals, bands of outputs over the travel, and moves, boxes of hardpoints, from their texts."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...case.case import TIME, Case
from ...case.io.document import measure
from ...case.io.reader_options import CurveOptions
from ...case.io.table import read_unit
from ...case.models.files import load
from ...case.units import LENGTHS, SECOND, Unit
from ...cli.shared_options import driver_value
from ...errors import CaseError, KincheckError, unknown
from ...trajectory import Array
from ..hardpoints.options import WheelOptions
from ..measured.reference_curve import with_curve
from .rods import LENGTH, SHIM, ends_of, rods_of, with_sides

GOAL = '--goal "OUTPUT [at TRAVEL] = VALUE +- TOLERANCE UNIT"'
MOVE = '--move "POINT: [shim] AXES +- BOX UNIT" or "ROD: length +- BOX UNIT"'
SAME = 1e-9
"""Travels closer than this are one sample [m or rad]."""
_GOAL = re.compile(
    r"\s*(?P<output>\S+?)(?:\s+at\s+(?P<at>[^=]+?))?\s*(?:=|\s(?P<as>as)\s)\s*(?P<value>.+?)\s*"
    r"(?:\+-|\+/-|±)\s*(?P<tolerance>.+?)\s*"
)
_MOVE = re.compile(
    r"\s*(?P<points>[^:]+?)\s*:\s*(?:(?P<kind>length|shim)\b)?\s*(?P<axes>[xyz](?:[\s,]*[xyz])*)?"
    r"\s*(?P<box>[+±].*?)?\s*"
)
_BOX = re.compile(r"(?:\+-|\+/-|±)?\s*(?P<both>[^+-]*)|\+(?P<high>[\d.\s]+)-(?P<low>[^+-]+)")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


@dataclass(frozen=True, eq=False)
class Goal:
    """A band of an output.

    Attributes:
        text: as the user wrote it.
        unit: in which the user gave it.
        at: indices of the samples at which the band holds.
        middle: of the band at these samples [SI].
        tolerance: half-width of the band [SI].
    """

    text: str
    output: str
    unit: Unit
    at: NDArray[np.intp]
    middle: Array
    tolerance: float


@dataclass(frozen=True)
class Box:
    """How far a place may move down and up an axis of the table [m]: low to high."""

    low: float
    high: float

    @property
    def size(self) -> float:
        """The larger of both, by which moves are measured."""
        return max(-self.low, self.high)


def times(sizes: Mapping[str, float], u: Array) -> dict[str, float]:
    """Return sizes by place times factors, shape (places,)."""
    return {place: size * x for (place, size), x in zip(sizes.items(), u.tolist(), strict=True)}


@dataclass(frozen=True, eq=False)
class _Draft:
    """A goal whose samples are not known yet."""

    text: str
    output: str
    travel: float | None
    value: str
    unit: Unit
    tolerance: float


def read_goals(
    texts: Sequence[str], case: Case, supplied: WheelOptions
) -> tuple[Case, list[Goal], list[str]]:
    """Return the case with the travels of the goals among its samples, the goals, and notes on
    files.

    Raises:
        KincheckError: a goal has another form, there is no such output, or a travel or a curve lies
            beyond the sweep.
    """
    drafts = [each for text in texts for each in _drafts(text, case)]
    values, span = case.sweep.values, sorted((case.sweep.values[0], case.sweep.values[-1]))
    for each in drafts:
        if each.travel is None or np.abs(values - each.travel).min() <= SAME:
            continue
        if not span[0] <= each.travel <= span[1]:
            raise KincheckError(
                f"goal {each.text!r}: lies beyond the travel, {span[0]:g} to {span[1]:g}; give a"
                " wider --travel, or a travel with its unit: at 30mm"
            )
        values = np.sort(np.append(values, each.travel))
        values = values if case.sweep.values[0] < case.sweep.values[-1] else values[::-1]
    case = replace(case, sweep=replace(case.sweep, values=values), reference={})
    goals, notes = list[Goal](), list[str]()
    for each in drafts:
        number = _NUMBER.fullmatch(each.value)
        whole = np.arange(len(values))
        if each.travel is not None:
            whole = np.array([int(np.abs(values - each.travel).argmin())])
        if number is not None and not Path(each.value).is_file():
            unit = _unit(each.text, number[2], case, each.output) if number[2] else each.unit
            middle = np.full(len(values), unit(float(number[1])))
        else:
            middle, told = _curve(each, case, supplied)
            notes += told
        whole = whole[np.isfinite(middle[whole])]
        if not len(whole):
            raise KincheckError(
                f"goal {each.text!r}: the curve has no value within the travel; give another"
                " --travel"
            )
        goals.append(Goal(each.text, each.output, each.unit, whole, middle[whole], each.tolerance))
    return case, goals, notes


@dataclass(frozen=True)
class Movable:
    """What may move: its rows by all their names, and the units of its boxes.

    Attributes:
        bare: unit of a box without one.
        rods, ends: names of rods, and rows by all their names at the ends of rods alone.
    """

    rows: Mapping[str, str]
    units: Mapping[str, Unit]
    bare: str
    rods: Mapping[str, str] = field(default_factory=dict[str, str])
    ends: Mapping[str, str] = field(default_factory=dict[str, str])


def points_of(case: Case) -> Movable:
    """Return the points of a table that something follows."""
    moving = [each for each in case.hardpoints if each.moves]
    rows = {role: each.name for each in moving for role in each.roles}
    return Movable(rows | {each.name: each.name for each in moving}, LENGTHS, case.length_unit)


def parts_of(case: Case) -> Movable:
    """Return the points of a table, its rods, and the rows that may have a shim."""
    found, ends = points_of(case), ends_of(with_sides(case))
    rods = {name: name for name in rods_of(case).values()}
    return replace(
        found, rods=rods, ends={name: row for name, row in found.rows.items() if row in ends}
    )


def read_moves(texts: Sequence[str], movable: Movable, usual: str = "") -> dict[str, Box]:
    """Return the box of each place to move.

    Args:
        usual: box of moves without one.

    Raises:
        KincheckError: a move has another form, there is no such row, or it is given twice.
    """
    found = dict[str, Box]()
    for text in texts:
        read = _MOVE.fullmatch(text)
        if read is None or not (read["box"] or usual):
            raise KincheckError(
                f"move {text!r}: expected points, axes and a box; say {MOVE}, such as"
                ' "tierod_inner: y z +- 15 mm"'
            )
        box = read_box(read["box"] or usual, f"move {text!r}", movable)
        what, known, kind = "point", movable.rows, ""
        axes = [f" {axis}" for axis in re.findall("[xyz]", read["axes"] or "xyz")]
        if read["kind"] == "length":
            what, known, kind, axes = "rod", movable.rods, LENGTH, [""]
        elif read["kind"] == "shim":
            what, known, kind = "end of a rod or bare arm", movable.ends, SHIM
        for name in re.split(r"\s*,\s*", read["points"]):
            if name not in known:
                raise KincheckError(f"move {text!r}: {unknown(what, name, known)}")
            for axis in axes:
                if (place := f"{known[name]}{kind}{axis}") in found:
                    raise KincheckError(f"move {text!r}: {place} is given twice; leave one out")
                found[place] = box
    return found


def read_box(text: str, what: str, movable: Movable) -> Box:
    """Return a box: "+- 15 mm", or "+5 -10 mm".

    Raises:
        KincheckError: it is no positive number with a unit.
    """
    found, low, high = _BOX.fullmatch(text.strip()), np.nan, np.nan
    if found is not None:
        with suppress(ValueError):
            both = found["both"] or found["low"] or ""
            lower, unit = measure(both, movable.units, movable.bare)
            low, high = -lower, lower
            if found["high"] is not None:
                high = movable.units[unit or movable.bare](float(found["high"]))
    if not (-np.inf < low <= 0.0 <= high < np.inf and low < high):
        raise KincheckError(
            f"{what}: found the box {text!r}, expected a positive number of"
            f" {' or '.join([*movable.units][:3])}; say +- 15 {movable.bare}, or +5 -10"
            f" {movable.bare}"
        )
    return Box(low, high)


def _drafts(text: str, case: Case) -> list[_Draft]:
    """Return the goal of a text; of an axle, those of both wheels if it names none."""
    read = _GOAL.fullmatch(text)
    if read is None:
        raise KincheckError(
            f"goal {text!r}: expected an output, a value and a tolerance; say {GOAL}, such as"
            ' "toe = 0 +- 0.05 deg", or a file of a curve in place of the value'
        )
    names = [each.name for each in case.outputs if not each.forces]
    sides = [f"{side}_{read['output']}" for side in ("left", "right")]
    outputs = sides if {*sides} <= {*names} else [read["output"]]
    if outputs[0] not in names:
        raise KincheckError(f"goal {text!r}: {unknown('output', read['output'], names)}")
    number = _NUMBER.fullmatch(read["tolerance"])
    if number is None or not 0.0 < float(number[1]) < np.inf:
        raise KincheckError(
            f"goal {text!r}: found the tolerance {read['tolerance']!r}, expected a positive number"
            " with a unit; say +- 0.05 deg"
        )
    unit = _unit(text, number[2], case, outputs[0])
    try:
        travel = driver_value(read["at"], case)
    except KincheckError as error:
        raise KincheckError(f"goal {text!r}: {str(error).removeprefix('--at: ')}") from None
    tolerance = unit.size * float(number[1])
    return [_Draft(text, each, travel, read["value"], unit, tolerance) for each in outputs]


def _unit(text: str, name: str, case: Case, output: str) -> Unit:
    """Return a unit of an output by its name; without one, the table's."""
    si = next(each.unit for each in case.outputs if each.name == output)
    expected, found = read_unit(si), read_unit(name or _of_table(si, case))
    if found is not None and expected is not None and found[1] == expected[1]:
        return found[0]
    raise KincheckError(
        f"goal {text!r}: found the unit {name!r}, expected one of {output}, such as"
        f" {_of_table(si, case)}; correct it"
    )


def travel_of(case: Case) -> tuple[str, Unit]:
    """Return the name of the travel, and its unit in the table."""
    driver = case.sweep.driver
    if driver == TIME:
        return TIME, SECOND
    return driver, unit_in_table("rad" if case.mechanism.driver(driver).turns else "m", case)


def unit_in_table(si: str, case: Case) -> Unit:
    """Return the unit of an output as the table has it."""
    found = read_unit(_of_table(si, case))
    return found[0] if found is not None else Unit(si, 1.0, float)


def _of_table(si: str, case: Case) -> str:
    """Return an SI unit in the units of the table; rates of change are per metre and per kN."""
    first, *per = si.split("/")
    first = {"m": case.length_unit, "rad": case.angle_unit}.get(first, first)
    return "/".join([first, *("kN" if each == "N" else each for each in per)])


def _curve(goal: _Draft, case: Case, supplied: WheelOptions) -> tuple[Array, list[str]]:
    """Return the values of a goal's file at the samples: a measured curve, or those of another
    table or case.
    """
    file = Path(goal.value)
    if not file.is_file():
        raise KincheckError(
            f"goal {goal.text!r}: found {goal.value!r}, neither a number nor a file; give a value"
            " or a measured curve"
        )
    try:
        found, notes = with_curve(case, file, CurveOptions())
    except CaseError as error:
        values = _of_design(goal, file, case, supplied, error)
        return values, []
    series = found.reference.get(goal.output)
    if series is None:
        columns = ", ".join(found.reference)
        raise KincheckError(
            f"goal {goal.text!r}: {file} has no column {goal.output}, but {columns}; name one"
        )
    return series.position, notes


def _of_design(
    goal: _Draft, file: Path, case: Case, supplied: WheelOptions, error: CaseError
) -> Array:
    from ...harness.compare import output_series
    from ...kinematics import NativeSolver

    try:
        other = load(file, supplied)
    except CaseError:
        raise error from None
    output = next((each for each in other.outputs if each.name == goal.output), None)
    if output is None or other.sweep.driver != case.sweep.driver:
        raise KincheckError(
            f"goal {goal.text!r}: {file} has no {goal.output} over {case.sweep.driver}; give"
            " another file"
        )
    values = case.sweep.change + other.sweep.design
    other = replace(other, sweep=replace(other.sweep, values=values))
    found = NativeSolver().prepare(other.mechanism, other.sweep.path, other.points)(1e-12)
    return output_series(other, output, found).position
