"""The engines on the shared tree: right to round-off each, found out where their model is wrong,
and no danger to others where their simulator gives up.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.adapters.shared.tree_plan import Link
from kincheck.core.case.case import Case
from kincheck.core.case.joint_probe import probe, probes
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.resource_limits import Limits
from kincheck.core.harness.run import run
from kincheck.core.harness.workers.pool import in_workers
from kincheck.core.joints import Spherical
from kincheck.core.trajectory import Array, Trajectory

from ..support.fakes import Fake, crank
from ..support.giving_up import GivingUp

ROOT = Path(__file__).parents[2]
TREES = ("pinocchio", "drake", "dart", "simbody")
# Round-off of the strut's coordinates, of about a metre, in each of the simulators [m, m/s, m/s^2].
STRUT = {"position": 1e-14, "velocity": 1e-13, "acceleration": 1e-12}
# Of the probes, whose rods are amplified by their closures: some times of what was measured.
PROBES = {"position": 1e-14, "velocity": 1e-13, "acceleration": 5e-12}


def installed(name: str) -> Any:
    engine = adapters.engine(name)
    if engine.version() is None:
        pytest.skip(f"{name} is not installed: pip install 'kincheck[{name}]'")
    return engine


def thinned(case: Case, samples: int) -> Case:
    """Return the case with fewer samples and without a reference."""
    values = case.sweep.values[:: max(1, len(case.sweep.values) // samples)]
    return replace(case, sweep=replace(case.sweep, values=values), reference={})


@pytest.mark.parametrize("name", ["mujoco", "exudyn", *TREES])
def test_the_strut_is_the_truth_to_round_off(name: str) -> None:
    (record,) = run([cases.load("mcpherson_strut")], [installed(name)], tol=1e-12).records
    assert record.outcome is Outcome.PASS, record.message
    for errors in record.errors.values():
        for quantity, each in errors.items():
            assert each.max_abs <= STRUT[quantity]


@cache
def probed() -> list[tuple[Case, Trajectory]]:
    """Return every joint's probe with the motion by the native engine."""
    native = adapters.engine("native")
    every = [thinned(each, 8) for each in probes()]
    return [(case, native.solve(native.build(case), case, 1e-12)) for case in every]


# Pinocchio's have tests of their own.
@pytest.mark.parametrize("name", TREES[1:])
def test_every_joint_is_as_in_the_native_solver(name: str) -> None:
    engine = installed(name)
    for case, expected in probed():
        assert engine.unsupported(case) is None
        found = engine.solve(engine.build(case), case, 1e-12)
        assert found.solved.all(), (case.name, found.message)
        for point in case.points:
            for quantity, limit in PROBES.items():
                one, other = (getattr(each.points[point], quantity) for each in (found, expected))
                assert np.abs(one - other).max() <= limit, (case.name, point, quantity)


@pytest.mark.parametrize("name", TREES)
def test_balls_turn_by_small_angles(name: str) -> None:
    """By a ten-thousandth of a radian, where a simulator's rotations may be those of a series."""
    case = probe(Spherical)
    case = replace(case, sweep=replace(case.sweep, values=np.linspace(-2e-3, 2e-3, 9)))
    engine, native = installed(name), adapters.engine("native")
    found, expected = (each.solve(each.build(case), case, 1e-12) for each in (engine, native))
    assert found.solved.all(), found.message
    for point in case.points:
        off = found.points[point].position - expected.points[point].position
        assert np.abs(off).max() <= PROBES["position"]


@pytest.mark.parametrize("name", TREES)
def test_a_wrong_axis_closes_its_loops_and_is_found_and_named_by_comparison(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by a wrong convention: the arm's hinge is tilted by a tenth of a radian."""
    engine = installed(name)
    case = thinned(cases.load("mcpherson_strut"), 8)
    model = type(engine.build(case))
    add = model.add_link

    def tilted(self: Any, parent: int, link: Link, offset: Array) -> None:
        if link.move == "hinge" and link.axis == (1.0, 0.0, 0.0):
            link = replace(link, axis=(float(np.cos(0.1)), float(np.sin(0.1)), 0.0))
        add(self, parent, link, offset)

    monkeypatch.setattr(model, "add_link", tilted)
    others = [
        adapters.engine("native"),
        *(e for e in map(adapters.engine, ("mujoco", "exudyn")) if e.version()),
    ]
    results = run([case], [*others, engine], tol=1e-12)
    wrong = next(each for each in results.records if each.engine == name)
    assert wrong.residual_max is not None
    assert wrong.residual_max <= 1e-12  # its own rows tell nothing
    assert wrong.outcome is Outcome.FAIL
    assert "half_track_change" in wrong.message or "wheelbase_change" in wrong.message
    for each in results.records:
        assert each is wrong or each.outcome is not Outcome.FAIL


@pytest.mark.parametrize("name", ["drake", "simbody"])
def test_a_simulator_that_gives_up_costs_its_pair_only(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drake's checks raise SystemExit, OpenSim ends the process at a name with a blank."""
    installed(name)
    monkeypatch.syspath_prepend(str(ROOT))
    results = run(
        [crank("gives_up"), crank("goes_on")],
        [GivingUp(name), Fake("good")],
        tol=1e-12,
        solver=in_workers(1, Limits(timeout=60.0, memory=4.0)),
    )
    found = {(each.case, each.engine): each for each in results.records}
    gave_up = found.pop(("gives_up", "giving_up"))
    if name == "drake":
        assert "SystemExit: Failure at" in gave_up.message
    assert gave_up.outcome is (Outcome.ERROR if name == "drake" else Outcome.CRASHED)
    assert {each.outcome for each in found.values()} == {Outcome.PASS}
