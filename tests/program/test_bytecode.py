"""Programs that are interpreted: the same numbers as compiled, to the last bit, and compiled only
where they are run often.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from shutil import copytree
from threading import Barrier, Thread
from time import sleep

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import solve, solve_designs
from kincheck.core.caches import clear_caches
from kincheck.core.kinematics.by_components.block_solver import Cascade
from kincheck.core.kinematics.by_components.sweep import CascadeSweep
from kincheck.core.kinematics.compiled import compiled_model as models
from kincheck.core.kinematics.compiled.compiled_model import Model, compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.compiled.samples import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.design_batch import solve_variants
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.structure.components import components
from kincheck.core.mechanism.motions import Path, Ramp
from kincheck.core.program import Plan, Program, Tape, absolute, before, program
from kincheck.core.program.bytecode import bytecode
from kincheck.core.program.llvm import code_cache, compiler
from kincheck.core.program.llvm import jit as llvm
from kincheck.core.program.llvm.executor import LlvmExecutor
from kincheck.core.program.llvm.jit import LlvmCode
from kincheck.core.program.lowering import lowered, unrolled

from ..kinematics.test_chain import chain
from ..support.mechanisms import four_bar, mcpherson
from .test_llvm import OPERATIONS

pytest.importorskip("llvmlite", reason="llvmlite is not installed")


@pytest.fixture(scope="module")
def loops(tmp_path_factory):
    """A cache with the loops that run any program, and nothing else."""
    folder = tmp_path_factory.mktemp("loops")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        clear_caches()
        for name in ("interpret", "follow"):
            llvm._loop(name, compiler.vector_width())
        clear_caches()
    return folder / "kincheck"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch, loops):
    """One without programs, so that none is compiled at first."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return copytree(loops, tmp_path / "kincheck")


def both(run: Callable[[LlvmCode], np.ndarray], plan: Plan) -> None:
    """What is interpreted is what is compiled."""
    made = LlvmCode(plan)
    assert made.interpreted
    interpreted = run(made)
    made.count(10**9)
    assert not made.interpreted
    assert run(made).tobytes() == interpreted.tobytes()  # the sign of zeros too


def every_slot(made: LlvmCode, name: str, lanes: int = 19) -> np.ndarray:
    """All slots after a program was run on numbers."""
    slots = range(len(made.plan.slots))
    executor = LlvmExecutor(made, lanes)
    executor.put(slots, np.random.default_rng(1).normal(size=(len(slots), lanes)))
    made._left = 10**9
    executor.run(name)
    return executor.get(slots)


DELTA = cases.load("delta_robot").mechanism


@pytest.mark.parametrize(
    ("mechanism", "width"),
    [*((mcpherson(), width) for width in (2, 4, 8)), (four_bar(), 4), (DELTA, 2)],
    ids=lambda each: getattr(each, "name", each),
)
def test_programs_of_models(mechanism, width, monkeypatch):
    if width > compiler.vector_width():
        pytest.skip("no such vectors here")
    monkeypatch.setattr(compiler, "vector_width", lambda: width)
    drivers = tuple(each.name for each in mechanism.drivers)
    places = ("joints.tie_rod.points.0",) if mechanism.name == mcpherson().name else ()
    request = Request(drivers, tuple(each.name for each in mechanism.points), varied=places)
    plan = compile_model(mechanism, request).plan
    both(lambda made: np.array([every_slot(made, name) for name in plan.programs]), plan)


@pytest.mark.parametrize("name", [*OPERATIONS, "before"])
def test_operations(name):
    tape = Tape()
    a, b = tape.input(0), tape.input(1)
    value = before(a, b) if name == "before" else OPERATIONS[name](a, b)
    plan = Plan({"f": program("f", tape, {2: value})}, {str(k): k for k in range(3)})
    both(lambda made: every_slot(made, "f"), plan)


def test_signs_of_zeros_are_the_same():
    """LLVM may turn them in compiled programs only, if the flag nsz allows it."""
    tape = Tape()
    a, b, c, d = (tape.input(k) for k in range(4))
    nodes = program("f", tape, {4: -(a * b - c), 5: -(c * d + a), 6: d - (b * c - a)})
    plan = Plan({"f": nodes}, {str(k): k for k in range(7)})
    values = np.array(list(product([0.0, -0.0, 1.0, -1.0], repeat=4))).T

    def run(made: LlvmCode) -> np.ndarray:
        made._left = 10**9
        executor = LlvmExecutor(made, values.shape[1])
        executor.put(range(4), values)
        executor.run("f")
        return executor.get(range(4, 7))

    both(run, plan)


def test_outputs_that_take_the_place_of_inputs():
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
    values = np.arange(1.0, 7.0)
    executor = LlvmExecutor(LlvmCode(plan), 1)
    executor.put(range(6), values[:, None])
    executor.run("f")
    assert executor.get(range(8))[:, 0].tolist() == [2.0, 1.0, 5.0, 4.0, 3.0, 2.0, 3.0, 5.0]
    both(lambda made: every_slot(made, "f"), plan)


def test_a_program_that_is_run_several_times():
    tape = Tape()
    nodes = program(
        "f",
        tape,
        {9: absolute(tape.input(0) - tape.input(4)), 10: absolute(tape.input(0))},
        times=3,
    )
    plan = Plan({"f": nodes}, {str(k): k for k in range(11)})
    values = np.array([1.0, -7.0, 2.0, 0.0, 1.5, -6.0, 9.0, 0.0, 0.0])
    executor = LlvmExecutor(LlvmCode(plan), 1)
    executor.put(range(9), values[:, None])
    executor.run("f")
    assert executor.get([9, 10])[:, 0].tolist() == [7.0, 7.0]
    both(lambda made: every_slot(made, "f"), plan)
    values[5] = np.nan
    executor.put(range(9), values[:, None])
    executor.run("f")
    assert np.isnan(executor.get([9])[0, 0])


def test_a_product_is_part_of_the_only_sum_it_goes_into():
    tape = Tape()
    a, b, c, d = (tape.input(k) for k in range(4))
    once, twice = a * b, c * d
    found = lowered(
        program(
            "f",
            tape,
            {4: c + once, 5: c - a * c, 6: a * d - b, 7: twice + a, 8: twice, 9: b * b + b * d},
        )
    )
    assert [node[0] for node in found.nodes if node[0] != "input"].count("fma") == 2
    kinds = sorted(node[0] for node in found.nodes if node[0] != "input")
    assert kinds == ["*", "*", "+", "fma", "fma", "fms", "fnma"]


def test_written_out_a_program_is_run_once():
    tape = Tape()
    short = program("f", tape, {9: absolute(tape.input(0) * 3.0)}, times=4)
    long = unrolled(short)
    assert long.times == 1
    assert long.operations["umax"] == 3
    assert {node[1] for node in long.nodes if node[0] == "input"} == {0, 1, 2, 3}
    assert unrolled(long) == long


def test_cells_are_used_again():
    tape = Tape()
    x = tape.input(0)
    for k in range(200):
        x = x * x + float(k % 3 + 2)
    found = bytecode(program("f", tape, {1: x}), 2, 8)
    assert found.cells <= 5


def sweeps(mechanism, driver: str, values: np.ndarray, **asked) -> tuple[Model, list[np.ndarray]]:
    model = compile_model(
        mechanism, Request((driver,), tuple(each.name for each in mechanism.points), **asked)
    )
    route = Route(model, Path({driver: Ramp(1.0)}, values))

    def positions() -> np.ndarray:
        return np.array([each.position for each in follow(route, 1e-12).points.values()])

    return model, [positions() for _ in range(10)]


@pytest.mark.parametrize("order", [0, 1, 2])
def test_sweeps_are_the_same_before_and_after(order):
    model, found = sweeps(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 161), order=order)
    assert model._code is not None
    assert not model._code.interpreted
    for each in found[1:]:
        np.testing.assert_array_equal(each, found[0])


def test_one_sweep_compiles_nothing():
    mechanism = mcpherson()
    solve(mechanism, "stroke", np.linspace(-0.08, 0.08, 161))
    model = models.recent_model(mechanism, request_of(mechanism))
    assert model._code is not None
    assert model._code.interpreted


def request_of(mechanism) -> Request:
    """That of `solve` with all it gives by itself."""
    return Request(
        ("stroke",),
        tuple(each.name for each in mechanism.points),
        tuple(each.name for each in mechanism.moving),
    )


@pytest.mark.parametrize("way", ["designs", "components"])
def test_designs_and_components_are_the_same_before_and_after(way, monkeypatch):
    def run() -> list[np.ndarray]:
        clear_caches()
        rod = np.array([1.115, 0.665, 0.118])
        places = {"joints.tie_rod.points.0": rod + np.linspace(0.0, 0.01, 11)[:, None]}
        if way == "designs":
            found = solve_designs(mcpherson(), "stroke", [-0.05, 0.0, 0.05], places, order=2).points
        else:
            found = solve(chain(8), "turn", np.linspace(-0.5, 0.5, 33)).points
        return [each.acceleration for each in found.values()]

    monkeypatch.setattr(llvm, "OFTEN", 10**9)
    interpreted = run()
    monkeypatch.setattr(llvm, "OFTEN", 0)
    for a, b in zip(interpreted, run(), strict=True):
        np.testing.assert_array_equal(a, b)


def test_many_designs_compile_their_programs():
    mechanism, place = mcpherson(), "joints.tie_rod.points.0"
    request = Request(("stroke",), ("wheel",), varied=(place,))
    route = Route(
        compile_model(mechanism, request), Path({"stroke": Ramp(1.0)}, np.linspace(-0.05, 0.05, 41))
    )
    rod = np.array([[1.115], [0.665], [0.118]]) + np.linspace(0.0, 0.01, 17)
    assert route.model._code.interpreted
    for _ in range(2):
        solve_variants(route, rod, 1e-12)
    assert not route.model._code.interpreted


def test_many_components_compile_their_programs():
    mechanism = chain(15)
    parts = components(mechanism, frames(mechanism))
    cascade = Cascade(mechanism, Request(("turn",), ()), parts)
    solver = CascadeSweep(cascade, Path({"turn": Ramp(1.0)}, np.linspace(-0.5, 0.5, 65)))
    assert all(kind.model._code.interpreted for kind in cascade.kinds)
    solver.solve(1e-12)
    assert not any(kind.model._code.interpreted for kind in cascade.kinds if len(kind.members) > 1)


def test_long_programs_are_walked_for_longer():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    for _ in range(llvm.OPERATIONS):
        x = x * y
    long = Program("f", program("f", tape, {2: x}).nodes, {2: llvm.OPERATIONS + 1})
    made = LlvmCode(Plan({"f": long, "g": replace(long, name="g")}, {"a": 0, "b": 1, "c": 2}))
    made.count(llvm.OFTEN)
    assert made.interpreted
    made.count(llvm.OFTEN + 1)
    assert not made.interpreted


def test_programs_that_another_process_walked_are_compiled_in_the_first_sweep():
    # its tables are in the cache now
    plan = compile_model(mcpherson(), Request(("stroke",), ())).plan
    made = LlvmCode(plan)
    made.count(llvm.AGAIN - 1)
    assert made.interpreted
    made.count(1)
    assert not made.interpreted


def test_who_measures_has_programs_compiled_at_once_and_nobody_else():
    with llvm.compiled_at_once():
        made = compile_model(mcpherson(), Request(("stroke",), ()))._code
    assert not made.interpreted  # they have run: the design is solved
    assert compile_model(four_bar(), Request(("turn",), ()))._code.interpreted


def test_what_was_compiled_is_found_by_the_next_process():
    plan = compile_model(four_bar(), Request((four_bar().drivers[0].name,), ())).plan
    assert LlvmCode(plan).interpreted
    LlvmCode(plan).count(10**9)
    assert not LlvmCode(plan).interpreted


def test_an_interrupted_compilation_is_made_up_for(monkeypatch):
    made = LlvmCode(compile_model(four_bar(), Request((four_bar().drivers[0].name,), ())).plan)
    wanted = every_slot(made, "newton")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(code_cache, "load", interrupted)
        with pytest.raises(KeyboardInterrupt):
            made.count(10**9)
    assert made.interpreted
    np.testing.assert_array_equal(every_slot(made, "newton"), wanted)
    made.count(10**9)
    assert not made.interpreted
    np.testing.assert_array_equal(every_slot(made, "newton"), wanted)


def test_threads_that_come_at_once_compile_once(monkeypatch):
    """The code of the first would be gone while it runs."""
    made = LlvmCode(compile_model(four_bar(), Request((four_bar().drivers[0].name,), ())).plan)
    load, loaded, meet = code_cache.load, list[str](), Barrier(4)

    def slowly(*given):
        loaded.append("once")
        sleep(0.2)
        return load(*given)

    def count() -> None:
        meet.wait()
        made.count(10**9)

    monkeypatch.setattr(code_cache, "load", slowly)
    threads = [Thread(target=count) for _ in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert loaded == ["once"]
