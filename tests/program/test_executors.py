"""Memory of executors: windows, tables, and slots that are read, written and carried."""

from __future__ import annotations

import math

import numpy as np
import pytest
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.program import NODES, NumpyExecutor, Plan, Tape, absolute, before, program
from kincheck.core.program.llvm.compiler import available
from kincheck.core.program.llvm.executor import LlvmExecutor
from kincheck.core.program.llvm.jit import OFTEN, LlvmCode
from kincheck.core.program.llvm.plan import TOGETHER, PlanInMemory, in_order

from ..support.mechanisms import mcpherson
from .test_tracks import COMPILED


def bound(traced, slots, lanes, compiled, often=OFTEN):
    plan = Plan({"f": traced}, {str(k): k for k in range(slots)})
    return LlvmExecutor(LlvmCode(plan, often), lanes) if compiled else NumpyExecutor(plan, lanes)


@pytest.mark.parametrize("lanes", [1, 7, 8, 19])
@pytest.mark.parametrize("compiled", COMPILED)
def test_repeated_program_keeps_largest_value(compiled, lanes):
    """Blocks of five slots: x from 0 on, y from 5 on."""
    times, tape = 5, Tape()
    x, y = tape.input(0), tape.input(times)
    traced = program(
        "f", tape, {10: absolute(x - y), 11: absolute(before(x, y) * 2.0)}, times=times
    )
    executor = bound(traced, 12, lanes, compiled)
    values = np.random.default_rng(3).normal(size=(10, lanes))
    values[7, -1] = math.nan
    executor.put(range(10), values)
    executor.run("f")
    xs, ys = values[:times], values[times:]
    shifted = np.roll(xs, 1, axis=1)
    group = executor.margin if compiled else lanes  # lanes are neighbours within a vector
    shifted[:, ::group] = ys[:, ::group]
    wanted = np.abs(xs - ys).max(axis=0), np.abs(2.0 * shifted).max(axis=0)
    assert np.isnan(wanted[0]).tolist() == [False] * (lanes - 1) + [True]
    np.testing.assert_array_equal(executor.get([10, 11]), wanted)


def test_flops_of_repeated_program():
    tape = Tape()
    x, y = tape.input(0), tape.input(5)
    once, five = (program("f", tape, {10: absolute(x - y)}, times=times) for times in (1, 5))
    assert (once.flops, five.flops) == (2, 14)  # and four times the larger of two


def after(moves):
    slots = list(range(300))
    for source, target in moves:
        slots[target] = slots[source]
    return slots


def test_carried_slots_are_ordered():
    """Whatever the order: the same as taking all over one after the other."""
    pairs = [
        (5, 6),
        (4, 5),
        (9, 9),
        *((k, k - 57) for k in range(182, 200)),
        *((k, k + 40) for k in range(20, 30)),
    ]
    moved = in_order(pairs)
    assert {*moved} == {*pairs} - {(9, 9)}
    assert moved != [pair for pair in pairs if pair != (9, 9)]
    assert after(pairs) == after(moved)


@pytest.mark.parametrize("count", range(1, 10))
def test_padding_of_carried_pairs_is_neutral(count):
    pairs, width = [(k, k + 1) for k in reversed(range(count))], 8
    table = PlanInMemory(Plan({}, {}, carried=pairs), width, 20)._tables["carried"]
    assert len(table) % TOGETHER == 0
    assert after(pairs) == after(table // (8 * width))


@pytest.mark.skipif(not available(), reason="llvmlite is not installed")
def test_tables_are_cache_aligned():
    mechanism = mcpherson()
    model = compile_model(
        mechanism, Request(("stroke",), ("wheel",), varied=("points.wheel.position",))
    )
    for lanes in (1, 9, 300):
        executor = model.executor(lanes)
        for columns in (1, 3):
            table = executor.table(columns)
            assert table.shape == (model.kept, columns, executor.room)
            assert table.ctypes.data % 64 == 0
            assert table.flags.c_contiguous


@pytest.mark.parametrize("lanes", [1, 7, 8, 19])
@pytest.mark.parametrize("compiled", COMPILED)
def test_slot_window_shares_memory(compiled, lanes):
    tape = Tape()
    traced = program("f", tape, {3: tape.input(1) - tape.input(2)})
    executor = bound(traced, 4, lanes, compiled)
    values = np.random.default_rng(1).normal(size=(2, lanes))
    executor.put(range(1, 3), values)
    window = executor.window(range(1, 3))
    before = window.copy()
    executor.clear()
    assert not executor.get(range(1, 3)).any()
    window[:] = before
    np.testing.assert_array_equal(executor.get(range(1, 3)), values)
    executor.run("f")
    np.testing.assert_array_equal(executor.get([3])[0], values[0] - values[1])
    copy = executor.get(range(1, 3))
    executor.clear()
    np.testing.assert_array_equal(copy, values)


@pytest.mark.parametrize("compiled", COMPILED)
def test_outputs_read_slots_before_overwriting(compiled):
    """Lanes of a group: to slots that are read, that are put out elsewhere, and that nobody reads;
    and values used on the way.
    """
    tape = Tape()
    x, last, first, other = (
        tape.input(0),
        tape.at(NODES - 1, 0),
        tape.at(0, 0),
        tape.at(NODES - 1, 1),
    )
    head = tape.at(0, 3)
    total = x
    for k in range(40):  # more than there are registers for
        total = total * (last + first * float(k)) * head
    late = tape.input(7) + total
    out = {
        0: total,
        1: last,
        2: first,
        3: other,
        4: tape.input(2),
        5: other + first,
        6: tape.input(1),
        7: head,
        8: late,
    }
    executor = bound(program("f", tape, out), 9, 8, compiled, often=0)
    group = executor.margin if compiled else 8
    values = np.random.default_rng(5).uniform(0.2, 0.4, size=(9, 8))
    heads = np.arange(8) // group * group
    for _ in range(2):  # interpreted, and compiled
        executor.put(range(9), values)
        executor.run("f")
        lasts, firsts = values[:, heads + group - 1], values[:, heads]
        expected = values[0]
        for k in range(40):
            expected = expected * (lasts[0] + firsts[0] * float(k)) * firsts[3]
        found = executor.get(range(9))
        for each, wanted in ((found[0], expected), (found[8], values[7] + expected)):
            # 160 operations, some of them fused, each rounded
            assert np.abs(each / wanted - 1.0).max() <= 4e-14
        stood = [
            lasts[0],
            firsts[0],
            lasts[1],
            values[2],
            lasts[1] + firsts[0],
            values[1],
            firsts[3],
        ]
        np.testing.assert_array_equal(found[1:8], stood)
