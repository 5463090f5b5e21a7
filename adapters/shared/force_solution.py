"""Forces of a solved motion by a simulator's own inverse dynamics: J^T lambda = M a + h - Q.

J has the rows of the projection, for joints, relations and drivers. Messages name forces that
redundant rows leave undetermined by joint and direction, as in the native engine. Force elements
act on frames of simulators without such elements, or with elements of another meaning. No engine
solves rows that are left out within the digits of a case; they count where forces are undetermined.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.forces import Forces, Multipliers, Reaction, in_wrenches
from ...core.joints import Joint
from ...core.joints.base import unit
from ...core.mechanism.loads import (
    Axes,
    Bushing,
    Curve,
    Force,
    ForceElement,
    Law,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import Array
from .constraints import BodyFrame, by_frame, closure_conditions
from .projection_model import Dynamics, ProjectionModel, SolvedPose
from .tree_plan import ends_of


def places(each: ForceElement, mechanism: Mechanism) -> Sequence[tuple[str, Vector]]:
    """Return the bodies of an element, and its points on them, global at design [m]."""
    if isinstance(each, SpringDamper):
        return list(zip(each.bodies, each.points, strict=True))
    if isinstance(each, TorsionSpringDamper):
        joint: Any = mechanism.joint(each.joint)
        return [(body, joint.point) for body in joint.bodies]
    if isinstance(each, Bushing):
        return [(body, each.point) for body in each.bodies]
    if isinstance(each, Force):
        return [(each.body, each.point)]
    assert isinstance(each, Torque)
    body = each.body
    return [(body, (0.0, 0.0, 0.0) if mechanism.is_fixed(body) else mechanism.body(body).origin)]


@dataclass(frozen=True, eq=False)
class Element:
    """A force element on frames of a simulator.

    Attributes:
        frames: one frame on each body of the element, at its point.
        axis: unit vector of the joint of a torsional spring-damper, at design.
        angle: returns the angle of this joint [rad].
    """

    given: ForceElement
    frames: Sequence[BodyFrame]
    axis: Array
    angle: Callable[[], float]

    def at_work(self) -> tuple[float, Sequence[Array]]:
        """Return the amount (see `core.forces.Forces.elements`), and the wrench on the body of each
        frame, force over moment about its point.
        """
        each = self.given
        if isinstance(each, SpringDamper):
            i, j = self.frames
            d = j.position - i.position
            length = float(np.sqrt(d @ d))
            along = d / length
            rate = float(along @ (j.velocity - i.velocity)[:3])
            deflection = length - (each.free_length or 0.0)
            tension = elastic_force(each, deflection) + each.damping * rate
            pull = np.concatenate([tension * along, np.zeros(3)])
            return tension, (pull, -pull)
        if isinstance(each, TorsionSpringDamper):
            i, j = self.frames
            axis = i.rotation @ self.axis
            rate = float(axis @ (j.velocity - i.velocity)[3:])
            deflection = self.angle() - each.free_angle
            amount = -(elastic_force(each, deflection) + each.damping * rate)
            twist = np.concatenate([np.zeros(3), amount * axis])
            return amount, (-twist, twist)
        if isinstance(each, Bushing):
            return bushing_at_work(each, *self.frames)
        assert isinstance(each, Force | Torque)
        vector = np.array(each.vector)
        turned = vector if each.frame is Axes.GLOBAL else self.frames[0].rotation @ vector
        parts = (np.zeros(3), turned) if isinstance(each, Torque) else (turned, np.zeros(3))
        return float(np.linalg.norm(vector)), (np.concatenate(parts),)


def elastic_force(each: SpringDamper | TorsionSpringDamper, deflection: float) -> float:
    """Return the tension or torque of a spring at a deflection, without damping [N or N m]."""
    return each.stiffness * deflection + curve_force(each.curve, deflection)


def elastic_forces(each: Bushing, x: Array) -> Array:
    """Return the forces on the first body along the bushing's axes at a displacement along them,
    without damping [N].
    """
    tables = each.curve or ((), (), ())
    curves = [curve_force(table, s) for table, s in zip(tables, x.tolist(), strict=True)]
    return np.array(each.stiffness) * x + np.array(each.preload) + np.array(curves)


def curve_force(table: Curve | None, deflection: float) -> float:
    """Return the force of a curve at a deflection; straight beyond its ends."""
    if not table:
        return 0.0
    inside = float(np.clip(deflection, table[0][0], table[-1][0]))
    cubic = _cubic(table)
    return float(cubic(inside) + cubic(inside, 1) * (deflection - inside))


@cache
def _cubic(table: Curve) -> Any:
    # slow to import, and few mechanisms have curves
    from scipy.interpolate import PchipInterpolator  # pyright: ignore[reportMissingTypeStubs]

    return PchipInterpolator(*np.array(table).T)


def bushing_at_work(each: Bushing, i: BodyFrame, j: BodyFrame) -> tuple[float, tuple[Array, Array]]:
    """Return the amount of a bushing, and its wrenches on both bodies about their points.

    Written with rotation matrices, as the native engine's with Euler parameters.
    """
    axes = i.rotation @ np.array(each.triad).T
    d = j.position - i.position
    v, w = i.velocity[:3], i.velocity[3:]
    rates = axes.T @ (j.velocity[:3] - v - np.cross(w, d))
    x = axes.T @ d
    force = axes @ (elastic_forces(each, x) + np.array(each.damping) * rates)
    turn = np.array(each.triad) @ i.rotation.T @ j.rotation @ np.array(each.triad).T
    torque = elastic_torque(each, turn)
    torque += np.array(each.turning_damping) * (axes.T @ (j.velocity[3:] - w))
    moment = axes @ torque
    size = float(np.linalg.norm(moment if each.turns_only else force))
    on_first: Any = np.concatenate([force, moment + np.cross(d, force)])
    return size, (on_first, -np.concatenate([force, moment]))


def elastic_torque(each: Bushing, turn: Array) -> Array:
    """Return the elastic torque on the first body in the bushing's axes [N m].

    Args:
        turn: rotation matrix of the second body in these axes since design.
    """
    k: Array = np.array(each.turning_stiffness)
    if each.law is Law.CARDAN:
        a, b = np.arctan2(-turn[1, 2], turn[2, 2]), np.arcsin(turn[0, 2])
        c = np.arctan2(-turn[0, 1], turn[0, 0])
        # the axes of the three turns, in the bushing's
        of_turns = np.array(
            [
                [1.0, 0.0, 0.0],
                [0.0, np.cos(a), np.sin(a)],
                [np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)],
            ]
        )
        torque: Any = np.linalg.solve(of_turns, k * np.array([a, b, c]))
        return torque
    e0 = 0.5 * np.sqrt(max(0.0, 1.0 + np.trace(turn)))
    if e0 < 0.5:  # near a half turn e is the axis, by the largest column
        square = 0.25 * (1.0 + 2.0 * np.diag(turn) - np.trace(turn))
        k_max = int(square.argmax())
        e = (turn[k_max] + turn[:, k_max]) / 4.0
        e[k_max] = square[k_max]
        e /= np.sqrt(square[k_max])
        other, third = (k_max + 1) % 3, (k_max + 2) % 3
        e0 = (turn[third, other] - turn[other, third]) / (4.0 * e[k_max])
    else:
        skew = turn - turn.T
        e = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4.0 * e0)
    t = 2.0 * k * e
    return e0 * t + np.cross(e, t)


def axis_of(each: ForceElement, mechanism: Mechanism) -> Array:
    """Return the unit axis of a torsional spring-damper's joint; for other elements, zero."""
    if not isinstance(each, TorsionSpringDamper):
        return np.zeros(3)
    joint: Any = mechanism.joint(each.joint)
    return np.array([*unit(joint.axis)])


@dataclass(frozen=True, eq=False)
class _Given:
    """The rows at a sample, those left out last, the drivers' columns, and the dynamics."""

    rows: Array
    columns: Array
    dynamics: Dynamics


def reacting_joints(case: Case) -> list[str]:
    """Return the names of the joints whose reactions are needed: of outputs, or of all where rows
    are left out within digits; see `in_wrenches`.
    """
    mechanism, wanted = case.mechanism, set(case.forces)
    return [j.name for j in mechanism.given_joints if mechanism.reduced or j.name in wanted]


def solved_forces(
    model: ProjectionModel,
    case: Case,
    samples: Mapping[int, SolvedPose],
    unit: float,
    freedoms: int = 0,
) -> Forces:
    """Return the forces that the outputs of the case use, at solved samples.

    Args:
        samples: solved samples by their index in the sweep.
        unit: unit of length in the model [m].
        freedoms: number of degrees of freedom that no row holds.
    """
    mechanism, path = case.mechanism, case.sweep.path
    n, wanted = len(path.times), set(case.forces)
    force, torque = unit, unit**2  # kg unit/s^2 in N, kg unit^2/s^2 in N m
    names = [each.name for each in mechanism.drivers]
    joints = reacting_joints(case)
    scales = np.array([torque if each.turns else force for each in mechanism.drivers])
    turning = {f.name for f in mechanism.forces if isinstance(f, TorsionSpringDamper | Torque)}
    efforts, power, largest = np.full((n, len(names)), np.nan), *np.full((2, n), np.nan)
    amounts = {each.name: np.full(n, np.nan) for each in mechanism.forces if each.name in wanted}
    solved = sorted(samples)
    given = [_evaluate(model, samples[k]) for k in solved]
    found = _multipliers(given, freedoms)
    wrenches = {name: np.full((n, 6), np.nan) for name in joints}
    free = {name: np.full((n, 6, found.free.shape[2]), np.nan) for name in joints}
    known = np.full(n, np.nan)
    known[solved] = found.known
    for k, each, multipliers, basis, singular in zip(
        solved, given, found.values, found.free, found.singular, strict=True
    ):
        dynamics = each.dynamics
        for name, values in amounts.items():
            values[k] = dynamics.elements[name] * (torque if name in turning else force)
        if singular:
            continue
        efforts[k] = scales * (each.columns.T @ multipliers[: len(each.columns)])
        rates = path.drive(names, path.times[[k]])[1][:, 0] if names else np.zeros(0)
        powers = np.concatenate([efforts[k] * rates, -torque * dynamics.demand * samples[k].v])
        power[k], largest[k] = powers.sum(), np.abs(powers).max(initial=0.0)
        undetermined = dict[str, Array]()
        for name in joints:
            alone, by_multiplier = dynamics.reactions[name]
            wrenches[name][k] = alone + by_multiplier @ multipliers
            undetermined[name] = (by_multiplier @ basis)[None]
        if mechanism.reduced:
            undetermined = in_wrenches(undetermined, known[[k]])
        for name, (each_free,) in undetermined.items():
            free[name][k] = each_free
    return Forces(
        {
            name: Reaction(
                force * wrenches[name][:, :3], torque * wrenches[name][:, 3:], free[name], known
            )
            for name in joints
            if name in wanted
        },
        {name: efforts[:, k] for k, name in enumerate(names) if name in wanted},
        amounts,
        power,
        largest,
        found.message(path.times[solved]),
    )


def _evaluate(model: ProjectionModel, at: SolvedPose) -> _Given:
    model.restore(at.saved)
    model.residual(at.c)
    J, columns = np.array(model.jacobian()), np.array(model.driver_columns())
    dynamics = model.dynamics(at.v, at.a)
    return _Given(np.vstack([J, dynamics.left_out]), columns, dynamics)


def _multipliers(given: Sequence[_Given], freedoms: int) -> Multipliers:
    if not given:
        return Multipliers(np.zeros((0, 0)), np.zeros((0, 0, 0)), *np.zeros((4, 0)))
    return Multipliers.of(
        np.array([each.rows for each in given]),
        np.array([each.dynamics.demand for each in given]),
        np.flatnonzero(given[0].columns.any(axis=1)).tolist(),
        len(given[0].dynamics.left_out),
        freedoms,
    )


@dataclass(frozen=True, eq=False)
class RowWrench:
    """Wrenches of unit multipliers on a body.

    Attributes:
        rows: indices of the rows.
        body: number of the body.
        point: point of the body, global.
        wrenches: wrench of each row, force over moment about the point, shape (rows, 6).
    """

    rows: slice
    body: int
    point: Array
    wrenches: Array


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Conditions that are left out.

    Attributes:
        of: name of the joint that they belong to, as given.
        joint: a joint with these conditions.
        frames: of a simulator on its two bodies.
    """

    of: str
    joint: Joint
    frames: tuple[BodyFrame, BodyFrame]

    def rows(self, first: int) -> tuple[Array, list[RowWrench]]:
        """Return the rows of the conditions, and what unit multipliers exert on the bodies.

        Args:
            first: index of the first row.
        """
        found, exerted = list[Array](), list[RowWrench]()
        for condition in closure_conditions(type(self.joint), self.joint, *self.frames):
            found.append(np.atleast_2d(condition.rows()[1]))
            rows = slice(first, first := first + len(found[-1]))
            exerted += [
                RowWrench(rows, frame.body, frame.position, wrenches)
                for frame, wrenches in zip(
                    self.frames, by_frame(condition, self.frames), strict=True
                )
            ]
        return np.vstack(found), exerted


def left_out_of(mechanism: Mechanism, frame: Callable[[str, Vector], BodyFrame]) -> list[LeftOut]:
    """Return the conditions left out of a mechanism.

    Args:
        frame: returns a frame on a body, at a point, global at design.
    """
    found = list[LeftOut]()
    for each in mechanism.reduced:
        for joint in each.left_out:
            i, j = map(frame, joint.bodies, ends_of(mechanism, joint))
            found.append(LeftOut(each.joint.name, joint, (i, j)))
    return found
