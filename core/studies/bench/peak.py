"""The peak arithmetic of one core: independent multiplications and additions of vectors, fused if
the processor supports it.

The compiler and the vector width are those of the programs; the loop loads and stores nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...program.llvm import compiler, jit
from ...trajectory import Array
from .rounds import Spread

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
