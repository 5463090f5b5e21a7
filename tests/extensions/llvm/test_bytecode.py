"""Programs that are interpreted: the same numbers as compiled, to the last bit."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.extensions.llvm import compiler
from kincheck.core.extensions.llvm.bytecode import bytecode, lower
from kincheck.core.extensions.llvm.executor import LlvmExecutor
from kincheck.core.extensions.llvm.jit import LlvmCode
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.program import Plan, Tape, absolute, before, program

from ...support.mechanisms import four_bar, mcpherson
from .test_llvm import OPERATIONS

pytest.importorskip("llvmlite", reason="llvmlite is not installed")


pytestmark = pytest.mark.usefixtures("no_programs_kept")


def both(run, plan):
    """What is interpreted is what is compiled."""
    made = LlvmCode(plan)
    assert made.interpreted
    interpreted = run(made)
    made.count(10**9)
    assert not made.interpreted
    assert run(made).tobytes() == interpreted.tobytes()  # the sign of zeros too


def every_slot(made, name="f", values=None):
    """All slots after a program was run on numbers, in the first slots."""
    slots = range(len(made.plan.slots))
    if values is None:
        values = np.random.default_rng(1).normal(size=(len(slots), 19))
    executor = LlvmExecutor(made, values.shape[1])
    executor.put(slots[: len(values)], values)
    made._left = 10**9
    executor.run(name)
    return executor.get(slots)


DELTA = cases.load("delta_robot").mechanism


@pytest.mark.parametrize(
    ("mechanism", "width"),
    [*((mcpherson(), width) for width in (2, 4, 8)), (four_bar(), 4), (DELTA, 2)],
    ids=lambda each: getattr(each, "name", each),
)
def test_bytecode_of_models_equals_machine_code(mechanism, width, monkeypatch):
    if width > compiler.vector_width():
        pytest.skip("no such vectors here")
    monkeypatch.setattr(compiler, "vector_width", lambda: width)
    drivers = tuple(each.name for each in mechanism.drivers)
    places = ("joints.tie_rod.points.0",) if mechanism.name == mcpherson().name else ()
    request = Request(drivers, tuple(each.name for each in mechanism.points), varied=places)
    plan = compile_model(mechanism, request).plan
    both(lambda made: np.array([every_slot(made, name) for name in plan.programs]), plan)


@pytest.mark.parametrize("name", [*OPERATIONS, "before"])
def test_bytecode_of_operations_equals_machine_code(name):
    tape = Tape()
    a, b = tape.input(0), tape.input(1)
    value = before(a, b) if name == "before" else OPERATIONS[name](a, b)
    plan = Plan({"f": program("f", tape, {2: value})}, {str(k): k for k in range(3)})
    both(every_slot, plan)


def test_bytecode_signs_of_zeros():
    """LLVM may turn them in compiled programs only, if the flag nsz allows it."""
    tape = Tape()
    a, b, c, d = (tape.input(k) for k in range(4))
    nodes = program("f", tape, {4: -(a * b - c), 5: -(c * d + a), 6: d - (b * c - a)})
    plan = Plan({"f": nodes}, {str(k): k for k in range(7)})
    values = np.array(list(product([0.0, -0.0, 1.0, -1.0], repeat=4))).T
    both(lambda made: every_slot(made, values=values)[4:], plan)


def test_bytecode_outputs_replace_inputs():
    tape = Tape()
    x = [tape.input(k) for k in range(6)]
    outputs = {
        0: x[1],
        1: x[0],
        2: x[0] * x[1] + x[2],
        3: x[3],
        4: x[2],
        5: 2.0,
        6: x[4] - x[0] * x[1],
        7: x[4],
    }
    plan = Plan({"f": program("f", tape, outputs)}, {str(k): k for k in range(8)})
    found = every_slot(LlvmCode(plan), values=np.arange(1.0, 7.0)[:, None])
    assert found[:, 0].tolist() == [2.0, 1.0, 5.0, 4.0, 3.0, 2.0, 3.0, 5.0]
    both(every_slot, plan)


def test_bytecode_of_repeated_program():
    tape = Tape()
    out = {9: absolute(tape.input(0) - tape.input(4)), 10: absolute(tape.input(0))}
    plan = Plan({"f": program("f", tape, out, times=3)}, {str(k): k for k in range(11)})
    both(every_slot, plan)


def test_single_use_product_is_fused():
    tape = Tape()
    a, b, c, d = (tape.input(k) for k in range(4))
    once, twice = a * b, c * d
    found = lower(
        program(
            "f",
            tape,
            {4: c + once, 5: c - a * c, 6: a * d - b, 7: twice + a, 8: twice, 9: b * b + b * d},
        )
    )
    assert [node[0] for node in found.nodes if node[0] != "input"].count("fma") == 2
    kinds = sorted(node[0] for node in found.nodes if node[0] != "input")
    assert kinds == ["*", "*", "+", "fma", "fma", "fms", "fnma"]


def test_bytecode_cells_are_reused():
    tape = Tape()
    x = tape.input(0)
    for k in range(200):
        x = x * x + float(k % 3 + 2)
    found = bytecode(program("f", tape, {1: x}), 2, 8)
    assert found.cells <= 5
