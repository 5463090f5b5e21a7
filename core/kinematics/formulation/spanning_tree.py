"""The spanning tree in joint coordinates: recursive poses, velocities and accelerations of bodies.

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
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...algebra import ZERO, Quat, Scalar, Vec3, X, Y, Z, cross, quat, turned_by, vec
from ...joints import (
    Cylindrical,
    Fixed,
    Joint,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ...joints.base import unit
from ...mechanism.mechanism import GROUND, Mechanism
from ...mechanism.tree import Branch, spanning_tree
from ...primitives.base import GROUND_POSE, GROUND_TWIST, Pose, Twist
from ...program import cos, sin
from .constraints import Frames
from .formulation import GROUND_ACCELERATION, Acceleration, State

BALL = 3
"""Unknowns of a ball."""


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


def chains(mechanism: Mechanism, frame: Frames) -> tuple[list[Chain], set[str]]:
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
class Posed:
    """The tree at a state: poses, the effect of every unknown, and the unknowns of each body."""

    poses: Mapping[str, Pose]
    columns: Sequence[Column]
    ancestors: Mapping[str, Sequence[int]]


def posed(tree: Sequence[Chain], state: State) -> Posed:
    """Compute poses and columns by recursion from the ground."""
    poses: dict[str, Pose] = {}
    columns: list[Column] = []
    ancestors: dict[str, list[int]] = {}
    for chain in tree:
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
    return Posed(poses, columns, ancestors)


def retracted(
    tree: Sequence[Chain], state: State, step_of: Sequence[Scalar]
) -> dict[str, Sequence[Scalar]]:
    """Return the state after a step of the unknowns."""
    after: dict[str, Sequence[Scalar]] = {}
    k = 0
    for step in (step for chain in tree for step in chain.steps):
        if step.axis is None:
            after[step.name] = tuple(
                turned_by(quat(state[step.name]), 0.5 * vec(step_of[k : k + BALL]))
            )
        else:
            after[step.name] = (state[step.name][0] + step_of[k],)
        k += step.unknowns
    return after


def moving(tree: Sequence[Chain], at: Posed, state: State, v: Sequence[Scalar]) -> dict[str, Twist]:
    """Return the velocities of all bodies at rates v."""
    return {
        name: twist for name, (twist, _) in accelerating(tree, at, state, v, [0.0] * len(v)).items()
    }


def accelerating(
    tree: Sequence[Chain], at: Posed, state: State, v: Sequence[Scalar], a: Sequence[Scalar]
) -> dict[str, tuple[Twist, Acceleration]]:
    """Return velocities and accelerations of all bodies at rates v and accelerations a."""
    found: dict[str, tuple[Twist, Acceleration]] = {}
    k = 0
    for chain in tree:
        pose = at.poses.get(chain.parent, GROUND_POSE)
        twist, acceleration = found.get(chain.parent, (GROUND_TWIST, GROUND_ACCELERATION))
        arm = pose.turn(chain.arm_parent)
        w, w_t = twist.w, acceleration.w_t
        v_P, v_P_t = twist.of(arm), acceleration.of(arm, twist)
        for step in chain.steps:
            axes = [column.axis for column in at.columns[k : k + step.unknowns]]
            rate = _weighted(v[k : k + step.unknowns], axes)
            rate_t = _weighted(a[k : k + step.unknowns], axes)
            if step.slides:
                slid = state[step.name][0] * axes[0]
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


def _weighted(weights: Sequence[Scalar], axes: Sequence[Vec3]) -> Vec3:
    total = ZERO
    for weight, axis in zip(weights, axes, strict=True):
        total = total + weight * axis
    return total
