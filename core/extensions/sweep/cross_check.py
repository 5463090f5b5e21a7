"""Cross-check of a sweep: another engine solves some variants as cases of their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any, overload

import msgspec
import numpy as np

from ...case.case import Case, Series
from ...errors import KincheckError, SolveError, shortened
from ...harness.compare import Curve, curve_of, describe, deviation, pace
from ...harness.engine import STANDARD, Engine
from ...harness.execution import Answer, Attempt, Pair, Solver
from ...harness.record import Deviation, Outcome
from ...harness.verdict import NAMED, UNCERTAIN, excess, residual_limit
from ...kinematics import NativeSolver
from ...trajectory import QUANTITIES, Array
from .study import ReducedQuantity, Study


class Checked(msgspec.Struct, frozen=True, kw_only=True):
    """A cross-checked variant, with the quantity of the largest deviation in tolerances.

    Attributes:
        message: the deviation, the reason for no answer, or the rows without values of the engine;
            empty if all rows pass.
        ratio: the largest deviation divided by its tolerance; null if nothing was compared.
    """

    variant: int
    outcome: Outcome
    message: str = ""
    row: str | None = None
    max_abs: float | None = None
    tolerance: float | None = None
    ratio: float | None = None


@dataclass(frozen=True, eq=False)
class Check:
    """A cross-check: another engine solves a share of the variants too."""

    engine: Engine
    share: float
    solver: Solver
    tol: float
    progress: Callable[[int, int], None] = lambda done, total: None


def choose_variants(samples: int, share: float, seed: int) -> frozenset[int]:
    """Return the variants to check: a random share, at least one."""
    count = min(samples, max(1, round(share * samples)))
    random = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=())))
    return frozenset(random.choice(samples, size=count, replace=False, shuffle=False).tolist())


@dataclass(frozen=True, eq=False)
class _Pairs(Sequence[Pair]):
    """Pairs of a variant and an engine; each case is built on demand, to save memory."""

    study: Study
    engine: Engine
    variants: Sequence[int]
    tol: float

    def __len__(self) -> int:
        return len(self.variants)

    @overload
    def __getitem__(self, index: int) -> Pair: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Pair]: ...
    def __getitem__(self, index: int | slice) -> Pair | Sequence[Pair]:
        if isinstance(index, slice):
            return [self[k] for k in range(len(self))[index]]
        return Pair(self.study.of_variant(self.variants[index]), self.engine, self.tol, timed=False)


def require_able(study: Study, check: Check) -> None:
    """Require the engine to solve the nominal design.

    Raises:
        KincheckError: the engine is not installed, or cannot express the case.
    """
    ((_, found),) = check.solver([Pair(study.case, check.engine, check.tol, timed=False)])
    result = found.result
    if not isinstance(result, Answer) and result.outcome in (
        Outcome.UNAVAILABLE,
        Outcome.UNSUPPORTED,
    ):
        raise KincheckError(
            f"--check {check.engine.name}: {result.outcome}: {result.message}. Check with"
            " another engine."
        )


def cross_check(study: Study, check: Check, picked: Mapping[int, Array]) -> list[Checked]:
    """Solve the picked variants with an engine and compare.

    Args:
        picked: the sweep's values by variant, shape (rows, n).
    """
    pairs = _Pairs(study, check.engine, sorted(picked), check.tol)
    tol = residual_limit(check.engine, check.tol)
    found: dict[int, Checked] = {}
    with closing(check.solver(pairs)) as attempts:
        for index, attempt in attempts:
            variant = pairs.variants[index]
            found[variant] = judge_variant(study, variant, attempt, picked[variant], tol)
            check.progress(len(found), len(pairs))
    return [found[variant] for variant in sorted(found)]


def judge_variant(
    study: Study, variant: int, attempt: Attempt, ours: Array, tol: float = math.inf
) -> Checked:
    """Compare an engine's answer with the sweep's values.

    A variant passes if every row is within its output's tolerance at all samples with both values.
    A variant without any common value is not judged. A variant fails if only one of engine and
    sweep has a solution.

    Args:
        tol: the largest residual promised by the engine, relative to the mechanism's size.
    """
    result = attempt.result
    if not isinstance(result, Answer):
        return Checked(variant=variant, outcome=result.outcome, message=result.message)
    case = study.of_variant(variant)
    beat = pace(case)
    residual = result.residual if result.solved else 0.0
    faults = [
        _contradiction(study, case, result, ours),
        excess(case, residual, tol),
        *result.faults,
    ]
    if any(faults):
        message = "; ".join(filter(None, faults))
        return Checked(variant=variant, outcome=Outcome.FAIL, message=message)
    lost, absent = "", list[str]()
    worst: tuple[Deviation, ReducedQuantity] | None = None
    for row, values in zip(study.rows, ours, strict=True):
        series: Series = result.outputs[row.output.name]
        theirs: Array | None = getattr(series, QUANTITIES[row.derivative])
        if theirs is None or not (row.derivative or series.possible):
            absent.append(row.name)
            continue
        # the sweep has no value here, and already counts the variant as unsolved
        if count := int((np.isfinite(values) & ~np.isfinite(theirs)).sum()):
            lost = (
                f"{row.name}: {count} samples without a value where the sweep has one:"
                f" {result.message or 'no reason given'}"
            )
        mine = curve_of(row.output, row.derivative, beat, theirs)
        off = deviation(mine, Curve(values), STANDARD)
        if off is not None and (worst is None or off.ratio > worst[0].ratio):
            worst = off, row
    outcome, message = Outcome.UNJUDGED, "no row has values from both"
    figures: dict[str, Any] = {}
    if worst is not None:
        off, row = worst
        outcome = Outcome.PASS if off.within else Outcome.FAIL
        quantity, sweep = QUANTITIES[row.derivative], case.sweep
        what = (row.output.name, quantity, off, sweep.driver, sweep.values.tolist())
        message = "" if off.within else describe(*what, row.output.unit)
        figures = {"row": row.name, "max_abs": off.max_abs, "tolerance": off.tolerance}
        figures["ratio"] = float(off.ratio)
    lack = ""
    if lost:
        outcome = Outcome.FAIL
    elif absent:
        lack = f"{Outcome.UNJUDGED.shown}: {shortened(absent, NAMED)}: the engine gives none"
    message = "; ".join(filter(None, (lost, message, lack)))
    return Checked(variant=variant, outcome=outcome, message=message, **figures)


def _contradiction(study: Study, case: Case, answer: Answer, ours: Array) -> str:
    """Return a message if an engine has values at samples native cannot reach; else an empty text.

    The message gives native's reason. Near singular poses, native refuses a batch of variants
    but may solve a single variant. So native solves the variant again alone.
    """
    values = np.logical_or.reduce(
        [np.isfinite(series.position) for series in answer.outputs.values()]
    )
    if not (values & ~np.isfinite(ours).any(axis=0)).any():
        return ""
    try:
        alone = NativeSolver().prepare(case.mechanism, case.sweep.path, case.points)(study.tol)
    except SolveError:  # without native's answer there is nothing to contradict
        return ""
    refused = values & ~alone.solved
    refused[alone.details.get(UNCERTAIN, [])] = False
    if not refused.any():
        return ""
    return (
        f"values at {refused.sum()} of {len(refused)} samples that {STANDARD} cannot reach;"
        f" {STANDARD}: {alone.message}"
    )
