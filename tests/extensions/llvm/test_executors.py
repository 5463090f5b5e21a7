"""Executors: their memory, and motions that they follow again and again by blocks of slots, tables,
and the worst sample.
"""

import math
import weakref
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import Mock

import numpy as np
import pytest
from kincheck import Ramp
from kincheck.core.extensions.llvm.executor import LlvmExecutor
from kincheck.core.extensions.llvm.jit import OFTEN, LlvmCode
from kincheck.core.extensions.llvm.machine_code import works
from kincheck.core.extensions.llvm.plan import TOGETHER, PlanInMemory, in_order
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import FROM, SIGMA, TIME, Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import follow_samples, marcher
from kincheck.core.mechanism.motions import Path
from kincheck.core.program import NODES, NumpyExecutor, Plan, Tape, absolute, before, program

from ...support.mechanisms import four_bar, mcpherson, slider_crank

COMPILED = [
    False,
    pytest.param(True, marks=pytest.mark.skipif(not works(), reason="llvmlite is not installed")),
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


SWEEPS = {
    "every sample": (mcpherson, "stroke", np.linspace(-0.05, 0.05, 33)),
    "an end on one side": (mcpherson, "stroke", np.linspace(-0.05, 0.4, 46)),
    "steps that are divided": (four_bar, "turn", np.linspace(0.0, 6.0, 5)),
}


@pytest.mark.parametrize("compiled", COMPILED)
@pytest.mark.parametrize(
    ("sweep", "order"), [(name, (0, 2)[k % 2]) for k, name in enumerate(SWEEPS)]
)
def test_worst_values_of_kept_samples(compiled, sweep, order):
    make, driver, values = SWEEPS[sweep]
    route = route_of(make(), driver, values, compiled=compiled, order=order)
    for _ in range(2):
        found = follow_samples(route, TOL)
        assert found.solved.all() == (sweep != "an end on one side")
        closure, leftover, sigma = (
            found.kept[route.model.rows[name].start, found.solved]
            for name in ("closure", "leftover", SIGMA)
        )
        assert found.worst == [closure.max(), leftover.max(), sigma.min()]


@pytest.mark.parametrize("compiled", COMPILED)
def test_worst_values_of_shorter_march(compiled):
    route = route_of(mcpherson(), "stroke", np.linspace(0.0, 0.2, 41), compiled=compiled)
    whole, half = follow_samples(route, TOL), follow_samples(route, TOL, visit={20})
    sigma = half.kept[route.model.rows[SIGMA].start, :21]
    assert half.worst[-1] == sigma.min() > whole.worst[-1]


@pytest.mark.parametrize("compiled", COMPILED)
def test_sweeps_of_one_model_are_independent(compiled):
    """Whatever was swept in between, by whatever tolerance: the same bits, and what was given away
    stays as it was.
    """
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33), compiled=compiled)
    other = Route(route.model, Path({"stroke": Ramp(1.0)}, np.linspace(0.02, 0.3, 33)))
    first = follow(route, TOL).points["wheel"]
    was = first.position.copy(), first.acceleration.copy()
    follow(other, TOL)
    assert not follow_samples(route, 1e-19).solved.all()
    again = follow(route, TOL).points["wheel"]
    assert not np.shares_memory(first.position, again.position)
    for now in (first, again):
        np.testing.assert_array_equal(now.position, was[0])
        np.testing.assert_array_equal(now.acceleration, was[1])


@pytest.mark.skipif(not works(), reason="llvmlite is not installed")
def test_route_keeps_no_results():
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33))
    found = follow(route, TOL)
    table = weakref.ref(found.points["wheel"].position.base)
    del found
    assert table() is None


@pytest.mark.parametrize("compiled", COMPILED)
def test_route_swept_by_threads(compiled):
    route = route_of(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 161), compiled=compiled)
    alone = follow(route, TOL).points["wheel"].acceleration.copy()
    with ThreadPoolExecutor(4) as threads:
        for found in threads.map(lambda _: follow(route, TOL), range(24)):
            np.testing.assert_array_equal(found.points["wheel"].acceleration, alone)


def test_interrupted_march_is_repeated(monkeypatch):
    route = route_of(mcpherson(), "stroke", np.linspace(-0.05, 0.05, 33), compiled=False)
    first = follow_samples(route, TOL)
    monkeypatch.setattr(NumpyExecutor, "run", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        follow_samples(route, TOL)
    monkeypatch.undo()
    np.testing.assert_array_equal(follow_samples(route, TOL).kept, first.kept)


@pytest.mark.parametrize("order", [0, 2])
@pytest.mark.parametrize("compiled", COMPILED)
def test_visited_samples_have_their_times(compiled, order):
    """A sweep leaves no anchors there; who follows a side by hand goes on from one."""
    route = route_of(
        mcpherson(), "stroke", np.linspace(-0.08, 0.08, 161), compiled=compiled, order=order
    )
    whole = follow_samples(route, TOL)
    visited = follow_samples(route, TOL, visit={0, 81, 103, 160}).visited
    time = route.model.slots[FROM + TIME]
    assert {k: float(lane[time]) for k, lane in visited.items()} == {
        k: float(route.path.times[k]) for k in (0, 81, 103, 160)
    }
    again = follow_samples(route, TOL)
    np.testing.assert_array_equal(again.kept, whole.kept)


@pytest.mark.parametrize("compiled", COMPILED)
def test_partly_accepted_group_is_continued(compiled):
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


@pytest.mark.skipif(not works(), reason="llvmlite is not installed")
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
