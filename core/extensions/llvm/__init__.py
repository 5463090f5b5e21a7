"""Plans as machine code, by llvmlite: LLVM text of programs and of the loops over lanes, an
interpreter for programs that run rarely, a cache on disk, and calls without the GIL.

From a plan to machine code:

- `bytecode`: fuse products and sums; write a program as a table for the interpreter.
- `programs`: schedule a program, assign registers, and write LLVM text; the interpreter of tables.
- `loops`: loops over lanes as LLVM text, the same for all plans. `plan` lays out a plan in memory
  for them, with the loops over its tables.
- `compiler`: compile the text, link the object file, and load it.
- `jit`: choose cached code, interpretation or compilation for a plan.
- `executor`: bind a plan to vectors of lanes, one call per motion.
- `machine_code`: whether llvmlite does all this here; numpy takes over where it does not.
"""

from ...doors import Extension

EXTENSION = Extension(__name__, compilers={"llvmlite": "machine_code:LLVM"})
