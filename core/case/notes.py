"""Notes on a case for readers of its results: input that may be intended, but may be a mistake."""

from __future__ import annotations

import numpy as np

from ..errors import Phrase
from ..joints.base import unit
from ..mechanism.mechanism import GROUND, Mechanism
from ..mechanism.motions import JointDriver, PointCoordinate
from .case import Case
from .quantity import Output
from .sizes import size_notes
from .units import LENGTHS

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
    said += [*case.assembly, *size_notes(case), *_closure_notes(case)]
    return [*said, *_reference_notes(case)]


def _closure_notes(case: Case) -> list[str]:
    if not no_output_depends_on_a_closure(case):
        return []
    return [
        "no output depends on a closure: all of them follow from the drivers alone, so that"
        " agreement says nothing of the loops; add outputs of the other bodies or joints"
    ]


def _reference_notes(case: Case) -> list[str]:
    grid = [f"the reference has {case.origin.grid}"] if case.origin and case.origin.grid else []
    return [*grid, *_coarse_notes(case), *_source_notes(case)]


def _coarse_notes(case: Case) -> list[str]:
    names: list[str] = []
    for name, series in (case.reference or {}).items():
        known = series.position[np.isfinite(series.position)]
        half = series.uncertainty.get("position", np.zeros(1))
        if known.size and half.max() > COARSE * np.abs(known).max():
            names.append(name)
    if not names:
        return []
    return [
        f"{', '.join(names)}: the reference is known to a tenth of its largest value or worse, by"
        " too few digits or rows: agreement says little; give more of them"
    ]


def _source_notes(case: Case) -> list[str]:
    if not (case.reference and case.truth.validates and case.origin):
        return []
    if case.origin.own:
        return [
            f"judged against a reference that kincheck has made, which is no {case.truth}: no pass"
            " is called validated"
        ]
    if not case.origin.citation:
        return [
            f"judged against an uncited reference: truth is {case.truth}, and [reference] does not"
            " say where it comes from, so that no pass is called validated; add citation ="
            ' "author, title, page or address" to [reference]'
        ]
    return []


def no_output_depends_on_a_closure(case: Case) -> bool:
    """Return whether the mechanism has bodies that a closure moves, and no output reads them.

    An output of the coordinate that is driven reads nothing else either.
    """
    mechanism = case.mechanism
    placed = _placed_by_drivers(mechanism)
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


def _placed_by_drivers(mechanism: Mechanism) -> set[str]:
    """Return the bodies that joints from the ground place, all of whose freedoms are driven."""
    placed = {GROUND, *(body.name for body in mechanism.bodies if body.fixed)}
    driven = {
        (each.joint, each.freedom) for each in mechanism.drivers if isinstance(each, JointDriver)
    }
    beside: dict[str, list[str]] = {}
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
