"""The order in which machine code goes through a program."""

from collections import Counter

import numpy as np
import pytest
from kincheck.core.extensions.llvm import programs
from kincheck.core.extensions.llvm.bytecode import lower
from kincheck.core.extensions.llvm.programs import AT_ONCE, CYCLES, OTHERS, _Straight, reschedule
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.program import Tape, program
from kincheck.core.program.tape import LEAVES, operands

from ...support.mechanisms import mcpherson
from ...support.program_blocks import run_on


def cycles(found):
    """When the last result is there, if operations begin in this order, so many in a cycle, and
    wait for their operands.
    """
    there, now, room = [], 0, AT_ONCE
    for node in found.nodes:
        if node[0] in LEAVES:
            there.append(0)
            continue
        begin = max(there[k] for k in operands(node))
        if not room or begin > now:
            now, room = max(now + 1, begin), AT_ONCE
        room -= 1
        there.append(now + CYCLES.get(node[0], OTHERS))
    return max(there)


def waiting(steps, beside):
    """Divisions that wait for one another, traced after products that wait for nothing."""
    tape = Tape()
    products = [tape.input(k) * tape.input(k + 1) for k in range(beside)]
    x = tape.input(0)
    for _ in range(steps):
        x = tape.input(1) / x
    return program("p", tape, {100 + k: value for k, value in enumerate([*products, x])})


def test_ordering_starts_with_longest_chain():
    found = reschedule(waiting(5, 30))
    kinds = [node[0] for node in found.nodes if node[0] not in LEAVES]
    assert kinds[0] == "/"
    assert "*" in kinds[1 : len(kinds) - 1 - kinds[::-1].index("/")]
    assert cycles(found) == 5 * CYCLES["/"] < cycles(waiting(5, 30))


def test_ordering_leaves_wide_program():
    wide = waiting(1, 90)
    assert reschedule(wide) is wide


@pytest.mark.parametrize("width", [2, 4, 8])
def test_ordering_depends_on_registers(width, monkeypatch):
    each = compile_model(mcpherson(), Request(("stroke",), ("wheel",), compiled=False)).programs[
        "newton"
    ]
    traced, waiting = (
        _Straight(found, width).text for found in (lower(each), reschedule(lower(each)))
    )
    assert traced != waiting
    assert (waiting if width == 8 else traced) in programs.function(each, width)
    monkeypatch.setattr(programs, "PUT_AWAY", 0.0)  # nothing may be put away for it
    assert traced in programs.function(each, width)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_ordering_keeps_results(order):
    model = compile_model(
        mcpherson(), Request(("stroke",), ("wheel",), ("strut", "knuckle"), order=order)
    )
    rng, moved = np.random.default_rng(1), 0
    for name, each in model.programs.items():
        if each.times > 1 or any(node[0] == "node" for node in each.nodes):
            continue
        before = lower(each)
        after = reschedule(before)
        assert all(k < number for number, node in enumerate(after.nodes) for k in operands(node))
        assert Counter(node[0] for node in after.nodes) == Counter(node[0] for node in before.nodes)
        assert after.outputs.keys() == before.outputs.keys()
        if after is before:
            continue
        moved += 1
        assert cycles(after) < 0.8 * cycles(before), name
        block = rng.uniform(0.5, 1.5, size=(len(model.slots), 3))
        blocks = block.copy(), block.copy()
        # what is fused, only machine code knows
        for found, here in zip((each, reschedule(each)), blocks, strict=True):
            run_on([found], here, each.name)
        assert np.array_equal(*blocks, equal_nan=True)
    assert moved >= 3
