"""A solution has what is asked for and no more, and bad arguments are refused."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import (
    Point,
    SolveError,
)
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import RATE, RATE_T, Request
from kincheck.core.kinematics.formulation.constraints import Style
from kincheck.core.kinematics.one_design import solve
from kincheck.core.mechanism.motions import Ramp
from kincheck.core.trajectory import Motions, PointMotion

from ..support.mechanisms import mcpherson, without_fixed_bodies
from .test_solve import MOVING, STROKES

# What is asked for, and no more


def flops(found):
    return {name: size["flops"] for name, size in found.details["program"].items()}


def test_lower_orders_cost_less():
    by_order = [
        solve(mcpherson(), "stroke", STROKES, bodies=MOVING, order=order) for order in (0, 1, 2)
    ]
    position, velocity, acceleration = by_order
    # all are predicted by rates and accelerations, and end at the same pose but for its rounding
    for found in by_order:
        assert (found.iterations == acceleration.iterations).all()
        assert (
            np.abs(found.points["wheel"].position - acceleration.points["wheel"].position).max()
            <= 3e-16
        )
        assert np.abs(found.bodies["strut"].p - acceleration.bodies["strut"].p).max() <= 3e-16
    assert position.points["wheel"].velocity is None
    assert position.bodies["strut"].v is None
    assert velocity.points["wheel"].acceleration is None
    assert velocity.bodies["strut"].a is None
    assert (
        np.abs(velocity.points["wheel"].velocity - acceleration.points["wheel"].velocity).max()
        <= 2e-15
    )
    assert np.abs(velocity.bodies["strut"].v - acceleration.bodies["strut"].v).max() <= 2e-15
    cost = [sum(flops(found).get(name, 0) for name in ("newton", "outputs")) for found in by_order]
    assert cost[0] < cost[1] < cost[2]
    for order, wanted in enumerate([set(), {RATE}, {RATE, RATE_T}]):
        model = compile_model(mcpherson(), Request(("stroke",), (), MOVING, order=order))
        put_out = model.programs["outputs"].outputs.keys()
        assert {name for name in (RATE, RATE_T) if put_out & {*model.vectors[name]}} == wanted


@pytest.mark.parametrize("style", [style.value for style in Style])
def test_fixed_bodies_cost_nothing(style):
    """Chassis and rack as fixed bodies, or as the ground itself: the same programs, the same
    bits.
    """
    free, fixed = (
        solve(each, "stroke", STROKES, style=style)
        for each in (without_fixed_bodies(mcpherson()), mcpherson())
    )
    assert flops(free) == flops(fixed)
    assert (free.points["wheel"].position == fixed.points["wheel"].position).all()
    assert free.details["rank"] == fixed.details["rank"]


def test_ground_as_either_body():
    """Which body of a joint is the fixed one costs nothing either."""
    m = mcpherson()
    turned = [
        joint.reversed() if any(map(m.is_fixed, joint.bodies)) else joint for joint in m.joints
    ]
    assert sum(joint is not other for joint, other in zip(turned, m.joints, strict=True)) == 3
    assert flops(solve(replace(m, joints=turned), "stroke", [0.0])) == flops(
        solve(m, "stroke", [0.0])
    )


def test_solution_has_requested_names_only():
    everything = solve(mcpherson(), "stroke", [0.0, 0.01], bodies=MOVING)
    assert set(everything.points) == {"wheel", "rod_end"}
    assert set(everything.bodies) == set(MOVING)
    little = solve(mcpherson(), "stroke", [0.0, 0.01], points=["rod_end"])
    assert set(little.points) == {"rod_end"}
    assert little.bodies == {}
    nothing = solve(mcpherson(), "stroke", [0.0, 0.01], points=[])
    assert nothing.points == {}
    assert flops(nothing)["outputs"] < flops(little)["outputs"] < flops(everything)["outputs"]
    assert flops(nothing)["newton"] == flops(everything)["newton"]


def test_fixed_bodies_stay():
    mechanism = mcpherson()
    mechanism = replace(
        mechanism, points=[*mechanism.points, Point("top", "chassis", (1.0, 0.55, 0.6))]
    )
    found = solve(mechanism, "stroke", [-0.05, 0.05], points=["top"], bodies=["rack"])
    top, rack = found.points["top"], found.bodies["rack"]
    assert (top.position == (1.0, 0.55, 0.6)).all()
    assert not top.velocity.any()
    assert not top.acceleration.any()
    assert (rack.r == (1.14, 0.0, 0.1455)).all()
    assert not rack.v.any()
    assert not rack.a.any()


def test_motions_are_lazy_views():
    table = np.arange(12.0).reshape(2, 6)
    motions = Motions(PointMotion, table, {"P": [slice(0, 3), slice(3, 6), None]})
    assert (list(motions), len(motions), "Q" in motions) == (["P"], 1, False)
    motion = pickle.loads(pickle.dumps(motions))["P"]
    assert (motion.position == table[:, :3]).all()
    assert (motion.velocity == table[:, 3:]).all()
    assert motion.acceleration is None
    assert np.shares_memory(motions["P"].velocity, table)
    with pytest.raises(KeyError, match="Q"):
        motions["Q"]


@pytest.mark.parametrize("name", ["rssr", "four_bar", "iftomm_n_four_bar"])
def test_solve_without_samples(name):
    """Also where rows are left out, which may be chosen anew."""
    case = cases.load(name)
    found = solve(case.mechanism, case.sweep.driver, [])
    assert found.solved.shape == (0,)
    assert {motion.position.shape for motion in found.points.values()} == {(0, 3)}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"driver": "steer"}, "there is no driver 'steer'; known: stroke"),
        ({"points": ["hub"]}, "there is no point 'hub'; known: rod_end, wheel"),
        ({"bodies": ["hub"]}, "there is no body 'hub'; known: "),
        ({"order": 3}, "order is 3, expected 0, 1 or 2"),
        ({"rate": 0.0}, "rate is 0.0, expected driver units"),
        ({"tol": np.nan}, "tol is nan, expected a positive number"),
        ({"tol": np.inf}, "tol is inf"),
        ({"values": 0.1}, r"values have shape \(\), expected \(n,\)"),
        ({"values": [[0.0, 0.1]]}, r"values have shape \(1, 2\)"),
        ({"values": [0.0, np.nan]}, "values are not all finite"),
        ({"values": ["a"]}, r"values are \['a'\], expected numbers"),
        ({"values": [1j]}, r"values are \[1j\], expected numbers"),
        ({"rate": 1e-320}, "rate is 1e-320: no number is the time of the values then"),
        ({"motions": {"stroke": Ramp(1.0)}}, "motions has 'stroke', which is swept; leave it out"),
        ({"motions": {"steer": Ramp(1.0)}}, "there is no driver 'steer'"),
        ({"motions": {"steer": 3.0}}, r"motions\['steer'\] is 3.0, expected a motion"),
        (
            {"style": "dads"},
            "there is no style 'dads'; known: native, paper, conventional, mixed, relative",
        ),
    ],
)
def test_solve_refuses_bad_arguments(arguments, message):
    with pytest.raises(SolveError, match=message):
        solve(mcpherson(), **({"driver": "stroke", "values": [0.0, 0.1]} | arguments))
