"""The start of the samples on a path, and the way of the drivers from the design position to there.

The design position is on the path if the drivers have their design values there, up to six typed
digits: at time zero, or else at a sample. Otherwise all drivers are assumed to go straight to the
start. Every engine takes the same start. Any difference between design and path is travelled, never
ignored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array, Trajectory
from ..formulation.constraints import size_of
from .compiled_model import CLOSED

# Six digits leave a number uncertain by up to 5e-6 of it. A driver's value and its design value are
# made of some six such numbers: amplitude, phase, three coordinates and a direction.
TYPED = 3e-5
# Times that differ by less than this part of the largest are one: more than rounding, less than
# anyone writes.
SAME_TIME = 1e-12
# Two ways end in one motion if its points differ by less than this part of the size: more than
# round-off beside a singular pose, less than the distance of two assemblies.
APART = 1e-6


@dataclass(frozen=True, eq=False)
class Start:
    """A time on a path, and the way of the drivers from the design position to there.

    Attributes:
        time: the samples are followed from here, both ways [s].
        name: of the time, for messages.
        lead: straight way to the start, which ends at its time one; None if the design position is
            there up to rounding.
        stands: whether the design position is there up to typed digits.
        other: another possible start, or None.
        ambiguous: whether only a rule prefers this start to the other.
    """

    time: float = 0.0
    name: str = "time zero"
    lead: Path | None = None
    stands: bool = True
    other: Start | None = None
    ambiguous: bool = False

    @cached_property
    def facts(self) -> Mapping[str, Any]:
        """Return the time, and how far the drivers go straight to there [SI], for the record."""
        way = dict[str, float]()
        if self.lead:
            way = dict(
                zip(self.lead.motions, self.lead.values(np.ones(1))[:, 0].tolist(), strict=True)
            )
        return {"time": self.time, "lead": way}


AT_DESIGN = Start()


def start_of(mechanism: Mechanism, path: Path) -> Start:
    """Return the start of the samples of a path.

    The design position decides if it is on the path, at time zero or else at the nearest sample. If
    not, all drivers go straight to their values at time zero if the samples lie around it, else to
    those at the first sample: the pose of a sample must not depend on the first sample of a sweep.
    """
    times = path.times
    known = path.covers(0.0)
    if not len(times) or (known and not path.values(np.zeros(1)).any()):
        return AT_DESIGN
    places = np.concatenate([np.zeros(1), times]) if known else times
    values = path.values(places)
    off = (np.abs(values) / _scales(mechanism, path, values)[:, None]).max(axis=0, initial=0.0)
    nearest = np.argsort(np.abs(places), kind="stable")
    same = SAME_TIME * float(np.abs(times).max())
    here = [k for k in nearest.tolist() if off[k] <= TYPED]
    first = _start(path, float(times[0]), float(off[-len(times)]))
    zero = (
        _start(path, 0.0, float(off[0]))
        if known and np.isfinite(off[0]) and abs(first.time) > same
        else None
    )
    if here:
        found = _start(path, float(places[here[0]]), float(off[here[0]]))
        again = [k for k in here if abs(float(places[k]) - found.time) > same]
        if abs(found.time) > same and again:
            return replace(
                found,
                other=_start(path, float(places[again[0]]), float(off[again[0]])),
                ambiguous=True,
            )
        others = [
            each
            for each in (first, zero)
            if each is not None and abs(each.time - found.time) > same
        ]
        return replace(found, other=others[0] if others else None)
    if zero is None:
        return first
    around = float(times.min()) <= same and float(times.max()) >= -same
    taken, other = (zero, first) if around else (first, zero)
    return replace(taken, other=other, ambiguous=True)


def _scales(mechanism: Mechanism, path: Path, values: Array) -> Array:
    """Return the scales of the moving drivers' values [m or rad], shape (drivers,): a radian or the
    mechanism's size, or the largest number in the values.
    """
    size, given = (
        size_of(mechanism),
        np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=1, initial=0.0),
    )
    own = [1.0 if mechanism.driver(name).turns else size for name in path.motions]
    return np.maximum(
        np.maximum(own, given), [abs(path.design.get(name, 0.0)) for name in path.motions]
    )


def _start(path: Path, time: float, off: float) -> Start:
    first = float(path.times[0])
    name = (
        "the first sample"
        if time == first
        else "time zero"
        if time == 0.0
        else f"the sample at {time:.9g} s"
    )
    return Start(time, name, None if off <= CLOSED else path.lead_in(time), off <= TYPED)


def solve_from_start(
    start: Start,
    mechanism: Mechanism,
    path: Path,
    solve: Callable[[Start], Trajectory],
    *,
    compare: bool = True,
) -> Trajectory:
    """Solve from a start, or from the other one if no sample is reached; add notes on the
    assumptions.

    Args:
        solve: solves all samples from a start.
        compare: whether the numbers are exact enough to compare two starts.
    """
    found, taken, other = solve(start), start, start.other
    notes: list[str] = []
    if other is not None and not found.solved.any():
        second = solve(other)
        if second.solved.any():
            notes.append(f"no sample can be reached by way of {start.name} ({found.message})")
            found, taken = second, other
    elif other is not None and start.ambiguous and compare:
        notes += _differ(start, other, found, solve(other), size_of(mechanism))
    notes = [
        *found.details.get("notes", ()),
        *notes,
        *(notes_on_start(taken, path) if found.solved.any() else ()),
    ]
    return replace(
        found,
        details={**found.details, "start": taken.facts, **({"notes": notes} if notes else {})},
    )


def notes_on_start(start: Start, path: Path) -> list[str]:
    """Return notes on the assumed way from the design position to the path; none if it is on the
    path.
    """
    if start.stands:
        return []
    way = (
        f"all drivers go straight from it to {start.name} ({path.where(start.time)}), and are"
        " followed from there"
    )
    return [f"the design position is not on the path: {way}"]


def _differ(
    start: Start, other: Start, found: Trajectory, second: Trajectory, size: float
) -> list[str]:
    """Return a note on the difference of the motions from two starts; none if they are one."""
    both = found.solved & second.solved
    apart = [
        motion.position - second.points[name].position for name, motion in found.points.items()
    ]
    for name, body in found.bodies.items():
        apart += [body.r - second.bodies[name].r, size * _turned(body.p, second.bodies[name].p)]
    worst = max((float(np.abs(each[both]).max(initial=0.0)) for each in apart), default=0.0)
    if worst <= APART * size:
        return []
    return [
        f"AMBIGUOUS: by way of {other.name} the results differ by up to {worst:.6g} m (another"
        f" assembly, or another number of turns); {start.name} is taken; make the design position"
        " the pose at time zero, or begin the sweep there"
    ]


def _turned(p: Array, q: Array) -> Array:
    """Return how far two sets of Euler parameters are apart; p and -p are the same."""
    return np.minimum(np.abs(p - q).max(axis=1), np.abs(p + q).max(axis=1))
