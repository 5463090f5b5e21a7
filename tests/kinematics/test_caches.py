"""One mechanism solved again and again is made ready once."""

import pathlib
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Thread
from weakref import WeakSet

import numpy as np
import pytest
from kincheck import Ramp, Sine, Spherical, Supplied, Table, clear_caches, solve
from kincheck.core.caches import KEYS, ThreadCache, cache_last
from kincheck.core.case import quantity
from kincheck.core.case.models.files import load
from kincheck.core.case.quantity import Output
from kincheck.core.kinematics import WantedOutput, placed, places
from kincheck.core.kinematics.compiled import compiled_model
from kincheck.core.kinematics.compiled import routes as samples
from kincheck.core.kinematics.compiled.compiled_model import source_files
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.continuation import walk
from kincheck.core.kinematics.one_design import prepare
from kincheck.core.mechanism.motions import Absolute, Motion, Path
from kincheck.core.program.executor import compiler

from ..support.fakes import calls
from ..support.mechanisms import X, chain, mcpherson, solve_all

DESIGNS = "kincheck.core.extensions.designs.design_batch"

STROKES = np.linspace(-0.05, 0.05, 21)


@pytest.fixture
def made(monkeypatch):
    """Models."""
    return calls(monkeypatch, compiled_model, "compile_model")


def test_model_cache_of_equal_requests(made):
    first = solve(mcpherson(), "stroke", STROKES).points["wheel"]
    was = first.position.copy()
    other = solve(mcpherson(), "stroke", STROKES[::-1] / 2.0).points["wheel"]
    again = solve(mcpherson(), "stroke", STROKES).points["wheel"]
    assert len(made) == 1
    np.testing.assert_array_equal(first.position, was)
    np.testing.assert_array_equal(again.position, was)
    assert np.abs(other.position - was[::-1]).max() > 1e-3
    solve(mcpherson(), "stroke", STROKES, order=0)
    wheel = mcpherson().point("wheel").position
    higher = replace(mcpherson().point("wheel"), position=(*wheel[:2], wheel[2] + 0.01))
    moved = solve(replace(mcpherson(), points=[higher]), "stroke", STROKES).points["wheel"]
    assert len(made) == 3
    assert np.abs(moved.position - was).max() > 1e-3


def test_model_cache_of_designs(made):
    solve_designs = pytest.importorskip(DESIGNS).solve_designs
    place = "points.wheel.position"
    values = {place: np.array([mcpherson().point("wheel").position, (0.1, 0.7, 0.3)])}
    first, again = (
        solve_designs(mcpherson(), "stroke", STROKES, values).points["wheel"].position
        for _ in range(2)
    )
    assert len(made) == 1
    np.testing.assert_array_equal(first, again)


def test_model_cache_is_shared_by_threads():
    alone = solve(mcpherson(), "stroke", STROKES).points["wheel"].acceleration.copy()
    with ThreadPoolExecutor(4) as threads:
        for found in threads.map(lambda _: solve(mcpherson(), "stroke", STROKES), range(24)):
            np.testing.assert_array_equal(found.points["wheel"].acceleration, alone)


@pytest.fixture
def swept(monkeypatch):
    """Paths through components."""
    blocks = pytest.importorskip("kincheck.core.extensions.blocks.sweep")
    return calls(monkeypatch, blocks.BlockSweep, "__init__")


def test_cache_keeps_last_path_of_chain(swept):
    turn, half = np.linspace(-0.1, 0.2, 9), np.linspace(-0.1, 0.05, 9)
    found = []
    for values, number in ((turn, 1), (turn, 1), (half, 2), (turn, 3)):
        found.append(solve(chain(21), "turn", values).points["end"].acceleration)
        assert len(swept) == number
    for each in (found[1], found[3]):
        np.testing.assert_array_equal(each, found[0])


def test_path_cache_is_per_thread(swept):
    turn = np.linspace(-0.1, 0.2, 9)
    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(1) as other:
        found = [
            pool.submit(solve, chain(21), "turn", turn).result().points["end"].acceleration
            for pool in (one, other, one, other)
        ]
    assert len(swept) == 2
    for each in found[1:]:
        np.testing.assert_array_equal(each, found[0])


@pytest.mark.usefixtures("own_joint_types")
@pytest.mark.parametrize(
    ("mechanism", "module", "name"),
    [
        (mcpherson(), compiled_model.__name__, "compile_model"),
        (chain(21), "kincheck.core.extensions.blocks.method", "ComponentLanes"),
    ],
    ids=["one program", "components"],
)
def test_user_joints_are_not_cached(mechanism, module, name, monkeypatch):
    """They may be equal, and yet not mean the same."""

    @dataclass(frozen=True)
    class Ball(Spherical):
        type = "ball_of_mine"

    built = calls(monkeypatch, pytest.importorskip(module), name)
    joints = [
        Ball(j.name, *j.bodies, j.point) if type(j) is Spherical else j for j in mechanism.joints
    ]
    own, (driver,) = replace(mechanism, joints=joints), mechanism.drivers
    for number in (1, 2):
        solve_all(own, driver.name, STROKES)
        assert len(built) == number


@pytest.fixture
def bound(monkeypatch):
    """Routes bound to lanes."""
    return calls(monkeypatch, walk.Marcher, "__init__")


def test_route_cache_of_equal_samples(bound):
    first, again = (
        solve(mcpherson(), "stroke", STROKES).points["wheel"].acceleration.copy() for _ in range(2)
    )
    assert len(bound) == 1
    np.testing.assert_array_equal(first, again)
    others = {"values": STROKES[:-1]}, {"rate": 2.0}, {"values": STROKES + 1e-15}, {"order": 1}
    for k, other in enumerate(others, start=2):
        solve(mcpherson(), "stroke", **({"values": STROKES} | other))
        assert len(bound) == k


def test_changed_sample_array_is_harmless():
    strokes = STROKES.copy()
    far = solve(mcpherson(), "stroke", strokes).points["wheel"].position[0].copy()
    strokes *= 0.5
    near = solve(mcpherson(), "stroke", strokes).points["wheel"].position
    assert np.abs(near[0] - far).max() > 1e-3
    np.testing.assert_array_equal(
        solve(mcpherson(), "stroke", STROKES).points["wheel"].position[0], far
    )


def test_user_motions_are_not_cached(bound, swept):
    """They may be equal, and yet not mean the same."""

    @dataclass(frozen=True)
    class Mine(Motion):
        def at(self, t):
            return 0.0 * t, 0.0 * t, 0.0 * t

    assert Path({}, np.ones(2)) == Path({}, np.ones(2)) != Path({}, np.ones(3))
    # their messages differ
    assert Path({}, np.ones(1), {"steer": 0.1}) != Path({}, np.ones(1), {"steer": 0.2})
    table, wave = Table(np.arange(2.0), [0.0, 1.0]), Absolute(Sine(1.0, 1.0, 0.0), 0.2)
    # whoever has an array may change it
    for motion, builtin in (
        *((own, False) for own in (Mine(), Absolute(Mine(), 0.0), Ramp(np.array(1.0)))),
        *((ours, True) for ours in (Ramp(1.0), wave, table)),
    ):
        assert Path({"steer": motion}, np.ones(1)).is_builtin == builtin
    for made, mechanism, driver, point in (
        (bound, mcpherson(), "stroke", "wheel"),
        (swept, chain(21), "turn", "end"),
    ):
        for number in (1, 2):
            request = samples.Request((driver,), (point,))
            found = prepare(mechanism, request, Path({driver: Mine()}, STROKES))(1e-12)
            assert found.solved.all()
            assert len(made) == number


def test_very_long_route_is_not_cached(bound):
    strokes = np.linspace(-0.05, 0.05, samples.LONGEST_KEPT + 1)
    for number in (1, 2):
        solve(mcpherson(), "stroke", strokes)
        assert len(bound) == number


def test_clear_caches_drops_models(made):
    for number in (1, 2):
        solve(mcpherson(), "stroke", STROKES)
        solve(mcpherson(), "stroke", STROKES)
        assert len(made) == number
        clear_caches()


# Caches of functions and threads: the last results are kept, and all are cleared


def test_thread_cache_ends_with_thread():
    bound = ThreadCache()
    made = WeakSet()

    class Made:
        pass

    def ask():
        one, other = (bound("key", Made) for _ in range(2))
        assert one is other
        made.add(one)

    ask()
    thread = Thread(target=ask)
    thread.start()
    thread.join()
    assert len(made) == 1


def test_thread_cache_replaces_oldest_key():
    bound, made = ThreadCache(), list[int]()

    def ask(key):
        return bound(key, lambda: made.append(key) or key)

    assert [ask(key) for key in range(KEYS)] == made == [*range(KEYS)]
    ask(0)  # used most recently, so the next key replaces 1
    ask(KEYS)
    ask(0)
    assert made == [*range(KEYS + 1)]
    ask(1)
    assert made == [*range(KEYS + 1), 1]


@pytest.mark.parametrize("per_thread", [False, True])
def test_cache_last_keeps_recent_results(per_thread):
    made = list[int]()

    @cache_last(2, per_thread=per_thread)
    def ask(key):
        made.append(key)
        return [key]

    assert ask(1) is ask(1)
    for key in (2, 1, 3, 1, 2):  # 3 replaces 2
        ask(key)
    assert made == [1, 2, 3, 2]
    with ThreadPoolExecutor(1) as threads:
        other = threads.submit(ask, 1).result()
    assert (other is ask(1)) is not per_thread


@pytest.mark.parametrize("per_thread", [False, True])
def test_clear_caches_reaches_every_thread(per_thread):
    class Large:
        pass

    made = WeakSet()

    @cache_last(2, per_thread=per_thread)
    def ask(key):
        found = Large()
        made.add(found)
        return found

    with ThreadPoolExecutor(1) as threads:  # the other thread lives on
        threads.submit(ask, 1).result()
        ask(2)
        assert len(made) == 2
        clear_caches()
        assert len(made) == 0


# The key of the program cache: a change of any source that tracing runs through must change it


TRACE = """
import sys
from kincheck import cases
from kincheck.core.kinematics.compiled import compiled_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.formulation.styles import styles

case = cases.load("mcpherson_strut")
for style in styles():
    request = Request(tuple(case.sweep.path.motions), tuple(case.points), style=style)
    compiled_model._trace(case.mechanism, request, None, 4)
for name, module in sys.modules.items():
    if name.startswith("kincheck.core.") and getattr(module, "__file__", None):
        print(name, module.__file__)
"""


def test_program_cache_key_covers_modules():
    done = subprocess.run(
        [sys.executable, "-c", TRACE], capture_output=True, text=True, check=True
    ).stdout
    loaded = dict(line.split(" ", 1) for line in done.splitlines())
    packages = ("core.case", "core.harness", "core.extensions", "adapters")
    layers = tuple(f"kincheck.{each}" for each in packages)
    traced = {file for name, file in loaded.items() if not name.startswith(layers)}
    assert len(traced) > 50
    assert traced <= {str(file) for file in source_files()}


class Foreign(Output):
    """An output of the user."""


def wanted(kind):
    """A wanted output of the strut, of a class."""
    return WantedOutput(kind("wheel_x", "wheel", X, True, 1e-9, 0.0, "test"))


@pytest.mark.needs("llvm")
def test_program_cache_key_covers_equations(tmp_path, monkeypatch):
    """Programs of varied places with outputs are found again; not after a change of a file beside
    the output's, and those of an output of the user never.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    traced = calls(monkeypatch, compiled_model, "_trace")

    def trace(kind):
        moved = ("points.wheel.position",)
        request = Request(("stroke",), (), order=0, varied=moved, outputs=(wanted(kind),))
        compiled_model.load_or_trace(mcpherson(), request)
        return len(traced)

    assert [trace(Output) for _ in range(3)] == [1, 1, 1]
    assert [trace(Foreign) for _ in range(2)] == [2, 3]
    folders, source = list[str](), compiled_model._source
    changed = lambda *given: (folders.extend(given), source(*given) + b"new")[1]  # noqa: E731
    monkeypatch.setattr(compiled_model, "_source", changed)
    assert trace(Output) == 4
    assert str(pathlib.Path(quantity.__file__).parent) in folders


@pytest.mark.needs("llvm")
def test_new_numbers_need_no_new_trace(tmp_path, monkeypatch):
    """Programs of varied places serve any numbers there: those found again equal those traced."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    traced, place = calls(monkeypatch, compiled_model, "_trace"), "joints.ball.point"
    request = Request(("stroke",), ("wheel",), varied=("joints.lca_pivot.axis", place))
    moved = placed(mcpherson(), {place: np.array(places(mcpherson())[place]) + 1e-3})
    compiled_model.load_or_trace(mcpherson(), request)
    found = compiled_model.load_or_trace(moved, request)
    assert len(traced) == 1
    fresh = compiled_model._trace(moved, request, None, compiler().width)
    assert repr(found.plan.programs) == repr(fresh.plan.programs)
    assert found.selection.chosen == fresh.selection.chosen
    assert (found.varied, found.frame, found.rows) == (fresh.varied, fresh.frame, fresh.rows)


def test_modules_of_suspension_outputs(tmp_path):
    """Those of an output that another one is made of, too: the slope by travel of toe."""
    suspension = "kincheck.core.extensions.hardpoints.suspension"
    templates = pytest.importorskip("kincheck.core.extensions.hardpoints.templates")
    file = tmp_path / "car.csv"
    file.write_text(templates.sample_table(templates.TEMPLATES["double_wishbone"]))
    case = load(file, Supplied(travel="0.02:3"))
    (slope,) = [each for each in case.outputs if each.name == "toe.per_travel"]
    found = compiled_model.modules_of([WantedOutput(slope)])
    assert {f"{suspension}.wheel", f"{suspension}.base", quantity.__name__} <= found
