"""[outputs.NAME] of a case file, read and written: coordinates of points, measures, and types of
extensions; their tolerances; and the outputs of a case whose file names none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import CaseError
from ...mechanism.loads import Bushing, ForceElement, Torque, TorsionSpringDamper
from ...mechanism.mechanism import Mechanism, Vector
from ..case import PER_TRAVEL, Case, Output, Quantity, pace, size
from ..measures import (
    ForceMeasure,
    JointAngle,
    JointDisplacement,
    Measure,
    key_of,
)
from ..quantity import AXES, Derived, TypedQuantity, own_keys
from ..units import Convert
from .document import Section, explained
from .reference_samples import RATES
from .schema import COORDINATE, OutputKeys, ToleranceKeys, keys_of
from .sections import sections, types
from .toml_text import toml_table

# Hardpoints are measured to about a micrometre; double precision rounds coordinates of metre-sized
# mechanisms at 1e-16 m.
DEFAULT_ATOL = 1e-9
# The driver's pace scales `atol`. Near a dead centre, outputs and their errors change thousands of
# times as fast as the driver. Example: a loop of a revolute, a cylindrical joint and a pin in a
# slot has 1,855 m/s^2 at a pace of 0.5 /s. Engines are proved to be within 3e-10 m/s^2; 1e-9 m at
# this pace allows less.
DEFAULT_RTOL = 1e-9
_OF_RANGE = "; and of values whose range is larger, as much of the range"
# For mechanisms below a millimetre: some are as small as a nanometre.
PART_OF_SIZE = 1e-6
DEFAULT_WHY = (
    "the default of 1e-9 m, or a millionth of the size of mechanisms below a millimetre: a"
    " thousandth of the micrometre that hardpoints are measured to, and millions of times the"
    f" round-off of metre-sized coordinates in double precision{_OF_RANGE}"
)
FORCES = ("N", "N m")
_OF_LOADS = (
    "the default of 1e-9 of the loads (weights, inertia at the drivers' pace, springs, applied"
    " forces): a thousandth of what load cells resolve, and a thousand times the round-off of the"
    f" least exact engine, which differentiates its rows numerically{_OF_RANGE}"
)
_DEFAULTS: Mapping[str, str] = {
    "m": DEFAULT_WHY,
    "rad": (
        "the default of 1e-9 rad: a nanometre, the default of lengths, at a metre; a"
        " hundred-thousandth of the hundredth of a degree that wheel alignment is measured to, and"
        f" millions of times the round-off of an angle in double precision{_OF_RANGE}"
    ),
    "1": (
        "the default of 1e-9 of a ratio: a nanometre, the default of lengths, in a metre, and"
        f" millions of times the round-off of a ratio near one in double precision{_OF_RANGE}"
    ),
    **dict.fromkeys(FORCES, _OF_LOADS),
}
"""Reason for the default, by the unit of the output."""


def default(size: float, unit: str = "m") -> tuple[float, float, str]:
    """Return the default atol [unit], rtol [-] and their reason.

    Args:
        size: size of the mechanism [m]; for a force or torque, the loads [unit].
    """
    least = {"m": min(DEFAULT_ATOL, PART_OF_SIZE * size)}
    return (
        least.get(unit, DEFAULT_ATOL * (size if unit in FORCES else 1.0)),
        DEFAULT_RTOL,
        _DEFAULTS[unit],
    )


def tolerance(
    section: Section, keys: ToleranceKeys, convert: Convert, size: float, unit: str = "m"
) -> tuple[float, float, str]:
    """Return atol [unit], rtol [-] and their reason.

    Args:
        convert: conversion from the file's unit of the output to SI.
        size: see `default`.
    """
    given = keys.atol is not None or keys.rtol is not None
    if given and keys.why is None:
        raise section.at("why").fault(
            "missing, expected the reason for the tolerance; add the key 'why'"
        )
    if keys.why is None:
        return default(size, unit)
    if not given:
        raise section.at("why").fault(
            "found a reason without a tolerance, expected both; add atol or rtol"
        )
    return convert(keys.atol or 0.0), keys.rtol or 0.0, keys.why


def with_all_coordinates(case: Case, points: Iterable[str] | None = None) -> Case:
    """Return the case with outputs POINT.x, .y and .z and default tolerances.

    Args:
        points: names of points; None for all.
    """
    given, names = (
        default(size(case)),
        [point.name for point in case.mechanism.points] if points is None else points,
    )
    outputs = [
        Output(f"{name}.{axis}", name, along, False, *given)
        for name in names
        for axis, along in AXES.items()
    ]
    return replace(case, outputs=tuple(outputs))


def read_output(name: str, section: Section, tables: Mapping[str, Any], case: Case) -> Quantity:
    """Return an output that the file names.

    Args:
        tables: those that extensions have read, by key.
        case: the case read so far.

    Raises:
        CaseError: an unknown type, key or name, a missing input of the type, or an output that this
            joint or wheel does not have.
    """
    if any(name.endswith(ending) for ending in (*RATES, PER_TRAVEL) if ending):
        raise section.fault(
            "a name with this ending is a derivative in reference tables; give the output another"
            " name"
        )
    if section.table.get("type", COORDINATE) != COORDINATE:
        known = {COORDINATE: Output, **Measure.registry, **types()}
        cls = section.class_of("output", known)
        if issubclass(cls, Measure):
            return _measure(name, section, cls, case)
        for each in sections():
            if its := each.types.get(section.table["type"]):
                return each.output(name, section, its, tables.get(each.key), case)
    keys = section.typed(OutputKeys)
    check_point(section.at("point"), keys.point, case.mechanism)
    match keys.component, keys.direction:
        case str(axis), None:
            along = AXES[axis]
        case None, (_, _, _) as found:
            along = direction(section.at("direction"), found)
        case component, _:
            what = "both component and" if component else "neither component nor"
            raise section.fault(
                f'found {what} direction, expected one of them; give component = "x" or direction ='
                " [x, y, z]"
            )
    given = tolerance(section, keys, section.units.length, size(case))
    return Output(name, keys.point, along, keys.relative, *given)


def direction(section: Section, found: Sequence[float]) -> Vector:
    """Return the unit vector of a direction of a file.

    Raises:
        CaseError: it is zero.
    """
    if not any(found):
        raise section.fault("found zero, expected a direction; give one of any other length")
    length = math.hypot(*found)
    x, y, z = found
    return x / length, y / length, z / length


def check_point(section: Section, name: str, mechanism: Mechanism) -> None:
    """Refuse a name without a point.

    Raises:
        CaseError: there is no such point.
    """
    section.require(name, [point.name for point in mechanism.points], "a point")


def _measure(name: str, section: Section, cls: type[Measure], case: Case) -> Measure:
    keys: Any = section.typed(keys_of(cls))
    given = {each.name: getattr(keys, key_of(each)) for each in own_keys(cls)}
    with explained(section.file, section.key):
        output = cls(name, 0.0, 0.0, "", **given)
        output.check(case.mechanism)
        output = output.bound(case.mechanism)
    scale = size(case)
    if isinstance(output, ForceMeasure):
        loads = largest_load(case.mechanism, scale, pace(case))
        scale = loads * scale if output.turns else loads
    _, convert = section.units.of(output.unit)
    atol, rtol, why = tolerance(section, keys, convert, scale, output.unit)
    if isinstance(output, JointAngle | JointDisplacement):
        output = replace(output, at_design=convert(output.at_design))
    return replace(output, atol=atol, rtol=rtol, why=why)


def _largest(each: ForceElement, name: str) -> float:
    """Return the largest of an element's numbers of a name; zero without it."""
    return float(np.max(getattr(each, name, 0.0)))


def _steepest(each: ForceElement) -> float:
    """Return the steepest slope between rows of an element's curves."""
    given: Any = getattr(each, "curve", None) or ()
    tables = given if isinstance(each, Bushing) else (given,)
    slopes = [np.abs(np.divide(*np.diff(table, axis=0).T[::-1])).max() for table in tables if table]
    return float(max(slopes, default=0.0))


def largest_load(mechanism: Mechanism, size: float, pace: float) -> float:
    """Return an estimate of the largest force of a mechanism [N], the scale of errors.

    It counts the weights, the inertia forces at a pace [1/s], springs stretched by their own
    length, and applied forces.
    """
    masses = sum(body.mass for body in mechanism.moving)
    total = masses * (math.hypot(*mechanism.gravity) + size * pace**2)
    for each in mechanism.forces:
        arm = 1.0 / size if isinstance(each, TorsionSpringDamper) else size
        total += (_largest(each, "stiffness") + _largest(each, "damping") * pace) * arm
        turning = _largest(each, "turning_stiffness") + _largest(each, "turning_damping") * pace
        total += turning / size + _largest(each, "preload") + _steepest(each) * arm
        vector = getattr(each, "vector", (0.0,))
        total += float(np.linalg.norm(vector)) / (size if isinstance(each, Torque) else 1.0)
    return total


def output_lines(case: Case) -> Iterator[str]:
    """Yield the lines of the outputs of a case, in SI units.

    Raises:
        CaseError: an output is one that a case file cannot name.
    """
    for output in case.outputs:
        if not isinstance(output, Derived):  # the reader derives it from the output before it
            keys = dict(_keys(case, output))
            given = {"atol": output.atol, "rtol": output.rtol, "why": output.why}
            yield from toml_table({**keys, **given}, "outputs", output.name)


def _keys(case: Case, output: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(output, TypedQuantity):
        yield "type", output.type
        for each in sections():
            yield from each.further(case, output)
        for each in own_keys(type(output)):
            value = getattr(output, each.name)
            if value is not None and value != each.metadata.get("unless"):
                yield key_of(each), value
    elif isinstance(output, Output):
        component = next((name for name, axis in AXES.items() if axis == output.direction), None)
        yield "point", output.point
        yield ("direction", output.direction) if component is None else ("component", component)
        yield "relative", output.relative
    else:
        raise CaseError(
            f"case {case.name!r}: output {output.name!r} is a derivative, which the file cannot"
            " name; leave it out"
        )
