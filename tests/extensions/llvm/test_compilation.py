"""Programs are compiled where they run often, once, and change no result by it."""

from __future__ import annotations

from dataclasses import replace
from threading import Barrier, Thread
from time import sleep

import numpy as np
import pytest
from kincheck import Ramp, solve
from kincheck.core.extensions.blocks.components import components
from kincheck.core.extensions.designs.design_batch import solve_variants
from kincheck.core.extensions.llvm import jit as llvm
from kincheck.core.extensions.llvm.jit import LlvmCode
from kincheck.core.kinematics.compiled import compiled_model as models
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.mechanism.motions import Path
from kincheck.core.program import Plan, Program, Tape, program
from kincheck.core.program.executor import compiled_at_once

from ...support.mechanisms import chain, four_bar, mcpherson
from .test_bytecode import every_slot

pytestmark = pytest.mark.usefixtures("no_programs_kept")


def test_single_sweep_is_interpreted():
    mechanism = mcpherson()
    solve(mechanism, "stroke", np.linspace(-0.08, 0.08, 161))
    points, bodies = (
        tuple(each.name for each in members) for members in (mechanism.points, mechanism.moving)
    )
    model = models.recent_model(mechanism, Request(("stroke",), points, bodies))
    assert model._bind.args[0].interpreted


def test_many_designs_are_compiled():
    mechanism, place = mcpherson(), "joints.tie_rod.points.0"
    request = Request(("stroke",), ("wheel",), varied=(place,))
    route = Route(
        compile_model(mechanism, request), Path({"stroke": Ramp(1.0)}, np.linspace(-0.05, 0.05, 41))
    )
    rod = np.array([[1.115], [0.665], [0.118]]) + np.linspace(0.0, 0.01, 17)
    assert route.model._bind.args[0].interpreted
    for _ in range(2):
        solve_variants(route, rod, 1e-12)
    assert not route.model._bind.args[0].interpreted


def test_many_components_are_compiled():
    lanes = pytest.importorskip("kincheck.core.extensions.blocks.component_lanes")
    walks = pytest.importorskip("kincheck.core.extensions.blocks.sweep")
    mechanism = chain(15)
    parts = components(mechanism, frames(mechanism))
    cascade = lanes.ComponentLanes(mechanism, Request(("turn",), ()), parts)
    path = Path({"turn": Ramp(1.0)}, np.linspace(-0.5, 0.5, 65))
    solver = walks.BlockSweep(cascade, path)
    assert all(kind.model._bind.args[0].interpreted for kind in cascade.kinds)
    solver.solve(1e-12)
    assert not any(
        kind.model._bind.args[0].interpreted for kind in cascade.kinds if len(kind.members) > 1
    )


def test_long_program_is_compiled_later():
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


def test_known_program_is_compiled_sooner():
    # its tables are in the cache now
    plan = compile_model(mcpherson(), Request(("stroke",), ())).plan
    made = LlvmCode(plan)
    made.count(llvm.AGAIN - 1)
    assert made.interpreted
    made.count(1)
    assert not made.interpreted


def test_compiled_at_once_context():
    with compiled_at_once():
        made = compile_model(mcpherson(), Request(("stroke",), ()))._bind.args[0]
    assert not made.interpreted  # they have run: the design is solved
    assert compile_model(four_bar(), Request(("turn",), ()))._bind.args[0].interpreted


def test_interrupted_compilation_is_repeated(monkeypatch):
    made = LlvmCode(compile_model(four_bar(), Request(("turn",), ())).plan)
    wanted = every_slot(made, "newton")

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(llvm, "load", interrupted)
        with pytest.raises(KeyboardInterrupt):
            made.count(10**9)
    assert made.interpreted
    np.testing.assert_array_equal(every_slot(made, "newton"), wanted)
    made.count(10**9)
    assert not made.interpreted
    np.testing.assert_array_equal(every_slot(made, "newton"), wanted)


def test_threads_compile_program_once(monkeypatch):
    """The code of the first would be gone while it runs."""
    made = LlvmCode(compile_model(four_bar(), Request(("turn",), ())).plan)
    load, loaded, meet = llvm.load, list[str](), Barrier(4)

    def slowly(*given):
        loaded.append("once")
        sleep(0.2)
        return load(*given)

    def count():
        meet.wait()
        made.count(10**9)

    monkeypatch.setattr(llvm, "load", slowly)
    threads = [Thread(target=count) for _ in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert loaded == ["once"]
