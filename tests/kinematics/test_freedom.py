"""Degrees of freedom: the paper's count, the rank, the rows that are left out, and what is said
where the numbers do not match.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import (
    Body,
    Distance,
    Fixed,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    SolveError,
    Spherical,
    Translational,
    Universal,
)
from kincheck.core.kinematics.diagnosis.rank import free_motions
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.one_design import solve
from kincheck.core.kinematics.structure.degrees_of_freedom import account

from ..support.mechanisms import CRANK, D0, ROD, Z, four_bar, mcpherson, placed, slider_crank


def account_of(mechanism):
    return account(mechanism, frames(mechanism))


def jacobian(formulation, at):
    """All rows as a dense matrix."""
    matrix = np.zeros((len(formulation.owners), formulation.unknowns))
    for k, row in enumerate(formulation.rows(at)):
        matrix[k, list(row)] = list(row.values())
    return matrix


def test_mcpherson_account():
    """Table 5 of the paper: five bodies, 35 coordinates, 34 equations; the native count: 18
    coordinates, rank 17.
    """
    found = account_of(mcpherson())
    assert found.counted == "35 - 34 = 1"
    assert (found.bodies, found.coordinates, found.equations) == (5, 35, 34)
    assert (found.moving_coordinates, found.rows, found.rank, found.dof) == (18, 17, 17, 1)
    assert found.redundant_rows == ()


def test_account_is_in_the_details():
    details = solve(mcpherson(), "stroke", [0.0]).details
    assert details["dof"] == 1
    assert details["rank"] == 17
    assert details["dof_account"]["paper"] == "35 - 34 = 1"


A, B, X = (0.1, -0.2, 0.3), (0.5, 0.4, 0.9), (1.0, 2.0, -0.5)


@pytest.mark.parametrize(
    ("joint", "dof"),
    [
        (Revolute("j", "ground", "body", A, X), 1),
        (Spherical("j", "ground", "body", A), 3),
        (Translational("j", "ground", "body", A, X), 1),
        (Universal("j", "ground", "body", A, ((1.0, 1.0, 0.0), (1.0, -1.0, 0.5))), 2),
        (Fixed("j", "ground", "body", A), 0),
        (Distance("j", "ground", "body", (A, B)), 5),
    ],
)
def test_freedoms_of_the_joints(joint, dof):
    """Formulation section 6."""
    found = account_of(Mechanism("m", [Body("body")], [joint]))
    assert (found.dof, found.rank) == (dof, joint.rows)


# Redundant rows


TILT = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
TILT *= np.sign(np.linalg.det(TILT))


def tilted(point):
    return tuple(TILT @ point)


@pytest.mark.parametrize(
    "mechanism", [four_bar(), placed(four_bar(), tilted, tilted)], ids=["upright", "tilted"]
)
def test_four_bar_of_spatial_revolutes(mechanism):
    """20 rows, 18 coordinates, rank 17 (formulation section 7): three rows are left out, named, and
    hold all the same.
    """
    found = account_of(mechanism)
    assert (found.rows, found.moving_coordinates, found.rank, found.dof) == (20, 18, 17, 1)
    assert len(found.redundant_rows) == 3
    for name in found.redundant_rows:
        joint, primitive = name.split(": ")
        assert joint in "ABCD"
        assert primitive in ("Spherical", "Dot11")
    motion = solve(mechanism, "turn", np.linspace(0.0, 6.0, 40))
    assert motion.solved.all()
    assert motion.details["redundant_residual"] < 1e-14


def test_redundant_rows_that_contradict_are_not_passed_over():
    """A rod across a guide gives way to first order only: its row is redundant at design and
    violated beyond.
    """
    guided = [
        Translational("guide", "ground", "slider", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        Distance("rod", "ground", "slider", (Z, (0.0, 0.0, 0.0))),
    ]
    m = Mechanism("m", [Body("slider")], guided, [], [JointDisplacement("push", "guide")])
    assert account_of(m).redundant_rows == ("rod: Distance",)
    motion = solve(m, "push", [0.0, 0.1])
    assert motion.solved.tolist() == [True, False]
    assert "the redundant rows (rod: Distance) contradict the others" in motion.message


def test_a_pivot_out_of_parallel_locks():
    skew = Revolute("D", "ground", "rocker", D0, (1e-6, 1.0, 0.0))
    with pytest.raises(SolveError, match="0 degrees of freedom"):
        solve(replace(four_bar(), joints=[*four_bar().joints[:3], skew]), "turn", [0.0, 1.0])


def test_a_body_held_twice():
    m = mechanism_of(
        Fixed("weld", "ground", "a", A),
        Fixed("weld again", "ground", "a", B),
        Revolute("r", "a", "b", A, X),
    )
    found = account_of(m)
    assert (found.rows, found.rank, found.dof) == (17, 11, 1)
    assert solve(m, "turn", [0.0, 0.5]).solved.all()


def mechanism_of(*joints, drivers=None):
    drivers = [JointAngle("turn", "r")] if drivers is None else drivers
    return Mechanism("m", [Body("a"), Body("b")], joints, [Point("tip", "b", B)], drivers)


# Freedoms and drivers that do not match


def rod_between_balls(count):
    """A slider-crank whose rod is a body between two balls and so spins about itself."""
    base = slider_crank()
    pin, end = (CRANK, 0.0, 0.0), (CRANK + ROD, 0.0, 0.0)
    joints = [
        base.joint("pivot"),
        Spherical("big end", "crank", "con rod", pin),
        Spherical("small end", "con rod", "slider", end),
    ]
    return replace(
        base, bodies=[*base.bodies, Body("con rod")], joints=[*joints, base.joint("guide")][:count]
    )


def test_a_rod_that_spins_is_named():
    """It alone: the driver holds the crank."""
    with pytest.raises(
        SolveError, match=r"2 degrees of freedom .* 1 driver; 'con rod' can turn; .*use distance"
    ):
        solve(rod_between_balls(4), "turn", [0.0])


def test_without_drivers_all_that_moves_is_named():
    with pytest.raises(SolveError, match=r"0 drivers; 'crank' can turn, 'con rod' can"):
        solve(replace(rod_between_balls(4), drivers=[]), "turn", [0.0])


def test_a_body_without_joints_is_named():
    with pytest.raises(
        SolveError, match=r"6 degrees of freedom .* 0 drivers; 'a' can move; add a driver"
    ):
        solve(Mechanism("m", [Body("a")], []), "none", [0.0])


def test_a_loose_body_is_named():
    with pytest.raises(SolveError, match="'slider' can move"):
        solve(rod_between_balls(3), "turn", [0.0])


def test_too_many_drivers():
    m = slider_crank()
    both = replace(m, drivers=[*m.drivers, JointDisplacement("push", "guide")])
    with pytest.raises(SolveError, match=r"1 degree of freedom .* 2 drivers; remove 1"):
        solve(both, "turn", [0.0])


def test_a_driver_at_its_dead_centre():
    """Stretched out, the slider does not move the crank to first order."""
    pushed = replace(slider_crank(), drivers=[JointDisplacement("push", "guide")])
    with pytest.raises(SolveError, match=r"driver 'push' does not move it .*dead"):
        solve(pushed, "push", [0.0, -0.01])


def test_a_driver_across_the_motion():
    """A point of the slider cannot be driven across its guide."""
    lifted = replace(slider_crank(), drivers=[PointCoordinate("lift", "end", Z)])
    with pytest.raises(SolveError, match="'lift'"):
        solve(lifted, "lift", [0.0])


def test_two_drivers_of_the_same_freedom():
    """Two freedoms, two drivers, but both drive the same one."""
    m = mechanism_of(
        Revolute("r", "ground", "a", A, X),
        Revolute("s", "ground", "b", A, X),
        drivers=[JointAngle("turn", "r"), PointCoordinate("again", "tip", Z)],
    )
    assert solve(m, "turn", [0.0, 0.1]).solved.all()
    same = replace(m, points=[Point("tip", "a", B)])
    with pytest.raises(SolveError, match="'turn', 'again'"):
        solve(same, "turn", [0.0])


def test_nothing_can_move():
    with pytest.raises(SolveError, match="no body can move"):
        solve(Mechanism("m", [Body("a", fixed=True)], []), "none", [0.0])


def test_a_mechanism_that_does_not_close():
    """A rod too short to reach the slider's end of it wherever the slider is."""
    m = slider_crank()
    short = Distance("rod", "crank", "slider", ((CRANK, 0.0, 0.0), (CRANK + ROD, 2.0, 0.0)), 1.0)
    with pytest.raises(SolveError, match=r"does not close at the design position: residual .* m"):
        solve(replace(m, joints=[m.joint("pivot"), short, m.joint("guide")]), "turn", [0.0])


@pytest.mark.parametrize("style", ["native", "mixed", "conventional"])
def test_a_driver_that_is_locked_at_the_design_is_named_with_what_locks_it_and_what_to_do(style):
    pushed = replace(slider_crank(), drivers=[PointCoordinate("push", "end", (1.0, 0.0, 0.0))])
    said = (
        r"driver 'push' does not move it .* already from 'pivot', 'rod'; give the design in another"
        r" pose"
    )
    with pytest.raises(SolveError, match=said):
        solve(pushed, "push", [0.0], style=style)


def test_drivers_that_repeat_each_other_are_named_and_no_others():
    axles = [
        Revolute(name, "ground", name, (x, 0.0, 0.0), Z)
        for name, x in (("a", 0.0), ("b", 1.0), ("c", 2.0))
    ]
    drivers = [JointAngle("first", "a"), JointAngle("second", "a"), JointAngle("sound", "b")]
    twice = Mechanism("twice", [Body("a"), Body("b"), Body("c")], axles, [], drivers)
    with pytest.raises(
        SolveError,
        match=r"drivers 'first', 'second' do not move it .* follows already from each other; give",
    ):
        solve(twice, "first", [0.0])


def test_motions_that_have_nothing_to_do_with_each_other_are_not_mixed():
    """Three motions of two columns each, in a null space whose orthonormal basis mixes them."""
    rng = np.random.default_rng(7)
    apart = np.kron(np.eye(3), [[1.0, -1.0]])  # each row ties two columns together
    found = free_motions(rng.normal(size=(3, 3)) @ apart)
    assert found.shape == (3, 6)
    assert np.abs(apart @ found.T).max() <= 1e-14
    assert ((np.abs(found) > 1e-12).sum(axis=1) == 2).all()
