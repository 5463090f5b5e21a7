"""Many designs by one call: each as if solved alone, or refused with the reason."""

import numpy as np
import pytest
from kincheck.core import (
    Body,
    JointAngle,
    Mechanism,
    Point,
    Screw,
    SolveError,
    solve,
    solve_designs,
)
from kincheck.core.kinematics.formulation.parameters import placed

from ..support.mechanisms import (
    BRANCH,
    chain,
    circles_meet,
    errors,
    four_bar,
    planar_four_bar,
    solve_all,
)
from .test_design_lanes import SAME, strut


@pytest.mark.parametrize("values", [[0.0], [0.1, 0.0, -0.1]])
def test_locked_variant_is_refused(values):
    """A four-bar of four hinges with the last one tilted: it closes where it is, and is a frame."""
    mechanism, tilts = four_bar(), np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 1e-3], [0.1, 1.0, 0.0]])
    found = solve_designs(mechanism, "turn", values, {"joints.D.axis": tilts}, order=2)
    assert found.solved.tolist() == [[True] * len(values), *[[False] * len(values)] * 2]
    assert np.isnan(found.points["C"].velocity[1:]).all()
    assert sorted(found.messages) == [1, 2]
    for k, message in found.messages.items():
        with pytest.raises(SolveError) as own:
            solve(placed(mechanism, {"joints.D.axis": tuple(tilts[k])}), "turn", values)
        assert message == str(own.value)


# 128 of them at once, or 32 of many samples
@pytest.mark.parametrize("samples", [7, 2001])
def test_designs_match_single_solves(samples):
    mechanism, _ = strut()
    values, place = np.linspace(-0.05, 0.05, samples), "joints.tie_rod.points.0"
    moved = np.array([1.115, 0.665, 0.118]) + np.random.default_rng(3).normal(size=(300, 3)) * 1e-3
    found = solve_designs(mechanism, "stroke", values, {place: moved}, order=1)
    motion = found.points["wheel_center"]
    assert motion.position.shape == (300, samples, 3)
    assert motion.acceleration is None
    assert found.solved.all()
    assert found.messages == {}
    for k in (0, 255, 256, 299):
        own = solve(placed(mechanism, {place: tuple(moved[k])}), "stroke", values)
        expected = motion.position[k], motion.velocity[k]
        assert (errors(own.points["wheel_center"], expected) <= SAME).all()


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        (
            {"joints.tie_rod.end": np.zeros((4, 3))},
            "no place to vary 'joints.tie_rod.end'; did you mean 'joints.tie_rod.points.1'",
        ),
        ({"joints.ball.point": np.zeros((4, 2))}, r"has shape \(4, 2\), expected \(designs, 3\)"),
        ({"joints.ball.point": np.full((4, 3), np.nan)}, "is not finite everywhere"),
        (
            {"joints.ball.point": np.ones((4, 3)), "joints.strut_top.point": np.ones((5, 3))},
            r"found \[4, 5\] designs",
        ),
        ({}, "^solve_designs: geometry names no place to vary; known: joints.lca_pivot.point, "),
    ],
)
def test_designs_refuse_bad_geometry(geometry, message):
    with pytest.raises(SolveError, match=message):
        solve_designs(strut()[0], "stroke", [0.0], geometry)


def test_designs_refuse_bad_order():
    with pytest.raises(SolveError, match=r"^solve_designs: order is 5, expected 0, 1 or 2"):
        solve_designs(strut()[0], "stroke", [0.0], {"joints.ball.point": np.zeros((4, 3))}, order=5)


def test_designs_refuse_nearly_singular_samples():
    """What a run by itself would solve more closely; a study of many does not, and says so."""
    mechanism, samples = chain(1), [0.0, 1.8, BRANCH - 1e-4, 1.9]
    ends = np.array([mechanism.point("end").position]) + np.array(
        [[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]
    )
    found = solve_designs(mechanism, "turn", samples, {"points.end.position": ends})
    assert found.solved.tolist() == [[True, True, False, False]] * 2
    assert np.isnan(found.points["end"].position[:, 2:]).all()
    for message in found.messages.values():
        assert "cannot be followed beyond turn = 1.8707" in message
        assert "; refused at 1 sample" in message
        assert "as at turn = 1.87069633" in message


def test_designs_vary_screw_lead():
    """In the rows it is a weight, which is known only when the programs run."""
    thread = Screw("thread", "ground", "nut", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), lead=0.01)
    mechanism = Mechanism(
        "nut",
        [Body("nut")],
        [thread],
        [Point("rim", "nut", (1.0, 0.0, 0.0))],
        [JointAngle("turn", "thread")],
    )
    # the last larger than all else there is
    turns, leads = np.array([0.0, 1.0, 2.0]), [0.01, 0.011, 50.0]
    designs = solve_designs(mechanism, "turn", turns, {"joints.thread.lead": leads}, order=1)
    found = designs.points["rim"]
    for k, lead in enumerate(leads):
        slope = lead / (2.0 * np.pi)
        place = np.column_stack([np.cos(turns), np.sin(turns), slope * turns])
        rate = np.column_stack([-np.sin(turns), np.cos(turns), np.full(3, slope)])
        for values, expected in ((found.position, place), (found.velocity, rate)):
            assert np.abs(values[k] - expected).max() <= 1e-15 * max(1.0, lead)


def test_variant_beyond_travel_says_why():
    found = solve_designs(
        strut()[0], "stroke", [0.0, 0.5], {"joints.ball.point": [strut()[0].joint("ball").point]}
    )
    assert "cannot be followed beyond stroke = 0.293" in found.messages[0]
    assert found.messages[0].endswith(
        "by itself, a variant may pass a singular pose; many at once do not"
    )


def test_variant_with_dependent_rows_says_why():
    """A kite off by a twentieth, its rod on universals: one row too many, and the one that is left
    out does not stay so.
    """
    turn, rest = np.linspace(0.0, 1.6, 17), (1.2, 0.0, 0.0)
    pin = 1.25 * np.array([np.cos(1.1), -np.sin(1.1), 0.0])
    meet = circles_meet(pin, 0.7, rest, 0.7)
    kite = planar_four_bar(pin, meet, rest, "universals")
    solve_all(kite, "turn", turn)
    found = solve_designs(kite, "turn", turn, {"points.meet.position": np.array([meet])})
    assert not found.solved.all()
    assert (
        "what is singular may be the 18 rows chosen at the nominal design out of 19"
        in found.messages[0]
    )
    assert "solve this variant by itself" in found.messages[0]
