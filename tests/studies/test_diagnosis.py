"""Why a mechanism cannot be solved, by name and by how much."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.adapters import engine
from kincheck.core import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    OrientationLock,
    Point,
    PointCoordinate,
    Revolute,
    Screw,
    Spherical,
    Translational,
    solve,
)
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.case.measures import DriverEffort
from kincheck.core.case.quantity import with_markers
from kincheck.core.cli.joint_loading import load_joint
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run
from kincheck.core.joints import Kind
from kincheck.core.kinematics import Ranks, kinds
from kincheck.core.mechanism.loads import TorsionSpringDamper
from kincheck.core.studies.diagnosis import diagnose

from ..support.mechanisms import four_bar, mcpherson, slider_crank

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def case(mechanism, values, point=None):
    outputs = [
        Output(axis, point, d, False, 1e-9, 0.0, "made up")
        for axis, d in zip("xyz", (X, Y, Z), strict=True)
        if point
    ]
    driver = mechanism.drivers[0].name if mechanism.drivers else "none"
    return Case(
        mechanism.name,
        "made up",
        Truth.CONSENSUS_ONLY,
        mechanism,
        Sweep(driver, np.array(values)),
        tuple(outputs),
    )


def with_joint(mechanism, name, **changes):
    """The mechanism with fields of one joint changed."""
    return replace(
        mechanism,
        joints=[
            replace(each, **changes) if each.name == name else each for each in mechanism.joints
        ],
    )


def test_redundant_rows_are_sums_of_others():
    ranks = Ranks(four_bar())
    assert len(ranks.dependencies) == ranks.account.rows - ranks.account.rank == 3
    rows = list(map(str, ranks.rows))
    assert len(set(rows)) == len(rows)  # each has a name of its own
    for each in ranks.dependencies:
        total = sum(weight * ranks.matrix[rows.index(str(row))] for weight, row in each.repeats)
        assert np.abs(total - ranks.matrix[rows.index(str(each.row))]).max() <= 1e-14
    # of one of the coupler's hinges, not of those on the ground: C's would do as well, and the
    # first of equals is left out
    assert [str(each.row) for each in ranks.dependencies] == [
        f"B: {x}" for x in ("Spherical (along y)", "Dot11 (about z)", "Dot11 (about x)")
    ]
    parallel = ranks.dependencies[-1]
    assert {row.holds for _, row in parallel.repeats} == {"about x"}
    assert {parallel.row.owner, *(row.owner for _, row in parallel.repeats)} == {"A", "B", "C", "D"}


def test_hinge_out_of_line_is_named():
    tilt = 1e-6
    found = diagnose(
        case(with_joint(four_bar(), "C", axis=(tilt, 1.0, 0.0)), [0.0, 0.1]), samples=3, tol=1e-12
    )
    assert found.freedom.dof == 0
    (finding,) = found.findings
    assert "driver 'turn' cannot move" in finding
    assert "exactly parallel" in finding
    (blocked,) = found.blocked
    assert blocked.rows[0].row.owner == "C"
    assert tilt / 100.0 < abs(blocked.rows[0].amount) < tilt
    (nearly,) = found.nearly_redundant
    assert tilt / 100.0 < nearly.size < tilt
    assert diagnose(case(four_bar(), [0.0, 0.1]), samples=3, tol=1e-12).findings == []


def test_long_rods_contradict_by_excess_length():
    """Two rods of 1.001 m push a slider from both sides, 1 m away: it stays where it is and each is
    off by 1 mm.
    """
    rods = [
        Distance(name, "ground", "slider", ((x, 0.0, 0.0), (0.0, 0.0, 0.0)), 1.001)
        for name, x in (("left", -1.0), ("right", 1.0))
    ]
    pushed = Mechanism(
        "pushed",
        [Body("slider")],
        [Translational("guide", "ground", "slider", (0.0, 0.0, 0.0), X), *rods],
    )
    found = Ranks(pushed).contradictions
    assert {each.row.owner for each in found} == {"left", "right"}
    # (d d - L L) / 2L
    assert [abs(each.amount) for each in found] == pytest.approx([1e-3, 1e-3], rel=1e-3)
    moved = with_joint(pushed, "right", length=0.999)  # now both are met, 1 mm to the right
    assert Ranks(moved).contradictions == []


def test_free_motion_is_described_by_body():
    rod = Mechanism(
        "rod",
        [Body("a"), Body("rod"), Body("b")],
        [
            Revolute("p", "ground", "a", (0.0, 0.0, 0.0), Z),
            Spherical("s", "a", "rod", (1.0, 0.0, 0.0)),
            Spherical("t", "rod", "b", (1.0, 2.0, 0.0)),
            Revolute("q", "ground", "b", (3.0, 0.0, 0.0), (0.0, 1.0, 1.0)),
        ],
        drivers=[JointAngle("turn", "p")],
    )
    ((spin,),) = Ranks(rod).free  # the rod alone
    assert (spin.body, spin.axis, spin.shift) == ("rod", pytest.approx(Y), 0.0)
    assert spin.through[0] == pytest.approx(1.0)
    (finding,) = diagnose(case(rod, [0.0]), samples=1, tol=1e-12).findings
    assert finding.startswith(
        "1 motion is left free with the drivers held: 'rod' turns about (0, 1, 0) through (1, "
    )


def test_a_link_turns_about_its_instantaneous_centre():
    """Where crank and rocker, drawn longer, meet: (0.3, 0.4) s = (1.4, 0) + (0.2, 1.2) t at s =
    6.
    """
    (motion,) = Ranks(replace(four_bar(), drivers=[])).free
    (coupler,) = (screw for screw in motion if screw.body == "coupler")
    assert coupler.through[0] == pytest.approx(1.8)
    assert coupler.through[2] == pytest.approx(2.4)
    assert np.abs(coupler.axis) == pytest.approx(Y)


def test_a_nut_that_nothing_holds_screws_by_its_lead():
    nut = Mechanism(
        "nut", [Body("nut")], [Screw("thread", "ground", "nut", (0.5, 0.0, 0.0), Z, lead=0.3)]
    )
    ((screw,),) = Ranks(nut).free
    assert screw.axis == pytest.approx(Z)
    assert screw.through[:2] == pytest.approx((0.5, 0.0))
    assert screw.shift / screw.turn == pytest.approx(0.3 / (2.0 * np.pi))


def test_dead_centre_at_design_is_diagnosed():
    """Stretched out, the slider of a slider-crank cannot be driven: the crank turns without it."""
    stretched = replace(slider_crank(), drivers=[PointCoordinate("push", "end", X)])
    found = diagnose(case(stretched, [0.0]), samples=1, tol=1e-12)
    assert found.freedom.dof == 1
    assert any(
        "lock-up or dead centre" in finding and "'crank' turns about (0, 1, 0)" in finding
        for finding in found.findings
    )
    assert any("driver 'push' cannot move" in finding for finding in found.findings)


def test_two_mechanisms_in_one_are_two_components():
    one, other = mcpherson(), slider_crank()
    both = Mechanism(
        "both",
        [*one.bodies, *other.bodies],
        [*one.joints, *other.joints],
        [*one.points, *other.points],
        [*one.drivers, *other.drivers],
    )
    first, second = Ranks(both).components
    assert first.bodies == ("lca", "knuckle", "strut")
    assert (first.unknowns, first.rows, first.rank, first.dof, first.drivers) == (
        18,
        17,
        17,
        1,
        ("stroke",),
    )
    assert (second.bodies, second.dof, second.drivers) == (("crank", "slider"), 1, ("turn",))


def test_conditioning_finds_the_worst_sample_and_its_motion():
    """Near the limit of its stroke the strut's driver loses its hold of the motion that its other
    rows allow.
    """
    loaded = cases.load("mcpherson_strut")
    found = diagnose(
        replace(loaded, sweep=replace(loaded.sweep, values=np.linspace(0.0, 0.293, 30))),
        samples=30,
        tol=1e-12,
    )
    assert found.worst is found.samples[-1]
    assert found.worst.smallest < 0.2 * found.samples[0].smallest
    assert found.worst.condition == pytest.approx(found.worst.largest / found.worst.smallest)
    assert {screw.body for screw in found.worst.direction} == {"lca", "knuckle", "strut"}
    assert {each.orientation for each in found.samples} == {1.0}


@pytest.mark.parametrize("length", [1.0, 0.125, 0.3])
def test_blocked_shift_weights_turns_by_length(length):
    """A point on an arm, driven across the plane it moves in: the hinge would have to turn about
    the axes of that plane.
    """
    arm = Mechanism(
        "arm",
        [Body("arm")],
        [Revolute("hinge", "ground", "arm", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))],
        [Point("tip", "arm", (length, 0.0, 0.0))],
        [PointCoordinate("z", "tip", (0.0, 0.0, 1.0))],
    )
    (blocked,) = Ranks(arm).blocked
    # the least motion: v + w L = 1, weighted by the frame's unit u of length, is w u = L/u / (1 +
    # (L/u)^2)
    part = length / Ranks(arm).frame.unit
    turn = part / (1.0 + part**2) / Ranks(arm).frame.unit
    about = [each.amount for each in blocked.rows if "about" in each.row.holds]
    assert np.abs(about) == pytest.approx([turn])


def test_direction_kind_ignores_joint_name():
    """A joint may be called as a field is."""
    joints = [Revolute("rear.axis", "ground", "arm", (3.0, 4.0, 0.0), (0.0, 0.0, 2.0))]
    points = [Point("tip", "arm", (4.0, 4.0, 0.0))]
    arm = Mechanism("arm", [Body("arm")], joints, points, [JointAngle("turn", "rear.axis")])
    assert [place for place, kind in kinds(arm).items() if kind is Kind.DIRECTION] == [
        "joints.rear.axis.axis"
    ]
    output = Output("y", "tip", (0.0, 1.0, 0.0), False, 1e-9, 0.0, "test")
    case = Case("arm", "test", Truth.CONSENSUS_ONLY, arm, Sweep("turn", np.array([0.5])), (output,))
    found = {
        each.number: (each.unit, each.by_sample[0])
        for each in diagnose(case, samples=1, tol=1e-12).sensitivities
    }
    # the tip, in the arm, is its place at design less the point's: it turns about the point
    assert found["joints.rear.axis.point x"] == ("m/m", pytest.approx(-np.sin(0.5)))


def test_spring_torque_of_unreached_motion_is_missing():
    """A rocker far beyond its dead centres: how far the spring's joint turned is not known."""
    spring = TorsionSpringDamper("spring", "B", 2.0, 0.1)
    rocker = [JointAngle("rock", "D")]
    bodies = [replace(body, mass=1.0) for body in four_bar().bodies]
    mechanism = replace(four_bar(), bodies=bodies, drivers=rocker, forces=[spring])
    of = case(mechanism, [2.5, 2.6, 2.7], "C")
    outputs = (*of.outputs, DriverEffort("effort", 1e-9, 0.0, "made up", "rock"))
    of = replace(of, outputs=outputs, mechanism=with_markers(mechanism, outputs))
    (record,) = run([of], [engine("native")], tol=1e-12).records
    assert record.outcome is Outcome.FAIL
    assert record.message.startswith("0 of 3 samples solved: cannot be followed beyond rock = ")
    assert record.outputs["effort"].position == [None] * 3
    assert diagnose(of, samples=41, tol=1e-12).samples == []


@pytest.mark.usefixtures("in_folder", "own_joint_types")
def test_joint_of_its_residual_alone_is_solved_and_explained():
    """A marble in a bowl: z = x^2 / (2 R), so z' = x / R, z'' = 1 / R, and dz / dR = -z / R."""
    bowl = load_joint("bowl:Bowl")("bowl", "ground", "marble", (0.0, 0.0, 0.0), Z, 0.4)
    marble = Mechanism(
        "marble",
        [Body("marble")],
        [bowl, OrientationLock("upright", "ground", "marble")],
        [Point("centre", "marble", (0.0, 0.0, 0.0))],
        [PointCoordinate("along", "centre", X), PointCoordinate("across", "centre", Y)],
    )
    x = np.linspace(-0.2, 0.2, 5)
    found = solve(marble, "along", x).points["centre"]
    assert found.position[:, 2] == pytest.approx(x * x / 0.8, abs=1e-15)
    assert found.velocity[:, 2] == pytest.approx(x / 0.4, abs=1e-14)
    assert found.acceleration[:, 2] == pytest.approx(1.0 / 0.4, abs=1e-13)
    explained = diagnose(case(marble, x, "centre"), samples=3, tol=1e-12)
    slope = next(
        each
        for each in explained.sensitivities
        if each.output == "z" and each.number == "joints.bowl.radius"
    )
    assert slope.by_sample[0] == pytest.approx(-0.05 / 0.4)
