"""Which rows are left out where some repeat others: as many as must be, and such that the others
are good for the whole sweep.
"""

import numpy as np
import pytest
from kincheck import Body, JointAngle, Mechanism, Point, Revolute, solve
from kincheck.core.algebra import ZERO, Quat, vec
from kincheck.core.kinematics import Cartesian, constraints
from kincheck.core.kinematics.compiled.programs import Tracer
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.formulation.formulation import Condition
from kincheck.core.kinematics.formulation.state_vectors import jacobian
from kincheck.core.kinematics.structure.degrees_of_freedom import select_rows
from kincheck.core.kinematics.structure.redundancy import independent_rows
from kincheck.core.primitives import Pose
from kincheck.core.program import Elimination

from ..support.mechanisms import Z, errors, solve_all


def test_independent_rows_of_known_matrix():
    rows = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    kept = independent_rows(rows, 0)
    assert len(kept) == np.linalg.matrix_rank(rows) == np.linalg.matrix_rank(rows[kept])
    assert independent_rows(rows, 1)[-1] == 3  # the last row first
    assert independent_rows(np.zeros((2, 3)), 0) == []


@pytest.mark.parametrize("seed", range(10))
def test_independent_rows_of_random_matrices(seed):
    """As many as the rank by singular values, and independent, with the last rows among them."""
    rng = np.random.default_rng(seed)
    rank = int(rng.integers(1, 8))
    matrix = rng.normal(size=(12, rank)) @ rng.normal(size=(rank, 9))
    kept = independent_rows(matrix, 1)
    assert len(kept) == rank == np.linalg.matrix_rank(matrix[kept])
    assert 11 in kept


def test_independent_rows_in_portions():
    """What is left out of the first is not taken up again, and what is kept is judged with the
    rest.
    """
    rng = np.random.default_rng(0)
    weights = rng.normal(size=(3000, 4))
    weights[:1500, :2] = weights[1500:, 2:] = 0.0  # neither half has what the other has
    matrix = weights @ rng.normal(size=(4, 6))
    conditions = [Condition(range(k, k + 3), remote=k // 600) for k in range(0, 3000, 3)]
    kept = independent_rows(matrix, 0, conditions)
    assert len(kept) == 4 == np.linalg.matrix_rank(matrix[kept])


@pytest.mark.parametrize("seed", range(8))
def test_redundant_rows_of_loops_sharing_crank(seed):
    """Each loop keeps a system of its own: of hinges alone three of its rows are left out, and they
    are none of the crank's.
    """
    linkages = pytest.importorskip("kincheck.core.extensions.laboratory.stress.families.linkages")
    rng = np.random.default_rng(seed)
    plane, bars = linkages.any_plane(rng), linkages.crank_rocker(rng)
    mechanism, _ = linkages.add_loop(
        linkages.four_bar(plane, *bars), plane, *bars, "revolutes", "twin "
    )
    frame = frames(mechanism)
    formulation = Cartesian(constraints(mechanism, frame, {}), frame.moving)
    selection = select_rows(mechanism, frame, formulation)
    assert {formulation.owners[k][0].removeprefix("twin ") for k in selection.dropped} <= {
        "pin_1",
        "pin_2",
    }
    traced = Tracer(mechanism, Request(("turn",), ()))
    assert traced.selection.chosen == selection.chosen
    rows = traced.formulation.rows(traced.at)
    cores = Elimination([rows[k] for k in selection.chosen]).cores
    assert max(len(core.rows) for core in cores) == 4


@pytest.mark.parametrize("seed", range(8))
def test_kept_rows_are_good_all_round(seed):
    """Against the best there is, all rows. Where one row each of two hinges kept an axis parallel
    there were poses without rank.
    """
    linkages = pytest.importorskip("kincheck.core.extensions.laboratory.stress.families.linkages")
    rng = np.random.default_rng(seed)
    plane, bars = linkages.any_plane(rng), linkages.crank_rocker(rng)
    mechanism, motion = linkages.four_bar(plane, *bars)
    frame = frames(mechanism)
    formulation = Cartesian(constraints(mechanism, frame, {}), frame.moving)
    kept = select_rows(mechanism, frame, formulation).chosen
    turns = np.linspace(-np.pi, np.pi, 37)
    moved = motion(turns[None])
    for sample in range(37):
        state = dict(formulation.design)
        for name in frame.moving:
            turn, pivot, shift = moved[name]
            shift = np.broadcast_to(shift, (3, 37))
            q, away = (
                turn[:, sample].astype(float),
                np.array([*frame.origins[name]]) - pivot.astype(float) / frame.unit,
            )
            swung = Pose.of(ZERO, Quat(q[0], vec(q[1:]))).swing(vec(away))
            state |= {
                f"q {name}": [*q],
                f"u {name}": [*(vec(shift[:, sample].astype(float) / frame.unit) + swung)],
            }
        at = formulation.configuration(state)
        assert np.abs(formulation.phi(at)[:-1]).max() < 1e-14  # all but the driver's, at rest
        matrix = jacobian(formulation, at)
        least, best = (
            np.linalg.svd(rows, compute_uv=False)[-1] for rows in (matrix[[*kept]], matrix)
        )
        assert least > 0.4 * best


LEFT = 0.9273


def locomotive(lead, first=LEFT):
    """Two wheels and two coupling rods, the second ahead by that angle: where one rod is at its
    dead point the other holds.
    """
    joints = [Revolute(f"axle{k}", "ground", f"wheel{k}", (2.0 * k, 0.0, 0.0), Z) for k in (0, 1)]
    for rod, angle in (("left", first), ("right", first + lead)):
        x, y = 0.4 * np.cos(angle), 0.4 * np.sin(angle)
        joints += [
            Revolute(f"{rod}{k}", f"wheel{k}", rod, (2.0 * k + x, y, 0.0), Z) for k in (0, 1)
        ]
    points = [Point("rim", "wheel1", (2.5, 0.0, 0.0))]
    return Mechanism(
        "loco",
        [Body(n) for n in ("wheel0", "wheel1", "left", "right")],
        joints,
        points,
        [JointAngle("turn", "axle0")],
    )


def rim(turn):
    """Closed form of the rim of the second wheel, its velocity and acceleration."""
    c, s, zero = 0.5 * np.cos(turn), 0.5 * np.sin(turn), 0.0 * turn
    return [np.column_stack(each) for each in ([2.0 + c, s, zero], [-s, c, zero], [-c, -s, zero])]


def test_dead_rod_is_no_singular_pose():
    """The rod whose rows were chosen comes to its dead points; the mechanism is regular there, for
    the other rod is not.
    """
    turn = np.linspace(0.0, 4.0 * np.pi, 49)
    found = solve_all(locomotive(np.pi / 2.0), "turn", turn)
    assert errors(found.points["rim"], rim(turn))[0] <= 1e-13
    assert not {"notes", "singular_poses"} & set(found.details)


def test_two_dead_rods_are_singular():
    found = solve(locomotive(np.pi), "turn", np.linspace(0.0, 4.0 * np.pi, 49))
    assert all("(bifurcation)" in note for note in found.details["notes"])
