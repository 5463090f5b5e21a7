"""A case without rows redundant but for the digits of its file."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial

from ...case.case import Case, Closure
from ...errors import MechanismError
from ...kinematics import NativeSolver, degrees_of_freedom, largest_residual
from .reduction import reduce_rows

# Largest accepted residual of the rows that are solved, relative to the mechanism's size.
_TOL = 1e-12
# Other joints that are tried to close the loops, each by a solved motion.
MOST_TRIED = 12
# A residual of so many tolerances is no sum of digits: the motion is another one.
OTHER = 10.0


@dataclass(frozen=True, eq=False)
class _Trial:
    """A case without rows of the joints of one choice, and how its motion keeps those.

    Attributes:
        left: largest residual of the joints at the samples reached [m].
        reached: number of these.
    """

    case: Case
    carrying: tuple[str, ...]
    unit: float
    left: float
    reached: int

    @property
    def names(self) -> str:
        """The joints with rows left out."""
        return ", ".join(str(each.joint) for each in self.case.mechanism.reduced)


def within_digits(case: Case, tolerance: float, why: str, carrying: Collection[str] = ()) -> Case:
    """Return the case without rows that are redundant within a tolerance [m], with a note.

    Rows that are redundant to round-off stay: all engines know them. Rows that determine the motion
    at the start may fail to do so elsewhere: then other joints close the loops.

    Args:
        why: origin of the tolerance, for the note.
        carrying: joints with all their rows, as long as others can close the loops.

    Raises:
        MechanismError: the rows are redundant at the start, but do not hold along the motion.
        SolveError: the mechanism does not close, or its drivers do not move it.
    """
    found = _trial(case, tolerance, carrying)
    if not found.case.mechanism.reduced:
        return case
    if found.left <= _TOL * found.unit and _is_driven(case):
        return case
    if found.left > tolerance or found.reached < len(case.sweep.path.times):
        found = max([found, *_others(case, tolerance, found)], key=partial(_worth, tolerance))
    if found.reached == 0 and not _is_driven(found.case):
        if not _is_driven(case):
            return case
        note = (
            f"rows of {found.names} are redundant within {tolerance:.3g} m ({why}), but without"
            " them the drivers do not determine the motion: all rows are kept, and forces multiply"
            " digits"
        )
        return replace(case, assembly=(*case.assembly, note))
    if found.left <= tolerance:
        note = (
            f"rows that are redundant within {tolerance:.3g} m ({why}) are left out, of"
            f" {found.names}; along the motion they keep a residual of {found.left:.2g} m"
        )
        closure = Closure(tolerance, found.carrying, note)
        return replace(found.case, assembly=(*case.assembly, note), closure=closure)
    if _is_driven(case):  # no digits: beside a singular pose
        return case
    raise MechanismError(
        f"rows of {found.names} are redundant at the start within {tolerance:.3g} m"
        f" ({why}), but along the motion they are off by up to {found.left:.3g} m, expected"
        f" {tolerance:.3g} m at most; start farther from a singular pose, or give"
        " another tolerance by --closure"
    )


def _worth(tolerance: float, trial: _Trial) -> tuple[bool, int, float]:
    """Return the order of trials, the best one last."""
    return trial.left <= OTHER * tolerance, trial.reached, -trial.left


def _others(case: Case, tolerance: float, first: _Trial) -> Iterator[_Trial]:
    """Yield trials in which one joint after the other closes its loop, until one holds."""
    names = [joint.name for joint in case.mechanism.joints]
    tried = {each.joint.name for each in first.case.mechanism.reduced}
    for name in [each for each in names if each not in tried][:MOST_TRIED]:
        trial = _trial(case, tolerance, [each for each in names if each != name])
        if name in {each.joint.name for each in trial.case.mechanism.reduced}:
            yield trial
            if trial.left <= tolerance and trial.reached == len(case.sweep.path.times):
                return


def _is_driven(case: Case) -> bool:
    return degrees_of_freedom(case.mechanism) == len(case.mechanism.drivers)


def _trial(case: Case, tolerance: float, carrying: Collection[str]) -> _Trial:
    """Return the case without rows, some joints keeping theirs, and its motion."""
    found = reduce_rows(case.mechanism, tolerance, carrying)
    less = replace(case, mechanism=found.mechanism)
    joints = [each.joint for each in found.mechanism.reduced]
    if not joints or not _is_driven(less):
        return _Trial(less, tuple(carrying), found.unit, math.inf, 0)
    bodies = tuple(body.name for body in found.mechanism.moving)
    motion = NativeSolver(order=0).prepare(found.mechanism, case.sweep.path, bodies=bodies)(_TOL)
    solved = {
        name: replace(each, r=each.r[motion.solved], p=each.p[motion.solved])
        for name, each in motion.bodies.items()
    }
    left = largest_residual(found.mechanism, joints, solved)
    return _Trial(less, tuple(carrying), found.unit, left, int(motion.solved.sum()))
