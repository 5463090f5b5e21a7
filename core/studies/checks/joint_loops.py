"""A joint in a small closed loop, solved natively and by every given engine, on the joint itself or
on its equivalent.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...algebra import Quat, quat, vec
from ...case.case import Case, Series
from ...case.joint_probe import alternatives
from ...errors import MechanismError
from ...harness.compare import output_series
from ...harness.engine import Engine
from ...harness.execution import Answer, Failure, Pair, attempt, error_text
from ...harness.native_engine import NativeEngine
from ...harness.record import Outcome
from ...harness.standard import STANDARD, Standard
from ...harness.verdict import judged as verdict_of
from ...joints import Attachment, AxialJoint, Joint
from ...mechanism.mechanism import declared_equivalent, with_equivalents
from ...primitives.base import Drive, Pose, Twist
from ...trajectory import Array
from .findings import AMPLIFIED, Finding, Verdict, agreement, judged, skipped, stated
from .loaded_probe import driven, loaded, reactions, solved
from .manifold import Specimen
from .traced_joint import COLUMNS, POSES, CarriedPoint, turned

FREEDOMS = ("rotation", "translation")
WHATS = ("value", "rate", "acceleration", "force", "turns")
WAY = 6.0
"""Largest further angle at which an angle's driver is examined [rad], almost a turn."""


def driver(s: Specimen) -> Iterator[Finding]:
    """Check every drivable coordinate of the joint."""
    joint = s.joint
    driven = [each for each in joint.freedoms if each in FREEDOMS]
    if not isinstance(joint, AxialJoint) or not driven:
        yield skipped("driver", "it has no coordinate that can be driven")
        return
    names = [f"{freedom}: {what}" for freedom in driven for what in WHATS]
    figures = np.concatenate([_defects(s, joint, freedom) for freedom in driven])
    remedy = (
        "measured() is to drive the joint's own coordinate: phi = 0 at the drive's c, nu of its"
        " c_t, gamma of its c_tt; its rows are a force along the axis through the joint's point, or"
        " a couple about the axis; its branch tests are positive at c, and not a turn further"
    )
    yield judged("driver", figures, AMPLIFIED, names, remedy=remedy)


def _moving(s: Specimen, k: int, arm: Array) -> CarriedPoint:
    state, rate, acceleration = (
        x[size * k : size * (k + 1)].T
        for x, size in ((s.state, 7), (s.rate, COLUMNS), (s.acceleration, COLUMNS))
    )
    rates = (*np.split(rate, 2, axis=1), *np.split(acceleration, 2, axis=1))
    return CarriedPoint.of(turned(state[:, 3:], arm), s.traced.origins[k] + state[:, :3], *rates)


def coordinate(s: Specimen, joint: AxialJoint, freedom: str) -> tuple[list[Array], Array]:
    """Return a coordinate of the joint with its rate and acceleration, by their definition, and the
    wrench of a unit effort on both bodies, lengths in the unit of the place.

    Returns:
        Three arrays of shape (lanes,), and one of shape (12, lanes): force and torque about the
        origin, of the first body, then of the second.
    """
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    point = np.array(joint.point) / s.place.unit
    i, j = (_moving(s, k, point - s.traced.origins[k]) for k in range(2))
    h = turned(s.state[3:7].T, axis)
    return _rotation(s, i, j, h, axis) if freedom == "rotation" else _slide(i, j, h)


def _defects(s: Specimen, joint: AxialJoint, freedom: str) -> Array:
    """Return the defects of one coordinate's driver as named by `WHATS`, shape (5, lanes)."""
    (c, c_t, c_tt), wrench = coordinate(s, joint, freedom)
    scaled = joint.scaled(1.0 / s.place.unit)
    attached = (Attachment(vec(tuple(origin))) for origin in s.traced.origins)
    measured: Any = scaled.measured(freedom, *attached)
    primitive, per_rate = (_driving(measured, c, rate, c_tt) for rate in (c_t, 1.0))
    poses = _poses(s.state)
    twists = [Twist(vec(tuple(x[:3])), vec(tuple(x[3:]))) for x in (s.rate[:6], s.rate[6:12])]
    (row,), (phi,) = primitive.rows(*poses), primitive.phi(*poses)
    (nu,), (one,), (gamma,) = (
        primitive.nu(*poses),
        per_rate.nu(*poses),
        primitive.gamma(*poses, *twists),
    )
    entries = np.array([x + np.zeros(s.lanes) for part in row for x in part])
    rates, accelerations = s.rate[: 2 * COLUMNS], s.acceleration[: 2 * COLUMNS]
    speed, pull = np.linalg.norm(rates, axis=0), np.linalg.norm(accelerations, axis=0)
    there, further = s.state, 0.0
    if freedom == "rotation":
        further = np.linspace(-WAY, WAY, s.lanes)
        there = _turned_on(s, joint, further)
    lost, far = _turns(measured, there, c + further, turning=freedom == "rotation")
    figures = (
        np.maximum(np.abs(phi), np.abs(far)),
        ((entries * rates).sum(axis=0) - nu) / (1.0 + speed),
        ((entries * accelerations).sum(axis=0) - gamma) / (1.0 + speed**2 + pull),
        np.abs(entries - one * wrench).max(axis=0),
        lost,
    )
    size = np.linalg.norm(entries, axis=0)
    return np.abs(figures) / np.where(size > 0.0, size, 1.0)


def _poses(state: Array) -> list[Pose]:
    return [Pose.of(vec(tuple(x[:3])), quat(x[3:])) for x in (state[:7], state[7:POSES])]


def _driving(measured: Any, c: Any, c_t: Any = 0.0, c_tt: Any = 0.0) -> Any:
    return replace(measured, drive=Drive(c, c_t, c_tt, np.cos(0.5 * c), np.sin(0.5 * c)))


def _turned_on(s: Specimen, joint: AxialJoint, angle: Array) -> Array:
    """Return the state with body j turned further about the axis."""
    h, state = turned(s.state[3:7].T, np.array(joint.axis)), s.state.copy()
    h /= np.linalg.norm(h, axis=1)[:, None]
    arm = np.array(joint.point) / s.place.unit - s.traced.origins[1]
    turn = Quat(np.cos(0.5 * angle), vec([*(np.sin(0.5 * angle) * h.T)]))
    state[10:14] = np.array([*(turn * quat(s.state[10:14]))])
    state[7:10] += (turned(s.state[10:14].T, arm) - turned(state[10:14].T, arm)).T
    return state


def _turns(measured: Any, state: Array, c: Array, *, turning: bool) -> tuple[Array, Array]:
    """Return one where a branch test refuses the drive's value, or accepts a zero of phi a turn
    further; and phi.
    """
    pair = _poses(state)
    wrong = np.zeros(state.shape[1], np.bool_)
    at_turns: list[Array] = []
    for turns in (0, 1) if turning else (0,):
        primitive = _driving(measured, c + 2.0 * np.pi * turns)
        (phi,) = primitive.phi(*pair)
        tests = [np.ones_like(c), *primitive.branch(*pair)]
        accepted = np.min(np.broadcast_arrays(*tests), axis=0) > 0.0
        wrong |= accepted & (np.abs(phi) < AMPLIFIED.value) if turns else ~accepted
        at_turns.append(phi + 0.0 * c)
    return wrong.astype(np.float64), at_turns[0]


def _slide(i: CarriedPoint, j: CarriedPoint, h: Array) -> tuple[list[Array], Array]:
    """Return the displacement with its rates, and the wrench of a unit force on both bodies."""
    d, d_t, d_tt = j.place - i.place, j.v - i.v, j.a - i.a
    h_t = np.cross(i.w, h)
    h_tt = np.cross(i.w_t, h) + np.cross(i.w, h_t)
    acceleration = _dot(h, d_tt) + 2.0 * _dot(h_t, d_t) + _dot(h_tt, d)
    values = [_dot(h, d), _dot(h, d_t) + _dot(h_t, d), acceleration]
    # the force on the first body acts at the same place, beyond its own point
    torques = -np.cross(i.arm + d, h), np.cross(j.arm, h)
    return values, np.hstack([-h, torques[0], h, torques[1]]).T


def _rotation(
    s: Specimen, i: CarriedPoint, j: CarriedPoint, h: Array, axis: Array
) -> tuple[list[Array], Array]:
    """Return the angle with its rates, and the wrench of a unit couple on both bodies."""
    p, q = s.state[3:7], s.state[10:14]
    cosine = (p * q).sum(axis=0)
    # axis . (vector part of conjugate(p) q)
    vector = p[0] * q[1:] - q[0] * p[1:] - np.cross(p[1:], q[1:], axis=0)
    angle = 2.0 * np.arctan2(axis @ vector, cosine)
    w, w_t = j.w - i.w, j.w_t - i.w_t
    values = [angle, _dot(h, w), _dot(h, w_t) + _dot(np.cross(i.w, h), w)]
    return values, np.hstack([0.0 * h, -h, 0.0 * h, h]).T


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=1)


# Largest accepted constraint residual of an engine [m or -]: round-off of metre-sized coordinates,
# x1000.
TOL = 1e-12
TOL_WHY = "round-off of metre-sized coordinates, x1000"
# The probe's rods may lock a joint of another kind before the end of the sweep. Other rods are
# tried, then shorter sweeps: at most this number of halvings.
HALVINGS = 3
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
        case, native = _unlocked(tested)
    except Exception as error:  # any error of the joint's own code
        yield stated("loop", error_text(error))
        return
    n = len(case.sweep.values)
    if isinstance(native, Failure):
        yield stated("loop", native.message)
        return
    reached = f"{native.solved} of {n} samples solved, to {case.sweep.values.max():.3g} rad"
    if native.solved < n:
        yield stated("loop", f"{reached}: {native.message}")
        return
    yield Finding("loop", Verdict.PASS, native.residual, TOL, TOL_WHY, message=reached)
    other: Case | str = "there is no equivalent() to solve instead"
    name = "loop: native, equivalent"
    try:
        equivalent = _equivalent(case)
        if equivalent is not None:
            other = equivalent
            yield _compared(name, other, _solved(NativeEngine(), other), native.outputs)
    except Exception as error:  # any error of the joint's own code
        other = FAILING_EQUIVALENT
        yield stated(name, error_text(error))
    if not engines:
        yield skipped("loop: simulators", "no engines were given")
    simulators = [engine for engine in engines if engine.name != STANDARD]
    for engine in simulators:
        yield _simulated(engine, case, other, native.outputs, "loop")
    if failing:
        yield skipped("reaction", f"first repair {', '.join(failing)}")
        return
    try:
        yield from _reactions(loaded(case), other, simulators, "reaction")
        own = driven(case)
        if own is None:
            yield skipped("driven reaction", "no AxialJoint: nothing drives it")
        else:
            yield from _reactions(own, other, simulators, "driven reaction")
    except Exception as error:  # any error of the joint's own code
        yield stated("reaction", error_text(error))


def _reactions(
    heavy: Case, other: Case | str, engines: Sequence[Engine], what: str
) -> Iterator[Finding]:
    """Check the reaction in a loaded probe, and compare it with that of the engines."""
    probe = solved(heavy)
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
        yield _simulated(engine, heavy, other, reference, what)


def _unlocked(tested: Joint | type[Joint]) -> tuple[Case, Answer | Failure]:
    """Return the first probe with all samples solved; the last one tried if none is."""
    first, *others = alternatives(tested)
    shorter = [
        replace(first, sweep=replace(first.sweep, values=0.5**k * first.sweep.values))
        for k in range(1, HALVINGS + 1)
    ]
    native = NativeEngine()
    case, found = first, _solved(native, first)
    for another in (*others, *shorter):
        if isinstance(found, Answer) and found.solved == len(case.sweep.values):
            break
        case, found = another, _solved(native, another)
    return case, found


def _solved(engine: Engine, case: Case) -> Answer | Failure:
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


def _simulated(
    engine: Engine, case: Case, other: Case | str, reference: Mapping[str, Series], what: str
) -> Finding:
    """Compare an engine's answer with the native one; `other` is the equivalent case, or the reason
    for its absence.
    """
    name, chosen, found = f"{what}: {engine.name}", case, _solved(engine, case)
    if isinstance(found, Failure) and found.outcome is Outcome.UNSUPPORTED:
        if isinstance(other, str):
            return skipped(name, f"{found.message}; {other}")
        reason, chosen, found = found.message, other, _solved(engine, other)
        if isinstance(found, Failure) and found.outcome is Outcome.UNSUPPORTED:
            return skipped(name, f"{reason}; nor its equivalent: {found.message}")
    if isinstance(found, Failure):
        if found.outcome is Outcome.UNAVAILABLE:
            return skipped(name, "not installed")
        # engines replace joints too, and meet the same error
        if other == FAILING_EQUIVALENT:
            return skipped(name, FAILING_EQUIVALENT)
        return stated(name, found.message)
    itself = chosen is case and "equivalents" not in found.details
    finding = _compared(name, chosen, found, reference)
    how = "on the joint itself" if itself else "on the equivalent"
    return replace(finding, message="; ".join(filter(None, (how, finding.message))))


def _compared(
    name: str, case: Case, found: Answer | Failure, reference: Mapping[str, Series]
) -> Finding:
    """Compare positions, velocities and accelerations, or forces, with the native ones of the joint
    itself.
    """
    if isinstance(found, Failure):
        return stated(name, found.message)
    judgement = verdict_of(case, found, Standard(reference), TOL)
    verdict = {Outcome.PASS: Verdict.PASS, Outcome.UNJUDGED: Verdict.SKIP}.get(
        judgement.outcome, Verdict.FAIL
    )
    message = "; ".join(judgement.messages)
    return agreement(name, verdict, judgement.errors, AGREE_WHY, message)
