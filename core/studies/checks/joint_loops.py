"""A joint in a small closed loop, solved natively and by every given engine, on the joint itself or
on its equivalent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...case.case import Case, Quantity, Series
from ...case.joint_probe import alternatives
from ...errors import MechanismError
from ...harness.compare import describe, deviations, output_series
from ...harness.engine import Engine
from ...harness.record import Deviation, Outcome
from ...harness.standard import STANDARD
from ...harness.trajectory_check import check
from ...harness.verdict import excess
from ...joints import Joint
from ...kinematics import solve
from ...mechanism.equivalents import declared_equivalent, with_equivalents
from ...trajectory import Array, Trajectory
from .findings import Finding, Verdict, judged
from .loaded_probe import driven, loaded, reactions, solved
from .manifold import ROUND_OFF

# Largest accepted constraint residual of an engine [m or -]: round-off of metre-sized coordinates,
# x1000.
TOL = 1e-12
# The probe's rods may lock a joint of another kind before the end of the sweep. Other rods are
# tried, then shorter sweeps: at most this number of halvings.
HALVINGS = 3
# Weights of sixth-order differences over seven samples.
WEIGHTS = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
# Intervals of the differences in each interval of the probe.
FINER = 4
RATES_WHY = "what the differences change by as their step is doubled: 63 times their error"
AGREE_WHY = "error over the tolerance of the probe's outputs"


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
        yield _broken("loop", error)
        return
    solved = (
        f"{native.solved.sum()} of {len(native.solved)} samples solved, to"
        f" {case.sweep.values.max():.3g} rad"
    )
    if not native.solved.all():
        yield Finding("loop", Verdict.FAIL, message=f"{solved}: {native.message}")
        return
    yield Finding(
        "loop",
        Verdict.PASS,
        native.residual,
        TOL,
        "round-off of metre-sized coordinates, x1000",
        message=solved,
    )
    yield from _rates(case)
    reference = {output.name: output_series(case, output, native) for output in case.outputs}
    other: Case | None = None
    without = "there is no equivalent() to solve instead"
    try:
        other = _equivalent(case)
        if other is not None:
            yield _compared("loop: native, equivalent", other, _solved(other), reference)
    except Exception as error:
        other, without = None, "equivalent() fails, see native"
        yield _broken("loop: native, equivalent", error)
    if not engines:
        yield Finding("loop: simulators", Verdict.SKIP, message="no engines were given")
    for engine in engines:
        if engine.name != STANDARD:
            yield _simulated(engine, case, other or without, reference)
    if failing:
        why = f"first repair {', '.join(failing)}"
        yield Finding("reaction", Verdict.SKIP, message=why)
        return
    try:
        yield from _forces(case, other or without, engines)
    except Exception as error:  # any error of the joint's own code
        yield _broken("reaction", error)


def _broken(name: str, error: Exception) -> Finding:
    return Finding(name, Verdict.FAIL, message=f"{type(error).__name__}: {error}")


def _forces(case: Case, other: Case | str, engines: Sequence[Engine]) -> Iterator[Finding]:
    """Check the reaction in the loaded probe and with driven coordinates, and compare it with that
    of the engines.
    """
    yield from _reactions(loaded(case), other, engines, "reaction")
    if (own := driven(case)) is None:
        why = "no AxialJoint: nothing drives it"
        yield Finding("driven reaction", Verdict.SKIP, message=why)
    else:
        yield from _reactions(own, other, engines, "driven reaction")


def _reactions(
    heavy: Case, other: Case | str, engines: Sequence[Engine], what: str
) -> Iterator[Finding]:
    probe = solved(heavy, heavy.mechanism)
    yield from reactions(probe, heavy, what)
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
        if engine.name != STANDARD:
            yield _simulated(engine, heavy, other, reference, what)


def _unlocked(tested: Joint | type[Joint]) -> tuple[Case, Trajectory]:
    """Return the first probe with all samples solved; the last one tried if none is."""
    first, *others = alternatives(tested)
    shorter = [
        replace(first, sweep=replace(first.sweep, values=0.5**k * first.sweep.values))
        for k in range(1, HALVINGS + 1)
    ]
    case, native = first, _solved(first)
    for other in (*others, *shorter):
        if native.solved.all():
            break
        case, native = other, _solved(other)
    return case, native


def _solved(case: Case) -> Trajectory:
    return solve(
        case.mechanism, case.sweep.driver, case.sweep.values, rate=case.sweep.rate, tol=TOL
    )


def _rates(case: Case) -> Iterator[Finding]:
    """Check velocities and accelerations against differences, which are independent of rows
    and right-hand sides.
    """
    first, *_, last = grid = case.sweep.values.tolist()
    values: Array = np.linspace(first, last, FINER * (len(grid) - 1) + 1, dtype=np.float64)
    fine = solve(case.mechanism, case.sweep.driver, values, rate=case.sweep.rate, tol=TOL)
    dt, motion = float(values[1] - values[0]) / case.sweep.rate, fine.points[case.points[0]]
    assert motion.velocity is not None
    assert motion.acceleration is not None
    pairs = (
        (motion.position, motion.velocity, "velocity"),
        (motion.velocity, motion.acceleration, "acceleration"),
    )
    for before, rates, name in pairs:
        slopes, coarse = differences(before, dt), differences(before[::2], 2.0 * dt)
        limit = float(np.abs(coarse - slopes[3:-3:2]).max()) + ROUND_OFF / dt
        remedy = "the solution's rates are not those of its positions: see rows, nu and gamma"
        yield judged(
            f"loop: {name}",
            np.abs(slopes - rates[3:-3]).max(axis=1),
            limit,
            RATES_WHY,
            [name],
            remedy=remedy,
        )


def differences(values: Array, dt: float) -> Array:
    """Return sixth-order differences of values at equal steps, without the first and last three
    samples, shape (n, ...) -> (n - 6, ...).
    """
    windows = np.lib.stride_tricks.sliding_window_view(values, len(WEIGHTS), axis=0)
    return np.asarray(windows @ WEIGHTS / dt)


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
            " two such joints collide in a mechanism; build the names of its parts from self.name"
        )
    known = {*Joint.registry.values()} - {type(tested)}
    mechanism = with_equivalents(case.mechanism, known)
    return replace(case, name=f"{case.name}_equivalent", mechanism=mechanism)


def _simulated(
    engine: Engine,
    case: Case,
    other: Case | str,
    reference: dict[str, Series],
    what: str = "loop",
) -> Finding:
    """Compare an engine's answer with the native one; `other` is the equivalent case, or the reason
    for its absence.
    """
    name = f"{what}: {engine.name}"
    if engine.version() is None:
        return Finding(name, Verdict.SKIP, message="not installed")
    try:
        reason = engine.unsupported(case)
    except Exception as error:  # any error of the joint's own equivalent, or of an engine
        if isinstance(other, str):
            return Finding(name, Verdict.SKIP, message=other)
        return _broken(name, error)
    chosen = case
    if reason is not None:
        if isinstance(other, str):
            return Finding(name, Verdict.SKIP, message=f"{reason}; {other}")
        unknown = engine.unsupported(other)
        if unknown is not None:
            return Finding(name, Verdict.SKIP, message=f"{reason}; nor its equivalent: {unknown}")
        chosen = other
    try:
        answer = engine.solve(engine.build(chosen), chosen, TOL)
        check(chosen, engine.name, answer)
    except Exception as error:  # any error of a simulator
        return _broken(name, error)
    if chosen.forces and answer.forces is None:
        return Finding(name, Verdict.SKIP, message="the engine gives no forces")
    found = _compared(name, chosen, answer, reference)
    itself = chosen is case and "equivalents" not in answer.details
    how = "on the joint itself" if itself else "on the equivalent"
    return replace(found, message="; ".join(part for part in (how, found.message) if part))


def _compared(name: str, case: Case, found: Trajectory, reference: dict[str, Series]) -> Finding:
    """Compare positions, velocities and accelerations with the native ones of the joint itself."""
    if not found.solved.all():
        return Finding(
            name,
            Verdict.FAIL,
            message=f"{found.solved.sum()} of {len(found.solved)} samples solved: {found.message}",
        )
    worst: tuple[float, Quantity, str, Deviation] | None = None
    lacking = ""
    for output in case.outputs:
        standards = [(STANDARD, reference[output.name])]
        result = deviations(case, output, output_series(case, output, found), standards)
        if len(result.items()) < output.orders:
            lacking = f"{Outcome.UNJUDGED.shown}: {result.reason}"
        for quantity, deviation in result.items():
            figure = deviation.max_abs / deviation.tolerance
            if worst is None or figure > worst[0]:
                worst = figure, output, quantity, deviation
    assert worst is not None
    if above := excess(case, found.residual, TOL):
        return Finding(name, Verdict.FAIL, message=above)
    figure, output, quantity, deviation = worst
    message = (
        lacking
        if figure <= 1.0
        else describe(
            output.name,
            quantity,
            deviation,
            case.sweep.driver,
            case.sweep.values.tolist(),
            output.unit,
        )
    )
    verdict = Verdict.PASS if figure <= 1.0 else Verdict.FAIL
    return Finding(
        name,
        verdict,
        figure,
        1.0,
        AGREE_WHY,
        None,
        deviation.worst_step,
        f"{output.name} {quantity}",
        message,
    )
