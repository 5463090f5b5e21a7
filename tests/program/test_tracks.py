"""What executors know of a motion they follow again and again: programs run over blocks of slots,
tables, and the worst sample.
"""

from __future__ import annotations

import math
import weakref
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import Mock

import numpy as np
import pytest
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import FROM, SIGMA, TIME, Request
from kincheck.core.kinematics.compiled.samples import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import march, marcher
from kincheck.core.mechanism.motions import Path, Ramp
from kincheck.core.program import NODES, NumpyExecutor, Plan, Tape, absolute, before, program
from kincheck.core.program.llvm.compiler import available
from kincheck.core.program.llvm.executor import LlvmExecutor
from kincheck.core.program.llvm.jit import LlvmCode
from kincheck.core.program.llvm.plan import TOGETHER, PlanInMemory, in_order

from ..support.mechanisms import four_bar, mcpherson, slider_crank

COMPILED = [
    False,
    pytest.param(
        True, marks=pytest.mark.skipif(not available(), reason="llvmlite is not installed")
    ),
]
TOL = 1e-12


def route_of(mechanism, driver, values, *, compiled=True, order=2):
    request = Request(
        (driver,), tuple(point.name for point in mechanism.points), order=order, compiled=compiled
    )
    return Route(
        compile_model(mechanism, request),
        Path({driver: Ramp(1.0)}, np.asarray(values, dtype=float)),
    )


@pytest.mark.parametrize("lanes", [1, 7, 8, 19])
@pytest.mark.parametrize("compiled", COMPILED)
def test_of_all_runs_of_a_program_the_largest_counts(compiled, lanes):
    """Blocks of five slots: x from 0 on, y from 5 on."""
    times, tape = 5, Tape()
    x, y = tape.input(0), tape.input(times)
    traced = program(
        "f", tape, {10: absolute(x - y), 11: absolute(before(x, y) * 2.0)}, times=times
    )
    plan = Plan({"f": traced}, {str(k): k for k in range(12)})
    executor = LlvmExecutor(LlvmCode(plan), lanes) if compiled else NumpyExecutor(plan, lanes)
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


def test_flops_of_a_program_are_those_of_all_its_runs():
    tape = Tape()
    x, y = tape.input(0), tape.input(5)
    once, five = (program("f", tape, {10: absolute(x - y)}, times=times) for times in (1, 5))
    assert (once.flops, five.flops) == (2, 14)  # and four times the larger of two


SWEEPS = {
    "every sample": (mcpherson, "stroke", np.linspace(-0.05, 0.05, 33)),
    "an end on one side": (mcpherson, "stroke", np.linspace(-0.05, 0.4, 46)),
    "steps that are divided": (four_bar, "turn", np.linspace(0.0, 6.0, 5)),
}


@pytest.mark.parametrize("compiled", COMPILED)
@pytest.mark.parametrize(
    ("sweep", "order"), [(name, (0, 2)[k % 2]) for k, name in enumerate(SWEEPS)]
)
def test_the_worst_is_that_of_the_samples_that_are_kept(compiled, sweep, order):
    make, driver, values = SWEEPS[sweep]
    route = route_of(make(), driver, values, compiled=compiled, order=order)
    for _ in range(2):
        found = march(route, TOL)
        assert found.solved.all() == (sweep != "an end on one side")
        closure, leftover, sigma = (
            found.kept[route.model.rows[name].start, found.solved]
            for name in ("closure", "leftover", SIGMA)
        )
        assert found.worst == [closure.max(), leftover.max(), sigma.min()]


@pytest.mark.parametrize("compiled", COMPILED)
def test_the_worst_of_a_march_before_is_forgotten(compiled):
    route = route_of(mcpherson(), "stroke", np.linspace(0.0, 0.2, 41), compiled=compiled)
    whole, half = march(route, TOL), march(route, TOL, visit={20})
    sigma = half.kept[route.model.rows[SIGMA].start, :21]
    assert half.worst[-1] == sigma.min() > whole.worst[-1]


@pytest.mark.parametrize("compiled", COMPILED)
def test_sweeps_of_one_model_leave_each_other_alone(compiled):
    """Whatever was swept in between, by whatever tolerance: the same bits, and what was given away
    stays as it was.
    """
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33), compiled=compiled)
    other = Route(route.model, Path({"stroke": Ramp(1.0)}, np.linspace(0.02, 0.3, 33)))
    first = follow(route, TOL).points["wheel"]
    was = first.position.copy(), first.acceleration.copy()
    follow(other, TOL)
    assert not march(route, 1e-19).solved.all()
    again = follow(route, TOL).points["wheel"]
    assert not np.shares_memory(first.position, again.position)
    for now in (first, again):
        np.testing.assert_array_equal(now.position, was[0])
        np.testing.assert_array_equal(now.acceleration, was[1])


@pytest.mark.skipif(not available(), reason="llvmlite is not installed")
def test_a_route_keeps_no_results():
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33))
    found = follow(route, TOL)
    table = weakref.ref(found.points["wheel"].position.base)
    del found
    assert table() is None


@pytest.mark.parametrize("compiled", COMPILED)
def test_a_route_may_be_swept_by_several_threads(compiled):
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 161), compiled=compiled)
    alone = follow(route, TOL).points["wheel"].acceleration.copy()
    with ThreadPoolExecutor(4) as threads:
        for found in threads.map(lambda _: follow(route, TOL), range(24)):
            np.testing.assert_array_equal(found.points["wheel"].acceleration, alone)


def test_what_is_carried_is_moved_so_that_no_slot_is_read_after_it_was_written():
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
    one, other = list(range(300)), list(range(300))
    for slots, moves in ((one, pairs), (other, moved)):
        for source, target in moves:
            slots[target] = slots[source]
    assert one == other


@pytest.mark.parametrize("count", range(1, 10))
def test_rows_that_fill_up_a_table_of_pairs_change_nothing(count):
    pairs, width = [(k, k + 1) for k in reversed(range(count))], 8
    table = PlanInMemory(Plan({}, {}, carried=pairs), width, 20)._tables["carried"]
    assert len(table) % TOGETHER == 0
    one, other = list(range(20)), list(range(20))
    for slots, moves in ((one, pairs), (other, table // (8 * width))):
        for source, target in moves:
            slots[target] = slots[source]
    assert one == other


def test_both_sides_are_one_attempt_of_the_numpy_executor(monkeypatch):
    """Neither side's first lane has a neighbour."""
    route, settled = (
        route_of(mcpherson(), "stroke", np.linspace(-0.05, 0.05, 33), compiled=False),
        list[list[int]](),
    )
    attempt = NumpyExecutor.settle
    monkeypatch.setattr(
        NumpyExecutor,
        "settle",
        lambda x, start, tests: (settled.append([*x.heads]), attempt(x, start, tests)),
    )
    assert march(route, TOL).solved.all()
    assert settled == [[0, 17]]
    assert march(route, TOL, visit={32}).solved[32]
    assert settled[1:] == [[0]]


def test_an_interrupted_attempt_leaves_no_heads_behind(monkeypatch):
    route = route_of(mcpherson(), "stroke", np.linspace(-0.05, 0.05, 33), compiled=False)
    first = march(route, TOL)
    monkeypatch.setattr(NumpyExecutor, "run", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        march(route, TOL)
    monkeypatch.undo()
    assert route.model.executor(route.lanes).heads == [0]
    np.testing.assert_array_equal(march(route, TOL).kept, first.kept)


def test_a_lane_that_is_a_head_has_none_before_it():
    tape = Tape()
    plan = Plan(
        {"f": program("f", tape, {2: before(tape.input(0), tape.input(1))})},
        {str(k): k for k in range(3)},
    )
    executor = NumpyExecutor(plan, 6)
    executor.put([0, 1], np.arange(12.0).reshape(2, 6))
    executor.heads[:] = [0, 4]
    executor.run("f")
    assert executor.get([2]).tolist() == [[6.0, 0.0, 1.0, 2.0, 10.0, 4.0]]


@pytest.mark.skipif(not available(), reason="llvmlite is not installed")
def test_tables_begin_with_a_cache_line():
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
def test_a_window_is_memory_and_takes_what_is_arranged(compiled, lanes):
    tape = Tape()
    plan = Plan(
        {"f": program("f", tape, {3: tape.input(1) - tape.input(2)})}, {str(k): k for k in range(4)}
    )
    executor = LlvmExecutor(LlvmCode(plan), lanes) if compiled else NumpyExecutor(plan, lanes)
    values = np.random.default_rng(1).normal(size=(2, lanes))
    executor.window(range(1, 3))[:] = executor.arranged(values)
    np.testing.assert_array_equal(executor.get(range(1, 3)), values)
    executor.run("f")
    found = np.full(lanes, np.nan)
    found[executor.arranged(np.arange(lanes)[None])] = executor.window(range(3, 4))
    np.testing.assert_array_equal(found, values[0] - values[1])
    copy = executor.get(range(1, 3))
    executor.clear()
    np.testing.assert_array_equal(copy, values)


@pytest.mark.parametrize("compiled", COMPILED)
def test_what_stood_in_slots_is_put_out_whatever_is_written_before(compiled, monkeypatch):
    """Lanes of a group: to slots that are read, that are put out elsewhere, and that nobody reads;
    and values used on the way.
    """
    monkeypatch.setattr("kincheck.core.program.llvm.jit.OFTEN", 0)
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
    plan = Plan({"f": program("f", tape, out)}, {str(k): k for k in range(9)})
    executor = LlvmExecutor(LlvmCode(plan), 8) if compiled else NumpyExecutor(plan, 8)
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


@pytest.mark.parametrize("order", [0, 2])
@pytest.mark.parametrize("compiled", COMPILED)
def test_at_its_end_a_side_stands_where_it_was_followed_to(compiled, order):
    """A sweep leaves no anchors there; who follows a side by hand goes on from one."""
    route = route_of(
        mcpherson(), "stroke", np.linspace(-0.08, 0.08, 161), compiled=compiled, order=order
    )
    whole = march(route, TOL)
    visited = march(route, TOL, visit={0, 81, 103, 160}).visited
    time = route.model.slots[FROM + TIME]
    assert {k: float(lane[time]) for k, lane in visited.items()} == {
        k: float(route.path.times[k]) for k in (0, 81, 103, 160)
    }
    again = march(route, TOL)
    np.testing.assert_array_equal(again.kept, whole.kept)


@pytest.mark.parametrize("compiled", COMPILED)
def test_a_group_that_is_accepted_in_part_is_followed_on(compiled):
    """Without a word from whoever divides steps."""
    route = route_of(
        slider_crank(),
        "turn",
        np.concatenate([[0.5, 1.0, 1.5], 1.5 + 0.002 * np.arange(1.0, 62.0)]),
        compiled=compiled,
    )
    bound = marcher(route, TOL, crossing=False)
    bound.run()
    kept = bound.track.begin()
    assert [*bound.track.run()] == [64]
    assert np.isfinite(kept).all()
