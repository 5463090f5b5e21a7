"""Trace a mechanism along the length of its motion, with the driver's value as an outcome: through limit points and beyond."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ...errors import SolveError
from ...given import no_such, require_positive
from ...mechanism import Mechanism
from ...motions import Path, Ramp
from ...trajectory import Array
from ..equations.constraints import Style
from ..model import compile_model
from ..request import Request
from ..structure.driven import require_driven
from ..system import System
from .arclength import NODE, ArclengthWalk, Beside, Spot
from .singularity import Singularity, examine

# A step is at most this long [units of the mechanism's size, rad]: poses far enough apart to be cheap, near enough to be drawn.
LONGEST = 0.05
# A curve closes where it passes its beginning again, going the same way: the cosine of the two directions is above this there, and
# below it where the curve crosses itself. In the first steps, so many of the longest, it has not left its beginning yet.
SAME_WAY, BEGINNING = 0.9, 4.0


@dataclass(frozen=True, eq=False)
class Event:
    """A singular pose on a curve.

    Attributes:
        arc: length from where the curve begins.
        value: of the driver, from the design position [m or rad].
        singularity: which rows depend on each other there, and what moves with the driver held.
        points: position of the wanted points [m], shape (3,) each.
    """

    arc: float
    value: float
    singularity: Singularity
    points: Mapping[str, Array]

    @property
    def kind(self) -> str:
        """A limit point is where the driver locks up and turns back; at a branch point the motion may go on in several ways."""
        return "limit point" if self.singularity.lock_up else "branch point"


@dataclass(frozen=True, eq=False)
class Curve:
    """The motion of a mechanism along its own length, n poses.

    Attributes:
        driver: its name.
        arc: length from the design position, falling from zero where the curve was traced backwards, shape (n,). The length of a
            step is that of all unknowns: displacements in units of the mechanism's size, turns in radians.
        values: of the driver, from its design value [m or rad], shape (n,).
        sigma: smallest singular value of the rows, drivers included: how near a singular pose is [-], shape (n,).
        points: position by name [m], shape (n, 3).
        events: limit points and branch points, in order.
        closed: whether it came back to the design position.
        message: empty, or why it ends before its length.
    """

    driver: str
    arc: Array
    values: Array
    sigma: Array
    points: Mapping[str, Array]
    events: tuple[Event, ...]
    closed: bool
    message: str = ""


@dataclass
class _Trail:
    """Spots of a walk, and events between them."""

    spots: list[Spot]
    events: list[Event] = field(default_factory=list[Event])
    closed: bool = False


def trace(
    mechanism: Mechanism,
    driver: str,
    *,
    length: float = 5.0,
    direction: int = 1,
    points: Sequence[str] | None = None,
    longest: float = LONGEST,
    tol: float = 1e-12,
    style: str = "native",
) -> Curve:
    """Trace the motion from the design position, whatever the driver does on the way; further drivers hold their design value.

    Args:
        mechanism: what to trace.
        driver: whose value is given along the curve.
        length: to trace [units of the mechanism's size, rad]; it ends before where it is back at the design position.
        direction: 1 to start with the driver's value growing, -1 with it falling.
        points: names of the points whose positions are wanted; all of them unless given.
        longest: step.
        tol: largest accepted constraint residual, relative to the mechanism's size.
        style: how the rows are written, as for `solve`.

    Raises:
        SolveError: drivers and degrees of freedom do not match, the mechanism does not close at the design position, or an
            argument makes no sense.
    """
    if driver not in (drivers := [each.name for each in mechanism.drivers]):
        require_driven(mechanism)
        raise no_such("trace", "driver", driver, drivers)
    if direction not in (1, -1):
        raise SolveError(f"trace: direction is {direction}, expected 1 (the driver's value grows) or -1 (it falls)")
    for name, given in (("length", length), ("longest", longest), ("tol", tol)):
        require_positive("trace", name, given)
    there = [point.name for point in mechanism.points]
    wanted = tuple(there if points is None else points)
    for name in wanted:
        if name not in there:
            raise no_such("trace", "point", name, there)
    request = Request((driver,), wanted, order=0, style=Style(style), compiled=False)
    model = compile_model(mechanism, request)
    system = System(model)
    walk = ArclengthWalk(system, Path({driver: Ramp(1.0)}, np.zeros(1)), tol)
    trail = _walked(walk, walk.begin(system.state(model.design[:, None], ahead=""), 0.0, direction), length, longest)
    spots, reached = trail.spots, trail.spots[-1].arc
    message = (
        ""
        if trail.closed or reached >= length
        else (
            f"ends at the length {reached:.6g} of {length:.6g}, {driver} = {spots[-1].time:.9g}: no pose is found ahead; "
            f"smallest singular value of the rows without their driver {spots[-1].sigma:.3g}"
        )
    )
    return Curve(
        driver=driver,
        arc=direction * np.array([spot.arc for spot in spots]),
        values=np.array([spot.time for spot in spots]),
        sigma=np.array([examine(system, spot.state, walk.sample(spot.time)).sigma for spot in spots]),
        points=_points(walk, spots),
        events=tuple(trail.events),
        closed=trail.closed,
        message=message,
    )


def limit_ahead(system: System, path: Path, state: Array, time: float, direction: int, tol: float) -> Event | None:
    """The limit point that a pose of a path is close to, going on in a direction of time; None where there is none nearby."""
    walk = ArclengthWalk(system, path, tol)
    try:
        spot = walk.begin(state, time, direction)
    except np.linalg.LinAlgError:
        return None
    for before, after in pairwise(_from(spot, walk.along(spot, NEARBY, LONGEST, ATTEMPTS))):
        if before.dt * after.dt < 0.0:
            return _event(walk, walk.limit(before, after))
    return None


# A march that fails is left this near [units of the mechanism's size, rad] to the limit point that stopped it, or it was something
# else.
NEARBY = 0.5
# Ten times the steps that such a way takes; equations whose rows are wrong would have it creep on and on.
ATTEMPTS = 100


def _from(first: Spot, others: Iterator[Spot]) -> Iterator[Spot]:
    yield first
    yield from others


def _walked(walk: ArclengthWalk, first: Spot, length: float, longest: float) -> _Trail:
    trail = _Trail([first])
    for spot in walk.along(first, length, longest):
        trail.spots.append(spot)
        _note(walk, trail)
        if spot.arc > BEGINNING * longest and _back(walk.system, first, spot, longest):
            trail.closed = True
            break
    trail.events.sort(key=lambda event: event.arc)
    return trail


def _note(walk: ArclengthWalk, trail: _Trail) -> None:
    """Add what lies between the last spots."""
    before, after = trail.spots[-2:]
    if before.dt * after.dt < 0.0:
        trail.events.append(_event(walk, walk.limit(before, after)))
    if len(trail.spots) < 3:
        return
    # sigma is least at the middle one, or the determinant changes its sign beside it: both are seen at a simple branch point
    one, two, three = trail.spots[-3:]
    if two.sigma < min(one.sigma, three.sigma) or (two.sign != three.sign and two.sigma > three.sigma):
        found = walk.branching(one, three)
        if found is not None and all(abs(found.arc - other.arc) > NODE for other in trail.events):  # it may be seen from both sides
            event = _event(walk, found)
            if not event.singularity.regular:
                trail.events.append(event)


def _event(walk: ArclengthWalk, found: Beside) -> Event:
    spot = found.spot
    return Event(found.arc, found.time, examine(walk.system, spot.state, walk.sample(spot.time)), _at(walk, spot))


def _at(walk: ArclengthWalk, spot: Spot) -> dict[str, Array]:
    return {name: found[0] for name, found in _points(walk, [spot]).items()}


def _points(walk: ArclengthWalk, spots: Sequence[Spot]) -> dict[str, Array]:
    state = np.concatenate([spot.state for spot in spots], axis=1)
    sample = np.concatenate([walk.sample(spot.time) for spot in spots], axis=1)
    zero = np.zeros((len(spots), walk.system.unknowns))
    found = walk.system.outputs(state, sample, zero, zero)
    return {name: found[f"position {name}"].T for name in walk.system.model.request.points}


def _back(system: System, first: Spot, spot: Spot, longest: float) -> bool:
    """Whether the next step would pass where the curve began: there, and going the same way."""
    return system.apart(first.state, spot.state) < longest and float(first.dq @ spot.dq) > SAME_WAY
