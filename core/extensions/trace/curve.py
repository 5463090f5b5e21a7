"""Trace a motion along its own length, through limit points; the driver's value is a result.

A curve is closed if it passes its beginning again, in the same direction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...dataset import AXIS, Dataset, Variable
from ...errors import SolveError, number_of
from ...input_checks import names_of, require_kind, require_known, require_positive
from ...kinematics.compiled.compiled_model import recent_model
from ...kinematics.compiled.dense_equations import system_of
from ...kinematics.compiled.request import Request
from ...kinematics.continuation.pseudo_arclength import (
    LONGEST,
    MEETS,
    NODE,
    ArclengthWalk,
    CurvePoint,
    NearbyPoint,
    root_near,
    time_between,
    turns_back,
)
from ...kinematics.continuation.singular_poses import Singularity, examine
from ...kinematics.formulation.styles import NATIVE, require_style
from ...kinematics.structure.degrees_of_freedom import require_driven
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, Ramp
from ...tabular import Tabular
from ...trajectory import Array


@dataclass(frozen=True, eq=False)
class Event:
    """A singular pose on a curve.

    Attributes:
        arc: length from the beginning of the curve.
        value: of the driver, from the design position [m or rad].
        singularity: dependent rows, and motions possible with the driver held.
        points: position of the wanted points [m], shape (3,) each.
    """

    arc: float
    value: float
    singularity: Singularity
    points: Mapping[str, Array]

    @property
    def kind(self) -> str:
        """ "limit point" if the driver locks up and turns back; "branch point" if the motion may
        branch.
        """
        return "limit point" if self.singularity.lock_up else "branch point"


@dataclass(frozen=True, eq=False, repr=False)
class Curve(Tabular):
    """The motion of a mechanism along its own length, n poses.

    Attributes:
        driver: its name.
        arc: length from the design position, shape (n,); it falls from zero if the curve was traced
            backwards. The length of a step is the change of all unknowns: displacements in units of
            the mechanism's size, turns in radians.
        values: of the driver, from its design value [m or rad], shape (n,).
        sigma: smallest singular value of the rows, drivers included: distance from a singular pose
            [-], shape (n,).
        points: position by name [m], shape (n, 3).
        events: limit points and branch points, in order.
        closed: whether the curve came back to the design position, which is then the last pose too.
        message: empty, or the reason of an early end.
        unit: of the driver, m or rad.
    """

    driver: str
    arc: Array
    values: Array
    sigma: Array
    points: Mapping[str, Array]
    events: tuple[Event, ...]
    closed: bool
    message: str = ""
    unit: str = ""

    def summary(self) -> str:
        """Return the driver's range, the number of poses, and the singular ones."""
        low, high = self.values.min(initial=np.inf), self.values.max(initial=-np.inf)
        kinds = [each.kind for each in self.events]
        events = [number_of(kinds.count(kind), kind) for kind in dict.fromkeys(kinds)]
        span = f"{self.driver} from {low:.6g} to {high:.6g} {self.unit}".rstrip()
        shape = "closed" if self.closed else "open"
        return ", ".join(filter(None, [span, number_of(len(self.arc), "pose"), shape, *events]))

    def dataset(self) -> Dataset:
        """Return driver, points and distance from singularity over the length of the curve."""
        coords = {
            "arc": Variable("pose", self.arc),
            "point": Variable("point", [*self.points]),
            "axis": AXIS,
        }
        variables = {
            self.driver: Variable("pose", self.values, self.unit),
            "smallest_singular_value": Variable("pose", self.sigma),
        }
        if self.points:
            positions = np.stack([*self.points.values()], axis=1)
            variables["position"] = Variable(("pose", "point", "axis"), positions, "m")
        return Dataset(("pose",), coords, variables, "arc")


# The cosine of two directions above which they are the same way: below it the curve crosses itself.
SAME_WAY = 0.9
# Two poses are one if no number differs by more than this part of the longest step: far above
# rounding.
SAME_POSE = 0.02
# Length over which the direction of the beginning is measured, and rounds of the secant rule that
# look for it.
SMALL, ROUNDS = 1e-6, 8


def trace(
    mechanism: Mechanism,
    driver: str,
    *,
    length: float = 5.0,
    direction: int = 1,
    points: Sequence[str] | None = None,
    longest: float = LONGEST,
    tol: float = 1e-12,
    style: str = NATIVE,
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
    driven = partial(require_driven, mechanism)
    require_known("trace", "driver", [driver], mechanism.drivers, driven)
    if direction not in (1, -1):
        raise SolveError(
            f"trace: direction is {direction}, expected 1 (the driver's value grows) or -1 (it"
            " falls)"
        )
    for name, given in (("length", length), ("longest", longest), ("tol", tol)):
        require_positive("trace", name, given)
    every = [point.name for point in mechanism.points]
    wanted = names_of("trace", "points", every if points is None else points)
    require_known("trace", "point", wanted, mechanism.points)
    request = Request((driver,), wanted, order=0, style=require_style(style), compiled=False)
    model = recent_model(mechanism, request)
    system = system_of(model)
    walk = ArclengthWalk(system, Path({driver: Ramp(1.0)}, np.zeros(1)), tol)
    first = walk.begin(system.state(model.design[:, None], ahead=""), 0.0, direction)
    trail = _Trail(walk, first, longest)
    trail.follow(length)
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
        sigma=np.linalg.svd(system.equations(*_stack(walk, spots)).jacobian)[1][:, -1],
        points=_points(walk, spots),
        events=tuple(trail.events),
        closed=trail.closed,
        message=message,
        unit="rad" if mechanism.driver(driver).turns else "m",
    )


class _Trail:
    """The spots of a walk, and the events between them.

    Attributes:
        length: of a closed curve; infinite until it is known to be one.
    """

    def __init__(self, walk: ArclengthWalk, first: CurvePoint, longest: float) -> None:
        self.walk, self.first, self.longest = walk, first, longest
        self.spots, self.events, self.length = [first], list[Event](), np.inf
        # the plane across the curve at its beginning
        self._poses = walk.system.poses(first.state)
        after = walk.system.poses(walk.system.stepped(first.state, SMALL * first.dq[:, None]))
        self._way = (after - self._poses) / SMALL

    @property
    def closed(self) -> bool:
        """Whether the walk came back to its first spot."""
        return self.length < np.inf

    def follow(self, length: float) -> None:
        """Walk up to a length, or until the curve closes."""
        for spot in self.walk.spots_after(self.first, length, self.longest):
            before = self.spots[-1]
            closing = self._closing_spot(before, spot)
            after = closing or spot
            self.spots.append(after)
            if turns_back(before, after):
                self.events.append(_event(self.walk, self.walk.limit(before, after)))
            if closing is not None:
                self.length = closing.arc
                break
        self._note_branches()
        self.events.sort(key=lambda event: event.arc)

    def _closing_spot(self, before: CurvePoint, after: CurvePoint) -> CurvePoint | None:
        """Return the beginning as a spot at its length on the curve if the step between two spots
        passes it, else None.
        """
        if float(self.first.dq @ after.dq) < SAME_WAY:
            return None
        change, change_after = self._change(before), self._change(after)
        ahead, beyond = self._length_along(change), -self._length_along(change_after)
        if not (ahead > 0.0 <= beyond and np.abs(change_after).max() <= 2.0 * self.longest):
            return None
        share = ahead / (ahead + beyond)
        apart = np.abs((1.0 - share) * change + share * change_after).max()
        spot: CurvePoint | None = None
        h = share * (after.arc - before.arc)
        for _ in range(ROUNDS):
            spot = self.walk.advance(before, h)
            # beside a branch point: where it is between the two spots is known well enough
            if spot is None:
                break
            change = self._change(spot)
            gap, apart = self._length_along(change), np.abs(change).max()
            h += gap
            if abs(gap) <= SMALL * SMALL:
                break
        if apart > SAME_POSE * self.longest:
            return None
        turned = before.time + share * (after.time - before.time) if spot is None else spot.time
        return replace(self.first, arc=before.arc + h, time=turned)

    def _change(self, spot: CurvePoint) -> Array:
        """Return the change from the pose of a spot to the beginning; Euler parameters p and -p are
        the same.
        """
        there = self.walk.system.poses(spot.state)
        there[:, 3:] *= np.where(
            (there[:, 3:] * self._poses[:, 3:]).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0
        )
        return self._poses - there

    def _length_along(self, change: Array) -> float:
        """Return the length of a change along the curve, to first order."""
        return float((change * self._way).sum() / (self._way * self._way).sum())

    def _note_branches(self) -> None:
        """Add branch points: sigma is least at a spot, or the determinant changes its sign."""
        spots, first, last = self._with_neighbours(), self.spots[0], self.spots[-1]
        for one, two, three in zip(spots, spots[1:], spots[2:], strict=False):
            least = two.sigma < min(one.sigma, three.sigma)
            if not least and not (two.sign != three.sign and two.sigma > three.sigma):
                continue
            found = _branch_point(self.walk, one, three)
            if found is None or not first.arc <= (arc := found.arc % self.length) <= last.arc:
                continue
            # each is seen from both sides
            ways = [abs(arc - other.arc) for other in self.events]
            if any(min(way, self.length - way) <= NODE for way in ways):
                continue
            turned = last.time - first.time if found.arc > last.arc else 0.0
            event = _event(self.walk, replace(found, arc=arc, time=found.time - turned))
            if not event.singularity.regular:
                self.events.append(event)

    def _with_neighbours(self) -> list[CurvePoint]:
        """Return the spots, and one before the first and after the last: a branch point is seen by
        the spots on both sides of it.
        """
        first, second, last = self.spots[0], self.spots[1:2], self.spots[-1]
        if self.closed:
            (after,) = second
            time = after.time + last.time - first.time
            return [*self.spots, replace(after, arc=after.arc + self.length, time=time)]
        h = second[0].arc - first.arc if second else NODE
        before, after = self.walk.advance(first, -h), self.walk.advance(last, h)
        return [*filter(None, (before, *self.spots, after))]


def _event(walk: ArclengthWalk, found: NearbyPoint) -> Event:
    spot = found.spot
    singularity = examine(walk.system, spot.state, walk.sample(spot.time))
    points = {name: places[0] for name, places in _points(walk, [spot]).items()}
    return Event(found.arc, found.time, singularity, points)


def _stack(walk: ArclengthWalk, spots: Sequence[CurvePoint]) -> tuple[Array, Array]:
    """Return states and samples of spots, shapes (numbers, spots) and (sampled, spots)."""
    state = np.concatenate([spot.state for spot in spots], axis=1)
    return state, np.concatenate([walk.sample(spot.time) for spot in spots], axis=1)


def _points(walk: ArclengthWalk, spots: Sequence[CurvePoint]) -> dict[str, Array]:
    zero = np.zeros((walk.system.unknowns, len(spots)))
    found = walk.system.outputs(*_stack(walk, spots), zero, zero)
    return {name: found[f"position {name}"].T for name in walk.system.tracer.request.points}


def _branch_point(walk: ArclengthWalk, before: CurvePoint, after: CurvePoint) -> NearbyPoint | None:
    """Return the branch point between two spots, or None.

    Corrections do not converge there, but sigma falls to zero linearly on both sides: with its
    sign changed on one side it is smooth, and its zero is interpolated. A minimum of sigma
    other than zero has no such line.
    """
    centre = _least(walk, before, after.arc - before.arc)
    nodes = walk.nodes(before, after, centre)
    if nodes is None:
        return None
    offsets, spots = nodes
    signed = np.sign(offsets) * np.array([spot.sigma for spot in spots])
    from_left, from_right, root = (
        root_near(offsets[kept], signed[kept]) for kept in (slice(4), slice(4, 8), slice(8))
    )
    if not abs(from_left - from_right) <= MEETS:
        return None
    return NearbyPoint(spots[3], before.arc + centre + root, time_between(offsets, spots, root))


def _least(walk: ArclengthWalk, before: CurvePoint, length: float) -> float:
    """Return the length to the least sigma, by golden section; 0 stands for unreached poses."""
    part = 0.5 * (np.sqrt(5.0) - 1.0)
    a, b = 0.0, length
    while b - a > 0.01 * length:
        c, d = b - part * (b - a), a + part * (b - a)
        spots = walk.advance(before, c), walk.advance(before, d)
        at_c, at_d = (spot.sigma if spot else 0.0 for spot in spots)
        a, b = (a, d) if at_c < at_d else (c, b)
    return 0.5 * (a + b)
