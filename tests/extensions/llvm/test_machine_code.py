"""What llvmlite cannot do takes no engine away: numpy does the same work, and a note says so."""

import numpy as np
import pytest
from kincheck import clear_caches, solve
from kincheck.core.extensions.llvm import compiler, jit, machine_code
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.program.executor import compiled_at_once

from ...support.mechanisms import mcpherson

pytest.importorskip("llvmlite", reason="llvmlite is not installed")


def wheel(samples=9):
    return solve(mcpherson(), "stroke", np.linspace(-0.08, 0.08, samples)).points["wheel"].position


@pytest.fixture
def unknown_compiler(cache_folder):
    """Nothing is known of the compiler, before the test and after it."""

    def forget():
        clear_caches()
        for each in (machine_code.problem, machine_code._noted):
            each.cache_clear()

    forget()
    yield
    forget()


BROKEN = {
    "import": (compiler, "llvm", ImportError("no libllvmlite.so")),
    "parse": (compiler, "emit", RuntimeError("IR parsing error\n<string>:1:24: no type\nptr\n^")),
    "link": (compiler, "image_of", ValueError("a relocation of another kind")),
    "load": (jit, "Code", OSError(1, "memory cannot be made to run")),
}


@pytest.mark.parametrize("step", BROKEN)
def test_numpy_solves_where_compiler_fails(step, unknown_compiler, monkeypatch, capfd):
    expected = wheel()
    assert NativeEngine().loop == "compiled"
    owner, name, error = BROKEN[step]

    def fail(*args):
        raise error

    monkeypatch.setattr(owner, name, fail)
    monkeypatch.setenv("XDG_CACHE_HOME", "none")  # void, as it is not absolute
    monkeypatch.setenv("HOME", "none")
    for each in (machine_code.problem, machine_code._noted):
        each.cache_clear()
    clear_caches()
    for _ in range(2):
        np.testing.assert_allclose(wheel(), expected, rtol=0.0, atol=1e-15)  # by rounding [m]
        clear_caches()
    assert NativeEngine().loop == "python"
    (note,) = capfd.readouterr().err.splitlines()
    assert note.startswith("kincheck: note: numpy solves, some fifty times slower: llvmlite ")
    assert str(error).split("\n")[-1 if step != "parse" else 1] in note
    assert note.endswith(": pip install 'llvmlite>=0.45'")


def test_uncompilable_program_stays_interpreted(no_programs_kept, monkeypatch, capfd):
    expected = wheel()
    load = jit.load

    def fail(content, text, signatures=None):
        if signatures is None:  # a program, no loop
            raise RuntimeError("cannot select")
        return load(content, text, signatures)

    monkeypatch.setattr(jit, "load", fail)
    clear_caches()
    with compiled_at_once():
        for _ in range(3):
            np.testing.assert_array_equal(wheel(), expected)
    assert capfd.readouterr().err == "kincheck: note: a program stays interpreted: cannot select\n"
