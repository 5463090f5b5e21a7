"""Written models, read by their simulators alone: they close at the design and elsewhere, and move
as the mechanism does.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from kincheck import adapters
from kincheck.adapters.shared.start_pose import at_start
from kincheck.core import (
    GROUND,
    Body,
    ConstantVelocity,
    Cylindrical,
    Distance,
    Gear,
    JointAngle,
    KincheckError,
    Mechanism,
    Point,
    Polynomial,
    RackPinion,
    Revolute,
    Screw,
    SolveError,
    Spherical,
    Translational,
    Universal,
)
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.model_writer import way_to
from kincheck.core.case.joint_probe import probes
from kincheck.core.cli import main
from kincheck.core.cli.export import FORMATS
from kincheck.core.mechanism.topology import Branch, SpanningTree, spanning_tree

from ..joints.test_planar_drive import ladder
from ..oracles import naive
from ..support.exported import READERS, read
from ..support.mechanisms import four_bar, mcpherson, slider_crank, swapped

# Roundings of numbers of a few metres: some twenty of 2.2e-16 each, through a chain of ten bodies
# at most.
ROUND_OFF = 5e-15

Z = (0.0, 0.0, 1.0)


def case(mechanism, stop):
    return Case(
        mechanism.name,
        "made up",
        Truth.CONSENSUS_ONLY,
        mechanism,
        Sweep(mechanism.drivers[0].name, np.array([stop])),
        (),
    )


def rssr():
    """With the rod as a body that cannot spin: the cross at its end is rounded off the right angle,
    as tables do.
    """
    ends = ((1.0, 0.0, 0.0), (2.0, 4.9, 2.2))
    rod = np.subtract(ends[1], ends[0])
    across = np.cross(rod, (0.3, -0.2, 1.0))
    return Mechanism(
        "rssr",
        [
            Body("crank", (0.2, 0.1, 0.0), (0.8, 0.0, 0.6, 0.0)),
            Body("rod", ends[0], (0.5, 0.5, -0.5, 0.5)),
            Body("rocker", ends[1]),
        ],
        [
            Revolute("input", "ground", "crank", (0.0, 0.0, 0.0), Z),
            Revolute("output", "ground", "rocker", (2.0, 1.0, 3.0), (1.0, 0.0, 0.0)),
            Spherical("ball", "crank", "rod", ends[0]),
            Universal(
                "cross",
                "rocker",
                "rod",
                ends[1],
                (tuple(np.round(across, 1)), tuple(np.cross(rod, across))),
            ),
        ],
        [Point("end", "rocker", ends[1])],
        [JointAngle("turn", "input")],
    )


def gear_train():
    """Turned several times: a pinion on a screw, whose nut is kept from turning, with a rack and a
    further wheel.
    """
    return Mechanism(
        "gear_train",
        [
            Body("bed", fixed=True, origin=(0.0, 0.5, 0.0)),
            Body("pinion"),
            Body("rack"),
            Body("nut", (0.1, 0.2, 0.3)),
            Body("wheel"),
        ],
        [
            Revolute("shaft", "ground", "pinion", (0.0, 0.0, 0.0), Z),
            Translational("guide", "rack", "bed", (0.0, 0.1, 0.0), (1.0, 0.0, 0.0)),
            Translational("key", "ground", "nut", (0.3, 0.0, 0.5), Z),
            Screw("thread", "nut", "pinion", (0.0, 0.0, 0.5), Z, 0.01),
            Cylindrical("bearing", "wheel", "bed", (0.7, 0.0, 0.2), Z),
            Distance("stop", "wheel", "bed", ((0.7, 0.0, 0.2), (0.7, 0.0, 1.2))),
        ],
        [Point("rim", "wheel", (1.0, 0.0, 0.2)), Point("edge", "nut", (0.2, 0.0, 0.5))],
        [JointAngle("turn", "shaft")],
        [RackPinion("mesh", ("shaft", "guide"), 0.02), Gear("pair", ("shaft", "bearing"), -1.7)],
    )


def shafts():
    """Two shafts, the bearing of one of them long, joined by a constant-velocity joint that closes
    the loop.
    """
    across = (0.2, 0.3, 1.0)
    return Mechanism(
        "shafts",
        [Body("first", (0.1, 0.2, 0.0), (0.6, 0.0, 0.0, 0.8)), Body("second")],
        [
            Revolute("left", "ground", "first", (0.0, 0.0, -0.5), Z),
            Revolute("right", "second", "ground", tuple(np.multiply(0.3, across)), across),
            ConstantVelocity("joint", "first", "second", (0.0, 0.0, 0.0), (Z, across)),
        ],
        [Point("mark", "second", (0.1, 0.0, 0.3))],
        [JointAngle("turn", "left")],
    )


def coupled_loop():
    """Two four-bars whose coupled joints close their loops, so that their coordinates are not those
    of a tree.
    """
    one = four_bar()
    names = {body.name: f"{body.name}_2" for body in one.bodies} | {"ground": "ground"}
    other = [
        replace(joint, name=f"{joint.name}2", i=names[joint.i], j=names[joint.j])
        for joint in one.joints
    ]
    bodies = [*one.bodies, *(replace(body, name=names[body.name]) for body in one.bodies)]
    couplers = [Gear(f"pair_{joint}", (joint, f"{joint}2"), 1.0) for joint in "ABCD"][:1]
    every = [Gear(f"again_{joint}", (joint, f"{joint}2"), 1.0) for joint in "BCD"]
    return replace(
        one,
        name="coupled_loop",
        bodies=bodies,
        joints=[*one.joints, *other],
        couplers=[*couplers, *every],
    )


CASES = {
    each.name: each
    for each in (
        case(mcpherson(), 0.08),
        case(replace(swapped(mcpherson()), name="strut_swapped"), -0.05),
        case(four_bar(), -2.0),
        case(slider_crank(), 15.0),
        case(rssr(), 2.5),
        case(gear_train(), 150.0),
        case(coupled_loop(), 5.0),
        case(shafts(), 3.0),
        case(ladder(("ladder", "ground"), Z), 8.0),
        *probes(),
    )
}


@cache
def way(name, elsewhere):
    each = CASES[name]
    return way_to(each, float(each.sweep.values[-1]) if elsewhere else 0.0)


def reading(to, name, folder, elsewhere=True):
    mechanism, path = CASES[name].mechanism, way(name, elsewhere)
    return read(to, adapters.writer(to)(mechanism, path, {}), mechanism, folder), path


def assert_read(found, mechanism, path, elsewhere):
    """It closes, is as free as it has drivers (so nothing is missing that would have to close), and
    is where it should be.
    """
    assert np.abs(found.residuals).max(initial=0.0) <= ROUND_OFF * (10.0 if elsewhere else 1.0)
    assert found.freedom == len(mechanism.drivers)
    for body in mechanism.moving:
        r, A = found.bodies[body.name]
        assert np.abs(r - path[body.name].r[-1]).max() <= 10.0 * ROUND_OFF
        assert np.abs(A - naive.A(path[body.name].p[-1])).max() <= 10.0 * ROUND_OFF
    for point in mechanism.points:
        expected = naive.Body(path[point.body].r[-1], path[point.body].p[-1])
        start = naive.Body(
            np.array(mechanism.body(point.body).origin),
            np.array(mechanism.body(point.body).euler_parameters),
        )
        arm = start.A.T @ (np.array(point.position) - start.r)
        assert (
            np.abs(found.points[point.name] - (expected.r + expected.A @ arm)).max()
            <= 10.0 * ROUND_OFF
        )


NO_POLYNOMIAL = {"exudyn": "Exudyn", "sdf": "SDF"}


@pytest.mark.parametrize("elsewhere", [False, True], ids=["design", "elsewhere"])
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("to", READERS)
def test_a_written_model_closes_where_the_native_engine_says(to, name, elsewhere, tmp_path):
    if name == "polynomial" and to in NO_POLYNOMIAL:
        with pytest.raises(KincheckError, match=f"has no counterpart in {NO_POLYNOMIAL[to]}"):
            reading(to, name, tmp_path, elsewhere)
        return
    found, path = reading(to, name, tmp_path, elsewhere)
    assert_read(found, CASES[name].mechanism, path, elsewhere)


def test_polynomials_count_from_the_start():
    """With y = x + 0.2 x^2, and x = 0.5 at the start."""
    hinges = [
        Revolute(name, "ground", name.upper(), (k, 0.0, 0.0), Z) for k, name in enumerate("ab")
    ]
    cam = Polynomial("cam", ("b", "a"), (0.0, 1.0, 0.2))
    bodies, turn = [Body("A"), Body("B", (1.0, 0.0, 0.0))], JointAngle("turn", "a")
    mechanism = Mechanism("cams", bodies, hinges, [], [turn], [cam])
    (moved,) = at_start(mechanism, way_to(case(mechanism, 0.5), 0.5)).couplers
    np.testing.assert_allclose(moved.coefficients, [0.0, 1.2, 0.2], rtol=0.0, atol=1e-15)


def cut_elsewhere(mechanism):
    """The tree without the joint that is probed: what it carried is free, and it closes the
    loop.
    """
    tree = spanning_tree(mechanism)
    tested = [
        joint
        for joint in mechanism.joints
        if joint.name in ("tested", "second") and joint not in tree.cut
    ]
    branches = [
        Branch(GROUND, each.child, None) if each.joint in tested else each for each in tree.branches
    ]
    return SpanningTree(tuple(branches), (*tree.cut, *tested))


@pytest.mark.parametrize("name", [each.name for each in probes()])
@pytest.mark.parametrize("to", ["mjcf", "urdf", "sdf", "osim"])
def test_a_joint_closes_a_loop_as_it_carries_a_body(to, name, tmp_path, monkeypatch):
    if name == "polynomial" and to in NO_POLYNOMIAL:
        return  # refused above
    module = "hung_tree" if to in ("sdf", "osim") else to
    monkeypatch.setattr(f"kincheck.adapters.writers.{module}.spanning_tree", cut_elsewhere)
    found, path = reading(to, name, tmp_path)
    assert_read(found, CASES[name].mechanism, path, True)


def test_the_cases_move_and_count_turns():
    for name in CASES:
        assert (
            max(
                np.abs(motion.r[-1] - motion.r[0]).max() + np.abs(motion.p[-1] - motion.p[0]).max()
                for motion in way(name, True).values()
            )
            > 0.01
        )
    # 150 rad of 0.01 m a turn
    assert abs(way("gear_train", True)["nut"].r[-1, 2] - 0.3 + 1.5 / (2.0 * np.pi)) <= 1e-14


@pytest.mark.parametrize("to", READERS)
def test_a_start_of_another_mechanism_is_seen(to, tmp_path):
    """The tie rod a millimetre longer than where the poses are from."""
    mechanism = mcpherson()
    rod = mechanism.joint("tie_rod")
    longer = replace(
        mechanism, joints=[*mechanism.joints[:-1], replace(rod, length=rod.design_distance + 1e-3)]
    )
    texts = adapters.writer(to)(longer, way("mcpherson", True), {})
    found = read(to, texts, longer, tmp_path)
    assert np.linalg.norm(found.residuals) == pytest.approx(1e-3, abs=1e-14)


@pytest.mark.parametrize("to", adapters.WRITERS)
def test_a_joint_without_counterpart_is_named(to):
    class Mine(Spherical):
        pass

    mechanism = mcpherson()
    mine = replace(
        mechanism,
        joints=[
            Mine(*vars(each).values()) if each.name == "ball" else each for each in mechanism.joints
        ],
    )
    with pytest.raises(KincheckError, match=r"joint 'ball' \(spherical\) has no counterpart in"):
        adapters.writer(to)(mine, way("mcpherson", False), {})


def test_names_that_a_format_keeps_or_needs_twice_are_refused():
    mechanism, path = slider_crank(), dict(way("slider_crank", False))
    world = replace(
        mechanism,
        bodies=[
            replace(body, name=body.name.replace("crank", "world")) for body in mechanism.bodies
        ],
        joints=[
            replace(each, i=each.i.replace("crank", "world"), j=each.j.replace("crank", "world"))
            for each in mechanism.joints
        ],
        points=[
            replace(each, body=each.body.replace("crank", "world")) for each in mechanism.points
        ],
    )
    with pytest.raises(KincheckError, match="'world' is taken"):
        adapters.writer("mjcf")(world, path | {"world": path["crank"]}, {})
    twice = replace(
        mechanism, points=[*mechanism.points, Point("rod.first", "crank", (0.0, 0.0, 0.0))]
    )
    with pytest.raises(KincheckError, match=r"'rod\.first' is taken"):
        adapters.writer("mjcf")(twice, path, {})


def test_names_with_blanks_are_read_by_simulators_that_have_none(tmp_path):
    """OpenSim ends the process at a name with a blank."""
    one = slider_crank()
    names = {"crank": "left crank", "rod": "rod/2"}
    other = replace(
        one,
        bodies=[replace(body, name=names.get(body.name, body.name)) for body in one.bodies],
        joints=[
            replace(each, i=names.get(each.i, each.i), j=names.get(each.j, each.j))
            for each in one.joints
        ],
        points=[replace(each, body=names.get(each.body, each.body)) for each in one.points],
    )
    path = {names.get(name, name): motion for name, motion in way("slider_crank", True).items()}
    for to in ("osim", "sdf"):
        found = read(to, adapters.writer(to)(other, path, {}), other, tmp_path)
        assert_read(found, other, path, True)


def test_a_joint_of_sdf_that_would_mimic_two_others_is_refused():
    mechanism = coupled_loop()
    third = Gear("third", ("A", "A2"), 1.0)
    fourth = Gear("fourth", ("A", "A2"), 1.0)
    mechanism = replace(mechanism, couplers=[*mechanism.couplers, third, fourth])
    with pytest.raises(KincheckError, match="mimics one other"):
        adapters.writer("sdf")(mechanism, way("coupled_loop", False), {})


def test_a_start_that_cannot_be_reached_says_how_far_it_goes():
    with pytest.raises(
        SolveError, match=r"no way from the design to stroke = 0\.5: .*beyond stroke = 0\.29"
    ):
        way_to(CASES["mcpherson"], 0.5)


# The command


@pytest.mark.parametrize(
    ("to", "endings"),
    [
        ("mjcf", [".xml"]),
        ("exudyn", [".py"]),
        ("urdf", [".urdf", ".constraints.json"]),
        ("sdf", [".sdf"]),
        ("osim", [".osim"]),
    ],
)
def test_export_writes_what_the_writer_writes(to, endings, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main.main(["export", "mcpherson_strut", "--to", to, "--at", "0.03"]) == 0
    names = [f"mcpherson_strut{ending}" for ending in endings]
    assert capsys.readouterr().out.split() == names
    texts = {
        ending: (tmp_path / name).read_text() for ending, name in zip(endings, names, strict=True)
    }
    assert "0.03" in texts[endings[-1]]
    found = read(to, texts, replace(mcpherson(), points=(), drivers=()), tmp_path)
    assert found.bodies["knuckle"][0][2] == pytest.approx(0.131, abs=1e-15)


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["--to", "mjfc"], "there is no format 'mjfc'; did you mean 'mjcf'?"),
        (["--to", "mjcf"], "mcpherson_strut.xml exists already"),
        (["--to", "mjcf", "--at", "nan"], "'nan' is not a number"),
        (
            ["--to", "mjcf", "--out", "nowhere/strut.xml"],
            "cannot be written (No such file or directory)",
        ),
    ],
)
def test_what_cannot_be_exported_is_said(argv, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mcpherson_strut.xml").write_text("mine")
    assert main.main(["export", "mcpherson_strut", *argv]) == 2
    assert said in capsys.readouterr().err
    assert (tmp_path / "mcpherson_strut.xml").read_text() == "mine"


def test_help_names_the_formats_that_there_are(capsys):
    assert tuple(FORMATS) == adapters.WRITERS
    for command in ("export", "assemblies"):
        assert main.main([command, "--help"]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert "mjcf (MuJoCo), exudyn (a Python script), urdf (Pinocchio), sdf (Drake) or" in said
