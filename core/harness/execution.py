"""Execution of one pair: an engine's answer to a case, as plain data to send between processes.
`verdict` judges it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..case.case import Case, Series
from ..errors import KincheckError, UnsupportedError
from ..failures import FailureKind
from ..forces import Forces
from ..trajectory import Array, Trajectory
from .compare import output_series
from .engine import Balancing, Engine
from .provenance import plain, readable, waiting_seconds
from .record import Outcome, Seconds
from .resource_limits import memory_limit
from .trajectory_check import Reported, check, faults, held_trajectories

# Number of solves: one interruption does not move their median. Slow engines stop after the budget
# [s], unless two solves differ in time by the factor UNLIKE: the slow one included a compilation.
WARM_SOLVES = 5
WARM_BUDGET = 0.5
UNLIKE = 2.0

# Longest message [characters]: a page. An engine may put all its data into one.
LONGEST_MESSAGE = 20_000


@dataclass(frozen=True, eq=False)
class Pair:
    """A case to be solved with an engine.

    Attributes:
        tol: the largest accepted constraint residual, as for `Engine.solve`.
        timed: whether to solve again to measure the time; otherwise the first answer is kept.
    """

    case: Case
    engine: Engine
    tol: float
    timed: bool = True


@dataclass(frozen=True)
class Facts:
    """The properties an engine reports about itself: see `Engine` and `Record`."""

    loop: str
    settings: Mapping[str, Any] = field(default_factory=dict[str, Any])
    version: str | None = None


@dataclass(frozen=True, eq=False)
class Answer:
    """An engine's answer to a case.

    Attributes:
        outputs: outputs by name, NaN at unsolved samples.
        solved: number of solved samples.
        iterations: sum over the solved samples.
        residual, message, details, failures: see `Trajectory`.
        power: missing to the balance at each sample [W], NaN if unknown or no power flows; None
            without forces.
        faults: what the answer gets wrong by itself, in sentences.
        reported: whether the outputs are reported and not solved, so that values may be missing.
        judged: whether the engine judged its answer by itself.
    """

    outputs: Mapping[str, Series]
    solved: int
    iterations: int
    residual: float
    message: str
    details: dict[str, Any]
    failures: Sequence[FailureKind] = ()
    power: Array | None = None
    faults: Sequence[str] = ()
    reported: bool = False
    judged: bool = False

    @staticmethod
    def of(
        pair: Pair,
        found: Trajectory,
        held: Mapping[tuple[str, ...], Trajectory] | None = None,
        why: str = "",
    ) -> Answer:
        """Return the answer that a checked trajectory gives to a pair.

        Args:
            held, why: from `held_trajectories`.
        """
        case, solved = pair.case, np.asarray(found.solved, dtype=np.bool_)
        rigid = pair.engine.mode == "projection"
        if isinstance(found, Reported):
            return Answer(
                outputs=found.outputs,
                solved=int(solved.sum()),
                iterations=0,
                residual=found.residual,
                message=shorten_text(found.message),
                details=plain(found.facts),
                faults=found.faults,
                reported=True,
                judged=found.judged,
            )
        return Answer(
            outputs={each.name: output_series(case, each, found, held) for each in case.outputs},
            solved=int(solved.sum()),
            iterations=int(np.asarray(found.iterations)[solved].sum()),
            residual=float(found.residual),
            message=shorten_text("; ".join(filter(None, (found.message, why)))),
            details=plain(found.facts),
            failures=found.failures,
            power=None if found.forces is None else _power(found.forces, solved),
            faults=[*faults(case, found, rigid=rigid)],
        )


def _power(forces: Forces, solved: NDArray[np.bool_]) -> Array:
    flowing = solved & (np.asarray(forces.largest_power) > 0.0)
    return np.where(flowing, forces.power, np.nan)


@dataclass(frozen=True)
class Failure:
    """The reason for a missing answer, with the end of the engine's printed output.

    Attributes:
        kind: type of the engine's error, if known.
    """

    outcome: Outcome
    message: str
    printed: str = ""
    kind: FailureKind | None = None

    @staticmethod
    def of(error: BaseException) -> Failure:
        """Return the failure that an error of the engine stands for."""
        if isinstance(error, UnsupportedError):
            return Failure(Outcome.UNSUPPORTED, shorten_text(error))
        kind = error.kind if isinstance(error, KincheckError) else None
        return Failure(Outcome.ERROR, error_text(error), kind=kind)


@dataclass(frozen=True, eq=False)
class Attempt:
    """The result of one pair.

    Attributes:
        facts: facts of the engine; None if the process ended before it reported them.
        seconds: times of the completed phases.
    """

    facts: Facts | None
    result: Answer | Failure
    seconds: Seconds | None = None


Attempts: TypeAlias = Generator[tuple[int, Attempt]]
Solver: TypeAlias = Callable[[Sequence[Pair]], Attempts]
"""Solver of pairs: it yields the index and the result of each pair once, in any order."""


def solve_in_process(pairs: Sequence[Pair]) -> Attempts:
    """Solve the pairs in this process, one after the other.

    If an engine crashes or hangs, the whole run does.
    """
    for index, pair in enumerate(pairs):
        yield index, attempt(pair)


def attempt(pair: Pair, report: Callable[[Facts], object] = lambda facts: None) -> Attempt:
    """Solve a pair. Any exception of the engine becomes a failure, except KeyboardInterrupt.

    Args:
        report: receives the engine's facts before any step that may end the process.
    """
    case, engine = pair.case, pair.engine
    seconds = dict[str, float]()
    facts: Facts | None = None

    def become(result: Answer | Failure) -> Attempt:
        return Attempt(facts, result, Seconds(**seconds) if seconds else None)

    try:
        facts = Facts(str(engine.loop), plain(engine.settings))
        report(facts)
        version = engine.version()
        if version is None:
            return become(
                Failure(
                    Outcome.UNAVAILABLE,
                    f"{engine.name} is not installed, or cannot be imported: kincheck doctor says"
                    " which",
                )
            )
        facts = replace(facts, version=shorten_text(version))
        report(facts)
        reason = engine.unsupported(case)
        if reason is not None:
            return become(Failure(Outcome.UNSUPPORTED, shorten_text(reason)))
        if case.balance is not None:
            return become(_solve_equilibrium(pair, seconds))
        return become(_solve(pair, seconds))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # simulators may raise anything; some raise SystemExit
        return become(Failure.of(error))


def _solve_equilibrium(pair: Pair, seconds: dict[str, float]) -> Answer:
    case, engine = pair.case, pair.engine
    if not isinstance(engine, Balancing):
        raise UnsupportedError(f"{engine.name} in mode {engine.mode} finds no equilibria")
    begin = perf_counter()
    found = engine.equilibria(case)
    seconds["first"] = perf_counter() - begin
    check(case, engine.name, found)
    return Answer.of(pair, found)


def _solve(pair: Pair, seconds: dict[str, float]) -> Answer:
    """Build once, solve, and solve again to measure the time. Return the last, timed answer."""
    case, engine = pair.case, pair.engine
    begin = perf_counter()
    model = engine.build(case)
    seconds["build"] = perf_counter() - begin

    def solve() -> tuple[Trajectory, float, float]:
        before, begin = waiting_seconds(), perf_counter()
        trajectory = engine.solve(model, case, pair.tol)
        seconds = perf_counter() - begin
        own = seconds - min(waiting_seconds() - before, seconds)
        check(case, engine.name, trajectory)
        return trajectory, seconds, own

    trajectory, seconds["first"], _ = solve()  # may load and compile
    if pair.timed:
        trajectory, last, own = solve()
        warm, undisturbed = [last], [own]
        while _more(seconds["first"], warm):
            trajectory, last, own = solve()
            warm.append(last)
            undisturbed.append(own)
        seconds["warm"] = float(np.median(warm))
        seconds["waited"] = seconds["warm"] - float(np.median(undisturbed))

    def solve_anew(case: Case) -> Trajectory:
        found = engine.solve(engine.build(case), case, pair.tol)
        check(case, engine.name, found)
        return found

    held, why = held_trajectories(case, engine.mode, trajectory, solve_anew)
    return Answer.of(pair, trajectory, held, why)


def _more(first: float, warm: Sequence[float]) -> bool:
    """Return whether to solve again for the time."""
    unlike = len(warm) < 3 and max(warm) > UNLIKE * min(first, *warm)
    return len(warm) < WARM_SOLVES and (unlike or sum(warm) + min(warm) <= WARM_BUDGET)


def error_text(error: BaseException) -> str:
    """Return the text of any exception."""
    try:
        text = str(error)
    except Exception as another:  # __str__ is code of the engine too
        text = f"its text cannot be had ({type(another).__name__})"
    message = shorten_text(f"{type(error).__name__}: {text}" if text else type(error).__name__)
    if isinstance(error, MemoryError) and (limit := memory_limit()):
        message += f"; this process may have {limit:g} GB, --memory gives it more"
    return message


def shorten_text(text: Any) -> str:
    """Return text of any origin for a record: readable, and of bounded length."""
    whole = text if isinstance(text, str) else str(text)
    if len(whole) > LONGEST_MESSAGE:
        half = LONGEST_MESSAGE // 2
        whole = (
            f"{whole[:half]} [... {len(whole) - 2 * half} characters left out ...] {whole[-half:]}"
        )
    return readable(whole)
