"""Answers of engines to specimens, and verdicts on their samples: correct, refused with the right
or a wrong reason, or silently wrong.

The native engine solves in this process, with machine code and with numpy; simulators solve in
worker processes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from ....case.case import Case
from ....errors import KincheckError
from ....failures import FailureKind
from ....harness.engine import Engine, runs_in_process
from ....harness.execution import Answer, Failure, Pair, error_text
from ....harness.native_engine import NativeEngine
from ....harness.record import Outcome
from ....harness.resource_limits import Limits
from ....harness.trajectory_check import check
from ....trajectory import QUANTITIES, Array
from ..truth.forces import known_forces
from ..truth.motion import Reach, Truth
from .families.base import MOTION_ENDS, Specimen


class Verdict(StrEnum):
    """The verdict on one sample; every sample has exactly one."""

    RIGHT = "right"
    REFUSED_RIGHTLY = "refused, right reason"
    REFUSED_WRONGLY = "refused, wrong reason"
    SILENTLY_WRONG = "silently wrong"
    WRONG_FORCE = "silently wrong force"
    UNDETERMINED_FORCE = "undetermined force given"
    MISSING_FORCE = "determined force missing"
    UNJUDGED = "not judged"
    UNSUPPORTED = "unsupported"


SILENT = (Verdict.SILENTLY_WRONG, Verdict.WRONG_FORCE, Verdict.UNDETERMINED_FORCE)
"""The verdicts on wrong numbers without a message."""
BAD = (*SILENT, Verdict.REFUSED_WRONGLY, Verdict.MISSING_FORCE)
"""Bad verdicts, the worst first."""

# An error above this, relative to the mechanism's size, means another assembly or none, not
# round-off.
ELSEWHERE = 1e-3
# Factor between residuals of contradictory geometry that count as equal: the residual may be spread
# over the rows or lie in one.
SPREAD = 10.0


@dataclass(frozen=True, eq=False)
class Judgement:
    """The outcome of a specimen with an engine.

    Attributes:
        verdicts: verdicts of the samples.
        worst: largest error of positions, velocities, accelerations and forces over the round-off
            bound; None if nothing was compared.
        elsewhere: number of silently wrong samples in another assembly.
        message: message of the engine.
        told: residual reported by the engine [m or -].
    """

    verdicts: NDArray[np.object_]
    worst: tuple[float | None, ...] = (None,) * 4
    elsewhere: int = 0
    message: str = ""
    told: float = 0.0
    counts: Mapping[str, int] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "counts", {each: int((self.verdicts == each).sum()) for each in Verdict}
        )

    def first(self, verdict: Verdict) -> int | None:
        """Return the first sample with a verdict; None if there is none."""
        return next(iter(np.flatnonzero(self.verdicts == verdict).tolist()), None)


def refused_description(specimen: Specimen, samples: int) -> Judgement:
    """Return the judgement of a specimen with a refused description, which is the same for every
    engine.
    """
    error = specimen.case
    kind = error.kind if isinstance(error, KincheckError) else None
    right = specimen.truth is None and kind in specimen.reasons
    verdict = Verdict.REFUSED_RIGHTLY if right else Verdict.REFUSED_WRONGLY
    return _all(samples, verdict, str(error))


def judge_answer(
    specimen: Specimen, case: Case, truth: Truth | None, result: Answer | Failure
) -> Judgement:
    """Compare an answer or a refusal with the reference; a None reference means that no sample is
    valid.
    """
    n = len(case.sweep.values)
    if isinstance(result, Failure):
        if result.outcome in (Outcome.UNSUPPORTED, Outcome.UNAVAILABLE):
            return _all(n, Verdict.UNSUPPORTED, result.message)
        if result.outcome is not Outcome.ERROR:  # a crash or a hang is not a valid refusal
            return _all(n, Verdict.REFUSED_WRONGLY, result.message)
        kinds = [] if result.kind is None else [result.kind]
        return Judgement(_refusal_verdicts(specimen, truth, n, kinds), message=result.message)
    shown = [output.name for output in case.outputs if not output.forces]
    points = list(dict.fromkeys(name.rpartition(".")[0] for name in shown))
    positions = {name: _point_quantity(result, name, "position") for name in points}
    solved = np.logical_and.reduce([np.isfinite(each).all(axis=1) for each in positions.values()])
    verdicts = _refusal_verdicts(specimen, truth, n, result.failures)
    if truth is None:
        verdicts[solved] = Verdict.SILENTLY_WRONG
        return Judgement(verdicts, message=result.message, elsewhere=int(solved.sum()))
    known = solved & (truth.reach == Reach.REACHED)
    ratios = np.zeros((4, n))
    errors = np.zeros(n)
    compared = [True, False, False, False]
    for name in points:
        moved = truth.points[name]
        for k, quantity in enumerate(QUANTITIES):
            found = _point_quantity(result, name, quantity)
            if not np.isfinite(found[known]).any():
                continue
            compared[k] = True
            # a missing value of a solved sample is infinitely wrong
            errors_of_axes = np.where(np.isfinite(found), np.abs(found - moved[k]), np.inf)
            off = errors_of_axes[known].max(axis=1).astype(np.float64)
            bound = np.maximum(truth.bounds[name][k, known], np.finfo(np.float64).tiny)
            ratios[k, known] = np.maximum(ratios[k, known], off / bound)
            if k == 0:
                errors[known] = np.maximum(errors[known], off)
    wrong = (ratios > 1.0).any(axis=0)
    forces = _judge_forces(case, truth, result, known & ~wrong, ratios[3])
    compared[3] = bool(np.isfinite(ratios[3]).any() and (ratios[3] > 0.0).any())
    told = max(result.residual, float(result.details.get("redundant_residual") or 0.0))
    if specimen.tilt is not None and truth.violated is not None:
        wrong |= known & (truth.violated > SPREAD * told)
    verdicts[solved] = Verdict.UNJUDGED
    verdicts[known] = np.where(wrong, Verdict.SILENTLY_WRONG, Verdict.RIGHT)[known]
    for verdict, where in forces.items():
        verdicts[where & (verdicts == Verdict.RIGHT)] = verdict
    beyond = solved & (truth.reach == Reach.BEYOND)
    verdicts[beyond] = Verdict.SILENTLY_WRONG
    far = (errors > ELSEWHERE * truth.system.rows.unit) | beyond
    worst = tuple(float(ratios[k].max()) if compared[k] and known.any() else None for k in range(4))
    # an engine's notes do not warn a reader of the samples, but explain the outcome
    message = "; ".join(
        [*filter(None, [result.message]), *map(str, result.details.get("notes", []))]
    )
    return Judgement(
        verdicts, worst, int((far & (verdicts == Verdict.SILENTLY_WRONG)).sum()), message, told
    )


def _judge_forces(
    case: Case, truth: Truth, result: Answer, known: NDArray[np.bool_], ratios: Array
) -> dict[Verdict, NDArray[np.bool_]]:
    """Return masks of the samples with wrong forces, by verdict, the worst first.

    Args:
        known: samples with the correct motion.
        ratios: largest errors over the round-off bound, filled in here, shape (n,).
    """
    found = {each: np.zeros(len(known), np.bool_) for each in (*SILENT[1:], Verdict.MISSING_FORCE)}
    lacking = np.zeros(len(known), np.bool_)
    if not case.forces:
        return found
    for name, right in known_forces(case, truth).items():
        series = result.outputs[name]
        if not series.possible:
            lacking |= known
            continue
        given = np.isfinite(series.position)
        told = known & np.isfinite(right.values)
        off = np.abs(series.position - right.values)
        compared = told & given & right.determined
        ratios[compared] = np.maximum(ratios[compared], (off / right.bounds)[compared])
        found[Verdict.WRONG_FORCE] |= compared & (off > right.bounds)
        found[Verdict.UNDETERMINED_FORCE] |= told & given & right.undetermined
        # at a singular pose rigid bodies determine no finite force
        found[Verdict.MISSING_FORCE] |= told & ~given & right.determined & ~truth.singular
    return {**found, Verdict.UNSUPPORTED: lacking}


def _refusal_verdicts(
    specimen: Specimen, truth: Truth | None, n: int, kinds: Collection[FailureKind]
) -> NDArray[np.object_]:
    """Return the verdicts on a refusal of all samples, by its reasons."""
    named = not specimen.reasons.isdisjoint(kinds)
    ended = not MOTION_ENDS.isdisjoint(kinds)
    if truth is None:
        right = np.full(n, named)
    else:
        over = truth.singular | (truth.reach != Reach.REACHED)
        right = (over & ended) | (specimen.excused & named)
    return np.where(right, Verdict.REFUSED_RIGHTLY, Verdict.REFUSED_WRONGLY).astype(object)


def _all(n: int, verdict: Verdict, message: str) -> Judgement:
    return Judgement(np.full(n, verdict, dtype=object), message=message)


def _point_quantity(result: Answer, point: str, quantity: str) -> Array:
    """Return a quantity of a point's motion, shape (n, 3); NaN if there is none."""
    series = [getattr(result.outputs[f"{point}.{axis}"], quantity) for axis in "xyz"]
    n = len(result.outputs[f"{point}.x"].position)
    return np.stack([np.full(n, np.nan) if each is None else each for each in series], axis=1)


# Answers

# Time limit of a sweep of this size [s]; a slower simulator counts as hanging.
PATIENCE = 60.0
MEMORY = 4.0
# Numpy solves one mechanism in four up to this number of bodies: around singular poses it takes up
# to ten times as long.
INTERPRETED, LARGEST_INTERPRETED = 4, 4
MOST_INTERPRETED = 2000
"""Largest number of samples solved without compilation."""


def suitable_engine(engine: Engine, case: Case, number: int) -> Engine:
    """Return the native engine, interpreted for some of the small mechanisms, which tests both
    executors. Return simulators unchanged.
    """
    small = (
        len(case.mechanism.moving) <= LARGEST_INTERPRETED
        and len(case.sweep.values) <= MOST_INTERPRETED
    )
    if isinstance(engine, NativeEngine) and number % INTERPRETED == INTERPRETED - 1 and small:
        return with_numpy_executor(engine)
    return engine


def with_numpy_executor(engine: NativeEngine) -> NativeEngine:
    """Return the native engine with numpy as executor: compilation does not pay for a single
    solution.
    """
    return replace(engine, solver=replace(engine.solver, compiled=False))


def solve_all(pairs: Sequence[Pair]) -> list[Answer | Failure]:
    """Return the answers in order; an error becomes a failure."""
    found = {k: once(pair) for k, pair in enumerate(pairs) if runs_in_process(pair.engine)}
    if away := [k for k in range(len(pairs)) if k not in found]:
        from ....harness.workers.pool import in_workers

        untimed = [replace(pairs[k], timed=False) for k in away]
        for k, attempt in in_workers(1, Limits(PATIENCE, MEMORY))(untimed):
            found[away[k]] = attempt.result
    return [found[k] for k in range(len(pairs))]


def once(pair: Pair) -> Answer | Failure:
    """Solve a pair once in this process, without timing."""
    case, engine = pair.case, pair.engine
    try:
        reason = engine.unsupported(case)
        if reason is not None:
            return Failure(Outcome.UNSUPPORTED, reason)
        trajectory = engine.solve(engine.build(case), case, pair.tol)
        check(case, engine.name, trajectory)
    except KincheckError as error:
        return Failure(Outcome.ERROR, str(error), kind=error.kind)
    except Exception as error:  # a defect
        return Failure(Outcome.ERROR, error_text(error))
    return Answer.of(pair, trajectory)
