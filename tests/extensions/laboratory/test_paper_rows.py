"""What the simplified rows are worth.

The paper's simplified rows are exact where the equations hold; away from there they are not, and
that is what keeps Newton off the spurious zeros (formulation section 3).
"""

import numpy as np
import pytest
from kincheck import Body, Mechanism, OrientationLock, SolveError
from kincheck.core.algebra import ZERO, Vec3, X, Y, Z, turned_by
from kincheck.core.extensions.laboratory.paper.rows import (
    LockTest,
    PaperDot11,
    PaperDot12,
    PaperDot20,
    PaperDot21,
    conventional_form,
    paper_form,
)
from kincheck.core.kinematics import formulate, styles
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.primitives import GROUND_POSE, Dot11, Dot12, NamedTurn, Pose

from ...support.specimens import (
    LANES,
    SPURIOUS,
    direction,
    frame,
    in_body_axes,
    lanes,
    orientation,
    rotation,
    vector,
)


@pytest.fixture
def rng():
    return np.random.default_rng(943745)


def test_primitive_without_paper_form_is_named():
    with pytest.raises(SolveError, match="NamedTurn has no rows in the styles paper"):
        paper_form(NamedTurn(X))
    with pytest.raises(SolveError, match="NamedTurn has no rows"):
        conventional_form(NamedTurn(X))


# Where the simplified rows are exact


def matrix(primitives, i, j):
    """The rows of primitives by (dr_i, dpi_i, dr_j, dpi_j), shape (lanes, rows, 12)."""
    rows = [
        lanes([*row.ri, *row.pi, *row.rj, *row.pj])
        for each in primitives
        for row in each.rows(i, j)
    ]
    return np.array(rows).transpose(2, 0, 1)


def both(native, i, j):
    """Rows of a native primitive's other forms: the simplified ones of the paper, and the exact
    ones by full products.
    """
    simplified, exact = (
        matrix(forms, i, j) for forms in (paper_form(native), conventional_form(native))
    )
    return simplified, exact


def off_by(rng, angle, turn=None):
    """Poses of two bodies, j turned against i by the angle about an axis of i (any axis unless
    given).
    """
    q, axis = orientation(rng), direction(rng) if turn is None else turn
    return Pose.of(vector(rng), q), Pose.of(vector(rng), q * rotation(axis, angle))


SMALL = np.geomspace(1e-6, 1e-2, LANES)


@pytest.mark.parametrize("primitive", [Dot11, Dot12])
def test_simplified_rows_by_misalignment(primitive, rng):
    """Of parallel axes and of a lock: exact on the manifold alone."""
    (f, g, h), i = frame(rng), Pose.of(vector(rng), orientation(rng))
    native = Dot11(f, g, h) if primitive is Dot11 else Dot12()
    spin = rotation(h, rng.uniform(-3.0, 3.0, LANES) if primitive is Dot11 else 0.0)

    def rows(misalignment):
        return both(native, i, Pose.of(vector(rng), i.q * rotation(f, misalignment) * spin))

    simplified, exact = rows(0.0)
    assert np.abs(simplified - exact).max() < 1e-14
    simplified, exact = rows(SMALL)
    error = np.abs(simplified - exact).max(axis=(1, 2)) / SMALL
    # first order in the misalignment: largest component of a unit vector
    assert 0.1 < error.min() < error.max() < 2.0
    if primitive is Dot11:  # opposite on the other branch
        simplified, exact = rows(np.pi)
        assert np.abs(simplified + exact).max() < 1e-14


def test_simplified_lock_rows_are_regular(rng):
    """Those by full products are, for one, at a right angle about a joint axis."""
    simplified, exact = both(Dot12(), *off_by(rng, 0.5 * np.pi, X))
    assert np.linalg.svd(exact, compute_uv=False).min() < 1e-15
    for i, j in (off_by(rng, 0.5 * np.pi, X), off_by(rng, rng.uniform(0.0, np.pi, LANES))):
        simplified, _ = both(Dot12(), i, j)
        assert np.linalg.svd(simplified, compute_uv=False) == pytest.approx(np.sqrt(2.0), abs=1e-14)


def beyond(rows, others):
    """The part of rows that others do not span: its largest component in each lane."""
    return np.abs(rows - rows @ np.linalg.pinv(others) @ others).max(axis=(1, 2))


def test_simplified_line_rows_need_lock(rng):
    """dot21 leaves out what three rows of dot12 say; with them it spans the exact rows at any pose,
    without them it is wrong.
    """
    f, g, h = frame(rng)
    s_i, s_j = vector(rng), vector(rng)
    line = [PaperDot20(a, s_i, s_j, ZERO) for a in (f, g)]
    simplified = [PaperDot21(f, g, s_i - s_j)]

    i, j = off_by(rng, rng.uniform(-3.0, 3.0, LANES))
    assert beyond(matrix(line, i, j), matrix([*simplified, PaperDot12()], i, j)).max() < 1e-12
    # a cylindrical joint must not be made so, not even where its axes are parallel
    i, j = off_by(rng, rng.uniform(0.5, 2.5, LANES), h)
    alone = beyond(matrix(line, i, j), matrix([*simplified, PaperDot11(f, g, h)], i, j))
    assert np.median(alone) > 0.1


# The branch that Newton reaches


def lock(style):
    """The primitives of an orientation lock between two moving bodies."""
    mechanism = Mechanism("lock", [Body("i"), Body("j")], [OrientationLock("lock", "i", "j")])
    found = formulate(mechanism, frames(mechanism), style)
    return [each.primitive for each in found.constraints]


def newton(primitives, i, j):
    """Plain Newton with the smallest steps: (whether a zero was reached, the angle left between the
    bodies [rad]).
    """
    done = np.zeros(LANES, dtype=bool)
    for _ in range(60):
        poses = Pose.of(ZERO, i), Pose.of(ZERO, j)
        phi = lanes([value for each in primitives for value in each.phi(*poses)])
        done = np.abs(phi).max(axis=0) < 1e-12
        if done.all():
            break
        rows = np.array(
            [lanes([*row.pi, *row.pj]) for each in primitives for row in each.rows(*poses)]
        ).transpose(2, 0, 1)
        step = -np.einsum("lij,jl->il", np.linalg.pinv(rows), phi) * ~done
        turns = [Vec3(*part) for part in (step[:3], step[3:])]
        if in_body_axes(type(primitives[0])):
            turns = [pose.A @ turn for pose, turn in zip(poses, turns, strict=True)]
        i, j = (turned_by(q, 0.5 * turn) for q, turn in zip((i, j), turns, strict=True))
    return done, 2.0 * np.arccos(np.minimum(np.abs((i * j.conjugate()).e0), 1.0))


@pytest.mark.parametrize("style", styles())
def test_newton_branch_from_random_starts(style, rng):
    """Exact rows lead to the nearest zero; seven of the eight rotations that solve the conventional
    residual are spurious.
    """
    done, left = newton(lock(style), orientation(rng), orientation(rng))
    assert done.all()
    right = int((left < 1e-6).sum())
    if style == "conventional":
        # 12 percent in formulation section 3; the others end at turns of 120 and 180 degrees
        assert 0.05 < right / LANES < 0.3
        turns = np.degrees(left[left > 1e-6])
        assert (np.minimum(np.abs(turns - 120.0), np.abs(turns - 180.0)) < 1e-3).all()
    else:
        assert right == LANES


@pytest.mark.parametrize("style", [PaperDot12(), LockTest(Y, Z)], ids=["paper", "lock"])
def test_branch_of_spurious_zeros(style):
    assert all(style.branch(GROUND_POSE, Pose.of(ZERO, turn))[0] < 0.0 for turn in SPURIOUS)
    assert style.branch(GROUND_POSE, Pose.of(ZERO, rotation(X, 0.5)))[0] > 0.0
