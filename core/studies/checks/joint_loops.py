"""A joint in a small closed loop, solved natively and by every given engine, on the joint itself or
on its equivalent.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

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
from ...joints import Joint
from ...mechanism.mechanism import declared_equivalent, with_equivalents
from .findings import Finding, Verdict, agreement, skipped, stated
from .loaded_probe import driven, loaded, reactions, solved

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
            " two such joints collide in a mechanism; build the names of its parts from self.name"
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
