"""Forces of a solved motion, reactions of joints and efforts of drivers; defects of a motion from
any source, by the constraints of the mechanism.

All samples are evaluated at once, as numpy lanes. Singular values show singular poses and the
forces left undetermined by redundant rows.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property
from itertools import islice
from typing import Any, TypeAlias

import numpy as np

from ...algebra import IDENTITY, ZERO, Vec3, angle_about, cross, quat, vec
from ...errors import SolveError
from ...forces import AMPLIFIED, Forces, Multipliers, Reaction, in_wrenches
from ...joints.base import Joint, unit
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import JointDriver, Path
from ...primitives.base import Drive, Pose, Twist
from ...trajectory import QUANTITIES, Array, BodyMotion, Trajectory
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import constraints_left_out, frames
from ..formulation.formulation import Acceleration, Configuration, Rows
from ..formulation.state_vectors import columns_of, dense, displaced, drive_numbers, state_of
from .equations import Applied, BodyStates, ForceEquations, at_work, powers
from .wanted import wanted_forces

Follow: TypeAlias = Callable[[str, Array, Array], Array]
"""Returns the angle of a joint with all its turns, of its name, its angle counted by rates and its
rate at the solved samples [rad, rad/s].
"""


TURN = 2.0 * np.pi


def joint_angle(mechanism: Mechanism, name: str, motion: Trajectory) -> tuple[Array, Array]:
    """Return the angle of a joint but for whole turns [rad], and its rate, shape (n,)."""
    joint: Any = mechanism.joint(name)
    axis = vec([*unit(joint.axis)])
    turns, spins = [IDENTITY] * 2, [ZERO] * 2
    for k, body in enumerate(joint.bodies):
        if (moved := motion.bodies.get(body)) is None:
            continue
        assert moved.v is not None
        pose = quat(moved.p.T)
        turns[k] = pose * quat(mechanism.body(body).euler_parameters).conjugate()
        spins[k] = Pose.of(ZERO, pose).turn(vec([*moved.v.T[3:]]))
    i, j = turns
    rate = Pose.of(ZERO, i).turn(axis) @ (spins[1] - spins[0])
    still = np.zeros(len(motion.solved))
    return angle_about(axis, i.conjugate() * j) + still, rate + still


def expected_change(rate: Array, times: Array) -> Array:
    """Return the changes between samples that the rates tell [rad]."""
    return 0.5 * (rate[1:] + rate[:-1]) * np.diff(times, axis=0)


# Size limit of the matrices solved at once, in numbers over all samples: some 64 MB.
AT_ONCE = 8_000_000


class ForceRows:
    """The motion at the solved samples, and the equations of forces there, as lanes; singular
    values solve them.

    Rows left out within digits come last: they carry nothing, and count in the self-stress.

    Args:
        freedoms: number of degrees of freedom that no driver holds, in a free motion.

    Attributes:
        frame, times, n: frames of the mechanism, times of the solved samples [s], and their number.
        at: poses, twists and accelerations of the moving bodies.
        values, rates: value from design and velocity, by driver [SI].
        applied: force elements at work, by name.

    Raises:
        SolveError: the motion lacks a body or its accelerations.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        path: Path,
        motion: Trajectory,
        follow: Follow | None = None,
        freedoms: int = 0,
    ) -> None:
        self.mechanism, self.frame = mechanism, frames(mechanism)
        self._motion, self._follow, self._freedoms = motion, follow, freedoms
        self.times: Array = path.times[motion.solved]
        self.n = len(self.times)
        self.at = self._states()
        names = [driver.name for driver in mechanism.drivers]
        drive = path.drive(names, self.times) if names else np.empty((3, 0, self.n))
        self.values, self.rates = (dict(zip(names, x, strict=True)) for x in drive[:2])
        self.applied: Mapping[str, Applied] = at_work(mechanism, self.at, self.angle)
        numbers = drive_numbers(mechanism.drivers, drive, self.frame.unit)
        drives = {name: Drive(*numbers[5 * k : 5 * k + 5]) for k, name in enumerate(names)}
        self.formulation = Cartesian.of(mechanism, self.frame, drives)
        state = state_of(self.formulation, mechanism, self.frame, self.at.poses, self.values)
        left_out = Cartesian(constraints_left_out(mechanism, self.frame), self.frame.moving)
        self.equations = ForceEquations(
            mechanism,
            self.formulation,
            self.formulation.configuration(state),
            self.at,
            self.applied,
            left_out,
        )

    def _states(self) -> BodyStates:
        solved, frame, placed = self._motion.solved, self.frame, dict[str, tuple[Array, Array]]()
        for body in self.mechanism.moving:
            if (moved := self._motion.bodies.get(body.name)) is None:
                raise SolveError(f"forces: the motion of body {body.name!r} is missing")
            placed[body.name] = moved.r[solved], moved.p[solved]
        poses, per_unit = displaced(self.mechanism, frame, placed), 1.0 / frame.unit
        twists, accelerations = dict[str, Twist](), dict[str, Acceleration]()
        for body in self.mechanism.moving:
            moved = self._motion.bodies[body.name]
            if moved.v is None or moved.a is None:
                raise SolveError(f"forces: body {body.name!r} has no accelerations; give order 2")
            own = Pose.of(ZERO, quat(moved.p[solved].T))
            v, a = moved.v[solved].T, moved.a[solved].T
            w, w_t = own.turn(vec([*v[3:]])), own.turn(vec([*a[3:]]))
            arm = poses[body.name].turn(frame.arm(body.name, body.origin))
            twists[body.name] = Twist(per_unit * vec([*v[:3]]) - cross(w, arm), w)
            # the origin's acceleration, less the part of the arm from the internal origin
            added = Acceleration(ZERO, w_t).of(arm, twists[body.name])
            accelerations[body.name] = Acceleration(per_unit * vec([*a[:3]]) - added, w_t)
        return BodyStates(frame, poses, twists, accelerations)

    def angle(self, name: str) -> Array:
        """Return the angle of a joint over the samples [rad], continuous, zero at design.

        The angle of a driven joint, or of a joint geared to one, is exact. Other angles follow the
        rates from the sample nearest to the design, and `follow` corrects their turns.
        """
        known = self._driven_coordinates.get((name, "rotation"))
        if known is not None or not self.n:
            return np.zeros(0) if known is None else known
        angle, rate = (
            each[self._motion.solved] for each in joint_angle(self.mechanism, name, self._motion)
        )
        order = np.argsort(self.times, kind="stable")
        turned, times = angle[order], self.times[order]
        expected = expected_change(rate[order], times)
        turned[1:] += TURN * np.cumsum(np.round((expected - np.diff(turned)) / TURN))
        nearest = float(turned[int(np.argmin(np.abs(times)))])
        angle[order] = turned - TURN * round(nearest / TURN)
        return self._follow(name, angle, rate) if self._follow else angle

    @cached_property
    def _driven_coordinates(self) -> Mapping[tuple[str, str], Array]:
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

    @cached_property
    def matrix(self) -> Array:
        """Return the Jacobian of all rows, lengths in the unit of the frames.

        Shape (n, rows, unknowns).
        """
        return dense(self.equations.rows, self.formulation.unknowns, self.n)

    @cached_property
    def demand(self) -> Array:
        """Return M a + h - Q by the unknowns [J], shape (n, unknowns)."""
        return columns_of(self.equations.demand, self.n)

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
        drivers = range(last - len(self.mechanism.drivers), last)
        return Multipliers.of(rows, demand, drivers, rows.shape[1] - last, self._freedoms)

    def wrench(self, joint: Joint, multipliers: Array) -> tuple[Array, Array]:
        """Return force [J / unit of the frames] and moment [N m] of a joint, shape (n, 3) each.

        They act on the joint's second body, about the joint's point carried by this body.
        """
        pair: tuple[Vec3, Vec3] = self.equations.reaction(joint, [*multipliers.T])
        return columns_of(pair[0], self.n), columns_of(pair[1], self.n)

    def free(self, joint: Joint, found: Multipliers) -> Array:
        """Return the undetermined directions of a joint's wrench, shape (n, 6, redundant rows)."""
        return free_wrench(self.equations, joint, found)

    def remainders(self, at: Configuration | None = None) -> Iterator[tuple[Array, Array]]:
        """Yield what is left of the rows by order of the motion, phi, J v - nu and J a - gamma, and
        their right-hand sides, shape (n, rows) each.

        The rates of the joints' own coordinates are those that their measuring rows tell.

        Args:
            at: configuration with other numbers of turns of the coordinates.
        """
        formulation, at = self.formulation, at or self.equations.at
        yield columns_of(formulation.phi(at), self.n), np.zeros((self.n, 1))
        rows, names = formulation.rows(at), formulation.bodies
        v = [x for k in names for x in (*self.at.twists[k].v, *self.at.twists[k].w)]
        nu = formulation.nu(at)
        own, off = self._less(nu, rows, v)
        yield columns_of(off, self.n), columns_of(nu, self.n)
        every = (self.at.accelerations[k] for k in names)
        a = [x for each in every for x in (*each.v_t, *each.w_t)]
        gamma = formulation.gamma(at, [*v, *own])
        yield columns_of(self._less(gamma, rows, a)[1], self.n), columns_of(gamma, self.n)

    def _less(
        self, right: Sequence[Any], rows: Rows, rates: Sequence[Any]
    ) -> tuple[list[Any], list[Any]]:
        """Return the rates of the joints' coordinates, and J times all rates less the right-hand
        sides.
        """
        bodies, formulation = len(rates), self.formulation
        left = [
            sum((x * rates[c] for c, x in row.items() if c < bodies), -b)
            for row, b in zip(rows, right, strict=True)
        ]
        own: list[Any] = [0.0] * (formulation.unknowns - bodies)
        for name, k in formulation.measuring_rows.items():
            column = formulation.coordinates[name]
            own[column - bodies] = -left[k] / rows[k][column]
        moved = (sum(x * own[c - bodies] for c, x in row.items() if c >= bodies) for row in rows)
        return own, [x + y for x, y in zip(left, moved, strict=True)]


def free_wrench(equations: ForceEquations, joint: Joint, found: Multipliers) -> Array:
    """Return the undetermined directions of a joint's wrench, shape (n, 6, redundant rows)."""
    n, _, redundant = found.free.shape
    every = np.empty((n, 6, redundant))
    for k in range(redundant):
        pair: tuple[Vec3, Vec3] = equations.reaction(joint, [*found.free[:, :, k].T])
        every[:, :, k] = columns_of([*pair[0], *pair[1]], n)
    return every


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
    message = "; ".join(filter(None, (motion.message, found.message)))
    kept = {name: motion.bodies[name] for name in bodies}
    return replace(motion, message=message, bodies=kept, forces=found)


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
    lines = ForceRows(mechanism, path, motion, follow, freedoms)
    solution, still = lines.solve(), np.zeros(lines.n)
    values = [*solution.values.T]
    efforts = {x.name: lines.equations.effort(x, values) + still for x in mechanism.drivers}
    elements = {name: each.amount + still for name, each in lines.applied.items()}
    every = powers(mechanism, lines.at, lines.applied, efforts, lines.rates)
    # its shape is given: without a mass, or without a solved sample, the list alone has none
    table: Array = np.array([each + still for each in every]).reshape(len(every), lines.n)

    def spread(values: Array, *, ill: bool = True) -> Array:
        """Place values of the solved samples among all, with NaN at the others and, if they are ill
        defined at singular poses, there.
        """
        found = np.full((len(motion.solved), *values.shape[1:]), np.nan)
        found[motion.solved] = values
        if ill:
            found[np.flatnonzero(motion.solved)[solution.singular]] = np.nan
        return found

    joints = [j for j in mechanism.given_joints if mechanism.reduced or j.name in wanted.joints]
    free = {joint.name: lines.free(joint, solution) for joint in joints}
    if mechanism.reduced:
        free = in_wrenches(free, solution.known)
    known = spread(solution.known)

    def reaction(name: str) -> Reaction:
        force, moment = map(spread, lines.wrench(mechanism.joint(name), solution.values))
        return Reaction(force / lines.frame.unit, moment, spread(free[name]), known)

    return Forces(
        {name: reaction(name) for name in wanted.joints},
        {name: spread(efforts[name]) for name in wanted.drivers},
        {name: spread(elements[name], ill=False) for name in wanted.elements},
        spread(table.sum(axis=0)),
        spread(np.abs(table).max(axis=0, initial=0.0)),
        solution.message(lines.times),
    )


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
    orders, bodies = with_rates(motion.bodies)
    lines = ForceRows(mechanism, path, replace(motion, bodies=bodies))
    found, speed = dict[str, Array](), 1.0
    for order, (defects, right) in enumerate(islice(lines.remainders(), orders)):
        largest = float(np.abs(right).max(initial=0.0))
        speed = largest or 1.0 if order == 1 else speed
        scale = (1.0, speed, max(largest, speed**2))[order]
        for (owner, _), row in zip(lines.formulation.owners, np.abs(defects).T, strict=True):
            label = f"{QUANTITIES[order]} at {owner!r}"
            found[label] = np.maximum(row / scale, found.get(label, 0.0))
    for point in mechanism.points:
        if point.name in motion.points:
            there = motion.points[point.name].position[motion.solved] - np.array(point.position)
            off = there - columns_of(lines.at.place(point.body, point.position), lines.n)
            distance = np.linalg.norm(off, axis=1) / lines.frame.unit
            label = f"position of points on {point.body!r}"
            found[label] = np.maximum(distance, found.get(label, 0.0))
    return found


def with_rates(motions: Mapping[str, BodyMotion]) -> tuple[int, dict[str, BodyMotion]]:
    """Return the number of orders that all motions have, and the motions with zero for rates that
    are not given.
    """
    orders = min(1 + (m.v is not None) * (1 + (m.a is not None)) for m in motions.values())
    found: dict[str, BodyMotion] = {}
    for name, motion in motions.items():
        none = np.zeros((len(motion.r), 6))
        v, a = (none if each is None else each for each in (motion.v, motion.a))
        found[name] = replace(motion, v=v, a=a)
    return orders, found
