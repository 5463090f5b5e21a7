"""Force elements at work, over any scalar: springs, bushings, constant forces and torques.

A bushing has axes a of the first body i, and displacements x_a = a . (r_j - r_i) of the second
body's point. Its force on body i is

    F = sum over a of (k_a x_a + c_a x_a' + preload_a + curve_a(x_a)) a,    acting at r_j

The torque is the gradient of the energy 1/2 k_a angle_a^2. With e0 + e the relative Euler
parameters, a rotation dpi of body j in axes of body i changes them by de = (e0 dpi + dpi x e) / 2.
The law of Euler parameters has the angles 2 a . e, and hence the torque on body i

    T = e0 t + e x t,    t = sum over a of k_a (2 a . e) a

The angles of the Cardan law turn about x, then y, then z of the turned axes; see `_cardan`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ...algebra import ZERO, Quat, Scalar, Vec3, cross, root, vec
from ...errors import SolveError
from ...joints.base import unit
from ...mechanism.curves import Curve, pieces
from ...mechanism.loads import (
    Axes,
    Bushing,
    Force,
    Law,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)
from ...mechanism.mechanism import Mechanism
from ...program import maximum, minimum
from .demand import BodyStates, Wrench

# Half angles are halved so often, and the series of the arctangent then has so many terms: the
# first one left out is below a tenth of the last digit of an angle of two right angles.
HALVINGS, TERMS = 3, 12


@dataclass(frozen=True, slots=True)
class Applied:
    """A force element at work.

    Attributes:
        amount: tension of a spring [N], torque on the joint's second body [N m], or the amount of a
            constant force [N] or torque [N m].
        wrenches: wrench on each body of the element, by body.
        stored: rate of its stored energy [W].
        lost: dissipated power, less the power of a constant force or torque [W].
    """

    amount: Scalar
    wrenches: Mapping[str, Wrench]
    stored: Scalar
    lost: Scalar


def at_work(
    mechanism: Mechanism, at: BodyStates, angle: Callable[[str], Scalar]
) -> dict[str, Applied]:
    """Return all force elements at work, by name.

    Args:
        angle: function from a joint's name to its angle [rad], continuous, zero at design.

    Raises:
        SolveError: the native solver does not know an element's type.
    """

    def at_work_now(each: Any) -> Applied:
        if isinstance(each, SpringDamper):
            return spring(each, at)
        if isinstance(each, TorsionSpringDamper):
            return torsion(each, mechanism, at, angle(each.joint))
        if isinstance(each, Bushing):
            return bushing(each, at)
        if isinstance(each, Force | Torque):
            return constant(each, at)
        raise SolveError(f"{each}: the native engine knows no force element of this kind")

    return {each.name: at_work_now(each) for each in mechanism.forces}


def spring(each: SpringDamper, at: BodyStates) -> Applied:
    """Return a spring-damper at work; a positive tension draws its ends together."""
    (i, P), (j, Q) = zip((each.i, each.j), each.points, strict=True)
    d = (vec(Q) - vec(P)) + (at.place(j, Q) - at.place(i, P))
    length = root(d @ d)
    along = (1.0 / length) * d
    rate = along @ (at.velocity(j, Q) - at.velocity(i, P))
    elastic = _elastic(each, length - (each.free_length or 0.0))
    tension = elastic + each.damping * rate
    pull = tension * along
    wrenches = {i: Wrench.at(at.arm(i, P), pull), j: Wrench.at(at.arm(j, Q), -pull)}
    return Applied(tension, wrenches, elastic * rate, each.damping * rate * rate)


def _elastic(each: SpringDamper | TorsionSpringDamper, deflection: Scalar) -> Scalar:
    linear = each.stiffness * deflection
    return linear if each.curve is None else linear + force_of(each.curve, deflection)


def torsion(
    each: TorsionSpringDamper, mechanism: Mechanism, at: BodyStates, angle: Scalar
) -> Applied:
    """Return a torsional spring-damper at work at its joint's angle."""
    joint: Any = mechanism.joint(each.joint)
    axis = at.turned(joint.i, [*unit(joint.axis)])
    rate = axis @ (at.spin(joint.j) - at.spin(joint.i))
    elastic = _elastic(each, angle - each.free_angle)
    amount = -(elastic + each.damping * rate)
    torque = amount * axis
    wrenches = {joint.i: Wrench(ZERO, -torque), joint.j: Wrench(ZERO, torque)}
    return Applied(amount, wrenches, elastic * rate, each.damping * rate * rate)


def constant(each: Force | Torque, at: BodyStates) -> Applied:
    """Return a constant force or torque at work."""
    body = each.body
    vector = vec(each.vector) if each.frame is Axes.GLOBAL else at.turned(body, each.vector)
    amount = root(sum(x * x for x in each.vector))
    if isinstance(each, Torque):
        return Applied(amount, {body: Wrench(ZERO, vector)}, 0.0, -(vector @ at.spin(body)))
    on_body = Wrench.at(at.arm(body, each.point), vector)
    return Applied(amount, {body: on_body}, 0.0, -(vector @ at.velocity(body, each.point)))


def force_of(table: Curve, deflection: Scalar) -> Scalar:
    """Return the force of a curve at a deflection; beyond its ends it goes on straight.

    Each piece adds its rise up to the deflection, which is none before it and all of it beyond.
    """
    parts = pieces(table)
    (first, _, slope, *_), (last, width, a, b, c) = parts[0], parts[-1]
    end = a + width * (2.0 * b + width * 3.0 * c)
    total = table[0][1] + slope * minimum(deflection - first, 0.0)
    for start, size, one, two, three in parts:
        s = minimum(maximum(deflection - start, 0.0), size)
        total = total + s * (one + s * (two + s * three))
    return total + end * maximum(deflection - (last + width), 0.0)


def bushing(each: Bushing, at: BodyStates) -> Applied:
    """Return a bushing at work; its amount is the size of its force, or torque if it has none."""
    i, j, place = each.i, each.j, each.point
    d = at.place(j, place) - at.place(i, place)
    axes = [at.turned(i, axis) for axis in each.triad]
    reach = at.arm(i, place) + d
    seen = at.velocity(j, place) - at.velocity(i, place) - cross(at.spin(i), d)
    turn = at.spin(j) - at.spin(i)
    elastic, viscous, twist = ZERO, ZERO, ZERO
    for k, axis in enumerate(axes):
        x = axis @ d
        force = each.stiffness[k] * x + each.preload[k]
        if each.curve and each.curve[k]:
            force = force + force_of(each.curve[k], x)
        elastic = elastic + force * axis
        viscous = viscous + (each.damping[k] * (axis @ seen)) * axis
        twist = twist + (each.turning_damping[k] * (axis @ turn)) * axis
    torque = _torque(each, at)
    force, moment = elastic + viscous, torque + twist
    on_second = Wrench.at(at.arm(j, place), -force) + Wrench(ZERO, -moment)
    size = moment if each.turns_only else force
    return Applied(
        root(size @ size),
        {i: Wrench.at(reach, force) + Wrench(ZERO, moment), j: on_second},
        elastic @ seen + torque @ turn,
        viscous @ seen + twist @ turn,
    )


def _torque(each: Bushing, at: BodyStates) -> Vec3:
    """Return the elastic torque on the first body [N m]."""
    if not any(each.turning_stiffness):
        return ZERO
    turn = at.turn_of(each.i).conjugate() * at.turn_of(each.j)
    axes = [vec(axis) for axis in each.triad]
    if each.law is Law.CARDAN:
        own = Quat(turn.e0, Vec3(*(axis @ turn.e for axis in axes)))
        parts = _cardan(each.turning_stiffness, own)
        found = sum((x * axis for x, axis in zip(parts, axes, strict=True)), ZERO)
    else:
        t = ZERO
        for axis, k in zip(axes, each.turning_stiffness, strict=True):
            t = t + (2.0 * k * (axis @ turn.e)) * axis
        found = turn.e0 * t + cross(turn.e, t)
    return at.turned(each.i, [*found])


def _cardan(stiffness: tuple[float, float, float], turn: Quat) -> Vec3:
    """Return the torque on the first body in the bushing's axes.

    The rotation is R = Rx(a) Ry(b) Rz(c). The torque T has the work of k angle along each axis of
    the angles: T . x = k_a a, T . Rx y = k_b b, T . Rx Ry z = k_c c.
    """
    R = _matrix(turn)
    cos_b = root(R[0][0] * R[0][0] + R[0][1] * R[0][1])
    a = _angle(-R[1][2], R[2][2], cos_b)
    b = _angle(R[0][2], cos_b, 1.0)
    c = _angle(-R[0][1], R[0][0], cos_b)
    cos_a, sin_a = R[2][2] / cos_b, -R[1][2] / cos_b
    along_x, along_y, along_z = (k * x for k, x in zip(stiffness, (a, b, c), strict=True))
    third = (along_z - R[0][2] * along_x) / cos_b
    return Vec3(along_x, cos_a * along_y - sin_a * third, sin_a * along_y + cos_a * third)


def _matrix(q: Quat) -> list[list[Scalar]]:
    w, (x, y, z) = q.e0, q.e
    return [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]


def _angle(sine: Scalar, cosine: Scalar, length: Scalar) -> Scalar:
    """Return the angle of a direction of a length, between minus and plus two right angles.

    Tangents of half angles need no branch: tan(x / 2) = tan x / (1 + sqrt(1 + tan^2 x)).
    """
    t = sine / (length + cosine)
    for _ in range(HALVINGS):
        t = t / (1.0 + root(1.0 + t * t))
    square, series = t * t, 0.0
    for k in range(TERMS - 1, -1, -1):
        series = (-1.0) ** k / (2 * k + 1) + square * series
    return 2.0 ** (HALVINGS + 1) * t * series
