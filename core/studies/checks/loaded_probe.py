"""Checks of a joint's reaction in its probe with masses, gravity and a spring, solved natively.

The reaction does no work on the freedoms of the joint, the first body gets the opposite of what the
second gets, and neither depends on the order of bodies and joints, on units or on place. Bodies are
balanced by Newton and Euler from their motion: no equation of the forces takes part.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...algebra import quat, rotation_less_identity
from ...case.case import Case
from ...case.io.tolerance import default
from ...case.measures import DriverEffort, ForceMeasure, JointForce, JointMoment
from ...case.quantity import with_markers
from ...errors import KincheckError, SolveError
from ...forces import Reaction
from ...joints import AxialJoint, Joint, Kind
from ...kinematics import NativeSolver
from ...mechanism.body import Body, inertia_matrix
from ...mechanism.drivers import JointAngle, JointDisplacement, JointDriver
from ...mechanism.loads import SpringDamper
from ...mechanism.mechanism import GROUND, Mechanism
from ...mechanism.motions import Path, Sine
from ...trajectory import Array, BodyMotion, Trajectory
from .findings import Finding, Verdict, judged

# Samples of the probe: forces follow from each pose alone.
SAMPLES = 3
TOL = 1e-12
GRAVITY = (0.5, -1.0, -9.75)
INERTIA = (0.04, 0.05, 0.06, 0.004, -0.003, 0.002)
CENTRE = np.array([0.05, -0.03, 0.04])
DRIVEN: Mapping[type[JointDriver], Sine] = {
    JointDisplacement: Sine(0.05, 0.5),
    JointAngle: Sine(0.5, 0.25),
}
"""Drivers of a joint's own coordinates, slides first, and their motions [m, rad]."""


@dataclass(frozen=True, eq=False)
class Probe:
    """A loaded probe and its native solution."""

    mechanism: Mechanism
    joint: Joint
    motion: Trajectory

    @property
    def reaction(self) -> Reaction:
        """The reaction of the joint under test."""
        assert self.motion.forces is not None
        return self.motion.forces.joints[self.joint.name]

    @property
    def size(self) -> float:
        """The largest force of any joint [N]."""
        assert self.motion.forces is not None
        every = self.motion.forces.joints.values()
        return max(float(np.abs(each.force).max()) for each in every)


def loaded(case: Case) -> Case:
    """Return the probe with loads, and the forces of joint and driver as outputs."""
    mechanism = case.mechanism
    bodies = [_with_mass(body, k, mechanism) for k, body in enumerate(mechanism.bodies)]
    last = bodies[-1].name
    ends = ((0.9, 0.4, -0.3), mechanism.points[0].position)
    spring = SpringDamper("spring", GROUND, last, ends, 50.0, 2.0, 0.5)
    heavy = replace(mechanism, bodies=bodies, gravity=GRAVITY, forces=[spring])
    name, weight = _tested(case).name, 10.0 * len(bodies)
    outputs: list[ForceMeasure] = [
        cls(f"{what}_{k}", *default(weight, "N"), joint=name, direction=axis)
        for cls, what in ((JointForce, "force"), (JointMoment, "moment"))
        for k, axis in zip("xyz", ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), strict=True)
    ]
    outputs.append(DriverEffort("effort", *default(weight, "N m"), driver=case.sweep.driver))
    bound = tuple(output.bound(heavy) for output in outputs)
    few = case.sweep.values[np.linspace(0, len(case.sweep.values) - 1, SAMPLES).astype(int)]
    sweep = replace(case.sweep, values=few)
    return replace(case, mechanism=with_markers(heavy, bound), sweep=sweep, outputs=bound)


def driven(case: Case) -> Case | None:
    """Return the loaded probe with drivers of the joint's own coordinates in place of rods, and the
    joint seen from its second body, whose frame is then off the axis; None without coordinates.
    """
    heavy = loaded(case)
    mechanism, tested = heavy.mechanism, _tested(heavy)
    if not isinstance(tested, AxialJoint):
        return None
    rods = [joint for joint in mechanism.joints if joint.name.startswith("rod_")]
    # a screw has two coordinates and one freedom
    found = [each for each in DRIVEN if each.freedom in tested.freedoms][: len(rods)]
    left = rods[len(found) :]
    joints = [tested.reversed() if each is tested else each for each in mechanism.joints]
    drivers = [each(f"own {each.freedom}", tested.name) for each in found]
    mechanism = replace(
        mechanism,
        joints=[joint for joint in joints if joint not in rods or joint in left],
        drivers=[*mechanism.drivers, *drivers],
    )
    motions = {driver.name: DRIVEN[type(driver)] for driver in drivers}
    efforts = [
        DriverEffort(f"{name} effort", *default(10.0, "N m"), driver=name).bound(mechanism)
        for name in motions
    ]
    return replace(
        heavy,
        mechanism=with_markers(mechanism, efforts),
        sweep=replace(heavy.sweep, motions=motions),
        outputs=(*heavy.outputs, *efforts),
    )


def _tested(case: Case) -> Joint:
    # the probe's hinge or rods may be of the same type
    return next(joint for joint in case.mechanism.joints if {*joint.bodies} == {"a", "b"})


def _with_mass(body: Body, number: int, mechanism: Mechanism) -> Body:
    near = [p for j in mechanism.joints if body.name in j.bodies for p in j.points_on(body.name)]
    center = np.mean(near or [(0.0, 0.0, 0.0)], axis=0) + CENTRE
    x, y, z = center.tolist()
    return replace(body, mass=2.0 + number, center_of_mass=(x, y, z), inertia=INERTIA)


def solved(case: Case, mechanism: Mechanism) -> Probe:
    """Solve the loaded probe natively.

    Raises:
        SolveError: samples are missing.
    """
    path: Path = case.sweep.path
    names = tuple(body.name for body in mechanism.moving)
    forces = [each.name for each in (*mechanism.joints, *mechanism.drivers)]
    solver = NativeSolver().prepare(mechanism, path, bodies=names, forces=forces)
    found = solver(TOL)
    if not found.solved.all() or found.forces is None:
        raise SolveError(f"the probe with masses cannot be solved: {found.message}")
    return Probe(mechanism, mechanism.joint(_tested(case).name), found)


# Balance of the bodies, which have their frame at the global origin at design.

# MERGED


def _turn(motion: BodyMotion) -> Array:
    """Return the rotation body -> global, shape (n, 3, 3)."""
    change = rotation_less_identity(quat(motion.p.T))
    return np.eye(3) + np.moveaxis(np.array([[*change.x], [*change.y], [*change.z]]), 2, 0)


def _moving(probe: Probe, body: str, point: Any) -> tuple[Array, Array, Array, Array]:
    """Return place, velocity and acceleration of a point of a body, and the body's angular
    velocity, global axes, shape (n, 3).
    """
    at = np.asarray(point, dtype=np.float64)
    motion = probe.motion.bodies.get(body)
    if motion is None:
        still = np.zeros((len(probe.motion.solved), 3))
        return still + at, still, still, still
    assert motion.v is not None
    assert motion.a is not None
    turn = _turn(motion)
    w, w_t = (np.einsum("nab,nb->na", turn, each[:, 3:]) for each in (motion.v, motion.a))
    arm = turn @ at
    v = motion.v[:, :3] + np.cross(w, arm)
    a = motion.a[:, :3] + np.cross(w_t, arm) + np.cross(w, np.cross(w, arm))
    return motion.r + arm, v, a, w


def work(probe: Probe) -> Array:
    """Return the power of the joint's reaction on both bodies [W], shape (n,)."""
    joint = probe.joint
    point = probe.mechanism.reaction_point(joint)
    place, v, _, w = _moving(probe, joint.j, point)
    origin, v_i, _, w_i = _moving(probe, joint.i, (0.0, 0.0, 0.0))
    there = v_i + np.cross(w_i, place - origin)
    force, moment = probe.reaction.force, probe.reaction.moment
    return (force * (v - there)).sum(axis=1) + (moment * (w - w_i)).sum(axis=1)


def speed(probe: Probe) -> float:
    """Return the largest velocity of any body's frame or turn, in one number [m/s, rad/s]."""
    motions = [each.v for each in probe.motion.bodies.values() if each.v is not None]
    return max(float(np.abs(each).max()) for each in motions)


def unbalanced(probe: Probe, name: str) -> Array:
    """Return what is missing to a body's balance by Newton and Euler, shape (n, 6)."""
    n = len(probe.motion.solved)
    if probe.mechanism.is_fixed(name):
        return np.zeros((n, 6))
    body, motion = probe.mechanism.body(name), probe.motion.bodies[name]
    assert motion.v is not None
    assert motion.a is not None
    assert body.inertia is not None
    centre, _, a, _ = _moving(probe, name, body.center_of_mass)
    force = body.mass * (np.array(GRAVITY) - a)
    inertia, w, w_t = inertia_matrix(body.inertia), motion.v[:, 3:], motion.a[:, 3:]
    change = w_t @ inertia + np.cross(w, w @ inertia)
    torque = -np.einsum("nab,nb->na", _turn(motion), change)
    for push, at, moment in _pushes(probe, name):
        force, torque = force + push, torque + moment + np.cross(at - centre, push)
    return np.hstack([force, torque])


def _pushes(probe: Probe, name: str) -> Iterator[tuple[Array, Array, Array]]:
    """Yield what joints, drivers and the spring do to a body: force, its place, moment."""
    mechanism, forces = probe.mechanism, probe.motion.forces
    assert forces is not None
    for joint in mechanism.joints:
        sign = {joint.j: 1.0, joint.i: -1.0}.get(name)
        if sign is not None:
            found = forces.joints[joint.name]
            place = _moving(probe, joint.j, mechanism.reaction_point(joint))[0]
            yield sign * found.force, place, sign * found.moment
    for driver in mechanism.drivers:
        effort = forces.drivers[driver.name][:, None]
        yield from _by_driver(probe, driver, effort, name)
    (spring,) = (each for each in mechanism.forces if isinstance(each, SpringDamper))
    if name == spring.j:
        start, v_i, *_ = _moving(probe, spring.i, spring.points[0])
        end, v_j, *_ = _moving(probe, spring.j, spring.points[1])
        length = np.linalg.norm(end - start, axis=1)
        along = (end - start) / length[:, None]
        rate = (along * (v_j - v_i)).sum(axis=1)
        tension = spring.stiffness * (length - (spring.free_length or 0.0)) + spring.damping * rate
        yield -tension[:, None] * along, end, 0.0 * end


def _by_driver(
    probe: Probe, driver: Any, effort: Array, name: str
) -> Iterator[tuple[Array, Array, Array]]:
    """Yield what a driver does: a couple about its joint's axis, or a force along it."""
    joint: Any = probe.mechanism.joint(driver.joint)
    if name not in joint.bodies:
        return
    tip, start = (_moving(probe, joint.i, at)[0] for at in (joint.axis, (0.0, 0.0, 0.0)))
    push = (1.0 if name == joint.j else -1.0) * effort * (tip - start)
    push /= np.linalg.norm(joint.axis)
    place = _moving(probe, joint.j, joint.point)[0]
    yield (0.0 * push, place, push) if driver.turns else (push, place, 0.0 * push)


# MERGED
# MERGED

# Round-off of sums of some thirty products over the smallest singular value of the probes (0.01),
# squared for accelerations, and ten times that.
LIMIT = 1e-10
WHY = "round-off over the squared smallest singular value of the probe, relative to the forces"
# An exact change of units, and a shift of the probe [m]: its coordinates lose three digits.
SMALLER, SHIFT = 2.0**-10, 128.0
PLACE_LIMIT = 1e3 * LIMIT


def reactions(probe: Probe, case: Case, what: str = "reaction") -> Iterator[Finding]:
    """Yield the findings on the reaction of the joint under test.

    Args:
        case: from `loaded` or `driven`, solved as `probe`.
        what: first part of the names of the findings.
    """
    forces = probe.motion.forces
    assert forces is not None
    largest = float(np.nanmax(forces.largest_power))
    yield judged(
        f"{what}: power",
        np.abs(forces.power)[None] / largest,
        LIMIT,
        WHY,
        ["power"],
        remedy="drivers, masses and springs do not balance: a joint has nu = 0",
    )
    yield judged(
        f"{what}: no work",
        np.abs(work(probe))[None] / (probe.size * speed(probe)),
        LIMIT,
        WHY,
        ["work"],
        remedy="the reaction works on the joint's freedoms: see rows and nu",
    )
    off = np.array([unbalanced(probe, body) for body in probe.joint.bodies])
    yield judged(
        f"{what}: acts and reacts",
        np.abs(off).max(axis=2) / probe.size,
        LIMIT,
        WHY,
        [f"body {body}" for body in probe.joint.bodies],
        remedy="what one body gets is not the opposite of what the other gets: see rows; a driver's"
        " force acts along the axis through the point: see measured()",
    )
    yield from _variants(probe, case, what)


def _variants(probe: Probe, case: Case, what: str) -> Iterator[Finding]:
    """Check that forces do not depend on what is arbitrary."""
    mechanism = case.mechanism
    others: Sequence[tuple[str, Mechanism, float, float]] = (
        ("order", _turned_round(mechanism), 1.0, LIMIT),
        ("units", _scaled(mechanism, SMALLER), SMALLER, LIMIT),
        ("place", _shifted(mechanism, SHIFT), 1.0, PLACE_LIMIT),
    )
    for name, other, scale, limit in others:
        remedy = (
            f"the reaction depends on the {name}: use no constants of length, no global coordinates"
            " and no internal origins in primitives()"
        )
        try:
            found = solved(_paced(case, scale), other).reaction
        except KincheckError as error:
            yield Finding(f"{what}: {name}", Verdict.FAIL, message=f"{error}; {remedy}")
            continue
        off = np.concatenate(
            [
                found.force / scale - probe.reaction.force,
                found.moment / scale**2 - probe.reaction.moment,
            ],
            axis=1,
        )
        yield judged(
            f"{what}: {name}",
            np.abs(off).T / probe.size,
            limit,
            WHY,
            ["force x", "force y", "force z", "moment x", "moment y", "moment z"],
            remedy=remedy,
        )


def _paced(case: Case, factor: float) -> Case:
    """Return the case with lengths in the motions of its drivers by a factor."""
    motions = {
        name: replace(motion, amplitude=factor * motion.amplitude)
        if isinstance(motion, Sine) and not case.mechanism.driver(name).turns
        else motion
        for name, motion in case.sweep.motions.items()
    }
    return replace(case, sweep=replace(case.sweep, motions=motions))


def _turned_round(mechanism: Mechanism) -> Mechanism:
    return replace(mechanism, bodies=mechanism.bodies[::-1], joints=mechanism.joints[::-1])


def _scaled(mechanism: Mechanism, factor: float) -> Mechanism:
    """Return the mechanism with all lengths by a factor, the same mass and times."""

    def place(point: Any) -> Any:
        return tuple(factor * x for x in point)

    return replace(
        mechanism,
        bodies=[body.in_frame(place, 1.0 / factor) for body in mechanism.bodies],
        joints=[joint.scaled(factor) for joint in mechanism.joints],
        points=[replace(point, position=place(point.position)) for point in mechanism.points],
        gravity=place(mechanism.gravity),
        forces=[force.in_frame(place, 1.0 / factor) for force in mechanism.forces],
    )


def _shifted(mechanism: Mechanism, offset: float) -> Mechanism:
    def place(point: Any) -> Any:
        return tuple(x + offset for x in point)

    return replace(
        mechanism,
        bodies=[body.in_frame(place) for body in mechanism.bodies],
        joints=[replace(j, **j.mapped({Kind.POSITION: place})) for j in mechanism.joints],
        points=[replace(point, position=place(point.position)) for point in mechanism.points],
        forces=[force.in_frame(place) for force in mechanism.forces],
    )
