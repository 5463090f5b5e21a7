"""Cost of an engine's whole loop over the cases, as a multiple of another engine's."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import msgspec
import numpy as np

from ...case.case import Case
from ...harness.engine import Engine
from ...trajectory import Trajectory
from .rounds import take_turns

# Base of the ratios: its simulator adds the least work to its kinematics.
BASE = "pinocchio"


class LoopTime(msgspec.Struct, frozen=True, kw_only=True):
    """Time of an engine in projection mode over the cases that both it and the base solve.

    Attributes:
        base: name of the engine that the ratios refer to.
        cases: number of the cases.
        us_per_sample: warm time per sample, median over the cases [us].
        ratio, lower, upper: ratio of the time to the base's time on the same case, median and
            extremes.
    """

    engine: str
    loop: str
    base: str
    cases: int
    us_per_sample: float
    ratio: float
    lower: float
    upper: float


def measure_loops(
    cases: Iterable[Case],
    engines: Sequence[Engine],
    tol: float,
    rounds: int,
    progress: Callable[[str], object],
) -> list[LoopTime]:
    """Return the times of all engines, which take turns on each case; without Pinocchio the base is
    the first engine.

    The least time of the rounds counts, so that other processes do not affect the ratios.
    """
    able = [engine for engine in engines if engine.version() is not None]
    names = [engine.name for engine in able]
    if not able:
        return []
    base = BASE if BASE in names else names[0]
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for case in cases:
        progress(f"{case.name}: loops of {len(able)} engines")
        work = {e.name: _work(case, e, tol) for e in able if e.unsupported(case) is None}
        if base not in work:
            continue
        us = {
            name: 1e6 * each.least / len(case.sweep.values)
            for name, each in take_turns(work, rounds).items()
        }
        for name, each in us.items():
            found[name].append((each, each / us[base]))
    return [_summary(engine, base, found) for engine in able if found[engine.name]]


def _work(case: Case, engine: Engine, tol: float) -> Callable[[], Trajectory]:
    model = engine.build(case)
    return lambda: engine.solve(model, case, tol)


def _summary(
    engine: Engine, base: str, found: Mapping[str, Sequence[tuple[float, float]]]
) -> LoopTime:
    us, ratios = np.array(found[engine.name]).T
    return LoopTime(
        engine=engine.name,
        loop=engine.loop,
        base=base,
        cases=len(us),
        us_per_sample=float(np.median(us)),
        ratio=float(np.median(ratios)),
        lower=float(ratios.min()),
        upper=float(ratios.max()),
    )
