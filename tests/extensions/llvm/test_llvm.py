"""Machine code against numpy: every operation, whole models, lanes that end in the middle of a
vector, and the cache on disk.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from kincheck import clear_caches, solve
from kincheck.core.algebra import arc_tangent, root
from kincheck.core.extensions.designs.design_batch import solve_designs
from kincheck.core.extensions.llvm import compiler
from kincheck.core.extensions.llvm.executor import LlvmExecutor
from kincheck.core.extensions.llvm.jit import LlvmCode
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.program import (
    NODES,
    NumpyExecutor,
    Plan,
    Tape,
    absolute,
    cos,
    maximum,
    minimum,
    place_of,
    program,
    sin,
    where_larger,
)

from ...support.mechanisms import chain, four_bar, mcpherson

llvm = pytest.importorskip("llvmlite", reason="llvmlite is not installed")


def executors(function, inputs, lanes):
    """The same program of `inputs` slots, its value in the next one, in both executors."""
    tape = Tape()
    traced = program("f", tape, {inputs: function(*(tape.input(k) for k in range(inputs)))})
    plan = Plan({"f": traced}, {str(k): k for k in range(inputs + 1)})
    return NumpyExecutor(plan, lanes), LlvmExecutor(LlvmCode(plan), lanes)


OPERATIONS = {
    "plus": lambda a, b: a + b,
    "minus": lambda a, b: a - b,
    "times": lambda a, b: a * b,
    "over": lambda a, b: a / b,
    "negative": lambda a, b: -a,
    "root": lambda a, b: root(a * a),
    "angle": arc_tangent,
    "size": lambda a, b: absolute(a),
    "smaller": minimum,
    "larger": maximum,
    "larger size": lambda a, b: maximum(absolute(a), absolute(b)),
    "choice": lambda a, b: where_larger(a, b, a + 1.0, b - 1.0),
}


@pytest.mark.parametrize("lanes", [1, 7, 8, 9, 33])
@pytest.mark.parametrize("name", OPERATIONS)
def test_machine_code_operations_equal_numpy(name, lanes):
    rng = np.random.default_rng(lanes)
    both = executors(OPERATIONS[name], 2, lanes)
    values = rng.normal(size=(2, lanes)) * 10.0 ** rng.integers(-3, 4, size=(2, lanes))
    values[:, -1] = math.nan, 1.0  # min and max must hand on what is not a number
    for executor in both:
        executor.put([0, 1], values)
        executor.run("f")
    a, b = (executor.get([2])[0] for executor in both)
    np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
    np.testing.assert_allclose(b, a, rtol=4e-16 if name == "angle" else 2e-16, atol=0.0)


def test_lanes_read_nodes_of_group():
    """The first of them, the last, and some between; of machine code a group is a vector."""
    lanes = compiler.vector_width()
    values = np.random.default_rng(0).normal(size=(1, lanes))
    read = values[0, [place_of(k, lanes)[1] for k in range(NODES)]]
    for executor in executors(
        lambda x: sum((10.0**k * x.tape.at(k, 0) for k in range(NODES)), 0.0), 1, lanes
    ):
        executor.put([0], values)
        executor.run("f")
        np.testing.assert_allclose(
            executor.get([1])[0], np.full(lanes, 10.0 ** np.arange(NODES) @ read), rtol=1e-14
        )


def test_arc_tangent_in_all_quadrants():
    rng = np.random.default_rng(66)
    angles = np.concatenate([rng.uniform(-math.pi, math.pi, 4000), np.arange(-4, 5) * math.pi / 4])
    sizes = 10.0 ** rng.uniform(-6.0, 6.0, len(angles))
    tiny = np.array([[1e-12, -1e-300, -1e-12, 3.0], [1.0, 2.0, -1.0, 1e-20]])
    values = np.concatenate([sizes * np.array([np.sin(angles), np.cos(angles)]), tiny], axis=1)
    _, compiled = executors(arc_tangent, 2, values.shape[1])
    compiled.put([0, 1], values)
    compiled.run("f")
    np.testing.assert_allclose(compiled.get([2])[0], np.arctan2(*values), rtol=4e-16, atol=0.0)


@pytest.mark.parametrize(("traced", "true"), [(sin, np.sin), (cos, np.cos)])
def test_sine_and_cosine_of_large_angles(traced, true):
    rng = np.random.default_rng(0)
    _, executor = executors(lambda x: traced(x), 1, 256)
    for extent in (1e-9, 1.0, 10.0, 1e4):
        x = rng.uniform(-extent, extent, size=256)
        executor.put([0], x[None])
        executor.run("f")
        # two units in the last place of one
        assert np.abs(executor.get([1])[0] - true(x)).max() <= 4e-16


def test_numpy_executor_without_llvmlite(monkeypatch):
    monkeypatch.setattr("kincheck.core.program.executor.compiler", lambda: None)
    mechanism = four_bar()
    model = compile_model(mechanism, Request((mechanism.drivers[0].name,), ()))
    assert isinstance(model.executor(3), NumpyExecutor)


WAYS = {
    "one program": lambda: solve(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33)).points,
    "one program, positions": lambda: (
        solve(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33), order=0).points
    ),
    "components": lambda: solve(chain(8), "turn", np.linspace(-0.5, 0.5, 33)).points,
    "designs": lambda: (
        solve_designs(
            mcpherson(),
            "stroke",
            [-0.05, 0.0, 0.05],
            {"joints.tie_rod.points.0": TIE_ROD + np.linspace(0.0, 0.01, 11)[:, None]},
            order=2,
        ).points
    ),
}
TIE_ROD = np.array([1.115, 0.665, 0.118])


@pytest.mark.parametrize("width", [2, 4])
@pytest.mark.parametrize("way", WAYS)
def test_vector_widths_give_equal_results(way, width, monkeypatch):
    expected, asked = WAYS[way](), list[int]()
    monkeypatch.setattr(compiler, "vector_width", lambda: asked.append(width) or width)
    clear_caches()
    found = WAYS[way]()
    assert asked  # whatever was kept was made for other vectors
    for name, motion in expected.items():
        for label, limit in (("position", 2e-15), ("velocity", 2e-14), ("acceleration", 2e-13)):
            if getattr(motion, label) is not None:
                assert np.abs(getattr(motion, label) - getattr(found[name], label)).max() <= limit
