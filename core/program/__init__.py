"""Programs: from an equation to machine code.

1. `tape`: run an equation on traced scalars (`Traced`). A `Tape` records each operation once and
   folds literal zeros, ones and signs.
2. `elimination`, `dense_core`: trace the solution of a linear system. Literal and lone pivots come
   first, then dense cores with partial pivoting by compare-and-select.
3. `derivative`: trace the Jacobian of traced scalars by the chain rule.
4. `straight_line`: collect the operations of some outputs into a `Program`. `Prepared` moves terms
   of the geometry alone into a program of its own.
5. `plan`: a `Plan` names the programs of a model, the slots of a lane, and the order of an attempt:
   predict, iterate Newton, test.
6. `executor_protocol`: an `Executor` binds a plan to lanes; a `Track` follows one motion.

Executors:

- `numpy_executor`, with `numpy_lanes` and `numpy_track`: one ufunc call per operation over all
  lanes. No start-up cost; the oracle of the tests.
- `llvm.executor`: machine code over vectors of lanes, one call per motion.
- `ball_executor`: ball arithmetic with proven error bounds; one lane, programs without a plan.

From a plan to machine code:

- `lowering`: fuse products and sums, so compiled and interpreted programs give equal bits.
- `bytecode`, `llvm.interpreter`: run a program from a table, without compilation.
- `llvm.ordering`, `llvm.programs`, `llvm.ir_writer`: schedule a program, assign registers, and
  write LLVM text.
- `llvm.one_motion`, `llvm.many_motions`, `llvm.loops`, `llvm.reduce`: loops over lanes as LLVM
  text, the same for all plans. `llvm.plan` lays out a plan in memory for them.
- `llvm.compiler`, `llvm.elf_loader`: compile the text, link the object file, and load it.
- `llvm.code_cache`, `disk_cache`: keep machine code, tables and traced programs on disk.
- `llvm.jit`: choose cached code, interpretation or compilation for a plan.

A mechanism's program is described once, in `core.kinematics.compiled`: `Tracing` names the slots of
its lanes and holds its `Plan`, `Model` makes code of the plan, and an executor binds it to lanes.
`core.caches` keeps recent models for the process, and bound lanes for each thread. `memory` aligns
arrays to cache lines.
"""

from .elimination import Elimination
from .executor_protocol import Executor, Parts, Side, Track
from .numpy_executor import NumpyExecutor
from .plan import DONE, ITERATIONS, MARGIN, Plan
from .straight_line import Prepared, Program, program
from .tape import (
    NODES,
    Tape,
    Traced,
    absolute,
    before,
    cos,
    groups_behind,
    maximum,
    minimum,
    place_of,
    sin,
    where_larger,
)

__all__ = [
    "DONE",
    "ITERATIONS",
    "MARGIN",
    "NODES",
    "Elimination",
    "Executor",
    "NumpyExecutor",
    "Parts",
    "Plan",
    "Prepared",
    "Program",
    "Side",
    "Tape",
    "Traced",
    "Track",
    "absolute",
    "before",
    "cos",
    "groups_behind",
    "maximum",
    "minimum",
    "place_of",
    "program",
    "sin",
    "where_larger",
]
