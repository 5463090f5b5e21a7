"""Traced programs and machine code on disk: used, rebuilt where damaged, never mistaken."""

from __future__ import annotations

from dataclasses import fields, replace
from gc import collect
from hashlib import sha256
from pathlib import Path
from pickle import dumps

import numpy as np
import pytest
from kincheck.core import Body, JointAngle, Mechanism, Point, Revolute, solve
from kincheck.core.caches import clear_caches
from kincheck.core.kinematics.compiled import compiled_model
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.continuation.sweep import sweep
from kincheck.core.mechanism import motions
from kincheck.core.mechanism.motions import Ramp
from kincheck.core.program.llvm import jit
from kincheck.core.program.llvm.jit import LlvmCode

from ..support.mechanisms import four_bar

pytest.importorskip("llvmlite", reason="llvmlite is not installed")


def test_code_in_use_stays_after_clearing_the_caches(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))  # no machine code of another test's
    mechanism, path = four_bar(), np.linspace(0.0, 1.0, 5)
    driver, point = mechanism.drivers[0].name, mechanism.points[0].name
    model = compile_model(mechanism, Request((driver,), (point,)))
    assert model._code.interpreted

    def positions():
        return sweep(model, motions.Path({driver: Ramp(1.0)}, path), 1e-12).points[point].position

    expected = positions()
    clear_caches()
    collect()
    np.testing.assert_array_equal(positions(), expected)


CRANK = Mechanism(
    "crank",
    [Body("crank")],
    [Revolute("axle", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))],
    [Point("tip", "crank", (1.0, 0.0, 0.0))],
    [JointAngle("turn", "axle")],
)


def test_cached_code_is_used_and_a_damaged_entry_is_rebuilt(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    wanted = np.linspace(0.0, 1.0, 5)

    def positions(*, often: bool = False):
        clear_caches()  # as another process
        mechanism = CRANK
        driver, point = mechanism.drivers[0].name, mechanism.points[0].name
        model = compile_model(mechanism, Request((driver,), (point,)))
        if often and model._code.interpreted:
            model._code.count(10**9)
        return sweep(model, motions.Path({driver: Ramp(1.0)}, wanted), 1e-12).points[point].position

    fresh = positions()
    interpreted = {*(tmp_path / "kincheck").iterdir()}
    # what was traced, its tables, what goes through them and the loops
    assert len(interpreted) == 4
    np.testing.assert_array_equal(positions(often=True), fresh)
    entries = [*(tmp_path / "kincheck").iterdir()]
    assert len(entries) == 5  # and its machine code
    for name in ("_trace", "bytecode", "_text"):
        owner = {"_trace": compiled_model, "bytecode": jit, "_text": LlvmCode}[name]
        monkeypatch.setattr(owner, name, None)
    np.testing.assert_array_equal(positions(), fresh)
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
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
            np.testing.assert_array_equal(positions(often=True), fresh)
            assert entry.read_bytes() == kept


class Planted:
    """Code of another user that a pickle runs."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return Path.touch, (self.mark,)


def test_planted_entries_are_not_run(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def positions():
        clear_caches()  # as another process
        model = compile_model(CRANK, Request(("turn",), ("tip",)))
        model._code.count(10**9)
        path = motions.Path({"turn": Ramp(1.0)}, np.linspace(0.0, 1.0, 5))
        return sweep(model, path, 1e-12).points["tip"].position

    fresh, mark = positions(), tmp_path / "planted"
    for entry in (tmp_path / "kincheck").iterdir():
        for planted in (dumps(Planted(mark)), b"", b"\x80", entry.read_bytes()[32:-1]):
            entry.write_bytes(sha256(entry.name.encode() + planted).digest() + planted)
            np.testing.assert_array_equal(positions(), fresh)
    assert not mark.exists()


def test_what_was_traced_is_not_taken_for_anything_else(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    times: list[str] = []
    trace = compiled_model._trace
    monkeypatch.setattr(
        compiled_model, "_trace", lambda *given: times.append("traced") or trace(*given)
    )
    mechanism = four_bar()
    request = Request((mechanism.drivers[0].name,), ())
    moved = replace(mechanism.bodies[0], origin=(1e-16, 0.0, 0.0))
    for different in (
        lambda: (mechanism, request),
        lambda: (mechanism, replace(request, order=1)),
        lambda: (replace(mechanism, bodies=[moved, *mechanism.bodies[1:]]), request),
        lambda: (
            monkeypatch.setattr(compiled_model, "_source", lambda: b"changed")
            or (mechanism, request)
        ),
    ):
        times.clear()
        for _ in range(2):
            compiled_model.load_or_trace(*different())
        assert times == ["traced"]


def test_joints_of_the_users_own_are_traced_every_time(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    known = four_bar()
    hinge = next(joint for joint in known.joints if isinstance(joint, Revolute))

    class Mine(Revolute):
        type = "mine_traced"

    monkeypatch.setattr(
        Revolute, "registry", {k: v for k, v in Revolute.registry.items() if k != "mine_traced"}
    )
    mine = Mine(**{each.name: getattr(hinge, each.name) for each in fields(hinge)})
    mechanism = replace(known, joints=[mine if joint is hinge else joint for joint in known.joints])
    compiled_model.load_or_trace(mechanism, Request((known.drivers[0].name,), ()))
    assert not (tmp_path / "kincheck").exists()


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(tmp_path, monkeypatch):
    (tmp_path / "kincheck").write_text("a file where the folder should be")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    mechanism = four_bar()
    assert solve(mechanism, mechanism.drivers[0].name, [0.0, 0.5]).solved.all()
