"""Why a mechanism cannot be solved, by name and by how much; what outputs depend on, against
solutions of changed mechanisms.
"""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    Screw,
    Spherical,
    Translational,
)
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.cli.main import main
from kincheck.core.joints import Kind
from kincheck.core.kinematics import NativeSolver, Ranks, kinds, places
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


def test_redundant_rows_are_sums_of_the_rows_they_repeat():
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


def test_a_hinge_out_of_line_is_named_with_the_size_of_the_contradiction():
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


def test_rods_that_are_too_long_contradict_by_what_they_are_too_long():
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


def test_what_is_left_free_is_described_body_by_body():
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


def test_a_dead_centre_at_the_design_is_told_from_a_missing_driver():
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


@pytest.mark.parametrize(
    ("name", "value"), [("mcpherson_strut", -0.08), ("rssr", 2.0), ("spatial_slider_crank", 0.7)]
)
def test_sensitivities_are_those_of_mechanisms_solved_anew(name, value):
    """Against central differences of 1e-5 m: they are off by the third derivative, 1e-10, and
    round-off, 1e-15 / 1e-5.
    """
    loaded = cases.load(name)
    case, mechanism = (
        replace(loaded, sweep=replace(loaded.sweep, values=np.array([value]))),
        loaded.mechanism,
    )
    numbers = [
        (place, k, x) for place, design in places(mechanism).items() for k, x in enumerate(design)
    ]
    h = 1e-5 * np.eye(len(numbers))
    designs = np.array([x for _, _, x in numbers])[:, None] + np.concatenate([h, -h], axis=1)
    ready = NativeSolver(order=0).prepare_designs(
        mechanism, case.sweep.path, tuple(places(mechanism)), case.points
    )
    solved = ready.solve(designs, 1e-13)
    assert solved.solved.all()
    known = {
        (each.output, each.number): each.by_sample[0]
        for each in diagnose(case, samples=1, tol=1e-12).sensitivities
    }
    checked = 0
    for output in case.outputs:
        if output.forces:
            continue
        own = [place for place, _, _ in numbers].index(f"points.{output.point}.position")
        designed = designs[own : own + 3] if output.relative else 0.0
        found = np.array(output.direction) @ (
            ready.motion(solved, output.point)[0][:, 0] - designed
        )
        differences = (found[: len(numbers)] - found[len(numbers) :]) / 2e-5
        for (place, k, _), difference in zip(numbers, differences, strict=True):
            vector = places(mechanism)[place]
            number = place if len(vector) == 1 else f"{place} {'xyz'[k]}"
            scale = np.linalg.norm(vector) if ".ax" in place else 1.0  # of directions, by the angle
            assert known.get((output.name, number), 0.0) == pytest.approx(
                scale * difference, abs=2e-8
            ), (output.name, number)
            checked += abs(difference) > 1e-3
    assert checked >= 20


@pytest.mark.parametrize("name", ["mcpherson_strut", "rssr", "chrono_multi_link"])
def test_the_budget_is_the_one_that_the_cases_were_given(name):
    loaded = cases.load(name)
    found = diagnose(loaded, samples=41, tol=1e-12)
    stated = float(re.search(r"at most ([\d.e+-]+) m", loaded.outputs[0].why)[1])
    # its two or three digits, and what the samples that are not looked at may add
    assert max(each.shift for each in found.budgets) == pytest.approx(stated, rel=0.02)
    assert all(
        99.999 * each.shift <= each.suggested <= 111.0 * each.shift for each in found.budgets
    )
    assert all(each.round_off < 1e-3 * each.shift for each in found.budgets)


def test_a_changed_axis_that_would_bind_is_flagged():
    found = diagnose(case(four_bar(), [0.0, 0.4, 0.8], "C"), samples=3, tol=1e-12)
    assert "joints.C.axis x" in found.binding  # out of parallel
    assert "joints.C.point x" not in found.binding  # another link length


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
)
def test_the_command_says_what_is_wrong_and_ends_accordingly(edit, status, said, tmp_path, capsys):
    text = (Path(cases.__file__).parent / "mcpherson_strut.toml").read_text(encoding="utf-8")
    file = tmp_path / "strut.toml"
    file.write_text(edit(text[: text.index("[reference]")]), encoding="utf-8")
    assert (
        main(["explain", str(file), "--samples", "5", "--json", str(tmp_path / "found.json")])
        == status
    )
    captured = capsys.readouterr()
    assert said in captured.out + captured.err
    if status < 2:
        found = json.loads((tmp_path / "found.json").read_text())
        assert found["schema"] == "kincheck-explain/1"
        assert bool(found["findings"]) == bool(status)


TWO = "points = [[1.115, 0.665, 0.118], [1.14, 0.355, 0.1455]]"
ONE = "point = [1.115, 0.665, 0.118]"


def test_every_case_of_the_library_is_found_sound(capsys):
    for name in ("four_bar", "bricard", "delta_robot", "mcpherson_suspension"):
        assert main(["explain", name, "--samples", "3"]) == 0
        out = capsys.readouterr().out
        assert "finding" not in out
        assert f"{name}: " in out  # what the native engine computes


def test_points_that_are_fixed_do_not_depend_on_anything_but_themselves():
    mechanism = replace(
        mcpherson(), points=[*mcpherson().points, Point("bolt", "chassis", (0.0, 0.0, 0.0))]
    )
    found = diagnose(case(mechanism, [0.01], "bolt"), samples=1, tol=1e-12)
    assert {each.number for each in found.sensitivities} == {
        f"points.bolt.position {axis}" for axis in "xyz"
    }
    assert {each.shift for each in found.budgets} == {0.0}


@pytest.mark.parametrize("length", [1.0, 0.125, 0.3])
def test_what_a_blocked_shift_asks_of_turns_is_by_the_metre(length):
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


def test_directions_are_told_by_what_they_are_not_by_their_names():
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


def test_an_over_constrained_mechanism_names_the_joints_that_free_it(capsys):
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
