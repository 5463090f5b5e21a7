"""Engines of a run, and their versions."""

import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from kincheck import Distance, Outcome, adapters, cases
from kincheck.core.case.io.case_file import load_case
from kincheck.core.cli import main
from kincheck.core.cli.registry import Status
from kincheck.core.harness.engine import Unloadable, versions

from ..support.fakes import record_of, run_case
from ..support.mechanisms import ORIGIN, placed
from ..support.version_engines import DEEDS, Foreign, Loading, Ours

# Closed forms over a full turn: a thousand times the round-off of metres, so that a slip in
# geometry cannot hide.
CLOSED_FORM = 1e-11


@cache
def built_in(name):
    """The case, read once: its frozen arrays are shared."""
    return cases.load(name)


def engine(name):
    found = adapters.engine(name)
    if found.version() is None:
        pytest.skip(f"{name} is not installed")
    return found


def record(case, name):
    return record_of(engine(name), case)


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", adapters.ENGINES)
@pytest.mark.parametrize("case", ["four_bar", "rssr", "spatial_slider_crank"])
def test_closed_forms_over_full_turn(case, name):
    found = record(built_in(case), name)
    assert found.outcome is Outcome.PASS
    assert np.ptp(next(iter(found.driver.values()))) == pytest.approx(2.0 * np.pi)
    for output in built_in(case).outputs:
        limit = CLOSED_FORM
        if output.forces:  # relative, see tests/adapters/test_engine_forces.py
            largest = np.abs(built_in(case).reference[output.name].position).max()
            limit = (1e-9 if name == "exudyn" else 1e-12) * largest
        assert found.errors[output.name].position.max_abs <= limit


@pytest.mark.parametrize("name", adapters.ENGINES)
def test_moved_hardpoint_fails_in_every_engine(name):
    case = built_in("mcpherson_strut")
    joints = list(case.mechanism.joints)
    k = [joint.name for joint in joints].index("tie_rod")
    (x, y, z), rack = joints[k].points
    joints[k] = Distance("tie_rod", *joints[k].bodies, points=((x, y, z + 1e-6), rack))
    found = record(replace(case, mechanism=replace(case.mechanism, joints=joints)), name)
    assert found.outcome is Outcome.FAIL
    assert "half_track_change" in found.message or "wheelbase_change" in found.message
    assert "stroke =" in found.message


@pytest.mark.parametrize("name", adapters.ENGINES)
def test_far_turned_world_keeps_digits(name):
    """Bodies without an origin of their own, as case files leave them: no engine may hang them on
    arms of a hundred metres.
    """
    case = built_in("mcpherson_strut")
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    far = np.array([100.0, -50.0, 20.0])
    moved = placed(
        case.mechanism,
        lambda q: tuple(turn @ np.array(q) + far),
        lambda a: tuple(turn @ np.array(a)),
    )
    (stroke,) = moved.drivers
    moved = replace(
        moved,
        bodies=[replace(body, origin=ORIGIN) for body in moved.bodies],
        drivers=[replace(stroke, direction=tuple(turn @ np.array(stroke.direction)))],
    )
    outputs = tuple(
        replace(output, direction=tuple(turn @ np.array(output.direction)))
        for output in case.outputs
    )
    found = record(replace(case, mechanism=moved, outputs=outputs), name)
    # coordinates of a hundred metres are rounded at 1e-14 m; the limits leave ten times that, and
    # Exudyn's its differences
    limits = (5e-13, 5e-12, 1e-9)
    for deviations in found.errors.values():
        worst = [deviation.max_abs for _, deviation in deviations.items()]
        assert all(error <= limit for error, limit in zip(worst, limits, strict=True)), worst
    assert found.outcome is Outcome.PASS


# How much round-off there is depends on the processor and on the steps that lead to the pose:
# 2e-11 to 2e-10 m/s^2 were seen.
@pytest.mark.parametrize("name", ["pinocchio", "exudyn"])
def test_round_off_near_singular_pose_passes(name):
    """The default is a nanometre at the driver's pace; the rod's end accelerates seven thousand
    times as fast there, and so does the round-off.
    """
    case = load_case(Path(__file__).parents[1] / "data" / "fast_loop.toml")
    native, found = run_case(case, engine("native"), engine(name)).records
    fastest = max(np.max(np.abs(each.acceleration)) for each in native.outputs.values())
    assert fastest > 5000 * case.sweep.rate**2
    worst = max(
        (each.acceleration for each in found.errors.values()), key=lambda each: each.max_abs
    )
    assert worst.max_abs < 1e-12 * 1855.0
    assert worst.within


# Engines are asked for their versions in processes of their own: whatever loading them does, it


def test_versions_keep_order_of_engines(monkeypatch):
    # where the processes find the engines
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    found = versions([*map(Loading, DEEDS), Unloadable("gone", "no module", "projection")])
    assert found == ["1.2", "3", *[None] * 5]


def test_hanging_engine_has_no_version(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    assert versions([Loading("hangs")], patience=1.0) == [None]


def test_version_read_in_process(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    ours, foreign = versions([Ours("any"), Foreign("native")])
    assert ours == str(os.getpid())
    assert foreign not in (ours, None)


def test_run_survives_crashing_simulator_imports(tmp_path):
    (tmp_path / "exudyn.py").write_text("import sys; sys.exit(0)")
    (tmp_path / "mujoco.py").write_text("import os; os.abort()")
    command = "run rssr --engine native exudyn mujoco".split()
    files = "--history h.sqlite --json r.json".split()
    code = "import sys; from kincheck.core.cli import main as cli; sys.exit(cli.main(sys.argv[1:]))"
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    found = subprocess.run(
        [sys.executable, "-c", code, *command, *files],
        cwd=tmp_path,
        env=env,
        capture_output=True,
        text=True,
        timeout=120.0,
    )
    assert "/3] rssr native: pass" in found.stderr
    assert "/3] rssr exudyn: unavailable" in found.stderr
    assert "/3] rssr mujoco: crashed" in found.stderr
    assert (tmp_path / "r.json").exists()
    assert (tmp_path / "h.sqlite").exists()


def test_exit_inside_command_is_failure(monkeypatch, capsys):
    monkeypatch.setattr(main, "registry", lambda: sys.exit(0))
    assert main.main(["list"]) == Status.FAILED
    assert "ended the program with status 0" in capsys.readouterr().err
