"""Cases made of a case: without rows redundant but for the digits of its file, and on a path for
derivatives by the travel of wheels.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ..errors import MechanismError
from ..kinematics import NativeSolver, degrees_of_freedom, largest_residual, reduce_rows
from ..mechanism.motions import Motion, Waypoints
from ..trajectory import Array
from .case import TIME, Case, Closure, Sweep, size

# Largest accepted residual of the rows that are solved, relative to the mechanism's size.
_TOL = 1e-12


def within_digits(case: Case, tolerance: float, why: str, carrying: Collection[str] = ()) -> Case:
    """Return the case without rows that are redundant within a tolerance [m], with a note.

    Rows that are redundant to round-off stay: all engines know them.

    Args:
        why: origin of the tolerance, for the note.
        carrying: joints with all their rows, as long as others can close the loops.

    Raises:
        MechanismError: the rows are redundant at the start, but do not hold along the motion.
        SolveError: the mechanism does not close, or its drivers do not move it.
    """
    found = reduce_rows(case.mechanism, tolerance, carrying)
    less = replace(case, mechanism=found.mechanism)
    if not found.mechanism.reduced:
        return case
    names = ", ".join(str(each.joint) for each in found.mechanism.reduced)
    if not _is_driven(less):
        if not _is_driven(case):
            return case
        note = (
            f"rows of {names} are redundant within {tolerance:.3g} m ({why}), but without them the"
            " drivers do not determine the motion: all rows are kept, and forces multiply digits"
        )
        return replace(case, assembly=(*case.assembly, note))
    left = _residual_left(less)
    if left <= _TOL * found.unit and _is_driven(case):
        return case
    if left <= found.limit:
        note = (
            f"rows that are redundant within {tolerance:.3g} m ({why}) are left out, of {names};"
            f" along the motion they keep a residual of {left:.2g} m"
        )
        closure = Closure(tolerance, tuple(carrying), note)
        return replace(less, assembly=(*case.assembly, note), closure=closure)
    if _is_driven(case):  # no digits: beside a singular pose
        return case
    raise MechanismError(
        f"rows of {names} are redundant at the start within {tolerance:.3g} m"
        f" ({why}), but along the motion they are off by up to {left:.3g} m, expected"
        f" {found.limit:.3g} m at most; start farther from a singular pose, or give"
        " another tolerance by --closure"
    )


def _is_driven(case: Case) -> bool:
    return degrees_of_freedom(case.mechanism) == len(case.mechanism.drivers)


def _residual_left(case: Case) -> float:
    """Return the largest residual of the reduced joints along the motion of a case [m]."""
    joints = [each.joint for each in case.mechanism.reduced]
    bodies = tuple(body.name for body in case.mechanism.moving)
    motion = NativeSolver(order=0).prepare(case.mechanism, case.sweep.path, bodies=bodies)(_TOL)
    solved = {
        name: replace(each, r=each.r[motion.solved], p=each.p[motion.solved])
        for name, each in motion.bodies.items()
    }
    return largest_residual(case.mechanism, joints, solved)


# Displacement of a driver at that rate in the time between two samples, over the mechanism's
# size: small, so that the path between samples goes hardly beyond them.
STEP = 1e-3


def held_case(case: Case, drivers: Sequence[str]) -> Case:
    """Return the case on a path through the same poses, on which these drivers alone move at each
    sample.
    """
    # only ratios of rates count, and those of a path at rest are the same
    sweep = replace(case.sweep, rate=1.0) if case.sweep.static else case.sweep
    path = sweep.path
    times: Array = np.unique([0.0, *path.times]) if path.covers(0.0) else np.unique(path.times)
    shortest = float(np.diff(times).min(initial=1.0))
    rate = STEP * size(case) / shortest
    motions = dict[str, Motion]()
    for name in dict.fromkeys((*path.motions, *drivers)):
        values = path.motions[name].at(times)[0] if name in path.motions else np.zeros_like(times)
        motions[name] = Waypoints(
            tuple(times.tolist()), tuple(values.tolist()), rate if name in drivers else 0.0
        )
    return replace(case, sweep=Sweep(TIME, path.times, motions=motions))
