"""Poses of bodies as displacements from design, the coordinates of chains of links, and a mechanism
with another pose as its design position, for formats without a state.

A displacement maps every point of a body from its design position to its current position, x -> q x
+ s, in global axes. So a chain of links (see `tree_plan`) displaces its second body relative to
its first by the product of its links' displacements; the reversed chain has the same coordinates
with other signs. OpenSim has angles of successive rotations about a body's x, y and z axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import atan2, hypot
from operator import mul
from typing import Any

import numpy as np

from ...core.algebra import IDENTITY, ZERO, Quat, Scalar, Vec3, angle_about, cross, quat, vec
from ...core.joints import Coupler, Distance, Follower, Joint
from ...core.joints.base import Kind
from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.loads import Bushing, ForceElement, SpringDamper, TorsionSpringDamper
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ...core.trajectory import Array, BodyMotion
from ..shared.tree_plan import CHAINS, Link, ends_of


def rotated(q: Quat, a: Vec3) -> Vec3:
    """Return the vector a turned by the unit quaternion q."""
    return (q * Quat(0.0, a) * q.conjugate()).e


@dataclass(frozen=True)
class Displacement:
    """Displacement of a body since design: x -> turn x + shift, global [m].

    Components have shape (n,), or are the same for all samples.
    """

    turn: Quat = IDENTITY
    shift: Vec3 = ZERO

    def of(self, P: Vec3) -> Vec3:
        """Return the current position of a point of the body from its design position P [m]."""
        return rotated(self.turn, P) + self.shift

    def relative_to(self, other: Displacement) -> Displacement:
        """Return this displacement relative to another: the other, followed by the result, is this
        displacement.
        """
        back = other.turn.conjugate()
        return Displacement(back * self.turn, rotated(back, self.shift - other.shift))

    def then_about(self, axis: Vec3, P: Vec3, angle: Scalar) -> Displacement:
        """Return the displacement of a body that a hinge moves on this body.

        The unit axis and the point P on it are global at design.
        """
        turn = self.turn * about(axis, angle)
        return Displacement(turn, self.of(P) - rotated(turn, P))


def attitude(body: Body) -> Quat:
    """Return the rotation of a body's frame at design, body -> global."""
    return quat(body.euler_parameters)


def displacements(mechanism: Mechanism, way: Mapping[str, BodyMotion]) -> dict[str, Displacement]:
    """Return the displacement of every body, including fixed bodies and the ground, from the motion
    of the moving bodies.
    """
    found = {body.name: Displacement() for body in mechanism.bodies} | {GROUND: Displacement()}
    for body in mechanism.moving:
        turn = quat(way[body.name].p.T) * attitude(body).conjugate()
        found[body.name] = Displacement(
            turn, vec([*way[body.name].r.T]) - rotated(turn, vec(body.origin))
        )
    return found


def link_motions(
    joint: Joint, links: Sequence[Link], placed: Mapping[str, Displacement]
) -> list[tuple[Array, ...]]:
    """Return the coordinates of a joint's links, each of shape (n,): a number [m or rad], or for a
    ball, which is the last link, Euler parameters.

    Angles are followed from the first sample, the design, so full turns count; between samples they
    must change by less than half a turn.
    """
    if not links:
        return []
    moved = placed[joint.j].relative_to(placed[joint.i])
    point, ball = vec(links[-1].point), links[-1].move == "ball"
    hinges = [(vec(link.axis), vec(link.point)) for link in links if link.move == "hinge"]
    # among joints that end in a ball, only the joint on a link has a hinge, which moves the ball
    if ball:
        angles = [_angle(axis, point - P, moved.of(point) - P) for axis, P in hinges]
    else:
        angles = _turns([axis for axis, _ in hinges], moved.turn)
    angles = [np.unwrap(np.atleast_1d(angle)) for angle in angles]
    swing = Displacement()
    for (axis, P), angle in zip(hinges, angles, strict=True):
        swing = swing.then_about(axis, P, angle)
    # only slides carry a slide, so it moves along its design axis
    apart = moved.of(point) - swing.of(point)
    turning = iter(angles)
    found: list[tuple[Array, ...]] = []
    for link in links:
        match link.move:
            case "slide":
                found.append((np.atleast_1d(vec(link.axis) @ apart),))
            case "hinge":
                found.append((next(turning),))
            case "ball":
                found.append(tuple(map(np.atleast_1d, swing.turn.conjugate() * moved.turn)))
    return found


def link_coordinates(
    joint: Joint, links: Sequence[Link], placed: Mapping[str, Displacement]
) -> list[tuple[float, ...]]:
    """Return the coordinates of a joint's links at the last sample."""
    return [
        tuple(float(each[-1]) for each in coordinate)
        for coordinate in link_motions(joint, links, placed)
    ]


def about(axis: Vec3, angle: Scalar) -> Quat:
    """Return the rotation about a unit axis by an angle [rad]."""
    return Quat(np.cos(0.5 * angle), np.sin(0.5 * angle) * axis)


def _turns(axes: Sequence[Vec3], q: Quat) -> list[Array]:
    """Return the angles of successive hinges with the rotation q [rad]."""
    match axes:
        case []:
            return []
        case [a]:
            return [angle_about(a, q)]
        # the second hinge does not move vectors along its axis, so the first alone moves b as q
        # does
        case [a, b]:
            first = _angle(a, b, rotated(q, b))
            rest = about(a, -first) * q
            return [first, angle_about(b, rest)]
        # equal bends, N(x) M(2y) N(x): the Euler parameters are cos x cos y, along n sin x cos y,
        # along m sin y
        case [n, m, _, _]:
            x, y = np.arctan2(n @ q.e, q.e0), np.arcsin(np.clip(m @ q.e, -1.0, 1.0))
            return [x, y, y, x]
        case _:
            raise NotImplementedError(f"a chain of {len(axes)} hinges: give its angles here")


def _angle(axis: Vec3, a: Vec3, b: Vec3) -> Array:
    """Return the angle from a to b about the unit axis [rad]."""
    across = a - (axis @ a) * axis
    return np.arctan2(cross(axis, across) @ b, across @ b)


def local(body: Body, P: Sequence[float]) -> Vector:
    """Return a point, global at design, in the frame of a body [m]."""
    return direction(body, [*(vec(P) - vec(body.origin))])


def direction(body: Body, a: Sequence[float]) -> Vector:
    """Return a vector, global at design, in the axes of a body."""
    x, y, z = rotated(attitude(body).conjugate(), vec(a))
    return x, y, z


def joint_coordinates(
    mechanism: Mechanism, way: Mapping[str, BodyMotion]
) -> dict[tuple[str, str], float]:
    """Return the rotations and translations of joints at the end of a way [rad or m], by joint and
    freedom.
    """
    placed, found = displacements(mechanism, way), dict[tuple[str, str], float]()
    for joint in mechanism.joints:
        if {"rotation", "translation"}.isdisjoint(joint.freedoms):
            continue
        links = CHAINS[type(joint)](joint, ends_of(mechanism, joint)[0])
        for link, value in zip(links, link_coordinates(joint, links, placed), strict=True):
            found[joint.name, link.name] = value[0]
    return found


def bushing_ends(mechanism: Mechanism, each: Bushing) -> list[tuple[str, Vector, Quat]]:
    """Return the bodies of a bushing, and its point and axes in their frames, which no motion
    changes.
    """
    R = np.array(each.triad).T
    # turns about x, then y, then z; where y is a quarter turn, z is none
    upright = hypot(R[0, 0], R[0, 1]) < np.finfo(float).eps
    first = atan2(R[2, 1], R[1, 1]) if upright else atan2(-R[1, 2], R[2, 2])
    angles = first, atan2(R[0, 2], hypot(R[0, 0], R[0, 1])), atan2(-R[0, 1], R[0, 0])
    turns = zip(np.eye(3).tolist(), angles[: 2 if upright else 3], strict=False)
    turn = reduce(mul, (about(vec(axis), angle) for axis, angle in turns))
    known = {body.name: body for body in mechanism.bodies} | {GROUND: Body(GROUND)}
    ends = ((known[name], each.point) for name in each.bodies)
    return [(b.name, local(b, at), attitude(b).conjugate() * turn) for b, at in ends]


def at_start(mechanism: Mechanism, way: Mapping[str, BodyMotion]) -> Mechanism:
    """Return the mechanism with the end of the way as its design position.

    A joint's point moves with its second body and its axis with its first, so that a point stays on
    its line or plane; of a pair, each element moves with its body. Distances keep their lengths.
    Coordinates of curves and of torsional springs count from the start. Drivers, forces and
    torques are left out.
    """
    placed, coordinates = displacements(mechanism, way), joint_coordinates(mechanism, way)

    def coupler(each: Coupler) -> Coupler:
        if not isinstance(each, Follower):
            return each
        y, x = (coordinates[named] for named in zip(each.joints, each.freedoms, strict=True))
        return each.counted_from(y, x)

    def springs() -> Iterator[ForceElement]:
        for each in mechanism.forces:
            if isinstance(each, SpringDamper):
                ends = zip(each.bodies, each.points, strict=True)
                P, Q = (_last(placed[body].of(vec(point))) for body, point in ends)
                yield replace(each, points=(P, Q))
            elif isinstance(each, TorsionSpringDamper):
                # a joint between fixed bodies does not turn
                angle = coordinates.get((each.joint, "rotation"), 0.0)
                yield replace(each, free_angle=each.free_angle - angle)

    return mechanism.with_joints(
        lambda joint: _joint(joint, placed),
        bodies=[_body(body, placed[body.name], way) for body in mechanism.bodies],
        points=[
            replace(point, position=_last(placed[point.body].of(vec(point.position))))
            for point in mechanism.points
        ],
        drivers=[],
        couplers=[coupler(each) for each in mechanism.couplers],
        forces=[*springs()],
    )


def _last(a: Vec3) -> Vector:
    x, y, z = (float(np.ravel(each)[-1]) for each in a)
    return x, y, z


def _body(body: Body, placed: Displacement, way: Mapping[str, BodyMotion]) -> Body:
    if body.name not in way:
        return body
    x, y, z = way[body.name].r[-1].tolist()
    changes: dict[str, Any] = {"euler_parameters": (*way[body.name].p[-1].tolist(),)}
    if body.center_of_mass is not None:
        changes["center_of_mass"] = _last(placed.of(vec(body.center_of_mass)))
    if body.inertia is not None:
        turn = np.column_stack([_last(rotated(placed.turn, vec(e))) for e in np.eye(3).tolist()])
        moved = turn @ inertia_matrix(body.inertia) @ turn.T
        xx, yy, zz = np.diag(moved).tolist()
        changes["inertia"] = (xx, yy, zz, *(float(moved[at]) for at in ((0, 1), (1, 2), (0, 2))))
    return replace(body, origin=(x, y, z), **changes)


def _joint(joint: Joint, placed: Mapping[str, Displacement]) -> Joint:
    def moved(kind: Kind, value: Any, body: str) -> Vector:
        if kind is Kind.POSITION:
            return _last(placed[body].of(vec(value)))
        return _last(rotated(placed[body].turn, vec(value)))

    changes: dict[str, Any] = {}
    for name, kind, value in joint.geometry():
        if kind.single is Kind.LENGTH:
            continue
        if kind.pair:
            changes[name] = tuple(
                moved(kind.single, one, body) for one, body in zip(value, joint.bodies, strict=True)
            )
        else:
            changes[name] = moved(kind, value, joint.j if kind is Kind.POSITION else joint.i)
    if isinstance(joint, Distance):
        changes["length"] = joint.rod_length
    # without checks: axes rounded by a table stay rounded after the motion
    return joint.changed(**changes)
