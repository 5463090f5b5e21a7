"""Every simulator: right to round-off, the same numbers again, messages where a motion ends, found
out where its model is wrong, and no danger to others where it gives up.
"""

import ctypes
import importlib
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from kincheck import Outcome, Revolute, adapters, cases
from kincheck.core.case.case import Sweep
from kincheck.core.harness.resource_limits import Limits
from kincheck.core.harness.run import run
from kincheck.core.harness.workers.pool import in_workers
from kincheck.core.mechanism.motions import Driver

from ..support.aborting_engine import GivingUp
from ..support.engine_motion import ENGINES, TOL, TREES, installed
from ..support.fakes import Fake, crank, record_of, run_case

ROOT = Path(__file__).parents[2]
# Round-off of the strut's coordinates, of about a metre, in each of the simulators [m, m/s, m/s^2].
STRUT = {"position": 1e-14, "velocity": 1e-13, "acceleration": 1e-12}


def strut(values=(), rate=1.0):
    """Return the McPherson strut, on other strokes and without a reference if they are given."""
    case = cases.load("mcpherson_strut")
    if not len(values):
        return case
    return replace(case, sweep=Sweep("stroke", np.asarray(values), rate), reference={})


@ENGINES
def test_strut_solved_to_round_off(engine):
    record = record_of(installed(engine), strut())
    assert record.outcome is Outcome.PASS, record.message
    for errors in record.errors.values():
        for quantity, each in errors.items():
            assert each.max_abs <= STRUT[quantity]


SHARED_ROWS = "points coincide (3 rows)", "points at constant distance (1 row)"
CLOSED_BY = {
    "mujoco": ("connect", "tendon"),
    **dict.fromkeys(("pinocchio", "drake", "dart"), SHARED_ROWS),
    "simbody": ("PointConstraint", "ConstantDistanceConstraint"),
}


@pytest.mark.parametrize("engine", TREES)
def test_details_name_loop_closures(engine):
    given, case = installed(engine), strut([0.0])
    details = given.solve(given.build(case), case, TOL).details
    assert details["closures"] == dict(
        zip(("strut_top", "tie_rod"), CLOSED_BY[engine], strict=True)
    )
    assert details["unknowns"] == details["rank"] == 5


@ENGINES
def test_repeated_solve_gives_equal_bits(engine):
    """Nothing is left in the model by what it solved before, reached or not."""
    given, case = installed(engine), strut(np.linspace(-0.08, 0.08, 9))
    model = given.build(case)
    first = given.solve(model, case, TOL)
    assert given.solve(model, strut(np.linspace(0.0, 0.02, 3)), TOL).solved.all()
    assert not given.solve(model, strut(np.linspace(0.0, 0.6, 61)), TOL).solved.all()
    again = given.solve(model, case, TOL)
    for name, motion in again.points.items():
        # made of all before it
        np.testing.assert_array_equal(motion.acceleration, first.points[name].acceleration)


@ENGINES
def test_end_of_motion_is_reported(engine, tmp_path, monkeypatch, capfd):
    given, values = installed(engine), np.arange(-10, 601) * 1e-3
    monkeypatch.chdir(tmp_path)
    case = strut(values)
    found = given.solve(given.build(case), case, TOL)
    # the strut locks between 0.293 and 0.294 m
    np.testing.assert_array_equal(found.solved, values < 0.2935)
    assert "beyond stroke = 0.293" in found.message
    assert "last reachable sample at stroke = 0.293;" in found.message
    for motion in found.points.values():
        for rows in (motion.position, motion.velocity, motion.acceleration):
            np.testing.assert_array_equal(np.isfinite(rows).all(axis=1), found.solved)
    assert [*tmp_path.iterdir()] == []
    assert tuple(capfd.readouterr()) == ("", "")


@dataclass(frozen=True)
class Wind(Driver):
    type = "wind"


@dataclass(frozen=True)
class Latch(Revolute):
    """A subclass of a known joint may mean something else."""


Latch.type = "latch"  # set here, it is not registered for case files


@ENGINES
def test_unknown_joint_or_driver_is_refused(engine):
    given, case = installed(engine), strut()
    assert given.unsupported(case) is None
    latch = Latch("bolt", "ground", "lca", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    for change, who in (
        ({"joints": [*case.mechanism.joints, latch]}, "'bolt' (latch)"),
        ({"drivers": [Wind("gust")]}, "'gust' (wind)"),
    ):
        other = replace(case, mechanism=replace(case.mechanism, **change))
        assert who in given.unsupported(other)


@ENGINES
def test_broken_simulator_has_no_version(engine, monkeypatch):
    given = installed(engine)
    assert isinstance(given.version(), str)

    def library(name):
        return ctypes.CDLL("there is no such library")

    def interpreter(name):
        raise SystemExit(name)

    for broken in (library, interpreter):
        monkeypatch.setattr(importlib, "import_module", broken)
        assert given.version() is None


def test_pinocchio_namesake_package_has_no_version(monkeypatch):
    engine, other = installed("pinocchio"), SimpleNamespace(__version__="0.4")
    monkeypatch.setattr(importlib, "import_module", lambda name: other)
    assert engine.version() is None


@pytest.mark.parametrize("engine", TREES[1:])
def test_tilted_axis_is_found_by_comparison(engine, monkeypatch):
    """As by a wrong convention: the arm's hinge is tilted by a tenth of a radian, and the loops
    close all the same.
    """
    given, case = installed(engine), strut(np.linspace(-0.08, 0.08, 9))
    model = type(given.build(case))
    add = model.add_link

    def tilted(self, parent, link, offset):
        if link.move == "hinge" and link.axis == (1.0, 0.0, 0.0):
            link = replace(link, axis=(float(np.cos(0.1)), float(np.sin(0.1)), 0.0))
        add(self, parent, link, offset)

    monkeypatch.setattr(model, "add_link", tilted)
    others = [
        adapters.engine("native"),
        *(e for e in map(adapters.engine, ("mujoco", "exudyn")) if e.version()),
    ]
    results = run_case(case, *others, given)
    wrong = next(each for each in results.records if each.engine == engine)
    assert wrong.residual_max is not None
    assert wrong.residual_max <= TOL  # its own rows tell nothing
    assert wrong.outcome is Outcome.FAIL
    assert "half_track_change" in wrong.message or "wheelbase_change" in wrong.message
    for each in results.records:
        assert each is wrong or each.outcome is not Outcome.FAIL


@pytest.mark.parametrize("name", ["drake", "simbody"])
def test_simulator_abort_costs_one_pair(name, monkeypatch):
    """Drake's checks raise SystemExit, OpenSim ends the process at a name with a blank."""
    installed(name)
    monkeypatch.syspath_prepend(str(ROOT))
    results = run(
        [crank("gives_up"), crank("goes_on")],
        [GivingUp(name), Fake("good")],
        tol=TOL,
        solver=in_workers(1, Limits(timeout=60.0, memory=4.0)),
    )
    found = {(each.case, each.engine): each for each in results.records}
    gave_up = found.pop(("gives_up", "giving_up"))
    if name == "drake":
        assert "SystemExit: Failure at" in gave_up.message
    assert gave_up.outcome is (Outcome.ERROR if name == "drake" else Outcome.CRASHED)
    assert {each.outcome for each in found.values()} == {Outcome.PASS}
