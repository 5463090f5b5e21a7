"""Traced programs and machine code on disk: used, rebuilt where damaged, never mistaken."""

from __future__ import annotations

from dataclasses import fields, replace
from gc import collect
from hashlib import sha256
from pathlib import Path
from pickle import dumps

import numpy as np
import pytest
from kincheck import Body, JointAngle, Mechanism, Point, Ramp, Revolute, clear_caches, solve
from kincheck.core.extensions.llvm import jit
from kincheck.core.extensions.llvm.jit import LlvmCode
from kincheck.core.kinematics.compiled import compiled_model
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.continuation.sweep import sweep
from kincheck.core.mechanism import motions

pytest.importorskip("llvmlite", reason="llvmlite is not installed")


CRANK = Mechanism(
    "crank",
    [Body("crank")],
    [Revolute("axle", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))],
    [Point("tip", "crank", (1.0, 0.0, 0.0))],
    [JointAngle("turn", "axle")],
)


def made():
    """The model of the crank, in another process."""
    clear_caches()
    return compile_model(CRANK, Request(("turn",), ("tip",)))


def positions(model, *, often=False):
    if often and model._bind.args[0].interpreted:
        model._bind.args[0].count(10**9)
    path = motions.Path({"turn": Ramp(1.0)}, np.linspace(0.0, 1.0, 5))
    return sweep(model, path, 1e-12).points["tip"].position


def test_code_in_use_survives_cleared_caches(cache_folder):
    model = made()
    assert model._bind.args[0].interpreted
    expected = positions(model)
    clear_caches()
    collect()
    np.testing.assert_array_equal(positions(model), expected)


def test_damaged_cache_entry_is_rebuilt(cache_folder):
    fresh = positions(made())
    interpreted = {*cache_folder.iterdir()}
    # what was traced, its tables, what goes through them and the loops
    assert len(interpreted) == 4
    np.testing.assert_array_equal(positions(made(), often=True), fresh)
    entries = [*cache_folder.iterdir()]
    assert len(entries) == 5  # and its machine code
    with pytest.MonkeyPatch.context() as patch:
        for owner, name in ((compiled_model, "_trace"), (jit, "bytecode"), (LlvmCode, "_text")):
            patch.setattr(owner, name, None)
        np.testing.assert_array_equal(positions(made()), fresh)
    (code,) = {*entries} - interpreted
    for entry, other in zip(entries, [*entries[1:], entries[0]], strict=True):
        kept = entry.read_bytes()
        flipped = kept[:-1] + bytes([kept[-1] ^ 1])
        every = (b"", kept[:100], flipped, b"\0" * len(kept), other.read_bytes())
        # all are read by one function: one of them is damaged in all ways
        for damage in every if entry == code else (flipped, other.read_bytes()):
            entry.write_bytes(damage)
            if entry != code:
                # where there is code, neither tables nor what goes through them is looked for
                code.unlink()
            np.testing.assert_array_equal(positions(made(), often=True), fresh)
            assert entry.read_bytes() == kept


class Planted:
    """Code of another user that a pickle runs."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return Path.touch, (self.mark,)


def test_planted_pickle_is_not_run(cache_folder, tmp_path):
    fresh, mark = positions(made(), often=True), tmp_path / "planted"
    for entry in cache_folder.iterdir():
        for planted in (dumps(Planted(mark)), b"", b"\x80", entry.read_bytes()[32:-1]):
            entry.write_bytes(sha256(entry.name.encode() + planted).digest() + planted)
            np.testing.assert_array_equal(positions(made(), often=True), fresh)
    assert not mark.exists()


def test_trace_cache_key_distinguishes_requests(cache_folder, monkeypatch):
    times: list[str] = []
    trace = compiled_model._trace
    monkeypatch.setattr(
        compiled_model, "_trace", lambda *given: times.append("traced") or trace(*given)
    )
    request = Request(("turn",), ())
    moved = replace(CRANK, bodies=[Body("crank", (1e-16, 0.0, 0.0))])
    for given in ((CRANK, request), (CRANK, replace(request, order=1)), (moved, request), None):
        if given is None:
            monkeypatch.setattr(compiled_model, "_source", lambda: b"changed")
        times.clear()
        for _ in range(2):
            compiled_model.load_or_trace(*given or (CRANK, request))
        assert times == ["traced"]


def test_user_joint_traces_are_not_cached(cache_folder, own_joint_types):
    class Mine(Revolute):
        type = "mine_traced"

    (hinge,) = CRANK.joints
    mine = Mine(**{each.name: getattr(hinge, each.name) for each in fields(hinge)})
    compiled_model.load_or_trace(replace(CRANK, joints=[mine]), Request(("turn",), ()))
    assert not cache_folder.exists()


def test_unwritable_cache_is_ignored(cache_folder):
    cache_folder.write_text("a file where the folder should be")
    assert solve(CRANK, "turn", [0.0, 0.5]).solved.all()
