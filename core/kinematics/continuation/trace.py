"""Trace a motion along its own length, through limit points; the driver's value is a result."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from ...errors import SolveError
from ...input_checks import names_of, no_such, require_kind, require_positive
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, Ramp
from ...trajectory import Array
from ..compiled.compiled_model import recent_model
from ..compiled.dense_equations import System, system_of
from ..compiled.request import Request
from ..formulation.constraints import Style
from ..structure.driver_count import require_driven
from .curve import Curve, Event
from .curve_start import Beginning
from .pseudo_arclength import NODE, ArclengthWalk, Beside, Spot
from .singularity import examine

# A step is at most this long [units of the mechanism's size, rad]: poses far enough apart to be
# cheap, near enough to be drawn.
LONGEST = 0.05


@dataclass
class _Trail:
    """Spots of a walk, and events between them.

    Attributes:
        length: of a closed curve; infinite until it is known to be one.
    """

    spots: list[Spot]
    events: list[Event] = field(default_factory=list[Event])
    length: float = np.inf

    @property
    def closed(self) -> bool:
        """Whether the walk came back to its first spot."""
        return self.length < np.inf


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
    """Trace the motion from the design position; further drivers hold their design value.

    Args:
        mechanism: to trace.
        driver: whose value is given along the curve.
        length: to trace [units of the mechanism's size, rad]; a closed curve ends before it, at
            design.
        direction: 1 to start with the driver's value growing, -1 with it falling.
        points: names of the points whose positions are wanted; all unless given.
        longest: longest step.
        tol: largest accepted constraint residual, relative to the mechanism's size.
        style: how the rows are written, as for `solve`.

    Raises:
        SolveError: drivers and degrees of freedom do not match, the mechanism does not close at the
            design position, or an argument is invalid.
    """
    require_kind("trace", "mechanism", mechanism, Mechanism)
    if driver not in (drivers := [each.name for each in mechanism.drivers]):
        require_driven(mechanism)
        raise no_such("trace", "driver", driver, drivers)
    if direction not in (1, -1):
        raise SolveError(
            f"trace: direction is {direction}, expected 1 (the driver's value grows) or -1 (it"
            " falls)"
        )
    for name, given in (("length", length), ("longest", longest), ("tol", tol)):
        require_positive("trace", name, given)
    there = [point.name for point in mechanism.points]
    wanted = names_of("trace", "points", there if points is None else points)
    for name in wanted:
        if name not in there:
            raise no_such("trace", "point", name, there)
    request = Request((driver,), wanted, order=0, style=Style(style), compiled=False)
    model = recent_model(mechanism, request)
    system = system_of(model)
    walk = ArclengthWalk(system, Path({driver: Ramp(1.0)}, np.zeros(1)), tol)
    trail = _walked(
        walk,
        walk.begin(system.state(model.design[:, None], ahead=""), 0.0, direction),
        length,
        longest,
    )
    spots, reached = trail.spots, trail.spots[-1].arc
    message = (
        ""
        if trail.closed or reached >= length
        else (
            f"ends at the length {reached:.6g} of {length:.6g}, {driver} = {spots[-1].time:.9g}: no"
            " pose is found ahead; smallest singular value of the rows without their driver"
            f" {spots[-1].sigma:.3g}"
        )
    )
    return Curve(
        driver=driver,
        arc=direction * np.array([spot.arc for spot in spots]),
        values=np.array([spot.time for spot in spots]),
        sigma=_sigma(walk, spots),
        points=_points(walk, spots),
        events=tuple(trail.events),
        closed=trail.closed,
        message=message,
        unit="rad" if mechanism.driver(driver).turns else "m",
    )


def limit_ahead(
    system: System, path: Path, state: Array, time: float, direction: int, tol: float
) -> Event | None:
    """Return the limit point close ahead of a pose in a direction of time, or None."""
    walk = ArclengthWalk(system, path, tol)
    try:
        spot = walk.begin(state, time, direction)
    except np.linalg.LinAlgError:
        return None
    for before, after in pairwise(_from(spot, walk.along(spot, NEARBY, LONGEST, ATTEMPTS))):
        if _turns_back(before, after):
            return _event(walk, walk.limit(before, after))
    return None


# A march that fails is left this near [units of the mechanism's size, rad] to the limit point that
# stopped it, or it was something else.
NEARBY = 0.5
# Ten times the steps that such a way takes; equations whose rows are wrong would have it creep on
# and on.
ATTEMPTS = 100


def _from(first: Spot, others: Iterator[Spot]) -> Iterator[Spot]:
    yield first
    yield from others


def _walked(walk: ArclengthWalk, first: Spot, length: float, longest: float) -> _Trail:
    trail, beginning = _Trail([first]), Beginning(walk, first, longest)
    for spot in walk.along(first, length, longest):
        closing = beginning.passed(trail.spots[-1], spot)
        trail.spots.append(closing or spot)
        _note_limit(walk, trail)
        if closing is not None:
            trail.length = closing.arc
            break
    _note_branches(walk, trail)
    trail.events.sort(key=lambda event: event.arc)
    return trail


def _turns_back(before: Spot, after: Spot) -> bool:
    """Return whether the driver's value is stationary between two spots; a spot counts once."""
    return (before.dt < 0.0) != (after.dt < 0.0)


def _note_limit(walk: ArclengthWalk, trail: _Trail) -> None:
    """Add the limit point between the last spots, if there is one."""
    before, after = trail.spots[-2:]
    if _turns_back(before, after):
        trail.events.append(_event(walk, walk.limit(before, after)))


def _note_branches(walk: ArclengthWalk, trail: _Trail) -> None:
    """Add branch points: sigma is least at a spot, or the determinant changes sign beside it."""
    spots = _with_neighbours(walk, trail)
    for one, two, three in zip(spots, spots[1:], spots[2:], strict=False):
        if two.sigma < min(one.sigma, three.sigma) or (
            two.sign != three.sign and two.sigma > three.sigma
        ):
            found = walk.branching(one, three)
            if (
                found is None
                or not trail.spots[0].arc
                <= (arc := found.arc % trail.length)
                <= trail.spots[-1].arc
            ):
                continue
            if any(_apart(arc, other.arc, trail.length) <= NODE for other in trail.events):
                continue  # it is seen from both sides
            turned = (
                trail.spots[-1].time - trail.spots[0].time
                if found.arc > trail.spots[-1].arc
                else 0.0
            )
            event = _event(walk, replace(found, arc=arc, time=found.time - turned))
            if not event.singularity.regular:
                trail.events.append(event)


def _with_neighbours(walk: ArclengthWalk, trail: _Trail) -> list[Spot]:
    """Return the spots, and one before the first and after the last: a branch point is seen by the
    spots on both sides of it.
    """
    first, last = trail.spots[0], trail.spots[-1]
    if trail.closed:
        after = trail.spots[1]
        again = replace(
            after, arc=after.arc + trail.length, time=after.time + last.time - first.time
        )
        return [*trail.spots, again]
    h = trail.spots[1].arc - first.arc if len(trail.spots) > 1 else NODE
    beside = walk.advance(first, -h), walk.advance(last, h)
    return [*([beside[0]] if beside[0] else []), *trail.spots, *([beside[1]] if beside[1] else [])]


def _apart(a: float, b: float, length: float) -> float:
    """Return how far two places are apart on a curve, of that length if it is closed."""
    way = abs(a - b)
    return min(way, length - way)


def _event(walk: ArclengthWalk, found: Beside) -> Event:
    spot = found.spot
    return Event(
        found.arc,
        found.time,
        examine(walk.system, spot.state, walk.sample(spot.time)),
        _at(walk, spot),
    )


def _at(walk: ArclengthWalk, spot: Spot) -> dict[str, Array]:
    return {name: found[0] for name, found in _points(walk, [spot]).items()}


def _sigma(walk: ArclengthWalk, spots: Sequence[Spot]) -> Array:
    """Return the smallest singular value of the kept rows at spots, shape (spots,)."""
    sigma = np.linalg.svd(walk.system.equations(*_stacked(walk, spots)).jacobian)[1]
    return np.asarray(sigma[:, -1], dtype=np.float64)


def _stacked(walk: ArclengthWalk, spots: Sequence[Spot]) -> tuple[Array, Array]:
    """Return states and samples of spots, shapes (numbers, spots) and (sampled, spots)."""
    state = np.concatenate([spot.state for spot in spots], axis=1)
    return state, np.concatenate([walk.sample(spot.time) for spot in spots], axis=1)


def _points(walk: ArclengthWalk, spots: Sequence[Spot]) -> dict[str, Array]:
    zero = np.zeros((walk.system.unknowns, len(spots)))
    found = walk.system.outputs(*_stacked(walk, spots), zero, zero)
    return {name: found[f"position {name}"].T for name in walk.system.tracer.request.points}
