"""Exports: the command, the writers, and exports read again."""

from dataclasses import replace
from itertools import product
from xml.etree import ElementTree

import numpy as np
import pytest
from kincheck import cases
from kincheck.adapters.writers.poses import at_start
from kincheck.core import (
    Gear,
    JointAngle,
    KincheckError,
    Point,
    Polynomial,
    Revolute,
    SolveError,
    Spherical,
)
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.joint_probe import probes
from kincheck.core.case.models.files import load
from kincheck.core.cli import main
from kincheck.core.doors import offers
from kincheck.core.extensions.exports.command import writer_of
from kincheck.core.extensions.exports.model_writer import way_to, written
from kincheck.core.joints import Joint
from kincheck.core.kinematics import NativeSolver, largest_residual
from kincheck.core.trajectory import BodyMotion
from scipy.spatial.transform import Rotation

from ...oracles.naive import A
from ...support.case_texts import write
from ...support.engine_motion import cutting, mechanism_of
from ...support.examples import examples
from ...support.exported import READERS, read
from ...support.mechanisms import mcpherson, slider_crank
from ...support.model_files import driven
from ...support.written_mechanisms import CASES, Z, assert_read, case, coupled_loop, way

(BAD_ARGUMENTS,) = examples(__file__, "bad_arguments")


@pytest.mark.parametrize("to", offers("writers"))
def test_export_names_joint_without_counterpart(to):
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
        writer_of(to)(mine, way("mcpherson", False), {})


def renamed(mechanism, **names):
    """The mechanism with other names of bodies."""

    def new(member, *keys):
        found = {key: getattr(member, key) for key in keys}
        return replace(member, **{key: names.get(name, name) for key, name in found.items()})

    path = {names.get(name, name): motion for name, motion in way(mechanism.name, True).items()}
    other = replace(
        mechanism,
        bodies=[new(each, "name") for each in mechanism.bodies],
        joints=[new(each, "i", "j") for each in mechanism.joints],
        points=[new(each, "body") for each in mechanism.points],
    )
    return other, path


def test_export_refuses_taken_names():
    world = renamed(slider_crank(), crank="world")
    with pytest.raises(KincheckError, match="'world' is taken"):
        writer_of("mjcf")(*world, {})
    mechanism, path = renamed(slider_crank())
    twice = [*mechanism.points, Point("rod.first", "crank", (0.0, 0.0, 0.0))]
    with pytest.raises(KincheckError, match=r"'rod\.first' is taken"):
        writer_of("mjcf")(replace(mechanism, points=twice), path, {})


@pytest.mark.parametrize("to", ["osim", "sdf"])
def test_export_of_names_with_blanks(to, tmp_path):
    """OpenSim ends the process at a name with a blank."""
    other, path = renamed(slider_crank(), crank="left crank", rod="rod/2")
    assert_read(read(to, writer_of(to)(other, path, {}), other, tmp_path), other, path, True)


def test_sdf_names_differ_in_a_model(tmp_path):
    """As libsdformat wants them, of any elements: the spring of a slide has the joint's name."""
    model = """<mujoco><worldbody><body name="a"><joint name="ja" axis="0 1 0"/><geom size="0.1"/>
    <body name="c" pos="0.5 0 0"><joint name="jc" type="slide" axis="1 0 0" stiffness="20"/>
    <geom size="0.1"/></body></body></worldbody></mujoco>"""
    case = load(write(tmp_path, model, "m.xml"), driven("ja:0:0.1:3", hold=("jc",)))
    (text,) = written(case, writer_of("sdf")).values()
    (found,) = ElementTree.fromstring(text).iter("model")
    names = [each.get("name") for each in found]
    assert len(names) == len({*names})
    assert "jc.spring" in names


def test_sdf_export_refuses_two_mimics():
    mechanism = coupled_loop()
    again = [Gear(name, ("A", "A2"), 1.0) for name in ("third", "fourth")]
    mechanism = replace(mechanism, couplers=[*mechanism.couplers, *again])
    with pytest.raises(KincheckError, match="mimics one other"):
        writer_of("sdf")(mechanism, way("coupled_loop", False), {})


def test_export_start_out_of_reach_fails():
    with pytest.raises(
        SolveError, match=r"no way from the design to stroke = 0\.5: .*beyond stroke = 0\.29"
    ):
        way_to(CASES["mcpherson"], 0.5)


def test_export_start_names_held_drivers():
    five_bar = cases.load("five_bar")
    case = replace(five_bar, sweep=replace(five_bar.sweep, motions={}))
    found = written(case, lambda mechanism, way, start, zeros, ranges: start, at=0.1)
    assert found == {"left": 0.1, "right": 0.0}


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
def test_export_command_writes_files(to, endings, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main.main(["export", "mcpherson_strut", "--to", to, "--at", "30mm"]) == 0
    names = [f"mcpherson_strut{ending}" for ending in endings]
    assert capsys.readouterr().out.split() == names
    texts = {
        ending: (tmp_path / name).read_text() for ending, name in zip(endings, names, strict=True)
    }
    assert "0.03" in texts[endings[-1]]
    found = read(to, texts, replace(mcpherson(), points=(), drivers=()), tmp_path)
    assert found.bodies["knuckle"][0][2] == pytest.approx(0.131, abs=1e-15)


@pytest.mark.parametrize(("argv", "said"), BAD_ARGUMENTS)
def test_export_command_refuses_bad_arguments(argv, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mcpherson_strut.xml").write_text("mine")
    assert main.main(["export", "mcpherson_strut", *argv]) == 2
    assert said in capsys.readouterr().err
    assert (tmp_path / "mcpherson_strut.xml").read_text() == "mine"


def test_export_help_lists_formats(capsys):
    assert [*offers("formats")] == [*offers("writers")]
    for command in ("export", "assemblies"):
        assert main.main([command, "--help"]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert "mjcf (MuJoCo), exudyn (a Python script), urdf (Pinocchio), sdf (Drake)" in said


# Written models, read by their simulators alone: they close at the design and elsewhere, and move


def reading(to, name, folder, elsewhere=True):
    mechanism, path = CASES[name].mechanism, way(name, elsewhere)
    return read(to, writer_of(to)(mechanism, path, {}), mechanism, folder), path


NO_CURVE = {"exudyn": "Exudyn", "sdf": "SDF"}
NOT_WRITTEN = {"polynomial": NO_CURVE, "spline": NO_CURVE | {"mjcf": "MJCF"}}


@pytest.mark.by_day(3)
@pytest.mark.parametrize("which", [*product(READERS, CASES, (False, True))], ids=str)
def test_written_model_closes_at_native_pose(which, tmp_path):
    to, name, elsewhere = which
    if refused := NOT_WRITTEN.get(name, {}).get(to):
        with pytest.raises(KincheckError, match=f"has no counterpart in {refused}"):
            reading(to, name, tmp_path, elsewhere)
        return
    found, path = reading(to, name, tmp_path, elsewhere)
    assert_read(found, CASES[name].mechanism, path, elsewhere)


def test_polynomial_coupler_shifted_to_start():
    """With y = x + 0.2 x^2, and x = 0.5 at the start."""
    hinges = [
        Revolute(name, "ground", name.upper(), (k, 0.0, 0.0), Z) for k, name in enumerate("ab")
    ]
    cam = Polynomial("cam", ("b", "a"), (0.0, 1.0, 0.2))
    mechanism = mechanism_of(hinges, {}, [JointAngle("turn", "a")], [cam])
    (moved,) = at_start(mechanism, way_to(case(mechanism, 0.5), 0.5)).couplers
    np.testing.assert_allclose(moved.coefficients, [0.0, 1.2, 0.2], rtol=0.0, atol=1e-15)


JOINTS = [each.name for each in probes()]


@pytest.mark.parametrize("which", [*product(JOINTS, ["mjcf", "urdf", "sdf", "osim"])], ids="-".join)
def test_written_joint_closes_loop(which, tmp_path):
    """As it carries a body elsewhere."""
    name, to = which
    if to in NOT_WRITTEN.get(name, ()):
        return  # refused above
    mechanism = CASES[name].mechanism
    with cutting(*(each.name for each in mechanism.joints if each.name in ("tested", "second"))):
        found, path = reading(to, name, tmp_path)
    assert_read(found, mechanism, path, True)


def test_written_cases_move_over_turns():
    for name in CASES:
        changes = [
            max(np.ptp(motion.r[[0, -1]], axis=0).max(), np.ptp(motion.p[[0, -1]], axis=0).max())
            for motion in way(name, True).values()
        ]
        assert max(changes) > 0.01
    # 150 rad of 0.01 m a turn
    assert abs(way("gear_train", True)["nut"].r[-1, 2] - 0.3 + 1.5 / (2.0 * np.pi)) <= 1e-14


@pytest.mark.parametrize("to", READERS)
def test_written_model_shows_wrong_start(to, tmp_path):
    """The tie rod a millimetre longer than where the poses are from."""
    mechanism = mcpherson()
    rod = mechanism.joint("tie_rod")
    longer = replace(
        mechanism, joints=[*mechanism.joints[:-1], replace(rod, length=rod.design_distance + 1e-3)]
    )
    texts = writer_of(to)(longer, way("mcpherson", True), {})
    found = read(to, texts, longer, tmp_path)
    assert np.linalg.norm(found.residuals) == pytest.approx(1e-3, abs=1e-14)


# Built-in cases, exported as models and read again: the motion that is read satisfies all joints


TREES = ("mjcf", "urdf", "sdf")
PAIRS = list(product(cases.names(), TREES))
# Round-off of metre-sized coordinates, and of angles between links at arms of their size.
EXACT = 1e-10
STEP = 0.02
"""End of the motion [rad or m]: far from any singular pose of the built-in cases."""


def exported(case, kind, folder):
    """Write a model and the files beside it; return its file."""
    texts = written(case, writer_of(kind))
    for ending, text in texts.items():
        (folder / f"model{ending}").write_text(text)
    return folder / f"model{next(iter(texts))}"


def read_again(case, file):
    """Return the case of a model, driven by the first joint of the original that moves it."""
    reasons = []
    for joint in case.mechanism.joints:
        for name in (joint.name, f"{joint.name}.rotation", f"{joint.name}.1"):
            try:
                return load(file, Supplied(drive=(f"{name}:0:{STEP}:2",), hold_rest=True))
            except KincheckError as error:
                reasons.append(str(error))
    raise AssertionError(reasons)


def carried(case, again):
    """Return the motions of the bodies of a case, from those of the frames of another one."""
    names = tuple(body.name for body in again.mechanism.moving)
    solver = NativeSolver(order=0, compiled=False)
    found = solver.prepare(again.mechanism, again.sweep.path, bodies=names)(1e-12)
    assert found.solved.all(), found.message
    motions = {}
    for body in case.mechanism.moving:
        other, motion = again.mechanism.body(body.name), found.bodies[body.name]
        turns = [A(p) @ A(np.array(other.euler_parameters)).T for p in motion.p]
        r = motion.r + np.array(turns) @ np.subtract(body.origin, other.origin)
        turns = np.array(turns) @ A(np.array(body.euler_parameters))
        p = Rotation.from_matrix(turns).as_quat(scalar_first=True)
        motions[body.name] = BodyMotion(r, p, None, None)
    return motions


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", sorted(Joint.registry))
def test_urdf_loop_read_again_moves_alike(name, tmp_path):
    """The joint closes a loop: the conditions beside the URDF tell its freedoms."""
    case = CASES[name]
    with cutting(
        *(each.name for each in case.mechanism.joints if each.name in ("tested", "second"))
    ):
        file = exported(case, "urdf", tmp_path)
    motions = carried(case, read_again(case, file))
    assert largest_residual(case.mechanism, case.mechanism.joints, motions) < EXACT
    assert max(np.ptp(motion.p, axis=0).max() for motion in motions.values()) > 1e-5


@pytest.mark.by_day(3)
@pytest.mark.parametrize("pair", PAIRS, ids="-".join)
def test_export_read_again_moves_alike(pair, tmp_path):
    name, kind = pair
    case = cases.load(name)
    again = read_again(case, exported(case, kind, tmp_path))
    motions = carried(case, again)
    parts = [*case.mechanism.joints, *case.mechanism.couplers]
    assert largest_residual(case.mechanism, parts, motions) < EXACT
    assert max(np.ptp(motion.p, axis=0).max() for motion in motions.values()) > 1e-5
    for body in case.mechanism.moving:
        there = again.mechanism.body(body.name)
        assert there.mass == pytest.approx(body.mass, abs=EXACT)
