"""Comparable times: contestants take turns in one process, so that other load of the machine
affects all of them. One of them may be the peak arithmetic of one core: independent multiplications
and additions of vectors, fused if the processor supports it. Its compiler and vector width are
those of the programs; the loop loads and stores nothing.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, TypeVar

import msgspec
import numpy as np

from ....trajectory import Array
from ...llvm import compiler, jit

# Duration of a turn [s]: long against the clock's resolution, short against interruptions. Quick
# work is repeated in a turn.
TURN = 2e-3
# Number of first calls, one of which runs at full speed if programs are compiled at once; and the
# budget that limits slow work [s].
FIRST, PATIENCE = 16, 0.5

Key = TypeVar("Key")
Work = Callable[[], object]


class Spread(msgspec.Struct, frozen=True, kw_only=True):
    """A time over several rounds: median, quartiles and minimum; the owner states the unit."""

    least: float
    median: float
    lower: float
    upper: float
    rounds: int

    def times(self, factor: float) -> Spread:
        """Return the spread with all times multiplied by a factor, for another unit or amount."""
        least, median, lower, upper = (
            factor * each for each in (self.least, self.median, self.lower, self.upper)
        )
        return Spread(least=least, median=median, lower=lower, upper=upper, rounds=self.rounds)


def spread(values: Sequence[float]) -> Spread:
    """Return the spread of values, one per round."""
    least, lower, median, upper = np.percentile(values, (0.0, 25.0, 50.0, 75.0)).tolist()
    return Spread(least=least, median=median, lower=lower, upper=upper, rounds=len(values))


def take_turns(
    contestants: Mapping[Key, Work],
    rounds: int,
    progress: Callable[[float], object] = lambda done: None,
    clock: Callable[[], float] | None = None,
) -> dict[Key, Spread]:
    """Return the seconds of one call of each contestant by a clock, over rounds in which each has a
    turn.

    Each is called before all rounds. Quick work is also called before each turn, untimed, to refill
    the caches after the previous contestant. Python's garbage is collected only between rounds.
    `progress` is called before each round with the finished share.
    """
    calls = {key: math.ceil(TURN / warm_up(work)) for key, work in contestants.items()}
    times: dict[Key, list[float]] = {key: [] for key in contestants}
    enabled = gc.isenabled()
    try:
        for number in range(rounds):
            progress(number / rounds)
            gc.collect()
            gc.disable()
            for key, work in contestants.items():
                times[key].append(_turn(work, calls[key], clock))
            gc.enable()
    finally:
        (gc.enable if enabled else gc.disable)()
    return {key: spread(each) for key, each in times.items()}


def warm_up(work: Work, clock: Callable[[], float] | None = None) -> float:
    """Return the least time of several calls by a clock [s]: a first call may compile."""
    least, begin, clock = math.inf, perf_counter(), clock or perf_counter
    for _ in range(FIRST):
        before = clock()
        work()
        least = min(least, clock() - before)
        if perf_counter() - begin > PATIENCE:
            break
    return least


def _turn(work: Work, calls: int, clock: Callable[[], float] | None) -> float:
    clock = clock or perf_counter
    if calls > 1:
        work()
    begin = clock()
    for _ in range(calls):
        work()
    return (clock() - begin) / calls


# Independent chains: enough to hide the latency of two units (2 x 4 cycles), and few enough for 16
# registers with two factors.
CHAINS = 12
STEPS = 20_000
"""Steps of a call: about a hundred microseconds."""


@dataclass(frozen=True, eq=False)
class Peak:
    """The compiled kernel.

    Attributes:
        width: number of doubles in a vector.
        flops: operations of a call; a fused multiply-add counts as two.
    """

    width: int
    flops: int
    function: Callable[..., int]
    memory: Array
    owner: Any

    def rate(self, seconds: Spread) -> float:
        """Return operations per second of the fastest turn, which nothing has delayed."""
        return self.flops / seconds.least

    def __call__(self) -> None:
        """Run all steps."""
        self.function(self.memory.ctypes.data, STEPS)


def prepare() -> Peak:
    """Compile the kernel; raise ImportError without llvmlite."""
    width = compiler.vector_width()
    text = _text(width)
    code = jit.load(text, lambda: text, {"peak": 2})
    # x <- 0.5 x + 1 stays near two: no overflow, no subnormal number
    memory = np.repeat([0.5, 1.0, *np.linspace(1.0, 2.0, CHAINS)], width)
    return Peak(width, 2 * CHAINS * width * STEPS, code.calls["peak"], memory, code)


def _text(width: int) -> str:
    vector, every = f"<{width} x double>", range(CHAINS)

    def place(name: str, number: int) -> str:
        return f"%{name} = getelementptr {vector}, ptr %memory, i64 {number}"

    begin = [place(f"p{k}", k) for k in range(CHAINS + 2)]
    begin += [f"%given{k} = load {vector}, ptr %p{k}, align 8" for k in range(CHAINS + 2)]
    joined = [f"%x{k} = phi {vector} [%given{k + 2}, %entry], [%next{k}, %loop]" for k in every]
    steps = [f"%product{k} = fmul contract {vector} %x{k}, %given0" for k in every]
    steps += [f"%next{k} = fadd contract {vector} %product{k}, %given1" for k in every]
    end = [f"store {vector} %next{k}, ptr %p{k + 2}, align 8" for k in every]
    lines = "\n  ".join
    return f"""define void @peak(ptr %memory, i64 %steps) {{
entry:
  {lines(begin)}
  br label %loop
loop:
  %step = phi i64 [0, %entry], [%done, %loop]
  {lines(joined)}
  {lines(steps)}
  %done = add i64 %step, 1
  %more = icmp slt i64 %done, %steps
  br i1 %more, label %loop, label %end
end:
  {lines(end)}
  ret void
}}
"""
