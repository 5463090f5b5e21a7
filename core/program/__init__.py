"""Programs: from an equation to machine code.

1. `tape`: run an equation on traced scalars (`Traced`). A `Tape` records each operation once and
   folds literal zeros, ones and signs. `jacobian` traces the derivatives by the chain rule.
   `moving` has derivatives of one equation while it is evaluated, over any scalars.
2. `elimination`: trace the solution of a linear system. Literal and lone pivots come first, then
   dense cores with partial pivoting by compare-and-select.
3. `straight_line`: collect the operations of some outputs into a `Program`. `Prepared` moves terms
   of the geometry alone into a program of its own. `lower` fuses products and sums, so compiled
   and interpreted programs give equal bits; `bytecode` runs without compilation.
4. `plan`: a `Plan` names the programs of a model, the slots of a lane, and the order of an attempt:
   predict, iterate Newton, test. An executor binds it to lanes; a track follows one motion.

Executors:

- `numpy_executor`: one ufunc call per operation over all lanes. No start-up cost; the oracle of the
  tests. `NumpyExecutor` and `NumpyTrack` describe what every executor does.
- `llvm.executor`: machine code over vectors of lanes, one call per motion.
- `ball_executor`: ball arithmetic with proven error bounds; one lane, programs without a plan.

From a plan to machine code:

- `llvm.programs`: schedule a program, assign registers, and write LLVM text; the interpreter of
  tables.
- `llvm.loops`: loops over lanes as LLVM text, the same for all plans. `llvm.plan` lays out a plan
  in memory for them, with the loops over its tables.
- `llvm.fixed_order`: sparse LU factors of several matrices at once, as loops over lists of places.
- `llvm.compiler`: compile the text, link the object file, and load it.
- `llvm.jit`: choose cached code, interpretation or compilation for a plan.
- `llvm.machine_code`: whether llvmlite does all this here; numpy takes over where it does not.
- `disk_cache`: keep machine code, tables and traced programs on disk.

A mechanism's program is described once, in `core.kinematics.compiled`: `Tracing` names the slots of
its lanes and holds its `Plan`, `Model` makes code of the plan, and an executor binds it to lanes.
`core.caches` keeps recent models for the process, and bound lanes for each thread.
"""

from .elimination import Elimination
from .numpy_executor import NumpyExecutor, leading
from .plan import DONE, ITERATIONS, MARGIN, Parts, Plan, Side
from .straight_line import Prepared, Program, program
from .tape import (
    NODES,
    Tape,
    Traced,
    absolute,
    before,
    changes,
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
    "NumpyExecutor",
    "Parts",
    "Plan",
    "Prepared",
    "Program",
    "Side",
    "Tape",
    "Traced",
    "absolute",
    "before",
    "changes",
    "cos",
    "groups_behind",
    "leading",
    "maximum",
    "minimum",
    "place_of",
    "program",
    "sin",
    "where_larger",
]
