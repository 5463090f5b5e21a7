"""One mechanism, several row styles: the same motion, and what the simplified rows are worth.

Whichever way the rows are written, the solutions agree to round-off. The paper's simplified rows
are exact where the equations hold; away from there they are not, and that is what keeps Newton off
the spurious zeros (formulation section 3).
"""

from dataclasses import replace

import kincheck.cases
import numpy as np
import pytest
from kincheck.core import Body, Mechanism, OrientationLock, SolveError, solve
from kincheck.core.algebra import ZERO, Quat, Vec3, X, turned_by
from kincheck.core.case.joint_probe import probes
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.continuation.sweep import sweep
from kincheck.core.kinematics.formulation.acceptance_criteria import (
    Block,
    Candidate,
    Limits,
    margins,
)
from kincheck.core.kinematics.formulation.cartesian import Cartesian
from kincheck.core.kinematics.formulation.constraints import Constraint, Style, constraints, frames
from kincheck.core.kinematics.structure.redundancy import independent_rows
from kincheck.core.mechanism.mechanism import GROUND
from kincheck.core.primitives import Drive, Ground, Twist
from kincheck.core.primitives.base import Pose
from kincheck.core.primitives.dot11 import Dot11, PaperDot11
from kincheck.core.primitives.dot12 import Dot12, PaperDot12
from kincheck.core.primitives.dot20 import PaperDot20
from kincheck.core.primitives.dot21 import PaperDot21
from kincheck.core.primitives.named import NamedTurn

from ..support.mechanisms import mcpherson
from ..support.specimens import LANES, direction, frame, lanes, orientation, rotation, vector
from .test_freedom import jacobian

OTHERS = [style for style in Style if style is not Style.NATIVE]
ORDERS = ("position", "velocity", "acceleration")


@pytest.fixture
def rng():
    return np.random.default_rng(943745)


# The same motion


def deviation(found, reference, order):
    """The largest over all points and samples."""
    assert found.solved.all(), found.message
    return max(
        np.abs(getattr(found.points[name], order) - getattr(reference.points[name], order)).max()
        for name in found.points
    )


STROKES = np.linspace(-0.08, 0.08, 161)


@pytest.mark.parametrize("style", OTHERS)
def test_strut_motion_in_row_styles(style):
    """Round-off of metre-sized coordinates is 1e-16; each derivative passes the equations, of
    pivots about 0.3, once more.
    """
    found, reference = (
        solve(mcpherson(), "stroke", STROKES, style=each) for each in (style, Style.NATIVE)
    )
    limits = dict(zip(ORDERS, (1e-15, 1e-14, 1e-13), strict=True))
    assert {
        order: d for order in ORDERS if (d := deviation(found, reference, order)) > limits[order]
    } == {}


def run(case, style):
    """The points of a case by the equations of a style."""
    request = Request(tuple(case.sweep.path.motions), case.points, style=style)
    return sweep(compile_model(case.mechanism, request), case.sweep.path, 1e-12)


# The platforms, of 13 bodies, take ten times as long to trace in all styles as any other case, and
# their joints occur elsewhere.
MOST_BODIES = 7
ALL = [*map(kincheck.cases.load, kincheck.cases.names()), *probes()]
CASES = {case.name: case for case in ALL if len(case.mechanism.moving) <= MOST_BODIES}
# The probes have the joints of all types one by one: they move in all styles. The library's cases
# combine them, which makes a difference to relative coordinates alone: rows of the other styles are
# written joint by joint.
PROBES = {case.name for case in probes()}
STYLES = {name: OTHERS if name in PROBES else [Style.RELATIVE] for name in CASES}


@pytest.mark.parametrize("name", CASES)
def test_case_motion_in_row_styles(name):
    reference = run(CASES[name], Style.NATIVE)
    # a hundred roundings, divided by the smallest singular value once for positions, and once more
    # for each derivative
    sigma = reference.details["smallest_singular_value"]
    for style in STYLES[name]:
        found = run(CASES[name], style)
        for k, order in enumerate(ORDERS):
            size = max(
                1.0, *(np.abs(getattr(motion, order)).max() for motion in reference.points.values())
            )
            assert deviation(found, reference, order) < 1e-14 * size / sigma ** (k + 1), (
                style,
                order,
            )


def test_primitive_without_paper_form_is_named():
    with pytest.raises(SolveError, match="NamedTurn has no rows in the styles paper"):
        NamedTurn(X).paper_form()
    with pytest.raises(SolveError, match="NamedTurn has no rows"):
        NamedTurn(X).conventional_form()


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
        matrix(forms, i, j) for forms in (native.paper_form(), native.conventional_form())
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

STARTS = 1500


def lock(style):
    """The primitives of an orientation lock between two moving bodies."""
    mechanism = Mechanism("lock", [Body("i"), Body("j")], [OrientationLock("lock", "i", "j")])
    return [each.primitive for each in constraints(mechanism, frames(mechanism), {}, style)]


def uniform(rng):
    e = rng.normal(size=(4, STARTS))
    e /= np.sqrt((e * e).sum(axis=0))
    return Quat(e[0], Vec3(*e[1:]))


def stacked(values):
    return np.array([np.broadcast_to(value, STARTS) for value in values])


def newton(primitives, i, j):
    """Plain Newton with the smallest steps: (whether a zero was reached, the angle left between the
    bodies [rad]).
    """
    done = np.zeros(STARTS, dtype=bool)
    for _ in range(60):
        poses = Pose.of(ZERO, i), Pose.of(ZERO, j)
        phi = stacked([value for each in primitives for value in each.phi(*poses)])
        done = np.abs(phi).max(axis=0) < 1e-12
        if done.all():
            break
        rows = np.array(
            [stacked([*row.pi, *row.pj]) for each in primitives for row in each.rows(*poses)]
        ).transpose(2, 0, 1)
        step = -np.einsum("lij,jl->il", np.linalg.pinv(rows), phi) * ~done
        turns = [Vec3(*part) for part in (step[:3], step[3:])]
        if primitives[0].body_axes:
            turns = [pose.A @ turn for pose, turn in zip(poses, turns, strict=True)]
        i, j = (turned_by(q, 0.5 * turn) for q, turn in zip((i, j), turns, strict=True))
    return done, 2.0 * np.arccos(np.minimum(np.abs((i * j.conjugate()).e0), 1.0))


@pytest.mark.parametrize("style", Style)
def test_newton_branch_from_random_starts(style, rng):
    """Exact rows lead to the nearest zero; seven of the eight rotations that solve the conventional
    residual are spurious.
    """
    done, left = newton(lock(style), uniform(rng), uniform(rng))
    assert done.all()
    right = int((left < 1e-6).sum())
    if style is Style.CONVENTIONAL:
        # 12 percent in formulation section 3; the others end at turns of 120 and 180 degrees
        assert 0.05 < right / STARTS < 0.3
        turns = np.degrees(left[left > 1e-6])
        assert (np.minimum(np.abs(turns - 120.0), np.abs(turns - 180.0)) < 1e-3).all()
    else:
        assert right == STARTS


# Ground rows: the paper counts fixed bodies too; eliminating them changes nothing


def with_ground_rows(mechanism, drives):
    held = [
        Constraint(body.name, Ground(), GROUND, body.name)
        for body in mechanism.bodies
        if body.fixed
    ]
    return Cartesian(
        [*held, *constraints(mechanism, frames(mechanism), drives)],
        [body.name for body in mechanism.bodies],
    )


def test_ground_rows_keep_rank():
    """Formulation section 10: 30 columns, 29 rows and the driver, rank 29 without it."""
    formulation = with_ground_rows(mcpherson(), {})
    J = jacobian(formulation, formulation.configuration(formulation.design))
    assert J.shape == (30, 30)
    singular = np.linalg.svd(J[:29], compute_uv=False)
    assert singular[-1] > 1e-3
    assert len(independent_rows(J[:29], 0)) == 29


def test_ground_rows_keep_solution():
    """Newton's iteration on all 30 unknowns, dense and by numpy, against the sweep of 18."""
    stroke, mechanism = 0.05, mcpherson()
    unit = frames(mechanism).unit
    formulation = with_ground_rows(mechanism, {"stroke": Drive(stroke / unit, 1.0 / unit)})
    at = formulation.configuration(formulation.design)
    for _ in range(8):
        step = np.linalg.solve(jacobian(formulation, at), -np.array(formulation.phi(at)))
        at = formulation.configuration(formulation.retract(at, list(step)))
    assert np.abs(formulation.phi(at)).max() < 1e-15
    v = np.linalg.solve(jacobian(formulation, at), formulation.nu(at))
    a = np.linalg.solve(jacobian(formulation, at), formulation.gamma(at, list(v)))
    arm = frames(mechanism).arm("knuckle", mechanism.point("wheel").position)
    pose, motion = at.poses["knuckle"], formulation.twists(at, list(v))["knuckle"]
    rest = formulation.accelerations(at, list(v), list(a))["knuckle"]
    S = pose.turn(arm)
    expected = (
        np.add([*(unit * (pose.u + pose.swing(arm)))], mechanism.point("wheel").position),
        [*(unit * motion.of(S))],
        [*(unit * (Twist(rest.v_t, rest.w_t).of(S) + motion.centripetal(S)))],
    )
    wheel = solve(mechanism, "stroke", [stroke]).points["wheel"]
    for found, wanted in zip(
        (wheel.position[0], wheel.velocity[0], wheel.acceleration[0]), expected, strict=True
    ):
        assert found == pytest.approx(wanted, rel=1e-14, abs=1e-14)
    for fixed in ("chassis", "rack"):
        assert np.abs([*at.poses[fixed].u]).max() < 1e-15


# Acceptance: each criterion fails alone

BLOCKS = [Block(0.5, 0.5, 0.1)]
POSE = Candidate(1.0, 1e-15, 1e-15, 1.0, 0.0, 0.1, 0.1, [0.1], 0.5, 0.5, 1.0, 0.0, BLOCKS)
SPOILT = [
    ("converged", {"done": 0.0}),
    ("closed", {"closure": 2e-12}),
    ("consistent", {"leftover": 2e-12}),
    ("on the branch", {"branch": -0.1}),
    ("continued", {"gap": 0.011}),
    ("near", {"reach": 0.6}),
    ("not turned round", {"turns": [0.1, -2.1]}),
    ("as regular", {"blocks": [Block(0.5, 0.03, 0.1)]}),
    ("as regular", {"blocks": [*BLOCKS, Block(0.03, 0.5, 0.1)]}),
    ("on this side", {"reversal": -1.0}),
    ("regular between", {"moved": 0.3, "blocks": [Block(0.5, 0.5, 1.0)]}),
    ("certain", {"sigma": 1e-7}),
    ("not turned by rounding", {"sigma": 2e-6, "before": 1e-6}),
]


@pytest.mark.parametrize(("criterion", "changes"), SPOILT, ids=str)
def test_margins_of_spoilt_pose(criterion, changes):
    def failed(pose, crossing):
        found = margins(pose, Limits(1e-12, 1e-12, crossing))
        return {name for name, margin in found.items() if margin <= 0.0}

    assert failed(POSE, 0.0) == set()
    assert failed(replace(POSE, **changes), 0.0) == {criterion}
    passed = criterion in ("as regular", "on this side", "regular between")
    assert failed(replace(POSE, **changes), 100.0) == (set() if passed else {criterion})
