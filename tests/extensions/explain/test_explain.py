"""kincheck explain: freedom, determinacy, conditions and sensitivities of a case; the command."""

import json
import re
from dataclasses import replace
from pathlib import Path

import kincheck
import kincheck.adapters
import kincheck.core
import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    Distance,
    JointAngle,
    Mechanism,
    Outcome,
    Point,
    PointCoordinate,
    Revolute,
    Screw,
    Spherical,
    Spline,
    Translational,
    cases,
)
from kincheck.adapters import engine
from kincheck.core.case.case import Output, Sweep, Truth, without_forces
from kincheck.core.case.io.case_file import case_text
from kincheck.core.case.measures import DriverEffort
from kincheck.core.case.models.files import load
from kincheck.core.case.quantity import with_markers
from kincheck.core.cli.main import main
from kincheck.core.extensions.explain.diagnose import determinacy, diagnose
from kincheck.core.extensions.explain.rank import Ranks, free_motions
from kincheck.core.extensions.explain.text import _directions, _forces
from kincheck.core.harness.native_engine import explain
from kincheck.core.harness.results_file import read_results
from kincheck.core.harness.run import run
from kincheck.core.joints import Kind
from kincheck.core.kinematics import NativeSolver, kinds
from kincheck.core.mechanism.loads import TorsionSpringDamper
from kincheck.core.report.terminal import console

from ...support.examples import examples
from ...support.fakes import swept
from ...support.mechanisms import ORIGIN, four_bar, mcpherson, slider_crank

(DIRECTIONS,) = examples(__file__, "directions")


def totals(lines):
    """Operations with one iteration, by order."""
    return [
        int(re.search(r": (\d+) with one iteration", line)[1])
        for line in lines
        if "iteration" in line
    ]


def test_program_account_names_uncomputed_parts():
    case = cases.load("mcpherson_strut")
    mechanism = replace(
        case.mechanism, points=[*case.mechanism.points, Point("unread", "lca", (1.0, 0.5, 0.0))]
    )
    lines = explain(replace(case, mechanism=mechanism))
    assert lines[0] == "mcpherson_strut: 18 unknowns for lca, knuckle, strut"
    assert "  fixed, in no program: chassis, rack" in lines
    assert "  rows solved: 18; redundant rows, only checked: none" in lines
    assert "  points computed: wheel_center; read by no output, not computed: unread" in lines
    positions, velocities, accelerations = totals(lines)
    assert positions < velocities < accelerations
    # the unread point cost nothing
    assert totals(explain(case)) == [positions, velocities, accelerations]


def test_program_account_names_redundant_rows():
    (line,) = (line for line in explain(cases.load("four_bar")) if "redundant" in line)
    assert line.count(":") == 5  # three rows, each JOINT: PRIMITIVE
    assert "none" not in line


def test_run_explain_prints_program_account(capsys):
    assert main("run rssr --engine native --explain".split()) == 0
    assert "rssr: 12 unknowns for crank, rocker" in capsys.readouterr().out
    assert main("run rssr --engine native --explain --json -".split()) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("{")
    assert "12 unknowns" in captured.err


def test_joints_between_fixed_bodies_are_skipped(tmp_path, capsys):
    """As a CAD export has them. What is written is read as the same case."""
    case = cases.load("mcpherson_strut")
    case = swept(case, np.linspace(-0.05, 0.05, 3))
    bolts = [
        Revolute("bolt", "chassis", "rack", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        Distance("stay", "ground", "chassis", (ORIGIN, (0, 0, 1))),
    ]
    file = tmp_path / "strut.toml"
    bolted = replace(case.mechanism, joints=[*bolts, *case.mechanism.joints])
    file.write_text(case_text(replace(case, mechanism=bolted)))
    assert load(file).mechanism == bolted
    assert main(f"run {file} --explain --jobs 0 --json {tmp_path / 'out.json'}".split()) == 0
    assert (
        "  joints between fixed bodies, satisfied at design, left out: bolt, stay"
        in capsys.readouterr().out.splitlines()
    )
    for record in read_results(tmp_path / "out.json").records:
        assert record.outcome in (Outcome.PASS, Outcome.UNJUDGED, Outcome.UNAVAILABLE), (
            record.message
        )


# Why a mechanism cannot be solved, by name and by how much


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


def test_redundant_rows_are_weighted_sums():
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


def test_contradiction_of_long_rods_by_length():
    """Two rods of 1.001 m push a slider from both sides, 1 m away: it stays where it is and each is
    off by 1 mm.
    """
    rods = [
        Distance(name, "ground", "slider", ((x, 0.0, 0.0), ORIGIN), 1.001)
        for name, x in (("left", -1.0), ("right", 1.0))
    ]
    pushed = Mechanism(
        "pushed", [Body("slider")], [Translational("guide", "ground", "slider", ORIGIN, X), *rods]
    )
    found = Ranks(pushed).contradictions
    assert {each.row.owner for each in found} == {"left", "right"}
    # (d d - L L) / 2L
    assert [abs(each.amount) for each in found] == pytest.approx([1e-3, 1e-3], rel=1e-3)
    moved = with_joint(pushed, "right", length=0.999)  # now both are met, 1 mm to the right
    assert Ranks(moved).contradictions == []


def test_coupled_joint_begins_elsewhere():
    hinges = [Revolute(x, "ground", x, X, X) for x in "ab"]
    knee = Spline("knee", ("b", "a"), ((-1.0, -1.0), (1.0, 1.2)))
    coupled = Mechanism("m", [*map(Body, "ab")], hinges, couplers=[knee])
    assert Ranks(coupled).contradictions == []


def test_free_motion_is_described_by_body():
    rod = Mechanism(
        "rod",
        [Body("a"), Body("rod"), Body("b")],
        [
            Revolute("p", "ground", "a", ORIGIN, Z),
            Spherical("s", "a", "rod", X),
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


def test_free_motion_about_instantaneous_centre():
    """Where crank and rocker, drawn longer, meet: (0.3, 0.4) s = (1.4, 0) + (0.2, 1.2) t at s =
    6.
    """
    (motion,) = Ranks(replace(four_bar(), drivers=[])).free
    (coupler,) = (screw for screw in motion if screw.body == "coupler")
    assert coupler.through[0] == pytest.approx(1.8)
    assert coupler.through[2] == pytest.approx(2.4)
    assert np.abs(coupler.axis) == pytest.approx(Y)


def test_free_motion_of_nut_has_lead():
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


def test_separate_mechanisms_are_two_components():
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


def test_conditioning_names_worst_sample_and_motion():
    """Near the limit of its stroke the strut's driver loses its hold of the motion that its other
    rows allow.
    """
    loaded = cases.load("mcpherson_strut")
    found = diagnose(swept(loaded, np.linspace(0.0, 0.293, 30)), samples=30, tol=1e-12)
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
        [Revolute("hinge", "ground", "arm", ORIGIN, Z)],
        [Point("tip", "arm", (length, 0.0, 0.0))],
        [PointCoordinate("z", "tip", Z)],
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
    output = Output("y", "tip", Y, False, 1e-9, 0.0, "test")
    case = Case("arm", "test", Truth.CONSENSUS_ONLY, arm, Sweep("turn", np.array([0.5])), (output,))
    found = {
        each.number: (each.unit, each.by_sample[0])
        for each in diagnose(case, samples=1, tol=1e-12).sensitivities
    }
    # the tip, in the arm, is its place at design less the point's: it turns about the point
    assert found["joints.rear.axis.point x"] == ("m/m", pytest.approx(-np.sin(0.5)))


def test_unreached_motion_lacks_spring_torque():
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


# The command diagnose: what it says, and its exit statuses


@pytest.mark.parametrize(
    ("edit", "status", "said"),
    [
        (lambda text: text, 0, "suggested"),
        (
            lambda text: text.replace("stop = 0.08", "stop = 0.4"),
            1,
            "finding: cannot be followed beyond stroke = 0.29333",
        ),
        (
            lambda text: text.replace('type = "distance"', 'type = "spherical"').replace(TWO, ONE),
            1,
            "cannot move what it drives",
        ),
        (
            lambda text: text[: text.index("[joints.tie_rod]")] + text[text.index("[points.") :],
            1,
            "1 motion is left free",
        ),
        (lambda text: text.replace("[1.0, 0.55, 0.6]", "[1.0, 0.55]"), 2, "bodies.strut.origin"),
    ],
    ids=["sound", "end of stroke", "over-constrained", "free", "bad file"],
)
def test_explain_status_follows_findings(edit, status, said, tmp_path, capsys):
    text = (Path(cases.__file__).parent / "mcpherson_strut.toml").read_text(encoding="utf-8")
    file = tmp_path / "strut.toml"
    file.write_text(edit(text[: text.index("[reference]")]), encoding="utf-8")
    assert main(f"explain {file} --samples 5 --json {tmp_path / 'found.json'}".split()) == status
    captured = capsys.readouterr()
    assert said in captured.out + captured.err
    if status < 2:
        found = json.loads((tmp_path / "found.json").read_text())
        assert found["schema"] == "kincheck-explain/1"
        assert bool(found["findings"]) == bool(status)


TWO = "points = [[1.115, 0.665, 0.118], [1.14, 0.355, 0.1455]]"
ONE = "point = [1.115, 0.665, 0.118]"


@pytest.mark.nightly
def test_explain_finds_library_cases_sound(capsys):
    for name in ("four_bar", "bricard", "delta_robot", "mcpherson_suspension"):
        assert main(["explain", name, "--samples", "3"]) == 0
        out = capsys.readouterr().out
        assert "finding" not in out
        assert f"{name}: " in out  # what the native engine computes


def test_over_constraint_names_freeing_joints(capsys):
    rssr = cases.load("rssr")
    tip = (2.0, 4.9257889538274894, 2.2330703487241702)
    brace = Distance("brace", "ground", "rocker", points=((1.0, 3.0, 0.0), tip))
    mechanism = replace(rssr.mechanism, joints=[*rssr.mechanism.joints, brace])
    found = diagnose(replace(rssr, mechanism=mechanism), samples=1, tol=1e-12)
    assert found.freeing == ["rod", "brace"]
    assert found.verdict == (
        "over-constrained, a driver cannot move: 0 degrees of freedom, 1 driver; it moves without"
        " 'rod' or 'brace'"
    )
    assert "take out 'rod' or 'brace'" in found.findings[0]
    assert main(["explain", "-q", "rssr"]) == 0
    (verdict,) = capsys.readouterr().out.splitlines()
    assert verdict.startswith("rssr: it can be solved: 1 degree of freedom, 1 driver, 0 redundant")


# Determinacy in explain: what redundant rows leave undetermined, without masses too


def found(name, *, massless=False, asked=False):
    """The determinacy of a built-in case, by a few samples."""
    case = cases.load(name)
    case = case if asked else without_forces(case)
    mechanism = case.mechanism
    if massless:
        bare = [Body(b.name, b.origin, b.euler_parameters, b.fixed) for b in mechanism.bodies]
        mechanism = replace(mechanism, bodies=bare, forces=())
    sweep = replace(case.sweep, values=case.sweep.values[[1, 20]])
    case = replace(case, mechanism=mechanism, sweep=sweep)
    names = tuple(body.name for body in mechanism.moving)
    return determinacy(case, NativeSolver().prepare(mechanism, sweep.path, bodies=names)(1e-12))


@pytest.mark.parametrize(("name", "expected"), DIRECTIONS)
def test_reaction_directions_are_counted_by_joint(name, expected):
    """The numbers are those of forces.md of the study."""
    made = found(name, massless=True)
    assert made.joints == len(made.partly) > 3
    assert {(each.force, each.moment, each.wrench) for each in made.partly} == {tuple(expected)}
    assert made.efforts == []
    assert "4 of 4" in str(made) or name == "bricard"


def test_reactions_without_redundant_rows_are_determined():
    made = found("rssr", massless=True)
    assert made.partly == []
    assert str(made) == "all reactions and efforts are determined"


def test_determinacy_covers_joints_of_outputs():
    whole, asked = found("four_bar"), found("four_bar", asked=True)
    (pin,) = asked.partly
    assert asked.joints == 1
    assert pin in whole.partly


def test_undetermined_directions_of_planar_four_bar():
    (pin, *_) = found("four_bar").partly
    normal = np.array(cases.load("four_bar").mechanism.joint(pin.joint).axis)
    normal /= np.linalg.norm(normal)
    assert np.abs(np.array(pin.force_along) @ normal).max() < 1e-12
    assert abs(abs(np.array(pin.moment_along[0]) @ normal) - 1.0) < 1e-12


def test_determinacy_table_names_directions(capsys):
    import sys

    page = console(sys.stdout)
    for each in _forces(found("four_bar")):
        page.print(each)
    out = capsys.readouterr().out
    assert "redundant rows leave 4 of 4 reactions not wholly determined" in out
    assert "2 of 3" in out
    assert "all across [" in out
    assert _directions([]) == "none"
    assert _directions(np.eye(3).tolist()) == "all"
    assert _directions([[0.0, 0.0, -1.0]]) == "[0, 0, 1]"
    assert _directions([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) == "all across [0, 0, 1]"


def test_free_motions_are_reported_separately():
    """Three motions of two columns each, in a null space whose orthonormal basis mixes them."""
    rng = np.random.default_rng(7)
    apart = np.kron(np.eye(3), [[1.0, -1.0]])  # each row ties two columns together
    found = free_motions(rng.normal(size=(3, 3)) @ apart)
    assert found.shape == (3, 6)
    assert np.abs(apart @ found.T).max() <= 1e-14
    assert ((np.abs(found) > 1e-12).sum(axis=1) == 2).all()


def test_explain_of_built_in_case():
    found = kincheck.explain("rssr", samples=3)
    assert len(found.samples) == 3
    assert not found.findings
