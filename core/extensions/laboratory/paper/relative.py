"""The relative formulation: joint coordinates of a spanning tree as unknowns, cut joints as rows.

Formulation section 5. A tree joint is a chain of steps from the parent to the child, each with its
unknowns: a turn about an axis, a slide along an axis, or a ball (any rotation). Axes are defined at
design and carried by the chain. Body axes are parallel to the global ones at design, so a turn by
theta about a is the rotation [cos theta/2, a sin theta/2] after those before it. In global axes,
with h the carried axis and p the joint's point on the chain:

    turn    q = q Q(theta)
            w = w + theta_t h
            wdot = wdot + theta_tt h + w x theta_t h
    slide   p = p + d h
            v = v + d_t h + w x d h
            vdot = vdot + d_tt h + 2 w x d_t h + wdot x d h + w x (w x d h)

The rows are those of the Cartesian formulation for the cut joints and the drivers, times the
velocity transformation B of the tree. With b = Bdot y_t, the accelerations at constant rates:

    position      (Phi_Pi B) dy   = -Phi
    velocity      (Phi_Pi B) y_t  = nu
    acceleration  (Phi_Pi B) y_tt = gamma - Phi_Pi b

Tree joints hold by construction and have no rows; the system is small and dense, the Cartesian one
large and sparse.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from ....algebra import (
    ZERO,
    Quat,
    Scalar,
    Vec3,
    X,
    Y,
    Z,
    cross,
    is_literal_zero,
    quat,
    turned_by,
    vec,
)
from ....joints import (
    Cylindrical,
    Fixed,
    Joint,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ....joints.base import unit
from ....kinematics import COLUMNS, Cartesian, Frames, Relation, constraints
from ....kinematics.formulation.formulation import (
    GROUND_ACCELERATION,
    Acceleration,
    Condition,
    Configuration,
    Rows,
    State,
)
from ....mechanism.mechanism import GROUND, Mechanism
from ....mechanism.tree import Branch, spanning_tree
from ....primitives.base import GROUND_POSE, GROUND_TWIST, Drive, Pose, Twist
from ....program import cos, sin

BALL = 3
"""Unknowns of a ball."""
BALLS = "q "
"""Before the names of the vectors of balls; those of other steps have one number."""


@dataclass(frozen=True)
class Step:
    """One step of a chain.

    Attributes:
        name: of its state vector.
        axis: at design; None for a ball.
        slides: whether it slides along the axis; else it turns about it.
    """

    name: str
    axis: Vec3 | None
    slides: bool = False
    sign: float = 1.0

    @property
    def unknowns(self) -> int:
        """Three for a ball, else one."""
        return BALL if self.axis is None else 1


@dataclass(frozen=True)
class Chain:
    """A branch of the tree as steps at a point P (global, at design).

    The arms to P start at the origins of parent and child.
    """

    parent: str
    child: str
    P: Vec3
    arm_parent: Vec3
    arm_child: Vec3
    steps: tuple[Step, ...]


@dataclass(frozen=True)
class Column:
    """The effect of one unknown: a turn of all later bodies about an axis through P, or a shift.

    P is a displacement from design.
    """

    axis: Vec3
    slides: bool
    P: Vec3
    P_design: Vec3


def _chains(mechanism: Mechanism, frame: Frames) -> tuple[list[Chain], set[str]]:
    """Return the chains of all moving bodies, parents first, and the names of their joints.

    A joint that is not made of turns, slides and a ball leaves its body free, with six unknowns;
    the joint then closes a loop.
    """
    found, used = list[Chain](), set[str]()
    for branch in spanning_tree(mechanism).branches:
        steps = _steps(branch)
        if branch.joint is None or steps is None:
            free = tuple(
                Step(f"x {branch.child} {axis}", e, slides=True)
                for axis, e in (("x", X), ("y", Y), ("z", Z))
            )
            # about its own origin: the arms end there
            own = frame.origins[branch.child]
            found.append(
                Chain(
                    GROUND, branch.child, own, own, ZERO, (*free, Step(f"q {branch.child}", None))
                )
            )
            continue
        used.add(branch.joint.name)
        point = getattr(branch.joint, "point", None)
        P = frame.origins[branch.child] if point is None else (1.0 / frame.unit) * vec(point)
        arm_parent, arm_child = (P - frame.origins[body] for body in (branch.parent, branch.child))
        found.append(Chain(branch.parent, branch.child, P, arm_parent, arm_child, steps))
    return found, used


def _steps(branch: Branch) -> tuple[Step, ...] | None:
    """Return the steps of a tree joint from parent to child; None for a joint that is no chain."""
    joint = branch.joint
    steps: list[Step]
    match joint:
        case Revolute():
            steps = [_turn(joint, joint.axis)]
        case Translational():
            steps = [_slide(joint, joint.axis)]
        case Cylindrical() if type(joint) in (Cylindrical, Screw):
            steps = [_slide(joint, joint.axis), _turn(joint, joint.axis)]
        case Universal():
            steps = [
                _turn(joint, axis, f" {body}") for axis, body in zip(joint.axes, "ij", strict=True)
            ]
        case Spherical():
            return (Step(f"q {joint.name}", None),)
        case Fixed():
            return ()
        case _:
            return None
    if branch.child == joint.i:  # coordinates are those of the second body relative to the first
        return tuple(Step(step.name, step.axis, step.slides, -1.0) for step in reversed(steps))
    return tuple(steps)


def _turn(joint: Joint, axis: Sequence[float], which: str = "") -> Step:
    return Step(f"x {joint.name}.rotation{which}", unit(axis))


def _slide(joint: Joint, axis: Sequence[float]) -> Step:
    return Step(f"x {joint.name}.translation", unit(axis), slides=True)


@dataclass(frozen=True, eq=False)
class TreeConfiguration(Configuration):
    """A configuration with the effect of every unknown of the tree, and the unknowns that move each
    body.
    """

    columns: Sequence[Column]
    ancestors: Mapping[str, Sequence[int]]

    def arm(self, name: str, column: Column, origins: Mapping[str, Vec3]) -> Vec3:
        """Return the vector from a column's point P to a body's origin, current global axes
        [units].
        """
        return (origins[name] - column.P_design) + (self.poses[name].u - column.P)


def relative(
    mechanism: Mechanism, frame: Frames, drives: Mapping[str, Drive], named: Collection[str]
) -> Relative:
    """Return the formulation of the row style; see `kinematics.formulation.styles`."""
    found = constraints(mechanism, frame, drives, named, mixed=True)
    chains, used = _chains(mechanism, frame)
    left = [c for c in found if isinstance(c, Relation) or c.owner not in used]
    names = tuple(
        step.name.removeprefix("x ")
        for chain in chains
        for step in chain.steps
        if step.axis is not None
    )
    return Relative(left, frame.moving, names, chains=chains, origins=frame.origins)


@dataclass(frozen=True, eq=False, kw_only=True)
class Relative(Cartesian):
    """A tree, and the Cartesian equations of the constraints that close it.

    Attributes:
        chains: of all moving bodies, parents first.
        origins: of the bodies at design [units].
    """

    chains: Sequence[Chain]
    origins: Mapping[str, Vec3]

    @cached_property
    def _columns(self) -> Mapping[str, int]:
        """First unknown of every vector of the state: of the steps of the tree, then of coordinates
        of joints outside it.
        """
        found, count = dict[str, int](), 0
        steps = (step.name for chain in self.chains for step in chain.steps)
        for name in (*steps, *(f"x {name}" for name in self.coordinates)):
            if name not in found:
                found[name] = count
                count += BALL if name.startswith(BALLS) else 1
        return found

    @property
    def unknowns(self) -> int:
        return sum(BALL if name.startswith(BALLS) else 1 for name in self._columns)

    @property
    def design(self) -> Mapping[str, Sequence[float]]:
        return {
            name: (1.0, 0.0, 0.0, 0.0) if name.startswith(BALLS) else (0.0,)
            for name in self._columns
        }

    @property
    def conditions(self) -> Sequence[Condition]:
        # no joint in these rows carries another loop
        return [replace(each, remote=0) for each in super().conditions]

    def configuration(self, state: State) -> Configuration:
        """Compute poses and columns by recursion from the ground."""
        poses: dict[str, Pose] = {}
        columns: list[Column] = []
        ancestors: dict[str, list[int]] = {}
        for chain in self.chains:
            parent = poses.get(chain.parent, GROUND_POSE)
            through = list(ancestors.get(chain.parent, []))
            p, q = parent.u + parent.swing(chain.arm_parent), parent.q
            for step in chain.steps:
                through += range(len(columns), len(columns) + step.unknowns)
                carried = Pose.of(ZERO, q)
                if step.axis is None:
                    columns += [Column(carried.turn(e), False, p, chain.P) for e in (X, Y, Z)]
                    q = q * quat(state[step.name])
                    continue
                h = step.sign * carried.turn(step.axis)
                (x,) = state[step.name]
                columns.append(Column(h, step.slides, p, chain.P))
                if step.slides:
                    p = p + x * h
                else:
                    q = q * Quat(cos(0.5 * x), (step.sign * sin(0.5 * x)) * step.axis)
            child = Pose.of(ZERO, q)
            poses[chain.child] = Pose(p - child.swing(chain.arm_child), q, child.D)
            ancestors[chain.child] = through
        return TreeConfiguration(state, poses, columns, ancestors)

    def retract(self, at: Configuration, step: Sequence[Scalar]) -> State:
        after: dict[str, Sequence[Scalar]] = {}
        for name, k in self._columns.items():
            value = at.state[name]
            if name.startswith(BALLS):
                after[name] = tuple(turned_by(quat(value), 0.5 * vec(step[k : k + BALL])))
            else:
                after[name] = (value[0] + step[k],)
        return after

    def rows(self, at: Configuration) -> Rows:
        return [self._transform(row, _of_tree(at)) for row in super().rows(at)]

    def gamma(self, at: Configuration, v: Sequence[Scalar]) -> list[Scalar]:
        moved = self._motions(at, v, [0.0] * len(v))
        rates, bias = [0.0] * super().unknowns, [0.0] * super().unknowns
        for name, k in self.columns.items():
            twist, acceleration = moved[name]
            rates[k : k + COLUMNS] = [*twist.v, *twist.w]
            bias[k : k + COLUMNS] = [*acceleration.v_t, *acceleration.w_t]
        for name, k in self.coordinates.items():
            rates[k] = v[self._columns[f"x {name}"]]
        rows = super().rows(at)
        return [
            value - sum((entry * bias[k] for k, entry in row.items()), 0.0)
            for value, row in zip(super().gamma(at, rates), rows, strict=True)
        ]

    def twists(self, at: Configuration, v: Sequence[Scalar]) -> Mapping[str, Twist]:
        moved = self._motions(at, v, [0.0] * len(v))
        return {name: twist for name, (twist, _) in moved.items()}

    def accelerations(
        self, at: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]
    ) -> Mapping[str, Acceleration]:
        return {name: acceleration for name, (_, acceleration) in self._motions(at, v, a).items()}

    def _motions(
        self, configuration: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]
    ) -> dict[str, tuple[Twist, Acceleration]]:
        """Return velocities and accelerations of all bodies at rates v and accelerations a."""
        found: dict[str, tuple[Twist, Acceleration]] = {}
        k, at = 0, _of_tree(configuration)
        for chain in self.chains:
            pose = at.poses.get(chain.parent, GROUND_POSE)
            twist, acceleration = found.get(chain.parent, (GROUND_TWIST, GROUND_ACCELERATION))
            arm = pose.turn(chain.arm_parent)
            w, w_t = twist.w, acceleration.w_t
            v_P, v_P_t = twist.of(arm), acceleration.of(arm, twist)
            for step in chain.steps:
                axes = [column.axis for column in at.columns[k : k + step.unknowns]]
                rate = _weighted_sum(v[k : k + step.unknowns], axes)
                rate_t = _weighted_sum(a[k : k + step.unknowns], axes)
                if step.slides:
                    slid = at.state[step.name][0] * axes[0]
                    v_P = v_P + rate + cross(w, slid)
                    v_P_t = (
                        v_P_t
                        + rate_t
                        + 2.0 * cross(w, rate)
                        + cross(w_t, slid)
                        + cross(w, cross(w, slid))
                    )
                else:
                    w, w_t = w + rate, w_t + rate_t + cross(w, rate)
                k += step.unknowns
            arm = at.poses[chain.child].turn(chain.arm_child)
            own = Twist(ZERO, w)
            found[chain.child] = (
                Twist(v_P - cross(w, arm), w),
                Acceleration(v_P_t - cross(w_t, arm) - own.centripetal(arm), w_t),
            )
        return found

    def _transform(self, row: Mapping[int, Scalar], at: TreeConfiguration) -> dict[int, Scalar]:
        """Return a Cartesian row times B, over the unknowns that move a body of the row."""
        entries: dict[int, Scalar] = {}
        for name, first in self.columns.items():
            r = Vec3(*(row.get(first + k, 0.0) for k in range(3)))
            p = Vec3(*(row.get(first + k, 0.0) for k in range(3, COLUMNS)))
            if all(map(is_literal_zero, (*r, *p))):
                continue
            for k in at.ancestors[name]:
                column = at.columns[k]
                value = r @ column.axis
                # turning about P moves the body's origin by axis x (origin - P)
                if not column.slides:
                    value = (p + cross(at.arm(name, column, self.origins), r)) @ column.axis
                entries[k] = entries.get(k, 0.0) + value
        for name, k in self.coordinates.items():
            if k in row:
                own = self._columns[f"x {name}"]
                entries[own] = entries.get(own, 0.0) + row[k]
        return {k: value for k, value in entries.items() if not is_literal_zero(value)}


def _of_tree(at: Configuration) -> TreeConfiguration:
    assert isinstance(at, TreeConfiguration)
    return at


def _weighted_sum(weights: Sequence[Scalar], axes: Sequence[Vec3]) -> Vec3:
    total = ZERO
    for weight, axis in zip(weights, axes, strict=True):
        total = total + weight * axis
    return total
