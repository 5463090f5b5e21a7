"""The truth of the stress run: conditions in extended precision, the motion followed from the
design, proofs of it.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck import KincheckError, Point, Spherical, cases, solve
from kincheck.core.case.case import Output, without_forces
from kincheck.core.case.io.outputs import with_all_coordinates
from kincheck.core.case.joint_probe import probes
from kincheck.core.extensions.laboratory.stress.families.base import as_case
from kincheck.core.extensions.laboratory.stress.families.degenerate import SOUND, WRONG
from kincheck.core.extensions.laboratory.stress.families.linkages import (
    add_loop,
    any_plane,
    crank_rocker,
    flats,
    four_bar,
    polar,
    slider_crank,
)
from kincheck.core.extensions.laboratory.truth.motion import (
    ROUND_OFF,
    DefectError,
    Reach,
    by_body,
    closed,
    follow_motion,
)
from kincheck.core.extensions.laboratory.truth.proofs import distance_from_proof
from kincheck.core.extensions.laboratory.truth.rows import NotStatedError, Poses, Rows, extended

from ...support.fakes import swept

PROBES = {case.name: case for case in probes()}
CRANK, ROD = 0.3, 1.0


def worst(truth, positions):
    """The largest error of positions over what is round-off, where the truth is known."""
    known = truth.reach == Reach.REACHED
    errors = [
        np.abs(positions[name] - x)[known].max(axis=1) / truth.bounds[name][0, known]
        for name, (x, _, _) in truth.points.items()
    ]
    return max(float(each.max()) for each in errors)


@pytest.mark.parametrize("name", PROBES)
def test_truth_jacobian_and_curvature_equal_differences(name):
    case = PROBES[name]
    rows = Rows(case.mechanism)
    bodies, rng, h = len(rows.bodies), np.random.default_rng(5), 1e-5
    step, rates = (by_body(rng.normal(size=(1, 6 * bodies))) for _ in range(2))
    at = Poses.design(bodies, 1).moved(step)
    near = rows.angles(at)
    before, here, after = (
        rows.residual(at.moved(s * h * rates), extended(np.zeros((1, 1))), near) for s in (-1, 0, 1)
    )
    first, second = (after - before) / (2 * h), (after - 2 * here + before) / h**2
    # an angle's derivatives are those on the joint's own conditions, which these bodies are not
    others = np.setdiff1d(np.arange(len(second)), rows.turn_rows)
    assert np.abs(rows.jacobian(at)[0] @ rates[1:].reshape(-1) - first[:, 0])[others].max() < 1e-8
    assert np.abs(rows.beyond(at, rates) - second)[others].max() < 1e-6


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", PROBES)
def test_truth_of_joint_types_equals_native(name):
    """That one is held to the paper's equations elsewhere; here it is the other way round: the same
    motion from other equations.
    """
    case = PROBES[name]
    found = solve(case.mechanism, case.sweep.driver, case.sweep.values)
    truth = follow_motion(case)
    assert (truth.reach == Reach.REACHED).all()
    assert worst(truth, {name: motion.position for name, motion in found.points.items()}) < 1.0


@pytest.mark.parametrize("name", ["polynomial", "spline"])
def test_truth_curve_rates_and_accelerations(name):
    """Against the native solver, whose curves other tests hold to closed forms."""
    case = PROBES[name]
    found = solve(case.mechanism, case.sweep.driver, case.sweep.values)
    for point, (_, v, a) in follow_motion(case).points.items():
        np.testing.assert_allclose(v.astype(float), found.points[point].velocity, atol=1e-12)
        np.testing.assert_allclose(a.astype(float), found.points[point].acceleration, atol=1e-11)


@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    "name",
    [
        "four_bar",
        "rssr",
        "rssr_other_branch",
        "hooke_joint",
        "stewart_platform",
        "bricard",
        "bennett",
    ],
)
def test_followed_motion_equals_closed_form(name):
    """Position, velocity and acceleration, of mechanisms whose closed forms are in the case
    library.
    """
    case = cases.load(name)
    truth = follow_motion(case)
    assert (truth.reach == Reach.REACHED).all()
    for output in without_forces(case).outputs:
        assert isinstance(output, Output)
        start = case.mechanism.point(output.point).position if output.relative else np.zeros(3)
        for order, (moved, quantity) in enumerate(
            zip(truth.points[output.point], ("position", "velocity", "acceleration"), strict=True)
        ):
            along = (moved - (extended(start) if order == 0 else 0.0)) @ extended(output.direction)
            # the closed form is computed in doubles, from design values that the table has rounded
            assert np.abs(along - getattr(case.reference[output.name], quantity)).max() < 1e-11


def test_truth_names_unknown_joint_type():
    @dataclass(frozen=True)
    class Odd(Spherical):
        type = "odd"

    try:
        case = PROBES["spherical"]
        joints = [
            Odd(j.name, j.i, j.j, j.point) if j.type == "spherical" else j
            for j in case.mechanism.joints
        ]
        with pytest.raises(NotStatedError, match="odd"):
            Rows(replace(case.mechanism, joints=joints))
    finally:
        del Spherical.registry["odd"]


# Near and beyond singular poses


def parallelogram(off, samples=9):
    """With the rocker longer by off, and how it moves."""
    b, q = polar(CRANK, 1.2), CRANK + off
    # C on the circles of the coupler, 1 m about B, and of the rocker about (1, 0), above both
    d = 1.0 - b
    e = abs(d) ** 2
    along = (1.0 - q**2 + e) / (2.0 * e)
    c = b + (along + 1j * np.sqrt(1.0 / e - along**2)) * d
    plane = any_plane(np.random.default_rng(1))
    mechanism, motion = four_bar(plane, b, 1.0 + 0j, c, "rod")
    return as_case(mechanism, "turn", np.linspace(-3.0, 3.0, samples)), motion


@pytest.mark.parametrize(("ratio", "seed"), [(1.0, 0), (1.0, 1), (1e-3, 2)])
def test_combined_loops_truth_equals_followed(ratio, seed):
    """The second with points of its own, of any size beside the first; its closed form is that of
    both.
    """
    rng = np.random.default_rng(seed)
    plane, first, second = any_plane(rng), crank_rocker(rng), crank_rocker(rng, ratio)
    mechanism, motion = add_loop(four_bar(plane, *first), plane, *second, "rod", "second ")
    case = as_case(mechanism, "turn", np.linspace(-3.0, 3.0, 7))
    truth = closed(case, motion)
    assert (truth.reach == Reach.REACHED).all()
    assert {"C", "second C"} < {*truth.points}
    assert worst(truth, {name: x for name, (x, _, _) in follow_motion(case).points.items()}) < 1.0


@pytest.mark.parametrize("off", [1e-9, 1e-3])
def test_truth_stops_at_narrow_gap(off):
    """The sweep has nine samples; what is nearly a change point turns the motion round within the
    root of off.
    """
    case, motion = parallelogram(off)
    truth, known = follow_motion(case), closed(case, motion)
    assert (truth.reach == Reach.REACHED).all()
    assert worst(truth, {name: x for name, (x, _, _) in known.points.items()}) < 1.0
    x = known.points["C"][0] - known.points["B"][0]
    # at both ends it is no parallelogram any more
    assert min(np.abs(x[end] - x[4]).max() for end in (0, -1)) > 0.1


@pytest.mark.parametrize("off", [-1e-9, -1e-3])
def test_samples_past_gap_are_beyond(off):
    case, motion = parallelogram(off)
    truth, known = follow_motion(case), closed(case, motion)
    assert list(truth.reach) == list(known.reach)
    assert (truth.reach == Reach.BEYOND).sum() in (2, 3, 4, 5)


def test_stroke_end_to_last_digits():
    """A slider-crank driven at its slider: it ends where the rod is stretched."""
    b = polar(CRANK, 0.4)
    c = float(b.real + np.sqrt(ROD**2 - b.imag**2))
    plane, left = any_plane(np.random.default_rng(2)), CRANK + ROD - c
    mechanism, motion = slider_crank(plane, b, complex(c), "rod", "slide")
    for part, reach in ((1.0 - 1e-7, Reach.REACHED), (1.0 + 1e-7, Reach.BEYOND)):
        case = as_case(mechanism, "slide", np.array([part * left]))
        assert follow_motion(case).reach[0] == reach
        assert closed(case, motion).reach[0] == reach


@pytest.mark.parametrize(("off", "told"), [(1e-8, True), (1e-3, False)])
def test_sample_behind_rounding_singularity_may_fail(off, told):
    """A kite's crank passes the rocker's pivot by a little, between two samples."""
    plane, b, d = any_plane(np.random.default_rng(1)), 0.4j * (1.0 - off), 0.4 + 0j
    c = (0.2 + 0.9 / 2**0.5) * (1.0 + 1j)
    mechanism, motion = four_bar(plane, b, d, c, "rod")
    case = as_case(mechanism, "turn", np.linspace(-2.5, 2.5, 4))
    truth = closed(case, motion, nearest=flats(b, d))
    assert min(flats(b, d), key=abs) == pytest.approx(-np.pi / 2.0)
    assert (truth.reach == Reach.REACHED).all()
    assert truth.singular.tolist() == [told, False, False, False]


def test_round_off_bound_grows_with_condition():
    near, far = (parallelogram(off, samples=2)[0] for off in (1e-1, 1e-3))
    bounds = [follow_motion(swept(case, [-1.2])).bounds["C"][0, 0] for case in (near, far)]
    assert ROUND_OFF < bounds[0] < 0.3 * bounds[1] < 1e-10


def test_wrong_closed_form_is_refused():
    case, motion = parallelogram(1e-3)
    wrong = replace(
        case.mechanism,
        joints=[
            replace(j, length=1.0 + 1e-9) if j.type == "distance" else j
            for j in case.mechanism.joints
        ],
    )
    with pytest.raises(DefectError, match="Correct the family"):
        closed(replace(case, mechanism=wrong), motion)


@pytest.mark.parametrize("name", ["rssr", "spatial_slider_crank", "gear", "rack_pinion", "screw"])
def test_proof_confirms_truth(name):
    """Krawczyk's test, about the equations of the engine: the two sets of equations have the same
    solution, to 19 digits.
    """
    case = PROBES.get(name) or cases.load(name)
    truth = follow_motion(case)
    assert distance_from_proof(truth, 3) < 1e-2
    off = {name: moved + [[[1e-14]], [[0.0]], [[0.0]]] for name, moved in truth.points.items()}
    assert distance_from_proof(replace(truth, points=off), 3) > 1e-2


def test_proof_chooses_rows_at_sample():
    """The Bennett loop after a quarter turn, where those chosen at the design depend on each
    other.
    """
    case = cases.load("bennett")
    truth = follow_motion(swept(case, np.radians([0.0, 45.0, 90.0])))
    assert distance_from_proof(truth, 2) < 1e-2


def test_ground_point_needs_no_proof():
    """At the global origin it has no round-off either."""
    case = cases.load("four_bar")
    points = [*case.mechanism.points, Point("here", "ground", (0.0, 0.0, 0.0))]
    case = replace(case, mechanism=replace(case.mechanism, points=points))
    few = with_all_coordinates(swept(case, [0.25]))
    assert "here" in few.points
    assert distance_from_proof(follow_motion(few), 0) < 1e-2


def failures(make):
    """The kinds of failures of a description."""
    try:
        mechanism = make(np.random.default_rng(7))
        return solve(mechanism, mechanism.drivers[0].name, [-0.3, 0.3]).failures
    except KincheckError as error:
        return (error.kind,)


@pytest.mark.parametrize(("make", "reasons"), WRONG.values(), ids=WRONG)
def test_degenerate_mechanisms_name_failure(make, reasons):
    assert reasons.intersection(failures(make))


@pytest.mark.parametrize("make", SOUND.values(), ids=SOUND)
def test_unusual_sound_mechanisms_are_solved(make):
    assert failures(make) == ()
