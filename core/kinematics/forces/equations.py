"""The equations of forces at one state, over any scalar: J^T lambda = M a + h - Q.

Newton-Euler gives the wrench demanded by a body's motion from joints and drivers, M a + h - Q: a
force, and a torque about the body's internal origin, in SI units.

J has all native rows of joints and drivers. On the manifold, the simplified rows of a whole joint
span the same space as its exact rows. The wrench of a joint is therefore independent of the row
style, and all styles take their forces from the native rows.

The balance of power is a check without reference: drivers' power is stored or dissipated.

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

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from ...algebra import ZERO, Mat3, Quat, Scalar, Vec3, cross, is_literal_zero, root, vec
from ...errors import SolveError
from ...joints.base import Joint, unit
from ...mechanism.body import Body
from ...mechanism.loads import (
    Axes,
    Bushing,
    Curve,
    Force,
    Law,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
    pieces,
)
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Driver
from ...primitives.base import GROUND_POSE, GROUND_TWIST, Pose, Twist
from ...program import maximum, minimum
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Constraint, Frames, Relation
from ..formulation.formulation import Acceleration, Configuration, Rows

# Half angles are halved so often, and the series of the arctangent then has so many terms: the
# first one left out is below a tenth of the last digit of an angle of two right angles.
HALVINGS, TERMS = 3, 12


@dataclass(frozen=True, slots=True)
class Wrench:
    """A force [N] and a torque about a body's internal origin [N m], global axes."""

    force: Vec3
    torque: Vec3

    @staticmethod
    def at(arm: Vec3, force: Vec3) -> Wrench:
        """Return the wrench of a force at the end of an arm [m]."""
        return Wrench(force, cross(arm, force))

    def __add__(self, b: Wrench) -> Wrench:
        return Wrench(self.force + b.force, self.torque + b.torque)

    def __neg__(self) -> Wrench:
        return Wrench(-self.force, -self.torque)


NO_WRENCH = Wrench(ZERO, ZERO)


@dataclass(frozen=True, eq=False)
class BodyStates:
    """Poses, twists and accelerations of the moving bodies by name, in the units of the frames."""

    frame: Frames
    poses: Mapping[str, Pose]
    twists: Mapping[str, Twist]
    accelerations: Mapping[str, Acceleration]

    def arm(self, body: str, position: Sequence[float]) -> Vec3:
        """Return the arm from a body's internal origin to a point of it, turned [m]."""
        return self.frame.unit * self._pose(body).turn(self.frame.arm(body, position))

    def place(self, body: str, position: Sequence[float]) -> Vec3:
        """Return the displacement of a point of a body since design [m]."""
        pose = self._pose(body)
        return self.frame.unit * (pose.u + pose.swing(self.frame.arm(body, position)))

    def velocity(self, body: str, position: Sequence[float]) -> Vec3:
        """Return the velocity of a point of a body [m/s]."""
        arm = self._pose(body).turn(self.frame.arm(body, position))
        return self.frame.unit * self.twists.get(body, GROUND_TWIST).of(arm)

    def spin(self, body: str) -> Vec3:
        """Return the angular velocity of a body [rad/s]."""
        return self.twists.get(body, GROUND_TWIST).w

    def turn(self, body: str, vector: Sequence[float]) -> Vec3:
        """Return a vector fixed in a body, given at design, in its current direction."""
        return self._pose(body).turn(vec(vector))

    def turn_of(self, body: str) -> Quat:
        """Return the rotation of a body since design."""
        return self._pose(body).q

    def _pose(self, body: str) -> Pose:
        return self.poses.get(body, GROUND_POSE)


def inertial(body: Body, at: BodyStates, gravity: Vec3) -> Wrench:
    """Return the demanded wrench of a body with mass: m (a - g), and I wdot + w x I w at C."""
    arm = arm_of_center(body, at)
    force = body.mass * (acceleration_of_center(body, at) - gravity)
    return Wrench(force, cross(at.frame.unit * arm, force) + spin_change(body, at))


def arm_of_center(body: Body, at: BodyStates) -> Vec3:
    """Return the arm from a body's internal origin to its centre of mass, turned [units]."""
    return at.poses[body.name].turn(at.frame.arm(body.name, body.center))


def acceleration_of_center(body: Body, at: BodyStates) -> Vec3:
    """Return the acceleration of a body's centre of mass [m/s^2]."""
    acceleration, twist = at.accelerations[body.name], at.twists[body.name]
    return at.frame.unit * acceleration.of(arm_of_center(body, at), twist)


def spin_change(body: Body, at: BodyStates) -> Vec3:
    """Return the change of a body's angular momentum about its centre of mass [N m].

    The body's own axes are global at design. The inertia, given at design in global axes, is
    therefore constant in them.
    """
    I = inertia_of(body)  # noqa: E741 - the field's letter
    if I is None:
        return ZERO
    pose, (w, w_t) = at.poses[body.name], spin_of(body, at)
    return pose.turn(I @ w_t + cross(w, I @ w))


def spin_of(body: Body, at: BodyStates) -> tuple[Vec3, Vec3]:
    """Return w and wdot of a body in its own axes, global at design."""
    back = at.poses[body.name].D.T
    w, w_t = at.twists[body.name].w, at.accelerations[body.name].w_t
    return w + back @ w, w_t + back @ w_t


def inertia_of(body: Body) -> Mat3 | None:
    """Return the inertia about the centre of mass at design, global axes; None for a point mass."""
    if body.inertia is None:
        return None
    xx, yy, zz, xy, yz, xz = body.inertia
    return Mat3(Vec3(xx, xy, xz), Vec3(xy, yy, yz), Vec3(xz, yz, zz))


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

    found: dict[str, Applied] = {}
    for each in mechanism.forces:
        if isinstance(each, SpringDamper):
            found[each.name] = spring(each, at)
        elif isinstance(each, TorsionSpringDamper):
            found[each.name] = torsion(each, mechanism, at, angle(each.joint))
        elif isinstance(each, Bushing):
            found[each.name] = bushing(each, at)
        elif isinstance(each, Force | Torque):
            found[each.name] = constant(each, at)
        else:
            raise SolveError(f"{each}: the native engine knows no force element of this kind")
    return found


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
    axis = at.turn(joint.i, [*unit(joint.axis)])
    rate = axis @ (at.spin(joint.j) - at.spin(joint.i))
    elastic = _elastic(each, angle - each.free_angle)
    amount = -(elastic + each.damping * rate)
    torque = amount * axis
    wrenches = {joint.i: Wrench(ZERO, -torque), joint.j: Wrench(ZERO, torque)}
    return Applied(amount, wrenches, elastic * rate, each.damping * rate * rate)


def constant(each: Force | Torque, at: BodyStates) -> Applied:
    """Return a constant force or torque at work."""
    body = each.body
    vector = vec(each.vector) if each.frame is Axes.GLOBAL else at.turn(body, each.vector)
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
    axes = [at.turn(i, axis) for axis in each.triad]
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
    return at.turn(each.i, [*found])


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


@dataclass(frozen=True, eq=False)
class ForceEquations:
    """The rows of joints and drivers at one state, their demand, and the meaning of multipliers.

    Attributes:
        formulation: native formulation of the whole mechanism.
        at: its configuration.
        states: poses, twists and accelerations of the bodies.
        applied: force elements at work, by name.
        left_out: rows left out within digits, which follow the others; none without self-stress.
    """

    mechanism: Mechanism
    formulation: Cartesian
    at: Configuration
    states: BodyStates
    applied: Mapping[str, Applied]
    left_out: Cartesian

    @classmethod
    def with_angles(
        cls, mechanism: Mechanism, formulation: Cartesian, at: Configuration, states: BodyStates
    ) -> ForceEquations:
        """Return the equations at a configuration that has the angles of torsional springs."""
        applied = at_work(mechanism, states, lambda joint: at.state[f"x {joint}.rotation"][0])
        return cls(mechanism, formulation, at, states, applied, Cartesian((), ()))

    @cached_property
    def rows(self) -> Rows:
        """Return the Jacobian of all rows, lengths in the unit of the frames."""
        return self.formulation.rows(self.at) + self.left_out.rows(self.at)

    @cached_property
    def demand(self) -> list[Scalar]:
        """Return M a + h - Q by the unknowns [J]; zero for the coordinates of joints."""
        gravity, wrenches = vec(self.mechanism.gravity), dict[str, Wrench]()
        for name in self.formulation.columns:
            body = self.mechanism.body(name)
            wrenches[name] = (
                NO_WRENCH if is_literal_zero(body.mass) else inertial(body, self.states, gravity)
            )
            for each in self.applied.values():
                if name in each.wrenches:
                    wrenches[name] += -each.wrenches[name]
        return self.by_unknowns(wrenches)

    def by_unknowns(self, wrenches: Mapping[str, Wrench]) -> list[Scalar]:
        """Return wrenches on the moving bodies by the unknowns [J]; zero for coordinates."""
        found: list[Scalar] = [0.0] * self.formulation.unknowns
        for name, first in self.formulation.columns.items():
            force = self.states.frame.unit * wrenches[name].force
            found[first : first + COLUMNS] = [*force, *wrenches[name].torque]
        return found

    @cached_property
    def _numbered_rows(self) -> list[tuple[int, Constraint | Relation]]:
        """Return the constraint and number of every row: joints, couplers, drivers, left out."""
        return [*enumerate((*self.formulation.of_rows, *self.left_out.of_rows))]

    @cached_property
    def _of_joints(self) -> Mapping[str, list[tuple[int, Constraint | Relation]]]:
        """Return the rows by given joint; a coupler or driver may have the name of a joint."""
        mechanism, every = self.mechanism, self.formulation.constraints
        last = len(every) - len(mechanism.couplers) - len(mechanism.drivers)
        own = {id(c) for c in (*every[:last], *self.left_out.constraints)}
        found: dict[str, list[tuple[int, Constraint | Relation]]] = {
            joint.name: [] for joint in mechanism.given_joints
        }
        for k, c in self._numbered_rows:
            if id(c) in own:
                found[mechanism.given_name(c.owner)].append((k, c))
        return found

    def _parts(self, joint: Joint, multipliers: Sequence[Scalar]) -> Iterator[tuple[int, Scalar]]:
        """Yield the rows acting on the bodies of a joint, with the joint's part of each multiplier.

        A row can measure a coordinate of a joint. Its multiplier then carries the loads of this
        coordinate's relations, and they count as loads of the relations, not of the joint. A gear's
        torque is thus no reaction of the coupled joints, and a screw's thrust is the screw's.
        """
        for k, c in self._of_joints[joint.name]:
            if isinstance(c, Relation):
                for name, weight in c.weights.items():
                    measuring = self.formulation.measuring_rows[name]
                    share = self.rows[measuring][self.formulation.coordinates[name]]
                    yield measuring, -(weight / share) * multipliers[k]
            elif not c.coordinate:
                yield k, multipliers[k]

    def reaction(self, joint: Joint, multipliers: Sequence[Scalar]) -> tuple[Vec3, Vec3]:
        """Return force [J / unit of the frames] and moment [N m] of a joint on its second body.

        The moment is about the joint's point, carried by the second body.
        """
        body, sign = (joint.j, 1.0) if joint.j in self.formulation.columns else (joint.i, -1.0)
        first, force, torque = self.formulation.columns[body], ZERO, ZERO
        for k, part in self._parts(joint, multipliers):
            entries = [self.rows[k].get(first + x, 0.0) for x in range(COLUMNS)]
            force += part * vec(entries[:3])
            torque += part * vec(entries[3:])
        return sign * force, sign * (torque - cross(self._arm(joint, body), force))

    def _arm(self, joint: Joint, body: str) -> Vec3:
        """Return the arm from a body's internal origin to the joint's point, turned [units].

        The second body carries the point.
        """
        held = self.at.poses.get(joint.j, GROUND_POSE)
        frame = self.states.frame
        arm = frame.arm(joint.j, self.mechanism.reaction_point(joint))
        if body == joint.j:
            return held.turn(arm)
        seen = self.at.poses.get(body, GROUND_POSE)
        carried = held.u + held.swing(arm) - seen.u
        return (arm + frame.origins[joint.j] - frame.origins[body]) + carried

    def effort(self, driver: Driver, multipliers: Sequence[Scalar]) -> Scalar:
        """Return the effort of a driver [N or N m]."""
        drivers = self.mechanism.drivers
        c: Any = self.formulation.constraints[drivers.index(driver) - len(drivers)]
        first = next(k for k, each in self._numbered_rows if each is c)
        # nu is linear in the driver's rate: at rate one it is the power per unit multiplier
        at_rate_one = replace(c.primitive, drive=replace(c.primitive.drive, c_t=1.0))
        pair = (self.at.poses.get(b, GROUND_POSE) for b in (c.i, c.j))
        found: Scalar = 0.0
        for k, value in enumerate(at_rate_one.nu(*pair)):
            found = found + value * multipliers[first + k]
        return found if driver.turns else (1.0 / self.states.frame.unit) * found


def powers(
    mechanism: Mechanism,
    at: BodyStates,
    applied: Mapping[str, Applied],
    efforts: Mapping[str, Scalar],
    rates: Mapping[str, Scalar],
) -> list[Scalar]:
    """Return the powers of drivers, less the changes of energy and the dissipation [W].

    Their sum is zero. Kinetic energy changes by m v a + w I wdot: the gyroscopic term does no work.
    The balance uses no joint and no row. A wrong sign, point or inertia in the equations of forces
    therefore breaks it.
    """
    found: list[Scalar] = [efforts[name] * rates[name] for name in efforts]
    gravity = vec(mechanism.gravity)
    for body in mechanism.moving:
        if is_literal_zero(body.mass):
            continue
        v = at.frame.unit * at.twists[body.name].of(arm_of_center(body, at))
        a = acceleration_of_center(body, at)
        found += [-body.mass * (v @ a), body.mass * (v @ gravity)]
        inertia = inertia_of(body)
        if inertia is not None:
            w, w_t = spin_of(body, at)
            found.append(-(w @ (inertia @ w_t)))
    for each in applied.values():
        found += [-each.stored, -each.lost]
    return found
