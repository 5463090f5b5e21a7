"""Machine code without LLVM: images of what it compiled, and what it said of the processor."""

from __future__ import annotations

import os
import subprocess
import sys
from ctypes import CFUNCTYPE, c_double

import numpy as np
import pytest
from kincheck import clear_caches, solve
from kincheck.core.extensions.llvm import compiler, jit
from kincheck.core.program.executor import compiled_at_once

from ...support.mechanisms import mcpherson

pytest.importorskip("llvmlite", reason="llvmlite is not installed")
images = pytest.mark.skipif(not compiler.possible(), reason="images run on x86-64 under Linux")

TEXT = """
define i64 @chosen(i64 %k) noinline {
entry:
  switch i64 %k, label %other [ i64 0, label %a i64 1, label %b i64 2, label %c i64 3, label %d i64 4, label %e ]
a:
  ret i64 7
b:
  %twice = mul i64 %k, 21
  ret i64 %twice
c:
  %less = sub i64 %k, 9
  ret i64 %less
d:
  %shifted = shl i64 %k, 33
  ret i64 %shifted
e:
  %turned = xor i64 %k, -1
  ret i64 %turned
other:
  ret i64 -1
}
define i64 @of_next(i64 %k) {
  %next = add i64 %k, 1
  %found = call i64 @chosen(i64 %next)
  ret i64 %found
}
define double @scaled(double %x) {
  %product = fmul double %x, 0x400921FB54442D18
  ret double %product
}
"""  # noqa: E501
"""A table to jump by, a call, a constant that is loaded."""


@images
def test_image_runs_its_text():
    code = jit.load(TEXT, lambda: TEXT, {"chosen": 1, "of_next": 1})
    assert [code.calls["chosen"](k) for k in range(6)] == [7, 21, -7, 3 << 33, ~4, -1]
    assert [code.calls["of_next"](k) for k in range(5)] == [21, -7, 3 << 33, ~4, -1]
    assert CFUNCTYPE(c_double, c_double)(code.address("scaled"))(2.0) == 2.0 * np.pi


@images
def test_image_with_external_call_is_refused():
    text = (
        "declare double @outside(double)\ndefine double @f(double %x) { %y = call double"
        " @outside(double %x) ret double %y }"
    )
    with pytest.raises(ValueError, match="'outside'"):
        compiler.image_of(compiler.emit(text))


def positions():
    clear_caches()
    return solve(mcpherson(), "stroke", np.linspace(-0.08, 0.08, 33)).points["wheel"].position


def test_object_files_where_images_cannot_run(cache_folder):
    expected = positions()
    loaded, load = list[str](), compiler.load_object
    with pytest.MonkeyPatch.context() as patch, compiled_at_once():
        patch.setattr(compiler, "possible", lambda: False)
        patch.setattr(compiler, "load_object", lambda file: loaded.append("once") or load(file))
        for _ in range(2):  # compiled, then kept
            np.testing.assert_array_equal(positions(), expected)
            assert loaded
            loaded.clear()
    np.testing.assert_array_equal(positions(), expected)  # an object file is not taken for an image


SOLVE = """
import sys
import numpy as np
from kincheck import cases
from kincheck.core import solve
for _ in range(10):
    solve(cases.load("mcpherson_strut").mechanism, "stroke", np.linspace(-0.08, 0.08, 161))
print("llvmlite" in sys.modules)
"""


@images
def test_second_process_imports_no_llvm(tmp_path):
    here = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}

    def imported():
        return subprocess.run(
            [sys.executable, "-c", SOLVE], env=here, capture_output=True, text=True, check=True
        ).stdout.strip()

    assert [imported() for _ in range(2)] == ["True", "False"]


@images
def test_processor_description_is_cached(cache_folder, monkeypatch):
    expected, asked, ask = compiler.processor(), list[str](), compiler._ask_llvm
    monkeypatch.setattr(compiler, "_ask_llvm", lambda: asked.append("once") or ask())

    def found():
        compiler.processor.cache_clear()  # as another process
        return compiler.processor()

    assert [found() for _ in range(2)] == [expected] * 2
    assert len(asked) == 1
    (entry,) = cache_folder.iterdir()
    entry.write_bytes(entry.read_bytes()[:-1])
    assert found() == expected
    assert len(asked) == 2
    described = compiler._describe()
    assert described is not None
    monkeypatch.setattr(compiler, "_describe", lambda: described.replace(b" sse2", b" no_sse2"))
    assert found() == expected
    monkeypatch.setattr(compiler, "_describe", lambda: None)
    assert found() == expected
    assert len(asked) == 4


@images
def test_processor_is_described_by_llvm_traits(monkeypatch):
    described = compiler._describe()
    assert described is not None
    assert {line.split(b"\t")[0] for line in described.splitlines() if b"\t" in line} == {
        *compiler.TRAITS
    }
    assert b"MHz" not in described  # changes from one moment to the next
    from llvmlite import __version__

    assert __version__.encode() in described


def test_cache_key_depends_on_compiler_sources(monkeypatch):
    before = jit.cache_key(TEXT)
    monkeypatch.setattr(jit, "_sources", lambda: "another way")
    assert jit.cache_key(TEXT) != before
