"""Large mechanisms: sparse systems choose rows anew where those of the design come to depend on
each other, step over no singular pose, and refuse what residuals leave uncertain.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Distance,
    Gear,
    Inline,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    Ramp,
    Revolute,
    Screw,
    SolveError,
    Spherical,
    Translational,
    Universal,
    solve,
)
from kincheck.core.extensions.blocks import component_lanes, sparse_lanes
from kincheck.core.extensions.blocks.sparse_lanes import POSES, SparseLanes, falling
from kincheck.core.extensions.blocks.sparse_lu import Blocks
from kincheck.core.extensions.blocks.sweep import Lanes
from kincheck.core.extensions.designs.design_batch import solve_designs
from kincheck.core.extensions.laboratory.bench.size import LEAN, circle, pivot, ring
from kincheck.core.kinematics import Cartesian, placed
from kincheck.core.kinematics.formulation.acceptance_criteria import least_slope
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.formulation.state_vectors import jacobian
from kincheck.core.kinematics.structure.degrees_of_freedom import NullSpaces
from kincheck.core.mechanism.motions import Path

from ...support.block_structures import chain_of_hinges, solve_sparse
from ...support.examples import examples
from ...support.fakes import calls
from ...support.mechanisms import (
    ORIGIN,
    X,
    Z,
    chain,
    circles_meet,
    crank_tip,
    errors,
    indexed,
    indexing,
    planar_four_bar,
    solve_all,
)

SHAPES, GAPS, EXCHANGED, RINGS = examples(__file__, "shapes", "gaps", "exchanged", "rings")

CRANKS = 5
"""A small ring is solved as one sparse system on request; the front door does so from 40 bodies."""


def swept(mechanism, turn, order=2):
    path = Path({"turn": Ramp(1.0)}, np.asarray(turn))
    points = [point.name for point in mechanism.points]
    return solve_sparse(mechanism, path, points, order=order)


def pin_meeting(crank, ground, rod, rocker, angle):
    """A crank's pin, and where a rod from there meets a rocker; of shape (n, 3) each."""
    pin = crank * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    return pin, circles_meet(pin, rod, (ground, 0.0, 0.0), rocker)


def four_bar(sizes, start, ends, cranks=CRANKS):
    """A four-bar on the driven crank of a ring."""
    pin, meet = pin_meeting(*sizes, start)
    bar = planar_four_bar(pin, meet, (sizes[1], 0.0, 0.0), ends, crank="crank0")
    whole = ring(cranks)
    return replace(
        whole,
        bodies=[*whole.bodies, *bar.bodies[1:]],
        joints=[*whole.joints, *bar.joints[1:]],
        points=bar.points,
    )


KITE = (1.25, 1.2, 0.7, 0.7)
"""Lengths of crank, ground, rod and rocker."""


@pytest.mark.parametrize(
    ("count", "shape", "ends"),
    EXCHANGED,
)
def test_sparse_rows_are_exchanged(shape, ends, count):
    """A plain four-bar, a kite off by a twentieth, and one on its side beside its corner."""
    turn, sizes = np.linspace(0.0, 1.6, count), SHAPES[shape]
    found = swept(four_bar(sizes, -1.1, ends), turn)
    assert found.solved.all(), found.message
    _, meet = pin_meeting(*sizes, turn - 1.1)
    assert np.abs(found.points["meet"].position - meet).max() < 1e-12


def test_sparse_rates_after_row_exchange():
    mechanism = four_bar(KITE, -1.1, "hinges")
    path = Path({"turn": Ramp(1.0)}, np.linspace(0.0, 1.6, 41))
    found = solve_sparse(mechanism, path, ["meet"])
    assert found.solved.all(), found.message
    assert found.details["rows_chosen_anew"] >= 1
    assert "rows_chosen_anew" not in swept(ring(CRANKS), np.linspace(0.0, 0.8, 9)).details
    pin, meet = pin_meeting(*KITE, path.times - 1.1)
    point = found.points["meet"]
    assert np.abs(point.position - meet).max() < 1e-13
    # the rod and the rocker keep their lengths, to the second derivative
    for end, rate, second in ((pin, np.cross(Z, pin), -pin), (np.array([1.2, 0.0, 0.0]), 0.0, 0.0)):
        d, v, a = point.position - end, point.velocity - rate, point.acceleration - second
        assert np.abs((d * v).sum(axis=1)).max() < 1e-12
        assert np.abs((v * v).sum(axis=1) + (d * a).sum(axis=1)).max() < 1e-10


def inside(off, ends, crank=3, cranks=CRANKS, phase=0.7):
    """A ring of which a crank is two, tied by a parallelogram, or by what is nearly one: it belongs
    to all that is irreducible.
    """
    whole, aside = ring(cranks), 0.7
    joints = [
        Inline(j.name, "other", f"plate{crank + 1}", (j.point[0] + aside, *j.point[1:]), Z)
        if j.name == f"before{crank + 1}"
        else j
        for j in whole.joints
    ]
    x, s, c = pivot(crank, cranks), np.sin(LEAN + phase), np.cos(LEAN + phase)
    pin = (float(x + 0.5 * s), float(0.5 * c), 0.0)
    end = (float(x + aside + (0.5 + off) * s), float((0.5 + off) * c), 0.0)
    joints.append(Revolute("rest", "ground", "other", (x + aside, 0.0, 0.0), Z))
    bodies = [*whole.bodies, Body("other")]
    if ends == "distance":
        return replace(
            whole,
            bodies=bodies,
            joints=[*joints, Distance("rod", f"crank{crank}", "other", (pin, end))],
        )
    joints += [
        Revolute("pin", f"crank{crank}", "rod", pin, Z),
        Revolute("end", "rod", "other", end, Z),
    ]
    return replace(whole, bodies=[*bodies, Body("rod")], joints=joints)


GRIDS = {
    "coarse": np.linspace(0.0, -1.1, 3),
    "middle": np.linspace(0.0, -1.1, 9),
    # samples close to each other only where the motion ends
    "fine": np.concatenate([np.linspace(0.0, -0.5, 9), np.arange(-0.5014, -0.601, -5e-4)]),
}


@pytest.mark.parametrize(
    ("grid", "ends"), [("coarse", "distance"), ("middle", "hinges"), ("fine", "distance")]
)
def test_parallelogram_in_line_goes_on(ends, grid):
    """Where the rod's arms are in line with it the parallelogram may go on as another."""
    turn = GRIDS[grid]
    found = swept(inside(0.0, ends), turn, order=0)
    assert found.solved.all(), found.message
    assert "crosses a singular pose near turn = -0.5707" in found.details["notes"][0]
    tip, *_ = crank_tip(pivot(2, CRANKS), LEAN - turn)
    assert np.abs(found.points["tip2"].position - tip).max() <= 1e-12


# where the rod's arms are in line with it, what is nearly a parallelogram turns back
@pytest.mark.by_day(3)
@pytest.mark.parametrize(
    "shape",
    GAPS,
    ids=str,
)
def test_sparse_gap_ends_motion(shape):
    grid, ends, off, end = shape
    turn = GRIDS[grid]
    found = swept(inside(off, ends), turn, order=0)
    assert found.solved.tolist() == (turn > -end).tolist()
    assert "cannot be followed beyond" in found.message


def test_sigmas_of_blocks():
    """Of blocks solved one after the other: of one row exact, of others the better the more
    singular they are.
    """
    rng, sizes = np.random.default_rng(2), [1, 3, 40, 2]
    block, n = np.repeat(np.arange(4), sizes), sum(sizes)
    i, j = np.nonzero(block[:, None] >= block)
    for near in (1.0, 1e-6):
        matrix = np.where(block[:, None] >= block, rng.normal(size=(n, n)), 0.0)
        for k in range(4):
            own = np.ix_(block == k, block == k)
            u, s, v = np.linalg.svd(matrix[own])
            s[-1] *= near
            matrix[own] = (u * s) @ v
        blocks = Blocks(i, j, n, np.arange(len(i)), None)
        one = np.arange(1)
        (found,), (sign,) = (each.T for each in blocks.sigmas(matrix[i, j][:, None], one))
        matrix[3] *= -1.0
        assert blocks.sigmas(matrix[i, j][:, None], one)[1] == -sign
        expected = [
            np.linalg.svd(matrix[np.ix_(block == k, block == k)], compute_uv=False)[-1]
            for k in range(4)
        ]
        rounding = n * np.finfo(float).eps * 10.0
        ratio = np.sort(found) / np.sort(expected)
        assert (ratio >= 1.0 - rounding / min(expected)).all()
        assert (ratio <= (4.0 if near == 1.0 else 1.0 + 1e-6)).all()


def test_kept_rows_are_well_conditioned():
    """Of a chain of loops rows were left out at one end: the smallest singular value was nothing,
    that of all rows is not.
    """
    mechanism = chain_of_hinges(30)
    whole = jacobian(Cartesian.of(mechanism, frames(mechanism)))
    i, j = np.nonzero(whole)
    kept = NullSpaces(i, j, whole[i, j], whole.shape).independent_rows(1)
    assert kept is not None
    assert len(whole) - len(kept) == 90
    least, of_all = (np.linalg.svd(each, compute_uv=False)[-1] for each in (whole[kept], whole))
    assert least > 0.2 * of_all
    found = solve_sparse(mechanism, Path({"turn": Ramp(1.0)}, np.linspace(0.0, 0.5, 9)))
    assert found.solved.all(), found.message


# Large mechanisms by the front door: how they are solved, and what is refused


@pytest.mark.parametrize("cranks", [12, 24])
def test_undriven_ring_names_freedom(cranks):
    with pytest.raises(SolveError, match=r"1 degree of freedom .* but 0 drivers; .*crank"):
        solve(replace(ring(cranks), drivers=()), "turn", [0.0])


@pytest.mark.nightly
def test_designs_of_large_ring():
    """What is known of sigma of many variants at once leaves all samples of such a ring in doubt.
    Designs that end early say why.
    """
    whole, turn, order = ring(21), np.array([0.1, -0.2, 0.0]), 1
    (hinge,) = (joint.point for joint in whole.joints if joint.name == "pivot0")
    hinges = np.array(hinge) + [[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]
    found = solve_designs(whole, "turn", turn, {"joints.pivot0.point": hinges}, order=order)
    assert found.solved.all()
    assert found.messages == {}
    for k, at in enumerate(hinges.tolist()):
        alone = solve(placed(whole, {"joints.pivot0.point": at}), "turn", turn, order=order)
        motion, own = found.points["tip12"], alone.points["tip12"]
        assert (errors(own, (motion.position[k], motion.velocity[k])) <= 1e-13).all()
        assert motion.acceleration is None
    # the same programs
    found = solve_designs(whole, "turn", [0.1, 3.0], {"joints.pivot0.point": [hinge]}, order=order)
    assert found.solved.tolist() == [[True, False]]
    assert "cannot be followed beyond turn = " in found.messages[0]


def stretched(crank, rod, angle):
    """A crank that its slider drives towards the stretched rod, with 42 wheels on it; and where the
    slider begins.
    """
    pin = (crank * np.cos(angle), crank * np.sin(angle), 0.0)
    begin = pin[0] + np.sqrt(rod**2 - pin[1] ** 2)
    wheels = [f"w{k}" for k in range(42)]
    whole = Mechanism(
        "stretched",
        bodies=[Body(name) for name in ("crank", "rod", "slider", *wheels)],
        joints=[
            Revolute("turn", "ground", "crank", ORIGIN, Z),
            Universal("pin", "crank", "rod", pin, (Z, (pin[1], begin - pin[0], 0.0))),
            Spherical("end", "rod", "slider", (begin, 0.0, 0.0)),
            Translational("guide", "ground", "slider", (begin, 0.0, 0.0), X),
            *(
                Revolute(f"axle {name}", "ground", name, (0.01 * k, 0.2, 0.0), Z)
                for k, name in enumerate(wheels)
            ),
        ],
        points=[Point("pin", "crank", pin)],
        drivers=[JointDisplacement("push", "guide")],
        couplers=[
            Gear(f"mesh {name}", (f"axle {name}", f"axle w{k - 1}" if k else "turn"), -1.0)
            for k, name in enumerate(wheels)
        ],
    )
    return whole, begin


@pytest.mark.parametrize(
    ("short", "solved"), [(1e-2, True), (1e-3, True), (1e-7, False), (1e-9, False)]
)
def test_sparse_rates_beside_dead_centre(short, solved):
    """Rates were off by up to 3e-6 of their own. The crank's angle follows from the slider's place
    by a triangle.
    """
    crank, rod = 0.5, 1.5
    mechanism, begin = stretched(crank, rod, 0.3)
    (value,) = values = [(crank + rod - begin) * (1.0 - short)]
    found = solve(mechanism, "push", values)
    assert "factor_entries" in found.details
    assert found.solved.tolist() == [solved]
    if not solved:
        assert (
            "refused at 1 sample so near a singular pose that residuals leave the pose or its"
            " rates uncertain" in found.message
        )
        return
    x = begin + value
    cosine = (crank**2 - rod**2 + x**2) / (2.0 * crank * x)
    rate = -(x - crank * cosine) / (crank * x * np.sqrt(1.0 - cosine**2))
    at = crank * np.array([cosine, np.sqrt(1.0 - cosine**2), 0.0])
    np.testing.assert_allclose(found.points["pin"].position[0], at, rtol=0, atol=1e-12)
    expected = rate * np.array([-at[1], at[0], 0.0])
    np.testing.assert_allclose(
        found.points["pin"].velocity[0], expected, rtol=0, atol=1e-9 * abs(rate)
    )


def test_refused_samples_name_worst():
    mechanism, begin = stretched(0.5, 1.5, 0.3)
    nearest, near = values = (2.0 - begin) * (1.0 - np.array([1e-9, 1e-7]))
    message = solve(mechanism, "push", values).message
    assert "refused at 2 samples" in message
    assert f"(at push = {nearest:.9g})" in message
    assert f"(at push = {near:.9g})" not in message


def test_nan_error_bound_refuses_sample(monkeypatch):
    """Wherever it stands: Python's own maximum passes over what is no number."""
    mechanism, begin = stretched(0.5, 1.5, 0.3)
    values = [(2.0 - begin) * (1.0 - 1e-7)]
    for found in (np.nan, np.inf):
        bounds = lambda lanes, state, *_, found=found: np.full(state.shape[1], found)  # noqa: E731
        monkeypatch.setattr(SparseLanes, "error_bounds", bounds)
        assert not solve(mechanism, "push", values).solved.any()
    bounds = lambda lanes, state, *_: np.zeros(state.shape[1])  # noqa: E731
    monkeypatch.setattr(SparseLanes, "error_bounds", bounds)
    assert solve(mechanism, "push", values).solved.all()


@pytest.mark.parametrize("uneven", [1.0, 64.0])
@pytest.mark.parametrize("mechanism", [ring(CRANKS), four_bar(SHAPES["plain"], -1.1, "hinges")])
def test_machine_code_walks_as_arrays_do(monkeypatch, mechanism, uneven):
    """With redundant rows too. The polynomial through the lanes before leaves most samples one
    iteration; behind lanes that are close together it is not used.
    """
    turn = np.linspace(0.0, 0.7, 5 * POSES - 3)
    turn[:POSES] /= uneven
    with monkeypatch.context() as changed:
        changed.delattr(SparseLanes, "attempt_at")
        walked = swept(mechanism, turn)
    monkeypatch.setattr(SparseLanes, "walk", Lanes.walk)
    found = swept(mechanism, turn)
    assert (walked.iterations == found.iterations).all()
    assert np.median(found.iterations) <= uneven
    for name, motion in found.points.items():
        assert np.abs(motion.acceleration - walked.points[name].acceleration).max() < 1e-12


def test_slopes_fall_lane_by_lane():
    rng = np.random.default_rng(6)
    slope, seen = rng.uniform(size=3), rng.uniform(size=(3, POSES)) ** 9
    _, after = falling(slope, seen)
    for k in range(POSES):
        slope = np.maximum(seen[:, k], least_slope(slope))
        np.testing.assert_array_equal(after[:, k], slope)


@pytest.mark.parametrize(("cranks", "turns", "count"), RINGS)
def test_ring_counts_turns_between_samples(cranks, turns, count):
    """A nut beside a ring, whose lead tells the turns: as one program, and as a sparse system."""
    whole, lead, last = ring(cranks), 0.01, 0.01
    joints = [
        Screw("thread", "ground", "driven", ORIGIN, Z, lead=lead),
        Translational("guide", "ground", "slide", Z, X),
    ]
    mechanism = replace(
        whole,
        bodies=[*whole.bodies, *indexing().bodies[1:]],
        joints=[*whole.joints, *joints],
        points=[Point("mark", "driven", (0.2, 0.0, 0.0))],
        drivers=[
            *whole.drivers,
            JointDisplacement("clock", "guide"),
            JointAngle("index", "thread"),
        ],
    )
    values = np.linspace(0.0, last, count)
    found = solve_all(mechanism, "clock", values, rate=last, motions={"index": indexed(turns)})
    assert ("factor_entries" in found.details) == (cranks == 22)
    assert found.points["mark"].position[-1] == pytest.approx([0.2, 0.0, lead * turns], abs=1e-14)


@pytest.mark.parametrize(
    ("large", "kind"),
    [(chain(21), component_lanes.ComponentLanes), (circle(22).mechanism, sparse_lanes.SparseLanes)],
    ids=["components", "sparse"],
)
def test_cache_keeps_last_large_mechanism(large, kind, monkeypatch):
    made = calls(monkeypatch, kind, "__init__")
    values, driver = np.linspace(-0.1, 0.2, 9), large.drivers[0].name
    first = solve(large, driver, values).points
    other = solve(large, driver, values[::2]).points
    again = solve(large, driver, values).points
    assert len(made) == 1
    for name, motion in first.items():
        np.testing.assert_array_equal(again[name].acceleration, motion.acceleration)
        # predicted from other samples: round-off, by the condition and once more for each
        # derivative
        assert np.abs(other[name].acceleration - motion.acceleration[::2]).max() <= 1e-10
    with ThreadPoolExecutor(1) as threads:
        threads.submit(solve, large, driver, values).result()
    assert len(made) == 2
