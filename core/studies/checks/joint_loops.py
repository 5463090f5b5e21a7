"""A joint in a small closed loop, solved natively and by every given engine, on the joint itself or
on its equivalent; and checks of its reaction there, with masses, gravity and a spring.

The reaction does no work on the freedoms of the joint, the first body gets the opposite of what the
second gets. Bodies are balanced by Newton and Euler from their motion: no equation of the forces
takes part.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...case.case import Case, Series
from ...case.io.outputs import default
from ...case.joint_probe import alternatives
from ...case.measures import DriverEffort, ForceMeasure, JointForce, JointMoment
from ...case.quantity import AXES, with_markers
from ...errors import MechanismError, SolveError
from ...forces import Reaction
from ...harness.compare import output_series
from ...harness.engine import STANDARD, Engine
from ...harness.execution import Answer, Failure, Pair, attempt, error_text
from ...harness.native_engine import NativeEngine
from ...harness.record import Outcome
from ...harness.verdict import Standard
from ...harness.verdict import judge_answer as verdict_of
from ...joints import AxialJoint, Joint
from ...kinematics import NativeSolver
from ...mechanism.body import Body, inertia_matrix
from ...mechanism.loads import SpringDamper
from ...mechanism.mechanism import GROUND, Mechanism, declared_equivalent, with_equivalents
from ...mechanism.motions import JointAngle, JointDisplacement, JointDriver, Sine
from ...trajectory import Array, Trajectory
from .findings import Finding, Limit, Verdict, agreement, fault_finding, judge_figures, skip
from .traced_joint import CarriedPoint, rotate_vectors

# Largest accepted constraint residual of an engine [m or -]: round-off of metre-sized coordinates,
# x1000.
TOL = 1e-12
TOL_WHY = "round-off of metre-sized coordinates, x1000"
# The probe's rods may lock a joint of another kind before the end of the sweep. Other rods are
# tried, then those that move farthest, over this part of their way, for a singular pose is near its
# end, and over halves of it: at most this number.
WAY, HALVINGS = 0.5, 3
AGREE_WHY = "error over the tolerance of the probe's outputs"
FAILING_EQUIVALENT = "equivalent() fails, see native"


def loops(
    tested: Joint | type[Joint], engines: Sequence[Engine], failing: Sequence[str] = ()
) -> Iterator[Finding]:
    """Solve the probe of a joint, or of a joint type, natively and in the other engines, and
    yield the findings.

    Args:
        failing: checks of the equations that fail: then there is no sense in forces.
    """
    try:
        case, native = _solvable_probe(tested)
    except Exception as error:  # any error of the joint's own code
        yield _fault_of("loop", error)
        return
    n = len(case.sweep.values)
    if isinstance(native, Failure) or native.solved < n:
        own = bool(failing) or (isinstance(native, Failure) and native.kind is None)
        yield fault_finding("loop", native.message) if own else _not_judged("loop", native.message)
        return
    reached = f"{n} of {n} samples solved, to {case.sweep.values.max():.3g} rad"
    yield Finding("loop", Verdict.PASS, native.residual, TOL, TOL_WHY, message=reached)
    other: Case | str = "there is no equivalent() to solve instead"
    name = "loop: native, equivalent"
    try:
        equivalent = _equivalent(case)
        if equivalent is not None:
            other = equivalent
            yield _compare_answer(name, other, _solve_case(NativeEngine(), other), native.outputs)
    except Exception as error:  # any error of the joint's own code
        other = FAILING_EQUIVALENT
        yield fault_finding(name, error_text(error))
    if not engines:
        yield skip("loop: simulators", "no engines were given")
    simulators = [engine for engine in engines if engine.name != STANDARD]
    for engine in simulators:
        yield _compare_engine(engine, case, other, native.outputs, "loop")
    if failing:
        yield skip("reaction", f"first repair {', '.join(failing)}")
        return
    try:
        yield from _reactions(with_loads(case), other, simulators, "reaction")
        own = with_own_drivers(case)
        if own is None:
            yield skip("driven reaction", "no AxialJoint: nothing drives it")
        else:
            yield from _reactions(own, other, simulators, "driven reaction")
    except Exception as error:  # any error of the joint's own code
        yield _fault_of("reaction", error)


def _not_judged(check: str, why: str) -> Finding:
    """Return the finding of a check whose own loop fails, as it may with a right joint."""
    return skip(check, f"not judged, the loop of this check fails: {why}")


def _fault_of(check: str, error: Exception) -> Finding:
    """Return the finding of an error: of the joint's own code, or of the solution of a loop."""
    solving = isinstance(error, SolveError)
    return (_not_judged if solving else fault_finding)(check, error_text(error))


def _reactions(
    heavy: Case, other: Case | str, engines: Sequence[Engine], what: str
) -> Iterator[Finding]:
    """Check the reaction in a loaded probe, and compare it with that of the engines."""
    probe = solve_probe(heavy)
    yield from reactions(probe, what)
    reference = {each.name: output_series(heavy, each, probe.motion) for each in heavy.outputs}
    if not isinstance(other, str):
        try:
            equivalent = _equivalent(heavy)
            assert equivalent is not None
            drivers = {driver.name for driver in heavy.mechanism.drivers}
            there = drivers | {joint.name for joint in equivalent.mechanism.joints}
            outputs = tuple(each for each in heavy.outputs if there.issuperset(each.forces))
            other = replace(equivalent, outputs=outputs)
        except MechanismError as error:  # a driver or coupler names a joint that is replaced
            other = f"its equivalent cannot be driven: {error}"
    for engine in engines:
        yield _compare_engine(engine, heavy, other, reference, what)


def _solvable_probe(tested: Joint | type[Joint]) -> tuple[Case, Answer | Failure]:
    """Return the first probe with all samples solved; the one that moves farthest if none is."""
    native, farthest, far = NativeEngine(), None, 0.0
    for case in alternatives(tested):
        found = _solve_case(native, case)
        reached = _reach(case, found)
        if reached == math.inf:
            return case, found
        if farthest is None or reached > far:
            farthest, far = (case, found), reached
    assert farthest is not None
    case, found = farthest
    values = case.sweep.values / float(np.abs(case.sweep.values).max())
    for k in range(HALVINGS if far else 0):
        shorter = replace(case, sweep=replace(case.sweep, values=WAY * 0.5**k * far * values))
        again = _solve_case(native, shorter)
        if _reach(shorter, again) == math.inf:
            return shorter, again
    return case, found


def _reach(case: Case, found: Answer | Failure) -> float:
    """Return how far both ways from design all samples are solved; infinite if all are."""
    if isinstance(found, Failure):
        return 0.0
    solved = np.isfinite(next(iter(found.outputs.values())).position)
    off = np.abs(case.sweep.values - case.sweep.design)
    if solved.all():
        return math.inf
    return float(off[off < off[~solved].min()].max(initial=0.0))


def _solve_case(engine: Engine, case: Case) -> Answer | Failure:
    return attempt(Pair(case, engine, TOL, timed=False)).result


def _equivalent(case: Case) -> Case | None:
    """Return the case with the tested joint replaced by its `equivalent()` bodies and joints; None
    if it has none.
    """
    tested = next(joint for joint in case.mechanism.joints if joint.type == case.name)
    offered = declared_equivalent(tested)
    if offered is None:
        return None
    another = declared_equivalent(replace(tested, name=f"{tested.name} again")) or ((), ())
    names = {part.name for parts in offered for part in parts}
    if taken := sorted(names & {part.name for parts in another for part in parts}):
        raise MechanismError(
            f"{tested}: equivalent() names a part {taken[0]!r}, whatever the joint's name is, so"
            " two such joints collide in a mechanism. Build the names of its parts from self.name."
        )
    known = {*Joint.registry.values()} - {type(tested)}
    mechanism = with_equivalents(case.mechanism, known)
    return replace(case, name=f"{case.name}_equivalent", mechanism=mechanism)


def _compare_engine(
    engine: Engine, case: Case, other: Case | str, reference: Mapping[str, Series], what: str
) -> Finding:
    """Compare an engine's answer with the native one; `other` is the equivalent case, or the reason
    for its absence.
    """
    name, chosen, found = f"{what}: {engine.name}", case, _solve_case(engine, case)
    if isinstance(found, Failure) and found.outcome is Outcome.UNSUPPORTED:
        if isinstance(other, str):
            return skip(name, f"{found.message}; {other}")
        reason, chosen, found = found.message, other, _solve_case(engine, other)
        if isinstance(found, Failure) and found.outcome is Outcome.UNSUPPORTED:
            return skip(name, f"{reason}; nor its equivalent: {found.message}")
    if isinstance(found, Failure):
        if found.outcome is Outcome.UNAVAILABLE:
            return skip(name, "not installed")
        # engines replace joints too, and meet the same error
        if other == FAILING_EQUIVALENT:
            return skip(name, FAILING_EQUIVALENT)
        return fault_finding(name, found.message)
    itself = chosen is case and "equivalents" not in found.details
    finding = _compare_answer(name, chosen, found, reference)
    how = "on the joint itself" if itself else "on the equivalent"
    return replace(finding, message="; ".join(filter(None, (how, finding.message))))


def _compare_answer(
    name: str, case: Case, found: Answer | Failure, reference: Mapping[str, Series]
) -> Finding:
    """Compare positions, velocities and accelerations, or forces, with the native ones of the joint
    itself.
    """
    if isinstance(found, Failure):
        return fault_finding(name, found.message)
    judgement = verdict_of(case, found, Standard(reference), TOL)
    verdict = {Outcome.PASS: Verdict.PASS, Outcome.UNJUDGED: Verdict.SKIP}.get(
        judgement.outcome, Verdict.FAIL
    )
    message = "; ".join(judgement.messages)
    return agreement(name, verdict, judgement.errors, AGREE_WHY, message)


# The reaction of the joint, in the loop with loads

# Samples of the probe: forces follow from each pose alone.
SAMPLES = 3
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


def with_loads(case: Case) -> Case:
    """Return the probe with loads, and the forces of joint and driver as outputs."""
    mechanism = case.mechanism
    bodies = [_with_mass(body, k, mechanism) for k, body in enumerate(mechanism.bodies)]
    last = bodies[-1].name
    ends = ((0.9, 0.4, -0.3), mechanism.points[0].position)
    spring = SpringDamper("spring", GROUND, last, ends, 50.0, 2.0, 0.5)
    heavy = replace(mechanism, bodies=bodies, gravity=GRAVITY, forces=[spring])
    name, weight = _tested_joint(case).name, 10.0 * len(bodies)
    outputs: list[ForceMeasure] = [
        cls(f"{what}_{k}", *default(weight, "N"), joint=name, direction=axis)
        for cls, what in ((JointForce, "force"), (JointMoment, "moment"))
        for k, axis in AXES.items()
    ]
    outputs.append(DriverEffort("effort", *default(weight, "N m"), driver=case.sweep.driver))
    bound = tuple(output.bound(heavy) for output in outputs)
    few = case.sweep.values[np.linspace(0, len(case.sweep.values) - 1, SAMPLES).astype(int)]
    sweep = replace(case.sweep, values=few)
    return replace(case, mechanism=with_markers(heavy, bound), sweep=sweep, outputs=bound)


def with_own_drivers(case: Case) -> Case | None:
    """Return the loaded probe with drivers of the joint's own coordinates in place of rods, and the
    joint seen from its second body, whose frame is then off the axis; None without coordinates.
    """
    heavy = with_loads(case)
    mechanism, tested = heavy.mechanism, _tested_joint(heavy)
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


def _tested_joint(case: Case) -> Joint:
    # the probe's hinge or rods may be of the same type
    return next(joint for joint in case.mechanism.joints if {*joint.bodies} == {"a", "b"})


def _with_mass(body: Body, number: int, mechanism: Mechanism) -> Body:
    near = [p for j in mechanism.joints if body.name in j.bodies for p in j.points_on(body.name)]
    center = np.mean(near or [(0.0, 0.0, 0.0)], axis=0) + CENTRE
    x, y, z = center.tolist()
    return replace(body, mass=2.0 + number, center_of_mass=(x, y, z), inertia=INERTIA)


def solve_probe(case: Case) -> Probe:
    """Solve the loaded probe natively.

    Raises:
        SolveError: samples are missing.
    """
    mechanism = case.mechanism
    names = tuple(body.name for body in mechanism.moving)
    forces = [each.name for each in (*mechanism.joints, *mechanism.drivers)]
    solver = NativeSolver().prepare(mechanism, case.sweep.path, bodies=names, forces=forces)
    found = solver(TOL)
    if not found.solved.all() or found.forces is None:
        raise SolveError(f"the probe with masses cannot be solved: {found.message}")
    return Probe(mechanism, mechanism.joint(_tested_joint(case).name), found)


# Balance of the bodies, which have their frame at the global origin at design.


def _body_point(probe: Probe, body: str, point: Any = (0.0, 0.0, 0.0)) -> CarriedPoint:
    """Return a point of a body over the samples."""
    at = np.asarray(point, dtype=np.float64)
    motion = probe.motion.bodies.get(body)
    if motion is None:
        still = np.zeros((len(probe.motion.solved), 3))
        return CarriedPoint(at, still + at, *[still] * 4)
    assert motion.v is not None
    assert motion.a is not None
    w, w_t = (rotate_vectors(motion.p, each[:, 3:]) for each in (motion.v, motion.a))
    arm = rotate_vectors(motion.p, at)
    return CarriedPoint.of(arm, motion.r, motion.v[:, :3], w, motion.a[:, :3], w_t)


def work(probe: Probe) -> Array:
    """Return the power of the joint's reaction on both bodies [W], shape (n,)."""
    joint = probe.joint
    j = _body_point(probe, joint.j, probe.mechanism.reaction_point(joint))
    i = _body_point(probe, joint.i)
    v = i.v + np.cross(i.w, j.place - i.place)
    force, moment = probe.reaction.force, probe.reaction.moment
    return (force * (j.v - v)).sum(axis=1) + (moment * (j.w - i.w)).sum(axis=1)


def largest_speed(probe: Probe) -> float:
    """Return the largest velocity of any body's frame or turn, in one number [m/s, rad/s]."""
    motions = [each.v for each in probe.motion.bodies.values() if each.v is not None]
    return max(float(np.abs(each).max()) for each in motions)


def missing_wrench(probe: Probe, name: str) -> Array:
    """Return the wrench missing to a body's balance by Newton and Euler, shape (n, 6)."""
    n = len(probe.motion.solved)
    if probe.mechanism.is_fixed(name):
        return np.zeros((n, 6))
    body, motion = probe.mechanism.body(name), probe.motion.bodies[name]
    assert motion.v is not None
    assert motion.a is not None
    centre = _body_point(probe, name, body.center_of_mass)
    force = body.mass * (np.array(GRAVITY) - centre.a)
    inertia, w, w_t = inertia_matrix(body.inertia), motion.v[:, 3:], motion.a[:, 3:]
    torque = -rotate_vectors(motion.p, w_t @ inertia + np.cross(w, w @ inertia))
    for push, at, moment in _pushes(probe, name):
        force, torque = force + push, torque + moment + np.cross(at - centre.place, push)
    return np.hstack([force, torque])


def _pushes(probe: Probe, name: str) -> Iterator[tuple[Array, Array, Array]]:
    """Yield the loads of joints, drivers and the spring on a body: force, its place, moment."""
    mechanism, forces = probe.mechanism, probe.motion.forces
    assert forces is not None
    for joint in mechanism.joints:
        sign = {joint.j: 1.0, joint.i: -1.0}.get(name)
        if sign is not None:
            found = forces.joints[joint.name]
            place = _body_point(probe, joint.j, mechanism.reaction_point(joint)).place
            yield sign * found.force, place, sign * found.moment
    for driver in mechanism.drivers:
        effort = forces.drivers[driver.name][:, None]
        yield from _by_driver(probe, driver, effort, name)
    (spring,) = (each for each in mechanism.forces if isinstance(each, SpringDamper))
    if name == spring.j:
        ends = zip((spring.i, spring.j), spring.points, strict=True)
        start, end = (_body_point(probe, body, at) for body, at in ends)
        length = np.linalg.norm(end.place - start.place, axis=1)
        along = (end.place - start.place) / length[:, None]
        rate = (along * (end.v - start.v)).sum(axis=1)
        tension = spring.stiffness * (length - (spring.free_length or 0.0)) + spring.damping * rate
        yield -tension[:, None] * along, end.place, 0.0 * end.place


def _by_driver(
    probe: Probe, driver: Any, effort: Array, name: str
) -> Iterator[tuple[Array, Array, Array]]:
    """Yield the load of a driver: a couple about its joint's axis, or a force along it."""
    joint: Any = probe.mechanism.joint(driver.joint)
    if name not in joint.bodies:
        return
    axis = _body_point(probe, joint.i, joint.axis).arm / np.linalg.norm(joint.axis)
    push = (1.0 if name == joint.j else -1.0) * effort * axis
    place = _body_point(probe, joint.j, joint.point).place
    yield (0.0 * push, place, push) if driver.turns else (push, place, 0.0 * push)


LIMIT = Limit(
    1e-10, "round-off over the squared smallest singular value of the probe, relative to the forces"
)
"""Round-off of sums of some thirty products over the smallest singular value of the probes (0.01),
squared for accelerations, and ten times that."""


def reactions(probe: Probe, what: str = "reaction") -> Iterator[Finding]:
    """Yield the findings on the reaction of the joint under test.

    Args:
        probe: of a case from `loaded` or `driven`.
        what: first part of the names of the findings.
    """
    forces = probe.motion.forces
    assert forces is not None
    missing = np.abs(forces.power)[None] / float(np.nanmax(forces.largest_power))
    yield judge_figures(f"{what}: power", missing, LIMIT, ["power"])
    done = np.abs(work(probe))[None] / (probe.size * largest_speed(probe))
    yield judge_figures(f"{what}: no work", done, LIMIT, ["work"])
    off = np.array([missing_wrench(probe, body) for body in probe.joint.bodies])
    names = [f"body {body}" for body in probe.joint.bodies]
    figures = np.abs(off).max(axis=2) / probe.size
    yield judge_figures(f"{what}: acts and reacts", figures, LIMIT, names)
