"""Forces of a solved motion, reactions of joints and efforts of drivers; defects of a motion from
any source, by the constraints of the mechanism.

All samples are evaluated at once, as numpy lanes. Singular values show singular poses and the
forces left undetermined by redundant rows.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...algebra import ZERO, Scalar, Vec3, angle_about, cross, quat, vec
from ...errors import SolveError
from ...forces import AMPLIFIED, Forces, Multipliers, Reaction, in_wrenches
from ...joints.base import Joint, unit
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Driver, JointDriver, Path
from ...primitives.base import GROUND_POSE, Drive, Pose, Twist
from ...trajectory import QUANTITIES, Array, BodyMotion, Trajectory
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import constraints_left_out, frames
from ..formulation.formulation import Acceleration, Configuration
from ..formulation.state_vectors import displaced, drive_numbers, state_of
from .equations import Applied, BodyStates, ForceEquations, at_work, powers
from .wanted import wanted_forces

Follow: TypeAlias = Callable[[str, Array, Array], Array]
"""Returns the angle of a joint with all its turns, of its name, its angle counted by rates and its
rate at the solved samples [rad, rad/s].
"""


class MotionLanes:
    """The motion at the solved samples: states of the bodies and of force elements, as lanes.

    Attributes:
        frame, times, n: frames of the mechanism, times of the solved samples [s], and their number.
        poses: poses of the moving bodies.
        at: poses, twists and accelerations.
        drive: value from design, velocity and acceleration of every driver [SI], shape
            (3, drivers, n).
        values, rates: value from design and velocity, by driver.
        applied: force elements at work, by name.

    Raises:
        SolveError: the motion lacks a body or its accelerations.
    """

    def __init__(
        self, mechanism: Mechanism, path: Path, motion: Trajectory, follow: Follow | None = None
    ) -> None:
        self._follow = follow
        self.mechanism, self.frame = mechanism, frames(mechanism)
        solved = motion.solved
        self.times: Array = path.times[solved]
        self.n = len(self.times)
        self.poses = self._poses(motion)
        self.at = self._states(motion)
        names = [driver.name for driver in mechanism.drivers]
        self.drive = path.drive(names, self.times) if names else np.empty((3, 0, self.n))
        self.rates = dict(zip(names, self.drive[1], strict=True))
        self.values = dict(zip(names, self.drive[0], strict=True))
        self.applied: Mapping[str, Applied] = at_work(mechanism, self.at, self.angle)

    def _poses(self, motion: Trajectory) -> dict[str, Pose]:
        missing = [body.name for body in self.mechanism.moving if body.name not in motion.bodies]
        if missing:
            raise SolveError(f"forces: the motion of body {missing[0]!r} is missing")
        placed = {
            name: (each.r[motion.solved], each.p[motion.solved])
            for name, each in motion.bodies.items()
        }
        return displaced(self.mechanism, self.frame, placed)

    def _states(self, motion: Trajectory) -> BodyStates:
        solved = motion.solved
        twists, accelerations = dict[str, Twist](), dict[str, Acceleration]()
        for body in self.mechanism.moving:
            moved = motion.bodies[body.name]
            if moved.v is None or moved.a is None:
                raise SolveError(f"forces: body {body.name!r} has no accelerations; give order 2")
            frame = Pose.of(ZERO, quat(moved.p[solved].T))
            v, a = moved.v[solved].T, moved.a[solved].T
            w, w_t = frame.turn(vec([*v[3:]])), frame.turn(vec([*a[3:]]))
            arm = self.poses[body.name].turn(self.frame.arm(body.name, body.origin))
            per_unit = 1.0 / self.frame.unit
            twists[body.name] = Twist(per_unit * vec([*v[:3]]) - cross(w, arm), w)
            # the origin's acceleration, less the part of the arm from the internal origin
            added = Acceleration(ZERO, w_t).of(arm, twists[body.name])
            accelerations[body.name] = Acceleration(per_unit * vec([*a[:3]]) - added, w_t)
        return BodyStates(self.frame, self.poses, twists, accelerations)

    def angle(self, name: str) -> Array:
        """Return the angle of a joint over the samples [rad], continuous, zero at design.

        The angle of a driven joint, or of a joint geared to one, is exact. Other angles follow the
        rates from the sample nearest to the design, and `follow` corrects their turns.
        """
        known = self._driven.get((name, "rotation"))
        if known is not None or not self.n:
            return np.zeros(0) if known is None else known
        joint: Any = self.mechanism.joint(name)
        i, j = (self.poses.get(body, GROUND_POSE) for body in joint.bodies)
        axis = vec([*unit(joint.axis)])
        order = np.argsort(self.times, kind="stable")
        angle: Array = (angle_about(axis, i.q.conjugate() * j.q) + np.zeros(self.n))[order]
        spin = self.at.spin(joint.j) - self.at.spin(joint.i)
        along = self.at.turned(joint.i, [*unit(joint.axis)])
        rate: Array = (along @ spin + np.zeros(self.n))[order]
        expected = 0.5 * (rate[1:] + rate[:-1]) * np.diff(self.times[order])
        jumps: Array = np.round((expected - np.diff(angle)) / (2.0 * np.pi))
        turned = angle.copy()
        turned[1:] += 2.0 * np.pi * np.cumsum(jumps)
        nearest = float(turned[int(np.argmin(np.abs(self.times[order])))])
        continuous, rates = np.empty(self.n), np.empty(self.n)
        continuous[order] = turned - 2.0 * np.pi * round(nearest / (2.0 * np.pi))
        rates[order] = rate
        return self._follow(name, continuous, rates) if self._follow else continuous

    @cached_property
    def _driven(self) -> Mapping[tuple[str, str], Array]:
        """Return coordinates given by drivers or their couplers: joint and freedom -> value."""
        found: dict[tuple[str, str], Array] = {
            (each.joint, each.freedom): self.values[each.name]
            for each in self.mechanism.drivers
            if isinstance(each, JointDriver)
        }
        for _ in self.mechanism.couplers:  # a chain is as long as their number
            for coupler in self.mechanism.couplers:
                if coupler.curve:  # not linear: the rates give the angles of its joints
                    continue
                weights = {(one, freedom): k for one, freedom, k in coupler.terms}
                unknown = weights.keys() - found.keys()
                if len(unknown) == 1:
                    (other,) = unknown
                    b = weights.pop(other)
                    found[other] = sum(
                        (-a / b * found[one] for one, a in weights.items()), np.zeros(self.n)
                    )
        return found


# Size limit of the matrices solved at once, in numbers over all samples: some 64 MB.
AT_ONCE = 8_000_000


class ForceRows:
    """The equations of forces at all samples as lanes, solved by singular values.

    Rows left out within digits come last: they carry nothing, and count in the self-stress.
    """

    def __init__(self, lanes: MotionLanes, freedoms: int = 0) -> None:
        self.lanes, mechanism, frame = lanes, lanes.mechanism, lanes.frame
        self._freedoms = freedoms
        numbers = drive_numbers(mechanism.drivers, lanes.drive, frame.unit)
        drives = {
            driver.name: Drive(*numbers[5 * k : 5 * k + 5])
            for k, driver in enumerate(mechanism.drivers)
        }
        self.formulation = Cartesian.of(mechanism, frame, drives)
        left_out = Cartesian(constraints_left_out(mechanism, frame), frame.moving)
        self.equations = ForceEquations(
            mechanism, self.formulation, self._configuration(), lanes.at, lanes.applied, left_out
        )

    def _configuration(self) -> Configuration:
        lanes = self.lanes
        state = state_of(self.formulation, lanes.mechanism, lanes.frame, lanes.poses, lanes.values)
        return self.formulation.configuration(state)

    @cached_property
    def matrix(self) -> Array:
        """Return the Jacobian of all rows, lengths in the unit of the frames.

        Shape (n, rows, unknowns).
        """
        rows = self.equations.rows
        found = np.zeros((self.lanes.n, len(rows), self.formulation.unknowns))
        for k, row in enumerate(rows):
            for column, value in row.items():
                found[:, k, column] = value
        return found

    @cached_property
    def demand(self) -> Array:
        """Return M a + h - Q by the unknowns [J], shape (n, unknowns)."""
        return self.stacked(self.equations.demand)

    def solve(self) -> Multipliers:
        """Return the multipliers at all samples [J]."""
        n, rows, unknowns = self.matrix.shape
        step = max(1, AT_ONCE // max(1, rows * unknowns))
        parts = [self._solve(slice(k, k + step)) for k in range(0, max(1, n), step)]
        columns = [[getattr(part, each.name) for part in parts] for each in fields(Multipliers)]
        return Multipliers(*map(np.concatenate, columns))

    def _solve(self, part: slice) -> Multipliers:
        rows, demand = self.matrix[part], self.demand[part]
        inverse = _inverse(rows)
        if inverse is not None:
            values, n = np.einsum("nur,nu->nr", inverse, demand), len(rows)
            one = np.ones(n)
            return Multipliers(values, np.empty((*values.shape, 0)), np.zeros(n), one, one, one)
        last = len(self.formulation.owners)
        drivers = range(last - len(self.lanes.mechanism.drivers), last)
        return Multipliers.of(rows, demand, drivers, rows.shape[1] - last, self._freedoms)

    def wrench(self, joint: Joint, multipliers: Array) -> tuple[Array, Array]:
        """Return force [J / unit of the frames] and moment [N m] of a joint, shape (n, 3) each.

        They act on the joint's second body, about the joint's point carried by this body.
        """
        pair: tuple[Vec3, Vec3] = self.equations.reaction(joint, [*multipliers.T])
        return self.stacked(pair[0]), self.stacked(pair[1])

    def free(self, joint: Joint, found: Multipliers) -> Array:
        """Return the undetermined directions of a joint's wrench, shape (n, 6, redundant rows)."""
        columns = np.moveaxis(found.free, 2, 0)
        each = [np.hstack(self.wrench(joint, multipliers)) for multipliers in columns]
        return np.stack(each, axis=2) if each else np.empty((self.lanes.n, 6, 0))

    def effort(self, driver: Driver, found: Multipliers) -> Array:
        """Return the effort of a driver [N or N m], shape (n,)."""
        effort: Array = self.equations.effort(driver, [*found.values.T])
        return effort + np.zeros(self.lanes.n)

    def stacked(self, values: Iterable[Scalar]) -> Array:
        """Return scalars over the samples as columns, shape (n, len(values))."""
        return np.stack([x + np.zeros(self.lanes.n) for x in values], axis=1)


def _inverse(rows: Array) -> Array | None:
    """Return the inverses of square matrices, shape (n, size, size).

    Return None if they are not square or one may be nearly singular: singular values must decide
    then. Inversion takes a tenth of their time.
    """
    if rows.shape[1] != rows.shape[2]:
        return None
    try:
        found: Array = np.asarray(np.linalg.inv(rows), np.float64)
    except np.linalg.LinAlgError:
        return None
    # the ratio of singular values is at most the size times this condition
    condition = np.abs(rows).sum(axis=1).max(axis=1) * np.abs(found).sum(axis=1).max(axis=1)
    return found if (rows.shape[1] * condition < AMPLIFIED).all() else None


Lanes: TypeAlias = NDArray[np.bool_]


def with_forces(
    mechanism: Mechanism,
    path: Path,
    motion: Trajectory,
    names: Collection[str] | None = None,
    bodies: Collection[str] = (),
    follow: Follow | None = None,
) -> Trajectory:
    """Return a solved motion with its forces and only the named bodies; see `forces_of`."""
    found = forces_of(mechanism, path, motion, names, follow)
    return Trajectory(
        motion.points,
        motion.solved,
        motion.iterations,
        motion.residual,
        "; ".join(filter(None, (motion.message, found.message))),
        motion.details,
        {name: motion.bodies[name] for name in bodies},
        found,
        failures=motion.failures,
    )


def forces_of(
    mechanism: Mechanism,
    path: Path,
    motion: Trajectory,
    names: Collection[str] | None = None,
    follow: Follow | None = None,
    freedoms: int = 0,
) -> Forces:
    """Return the forces of a solved motion.

    Args:
        mechanism: mechanism with masses, gravity and force elements.
        path: drivers' path followed by the motion.
        motion: motion of all moving bodies, with accelerations.
        names: names of joints, drivers and force elements; by default all.
        follow: counts the turns of joints with torsional springs; by default their rates do.
        freedoms: number of degrees of freedom that no driver holds, in a free motion.

    Raises:
        SolveError: a name is unknown, or the motion lacks a body.
    """
    wanted = wanted_forces(mechanism, names)
    solved = motion.solved
    lanes = MotionLanes(mechanism, path, motion, follow)
    lines = ForceRows(lanes, freedoms)
    solution = lines.solve()
    efforts = {each.name: lines.effort(each, solution) for each in mechanism.drivers}
    elements = {name: each.amount + np.zeros(lanes.n) for name, each in lanes.applied.items()}
    every = powers(mechanism, lanes.at, lanes.applied, efforts, lanes.rates)
    # its shape is given: without a mass, or without a solved sample, the list alone has none
    table: Array = np.array([each + np.zeros(lanes.n) for each in every])
    table = table.reshape(len(every), lanes.n)
    spread = _Spread(solved, solution.singular)
    joints = [j for j in mechanism.given_joints if mechanism.reduced or j.name in wanted.joints]
    free = {joint.name: lines.free(joint, solution) for joint in joints}
    if mechanism.reduced:
        free = in_wrenches(free, solution.known)
    known = spread(solution.known)

    def reaction(name: str) -> Reaction:
        force, moment = map(spread, lines.wrench(mechanism.joint(name), solution.values))
        return Reaction(force / lanes.frame.unit, moment, spread(free[name]), known)

    return Forces(
        {name: reaction(name) for name in wanted.joints},
        {name: spread(efforts[name]) for name in wanted.drivers},
        {name: spread(elements[name], ill=False) for name in wanted.elements},
        spread(table.sum(axis=0)),
        spread(np.abs(table).max(axis=0, initial=0.0)),
        solution.message(lanes.times),
    )


@dataclass(frozen=True, eq=False)
class _Spread:
    """Place values of the solved samples among all samples, with NaN at the others."""

    solved: Lanes
    singular: Lanes

    def __call__(self, values: Array, *, ill: bool = True) -> Array:
        found = np.full((len(self.solved), *values.shape[1:]), np.nan)
        keep = ~self.singular if ill else np.ones_like(self.singular)
        shown = np.where(keep.reshape(-1, *(1,) * (values.ndim - 1)), values, np.nan)
        found[self.solved] = shown
        return found


def motion_defects(mechanism: Mechanism, path: Path, motion: Trajectory) -> Mapping[str, Array]:
    """Return what the bodies of a motion leave of the constraints of joints, couplers and drivers,
    and their distance from the named points.

    Velocities and accelerations are judged if every body has them.

    Returns:
        By quantity and place in words, the largest defect at each solved sample, shape (n,): of
        positions relative to the mechanism's size, of rates relative to those of the constraints.

    Raises:
        SolveError: the motion lacks a body.
    """
    bodies = {name: motion.bodies[name] for name in motion.bodies}
    orders = min(1 + (each.v is not None) * (1 + (each.a is not None)) for each in bodies.values())
    whole = Trajectory(
        motion.points,
        motion.solved,
        motion.iterations,
        motion.residual,
        bodies={name: _with_rates(each) for name, each in bodies.items()},
    )
    lines = ForceRows(MotionLanes(mechanism, path, whole))
    found: dict[str, Array] = {}
    for quantity, defects in zip(QUANTITIES[:orders], _defects(lines), strict=False):
        for (owner, _), row in zip(lines.formulation.owners, np.abs(defects).T, strict=True):
            label = f"{quantity} at {owner!r}"
            found[label] = np.maximum(row, found.get(label, 0.0))
    for point in mechanism.points:
        if point.name in motion.points:
            there = motion.points[point.name].position[motion.solved] - np.array(point.position)
            off = there - lines.stacked(lines.lanes.at.place(point.body, point.position))
            distance = np.linalg.norm(off, axis=1) / lines.lanes.frame.unit
            label = f"position of points on {point.body!r}"
            found[label] = np.maximum(distance, found.get(label, 0.0))
    return found


def _defects(lines: ForceRows) -> Iterator[Array]:
    """Yield what is left of the constraints by order of the motion, shape (n, rows)."""
    lanes, formulation, at = lines.lanes, lines.formulation, lines.equations.at
    names, carried = formulation.bodies, lanes.at.accelerations
    yield lines.stacked(formulation.phi(at))
    v = lines.stacked([x for k in names for x in (*lanes.at.twists[k].v, *lanes.at.twists[k].w)])
    nu = lines.stacked(formulation.nu(at))
    speed = float(np.abs(nu).max(initial=0.0)) or 1.0
    own, off = _left(lines.matrix, v, nu)
    yield off / speed
    a = lines.stacked([x for k in names for x in (*carried[k].v_t, *carried[k].w_t)])
    gamma = lines.stacked(formulation.gamma(at, [*np.hstack([v, own]).T]))
    _, off = _left(lines.matrix, a, gamma)
    yield off / max(float(np.abs(gamma).max(initial=0.0)), speed**2)


def _with_rates(motion: BodyMotion) -> BodyMotion:
    """Return the motion with zero for rates that are not given."""
    none = np.zeros((len(motion.r), 6))
    v, a = (none if each is None else each for each in (motion.v, motion.a))
    return replace(motion, v=v, a=a)


def _left(matrix: Array, of_bodies: Array, right: Array) -> tuple[Array, Array]:
    """Return the rates of the joints' own coordinates that fit best, and what is left of the rows.

    Args:
        matrix: shape (n, rows, unknowns): bodies, then coordinates.
        of_bodies: rates of the bodies, shape (n, 6 bodies).
    """
    bodies, own = np.split(matrix, [of_bodies.shape[1]], axis=2)
    wanted = right - np.einsum("nrk,nk->nr", bodies, of_bodies)
    rates: Array = np.einsum("nkr,nr->nk", np.linalg.pinv(own), wanted)
    return rates, wanted - np.einsum("nrk,nk->nr", own, rates)
