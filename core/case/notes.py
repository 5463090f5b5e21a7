"""Notes on a case for readers of its results: input that may be intended, but may be a mistake,
such as improbable sizes of mechanisms and drives, most often a sign of a wrong unit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import Phrase
from ..joints.base import unit
from ..mechanism.mechanism import GROUND, Mechanism, Vector, extent
from ..mechanism.motions import JointDriver, PointCoordinate
from .case import MARKER, Case
from .quantity import Output
from .units import ANGLES, LENGTHS, Unit

# Of the largest value of a reference, an error that hides most mistakes of a mechanism.
COARSE = 0.1


def notes(case: Case) -> list[str]:
    """Return the notes on rod lengths, closure, sizes, outputs and the source of the reference.

    Numbers are in the units of the case's file.
    """
    written = LENGTHS[case.length_unit].written
    parts = (*case.mechanism.joints, *case.mechanism.couplers)
    joints = [note for part in parts for note in part.notes]
    said = [note.within(written) if isinstance(note, Phrase) else note for note in joints]
    said += [*case.assembly, *size_notes(case)]
    if no_output_depends_on_a_closure(case):
        said.append(
            "no output depends on a closure: all of them follow from the drivers alone, so that"
            " agreement says nothing of the loops; add outputs of the other bodies or joints"
        )
    return [*said, *_reference_notes(case)]


def _reference_notes(case: Case) -> Iterator[str]:
    origin = case.origin
    if origin and origin.grid:
        yield f"the reference has {origin.grid}"
    coarse = list[str]()
    for name, series in (case.reference or {}).items():
        known = series.position[np.isfinite(series.position)]
        half = series.uncertainty.get("position", np.zeros(1))
        if known.size and half.max() > COARSE * np.abs(known).max():
            coarse.append(name)
    if coarse:
        yield (
            f"{', '.join(coarse)}: the reference is known to a tenth of its largest value or worse,"
            " by too few digits or rows: agreement says little; give more of them"
        )
    if not (case.reference and case.truth.validates and origin):
        return
    if origin.own:
        yield (
            f"judged against a reference that kincheck has made, which is no {case.truth}: no pass"
            " is called validated"
        )
    elif not origin.citation:
        source = '"author, title, page or address"'
        where = origin.file if origin.by_option else "[reference]"
        add = f"--citation {source}" if origin.by_option else f"citation = {source} to [reference]"
        yield (
            f"judged against an uncited reference: truth is {case.truth}, and {where} does not say"
            f" where it comes from, so that no pass is called validated; add {add}"
        )


def no_output_depends_on_a_closure(case: Case) -> bool:
    """Return whether the mechanism has bodies that a closure moves, and no output reads them.

    An output of the coordinate that is driven reads nothing else either.
    """
    mechanism = case.mechanism
    placed = _driven_bodies(mechanism)
    if all(body.name in placed for body in mechanism.moving):
        return False
    driven = [each for each in mechanism.drivers if isinstance(each, PointCoordinate)]
    return all(
        (
            not output.forces  # a force depends on the closures
            and all(mechanism.point(name).body in placed for name in output.points)
        )
        or (
            isinstance(output, Output)
            and any(
                each.point == output.point and tuple(unit(each.direction)) == output.direction
                for each in driven
            )
        )
        for output in case.outputs
    )


def _driven_bodies(mechanism: Mechanism) -> set[str]:
    """Return the bodies that joints from the ground place, all of whose freedoms are driven."""
    placed = {GROUND, *(body.name for body in mechanism.bodies if body.fixed)}
    driven = {
        (each.joint, each.freedom) for each in mechanism.drivers if isinstance(each, JointDriver)
    }
    beside = dict[str, list[str]]()
    for joint in mechanism.joints:
        moved = sum((joint.name, each) in driven for each in joint.freedoms)
        if (moved or not joint.freedoms) and joint.rows + moved == 6:
            for here, there in (joint.bodies, joint.bodies[::-1]):
                beside.setdefault(here, []).append(there)
    waiting = [*placed]
    while waiting:
        new = [body for body in beside.get(waiting.pop(), ()) if body not in placed]
        placed.update(new)
        waiting += new
    return placed


# Points closer than this fraction of their coordinates coincide.
ROUNDING = 1e-12
_TAKEN_FOR: dict[tuple[str, bool], str] = {
    ("mm", True): "metres declared as mm",
    ("cm", True): "metres declared as cm",
    ("inch", True): "metres declared as inch",
    ("foot", True): "metres declared as foot",
    ("m", False): "mm declared as m",
    ("m", True): "mm converted to m twice",
    ("deg", True): "radians declared as deg",
    ("rad", False): "degrees declared as rad",
    ("rad", True): "degrees converted to radians twice",
}
"""Probable cause of an improbable size, by its unit and whether it is too small."""


@dataclass(frozen=True)
class Range:
    """Probable sizes [SI], and their description if the message needs one."""

    least: float
    most: float
    what: str = ""

    def improbable(self, size: float, unit: Unit) -> str:
        """Return the size in its unit, the expected range and a probable cause; empty for a
        probable size.
        """
        if self.least <= size <= self.most:
            return ""
        expected = " to ".join(
            unit.written(each) for each in (self.least, self.most) if math.isfinite(each)
        )
        if not math.isfinite(self.most):
            expected += " or more"
        taken = _TAKEN_FOR.get((unit.name, size < self.least), "numbers of another unit")
        return f"{unit.written(size)}, expected {self.what}{expected}: {taken}?"


MECHANISMS = Range(5e-3, 100.0)
# Strokes relative to the mechanism's size, from some hundredths to some times as long.
STROKES = Range(5e-4, 20.0)
# From degrees converted to radians twice, or once, up to a few turns.
TURNS = {"rad": Range(1.7e-3, 38.0), "deg": Range(math.radians(1.0), math.inf)}


def size_notes(case: Case) -> Iterator[str]:
    """Yield notes on an improbable size of the mechanism or range of a moving driver."""
    length, angle = LENGTHS[case.length_unit], ANGLES[case.angle_unit]
    positions = [
        point.position for point in case.mechanism.points if not point.name.startswith(MARKER)
    ]
    extent = largest_extent(
        [*positions, *(each for joint in case.mechanism.joints for each in joint.points_on())]
    )
    if extent and (found := MECHANISMS.improbable(extent, length)):
        yield f"the mechanism spans {found}"
    for name, values in case.sweep.moved.items():
        if name not in case.sweep.path.motions:  # time
            continue
        low, high, way = float(values.min()), float(values.max()), float(np.ptp(values))
        turns = case.mechanism.driver(name).turns
        unit = angle if turns else length
        probable = (
            TURNS[angle.name] if turns else Range(STROKES.least * extent, STROKES.most * extent)
        )
        if way and (turns or extent) and (found := probable.improbable(way, unit)):
            beside = "" if turns else f" beside a mechanism of {length.written(extent)}"
            yield (
                f"driver {name!r} goes from {unit.written(low)} to {unit.written(high)}{beside}, a"
                f" way of {found}"
            )


def largest_extent(positions: Sequence[Vector]) -> float:
    """Return the largest extent of positions along a global axis [m], zero if all coincide but for
    rounding.
    """
    if not positions:
        return 0.0
    largest = extent(positions)
    return largest if largest > ROUNDING * float(np.abs(positions).max()) else 0.0
