"""Probes of every type of joint and coupler: made from the class alone, far from lock-up, and
moving all there is to move.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from kincheck import Distance, Joint, MechanismError, Universal, solve
from kincheck.core.case.case import Truth
from kincheck.core.case.joint_probe import AXIS, PAIRS, POINT, TURN, probe, probes, specimen
from kincheck.core.harness.compare import output_series
from kincheck.core.joints import Coupler
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.dense_equations import system_of
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.singular_poses import solve_closely
from kincheck.core.kinematics.continuation.walk import follow_samples

from ..oracles import naive

JOINTS, COUPLERS = (
    sorted(name for name, each in base.registry.items() if each.__module__.startswith("kincheck."))
    for base in (Joint, Coupler)
)
TYPES = Joint.registry | Coupler.registry


def smallest_singular_value(case):
    """Of the rows at all samples; an engine's record holds an estimate."""
    route = Route(compile_model(case.mechanism, Request((case.sweep.driver,), ())), case.sweep.path)
    every = range(len(route.path.times))
    found, system = follow_samples(route, 1e-12, visit=every), system_of(route.model)
    lanes = np.array([found.visited[k] for k in every]).T
    return solve_closely(system, system.state(lanes), route.sampled(route.path.times)).sigma.min()


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", JOINTS + COUPLERS)
def test_probe_is_well_conditioned(name):
    case = probe(TYPES[name])
    found = solve(case.mechanism, case.sweep.driver, case.sweep.values, rate=case.sweep.rate)
    assert found.solved.all(), found.message
    # residuals are amplified by no more than the inverse of this, on which the probes' tolerance
    # rests
    assert smallest_singular_value(case) > 0.01
    assert not found.details["dof_account"]["redundant_rows"]
    for output in case.outputs:  # no output may agree by standing still
        assert np.ptp(output_series(case, output, found).position) > 1e-3
    assert case.truth is Truth.CONSENSUS_ONLY
    assert not case.reference


@pytest.mark.parametrize("name", JOINTS)
def test_probe_moves_every_freedom(name):
    """Of shifts and turns along f, g, h at the joint's point, as many move as the joint has
    freedoms.
    """
    case = probe(TYPES[name])
    joint = case.mechanism.joint("tested")
    found = solve(case.mechanism, "turn", TURN, bodies=["a", "b"])
    h = np.array(AXIS) / np.linalg.norm(AXIS)
    f = np.array(PAIRS[0][1])
    axes = np.array([f, np.cross(h, f), h])
    moves = []
    for k in range(len(TURN)):
        a, b = (naive.Body(found.bodies[name].r[k], found.bodies[name].p[k]) for name in "ab")
        turn = a.A.T @ b.A
        shift = a.A.T @ (b.r + b.A @ POINT - a.r) - POINT
        skew = turn - turn.T
        moves.append([*(axes @ shift), *(axes @ np.array([skew[2, 1], skew[0, 2], skew[1, 0]]))])
    # in metres and radians; a joint may mix them, but may not let fewer than its freedoms go
    assert (np.ptp(moves, axis=0) > 5e-3).sum() >= 6 - joint.rows


def test_probe_of_given_joint():
    rod = Distance("mine", "x", "y", ((0.2, 0.0, 0.1), (0.6, 0.1, 0.1)), 0.45)
    tested = probe(rod).mechanism.joint("mine")
    assert (tested.bodies, tested.points, tested.length) == (("a", "b"), rod.points, 0.45)


def test_probes_of_all_types():
    assert sorted(case.name for case in probes()) == sorted([*Joint.registry, *Coupler.registry])


def test_specimen_axes_at_forty_degrees():
    """For types that refuse a right angle."""
    for name, angle in (("universal", 90.0), ("constant_velocity", 40.0)):
        a, b = np.array(specimen(TYPES[name]).axes)
        cosine = a @ b / np.sqrt((a @ a) * (b @ b))
        assert cosine == pytest.approx(np.cos(np.radians(angle)), abs=1e-15)


def test_specimen_of_refusing_joint():
    @dataclass(frozen=True)
    class Fussy(Universal):
        def __post_init__(self):
            raise MechanismError("only parallel axes will do")

    with pytest.raises(
        MechanismError, match=r"Fussy: no specimen .* 40 degrees.*only parallel axes will do"
    ):
        specimen(Fussy)
