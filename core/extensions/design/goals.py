"""Goals, bands of outputs over the travel, and moves, boxes of hardpoints, from their texts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...case.case import Case
from ...case.io.document import measure
from ...case.io.reader_options import CurveOptions
from ...case.io.reference_curve import with_curve
from ...case.io.table import read_unit
from ...case.models.files import load
from ...case.units import LENGTHS, Unit
from ...cli.shared_options import driver_value
from ...errors import CaseError, KincheckError, unknown
from ...trajectory import Array
from ..hardpoints.options import WheelOptions

GOAL = '--goal "OUTPUT [at TRAVEL] = VALUE +- TOLERANCE UNIT"'
MOVE = '--move "POINT: AXES +- BOX UNIT"'
SAME = 1e-9
"""Travels closer than this are one sample [m or rad]."""
_GOAL = re.compile(
    r"\s*(?P<output>\S+?)(?:\s+at\s+(?P<at>[^=]+?))?\s*(?:=|\s(?P<as>as)\s)\s*(?P<value>.+?)\s*"
    r"(?:\+-|\+/-|±)\s*(?P<tolerance>.+?)\s*"
)
_MOVE = re.compile(
    r"\s*(?P<points>[^:]+?)\s*:\s*(?P<axes>[xyz](?:[\s,]*[xyz])*)?\s*(?:(?:\+-|\+/-|±)\s*(?P<box>.+?)\s*)?"
)
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


@dataclass(frozen=True, eq=False)
class Goal:
    """A band of an output.

    Attributes:
        text: as the user wrote it.
        unit: in which the user gave it, and its size [SI].
        at: indices of the samples at which the band holds.
        middle: of the band at these samples [SI].
        tolerance: half-width of the band [SI].
    """

    text: str
    output: str
    unit: tuple[str, float]
    at: NDArray[np.intp]
    middle: Array
    tolerance: float


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
    drafts = [_draft(text, case) for text in texts]
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
        unit_name = each.unit.name, each.unit.size
        goals.append(Goal(each.text, each.output, unit_name, whole, middle[whole], each.tolerance))
    return case, goals, notes


def read_moves(texts: Sequence[str], case: Case, usual: str = "") -> dict[str, float]:
    """Return the half-width of the box of each place that may move [m].

    Args:
        usual: box of moves without one.

    Raises:
        KincheckError: a move has another form, there is no such row, or it is given twice.
    """
    rows = {role: each.name for each in case.hardpoints for role in each.roles}
    rows |= {each.name: each.name for each in case.hardpoints}
    moving = {each.name for each in case.hardpoints if each.moves}
    found = dict[str, float]()
    for text in texts:
        read = _MOVE.fullmatch(text)
        if read is None or not (read["box"] or usual):
            raise KincheckError(
                f"move {text!r}: expected points, axes and a box; say {MOVE}, such as"
                ' "tierod_inner: y z +- 15 mm"'
            )
        box = read_box(read["box"] or usual, f"move {text!r}", case)
        for name in re.split(r"\s*,\s*", read["points"]):
            if name not in rows:
                raise KincheckError(f"move {text!r}: {unknown('point', name, rows)}")
            if rows[name] not in moving:
                raise KincheckError(
                    f"move {text!r}: nothing of the suspension follows {name}; leave it out"
                )
            for axis in re.findall("[xyz]", read["axes"] or "xyz"):
                if (place := f"{rows[name]} {axis}") in found:
                    raise KincheckError(f"move {text!r}: {place} is given twice; leave one out")
                found[place] = box
    return found


def read_box(text: str, what: str, case: Case) -> float:
    """Return the half-width of a box [m].

    Raises:
        KincheckError: it is no positive length.
    """
    try:
        box = measure(re.sub(r"^\s*(\+-|\+/-|±)", "", text), LENGTHS, case.length_unit)[0]
    except ValueError:
        box = np.nan
    if not 0.0 < box < np.inf:
        raise KincheckError(
            f"{what}: found the box {text!r}, expected a positive length with a unit; say +- 15"
            f" {case.length_unit}"
        )
    return box


def _draft(text: str, case: Case) -> _Draft:
    read = _GOAL.fullmatch(text)
    if read is None:
        raise KincheckError(
            f"goal {text!r}: expected an output, a value and a tolerance; say {GOAL}, such as"
            ' "toe = 0 +- 0.05 deg", or a file of a curve in place of the value'
        )
    names = [each.name for each in case.outputs if not each.forces]
    if read["output"] not in names:
        raise KincheckError(f"goal {text!r}: {unknown('output', read['output'], names)}")
    number = _NUMBER.fullmatch(read["tolerance"])
    if number is None or not 0.0 < float(number[1]) < np.inf:
        raise KincheckError(
            f"goal {text!r}: found the tolerance {read['tolerance']!r}, expected a positive number"
            " with a unit; say +- 0.05 deg"
        )
    unit = _unit(text, number[2], case, read["output"])
    try:
        travel = driver_value(read["at"], case)
    except KincheckError as error:
        raise KincheckError(f"goal {text!r}: {str(error).removeprefix('--at: ')}") from None
    return _Draft(text, read["output"], travel, read["value"], unit, unit.size * float(number[1]))


def _unit(text: str, name: str, case: Case, output: str) -> Unit:
    """Return a unit of an output by its name; without one, that of the table."""
    si = next(each.unit for each in case.outputs if each.name == output)
    expected, found = read_unit(si), read_unit(name or _of_table(si, case))
    if found is not None and expected is not None and found[1] == expected[1]:
        return found[0]
    raise KincheckError(
        f"goal {text!r}: found the unit {name!r}, expected one of {output}, such as"
        f" {_of_table(si, case)}; correct it"
    )


def unit_in_table(si: str, case: Case) -> Unit:
    """Return the unit of an output as the table has it."""
    found = read_unit(_of_table(si, case))
    return found[0] if found is not None else Unit(si, 1.0, float)


def _of_table(si: str, case: Case) -> str:
    """Return an SI unit in the units of the table; rates of change are per metre."""
    first, *per = si.split("/")
    return "/".join([{"m": case.length_unit, "rad": case.angle_unit}.get(first, first), *per])


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
