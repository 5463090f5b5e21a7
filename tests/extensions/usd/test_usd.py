"""USD: joints between frames of scaled and nested prims, against closed forms and MJCF."""

import importlib.util
import math
from functools import partial

import numpy as np
import pytest
from kincheck.core.case.models.files import load
from kincheck.core.extensions.same.undriven import undriven_file
from kincheck.core.extensions.same.verdict import compare
from kincheck.core.extensions.trees.driving import read_start
from kincheck.core.extensions.trees.reader import read_tree

from ...support.examples import examples
from ...support.model_files import driven
from ...support.model_poses import EXACT, coordinate, near, solution
from ...support.usd_texts import (
    ARM,
    EXCLUDED,
    FOUR_BAR,
    body,
    heavy,
    hinge,
    joint,
    locked,
    parallelogram,
    prim,
    stage,
    write_stage,
)

(KINDS,) = examples(__file__, "kinds")

pytestmark = pytest.mark.skipif(importlib.util.find_spec("pxr") is None, reason="no usd-core")
CENTI = 'metersPerUnit = 0.01\n    upAxis = "Z"'
DRIVE = driven("A:0:0.5:5")


@pytest.fixture
def write(tmp_path):
    return partial(write_stage, tmp_path)


def test_excluded_joint_closes_loop(write):
    """A parallelogram of 2 and 4: the coupler does not turn, the crank and the rocker do alike."""
    case = load(write(*FOUR_BAR), DRIVE)
    found = solution(case)
    turned = np.array([coordinate(case, found, x) for x in "ABDC"])
    assert turned == pytest.approx(np.outer([1, -1, 1, 1], case.sweep.values), abs=EXACT)
    pin = np.stack([np.sin(case.sweep.values), 0 * case.sweep.values, np.cos(case.sweep.values)])
    assert near(found.points["b"].position, 2 * pin.T)


def test_mujoco_equality_closes_loop(write):
    prims = [*FOUR_BAR]
    prims[5] = (
        prims[5]
        .replace(EXCLUDED, "")
        .replace(" (\n", ' (\nprepend apiSchemas = ["MjcEqualityConnectAPI"]', 1)
    )
    prims[3], prims[5] = prims[5], prims[3]  # a tree would take the first ones
    assert [tie.name for tie in read_tree(write(*prims)).ties] == ["C.closure"]


CENTIMETRES = (prim("PhysicsScene", "scene"), *parallelogram((400, 0, 0), (0, 200, 0), "Z"))
"""The same with y up, in the units that USD has unless a stage says others."""
SCALED = (
    body("a", ops="double3 xformOp:scale = (0.5, 2, 4)"),
    body("b", at=(0, 0, 2), ops="double3 xformOp:scale = (8, 1, 1)"),
    FOUR_BAR[2],
    hinge("A", "", "a"),
    hinge("B", "a", "b", p=(0, 0, 0.5)),
    hinge("C", "b", "c", EXCLUDED, p=(0.5, 0, 0), q=(0, 0, 2)),
    FOUR_BAR[6],
)
APART = (body("a", at=(7, 7, 7)), body("b", at=(1, 0, 3)), *FOUR_BAR[2:])
"""Places that their joints do not have."""
NESTED = (
    prim(
        "Xform",
        "arm",
        "double3 xformOp:translate = (0, 0, 1)",
        'uniform token[] xformOpOrder = ["xformOp:translate"]',
        body("a", at=(0, 0, -1)),
        body("b", at=(0, 0, 1)),
        body("c", at=(4, 0, -1)),
    ),
    hinge("A", "", "arm/a"),
    hinge("B", "arm/a", "arm/b", p=(0, 0, 2)),
    hinge("C", "arm/b", "arm/c", EXCLUDED, p=(4, 0, 0), q=(0, 0, 2)),
    hinge("D", "arm/c", "", q=(4, 0, 0)),
)


@pytest.mark.parametrize(
    ("prims", "units"),
    [
        (CENTIMETRES, ""),
        (CENTIMETRES, 'metersPerUnit = 0.01\n    upAxis = "Y"'),
        (SCALED, None),
        (APART, None),
        (NESTED, None),
        ([each.replace(EXCLUDED, "") for each in FOUR_BAR], None),
    ],
    ids="fallback centimetres scaled apart nested plain".split(),
)
def test_units_scales_and_places_keep_mechanism(write, prims, units):
    mechanism = undriven_file(write(*FOUR_BAR, name="truth.usda"))
    other = undriven_file(write(*prims, **({} if units is None else {"units": units})))
    found = compare(mechanism, other, {})
    assert found.verdict == "same", found.reason
    assert found.largest < 1e-12


def test_gravity_and_masses_in_stage_units(write):
    prims = [*CENTIMETRES]
    prims[1] = heavy(
        "a",
        "float physics:mass = 1",
        "float3 physics:diagonalInertia = (1e4, 1e4, 1e4)",
        "point3f physics:centerOfMass = (0, 10, 0)",
    )
    case = load(write(*prims, units=""), DRIVE)
    assert case.mechanism.gravity == (0.0, -9.81, 0.0)
    a = case.mechanism.body("a")
    found = (a.mass, *a.center_of_mass, *a.inertia[:3])
    assert found == pytest.approx((1, 0, 0.1, 0, 1, 1, 1), abs=EXACT)
    assert any("metersPerUnit is not given" in note for note in case.assembly)
    scene = "vector3f physics:gravityDirection = (0, 0, 2)\nfloat physics:gravityMagnitude = 162"
    prims[0] = prim("PhysicsScene", "scene", scene)
    moon = load(write(*prims, units=""), DRIVE).mechanism.gravity
    assert moon == pytest.approx((0, 0, 1.62), abs=EXACT)


@pytest.mark.parametrize("lock", KINDS)
def test_generic_joint_frees_unlocked_axes(write, lock):
    tree = read_tree(
        write(*ARM[:2], hinge("base", "", "a"), joint("", "j", "a", "b", *locked(lock)))
    )
    kinds = [move.kind for name, move in tree.moves.items() if name.split(".")[0] == "j"]
    if not lock:  # it holds nothing
        assert kinds == []
        assert tree.moves["b"].kind == "free"
    else:
        assert " ".join(kinds) == KINDS[lock]
    axes = {name.split(".")[-1]: [*move.axis] for name, move in tree.moves.items() if "." in name}
    for name, axis in axes.items():
        if name.startswith("trans"):
            assert axis == [float(letter == name[-1]) for letter in "XYZ"]


@pytest.mark.parametrize("name", ["k", "PhysxPhysicsGearJoint", "PhysxPhysicsGearJoint/k"])
def test_prim_left_out_by_name(write, name):
    file = write(*ARM, prim("PhysxPhysicsGearJoint", "k"))
    tree = read_tree(file, [name])
    assert any("</r/k>" in note for note in tree.notes)


MIMICS = {
    "physx": (
        "PhysxMimicJointAPI:rotY",
        """rel physxMimicJoint:rotY:referenceJoint = </r/A>
        float physxMimicJoint:rotY:gearing = -2
        float physxMimicJoint:rotY:offset = 30""",
        lambda q: 2 * q - math.radians(30),
    ),
    "newton": (
        "NewtonMimicAPI",
        """rel newton:mimicJoint = </r/A>
        float newton:mimicCoef0 = 30
        float newton:mimicCoef1 = -0.5""",
        lambda q: math.radians(30) - 0.5 * q,
    ),
    "mujoco": (
        "NewtonMimicAPI MjcEqualityJointAPI",
        """rel newton:mimicJoint = </r/A>
        rel mjc:target = </r/A>
        float newton:mimicCoef0 = 7
        double mjc:coef0 = 0.1
        double mjc:coef1 = -0.5
        double mjc:coef3 = 0.25""",
        lambda q: 0.1 - 0.5 * q + 0.25 * q**3,
    ),
    "mujoco on newton": (
        "MjcEqualityJointAPI",
        """rel newton:mimicJoint = </r/A>
        float newton:mimicCoef0 = 30
        float newton:mimicCoef1 = 2
        double mjc:coef2 = 1""",
        lambda q: math.radians(30) + 2 * q + q**2,
    ),
}


@pytest.mark.parametrize("dialect", MIMICS)
def test_mimic_joint_follows_leader(write, dialect):
    api, lines, law = MIMICS[dialect]
    follower = hinge("B", "a", "b", lines, p=(0, 0, 1), apis=api)
    case = load(write(*ARM[:2], hinge("A", "", "a"), follower), DRIVE)
    zero = law(0.0)
    turned = coordinate(case, solution(case), "B") + zero
    assert turned == pytest.approx(law(case.sweep.values), abs=EXACT)
    assert not zero or any(f"B {zero:.9g}" in note for note in case.assembly)


def test_mujoco_equality_in_stage_units(write):
    """In centimetres: x = 3 + 2 q, and a turn of 0.1 x^2 of that."""
    lines = "rel mjc:target = </r/A>", "double mjc:coef0 = 3", "double mjc:coef1 = 2"
    turn = "rel mjc:target = </r/x>", "double mjc:coef1 = 0", "double mjc:coef2 = 0.1"
    file = write(
        *(body(each) for each in "abc"),
        hinge("A", "", "a"),
        joint("Prismatic", "x", "", "b", *lines, apis="MjcEqualityJointAPI"),
        hinge("C", "", "c", *turn, apis="MjcEqualityJointAPI"),
        units=CENTI,
    )
    found = [each.coefficients for each in read_tree(file).ties]
    assert np.allclose(found, [[0.03, 0.02, 0, 0, 0], [0, 0, 1000.0, 0, 0]], rtol=1e-12, atol=0)


def test_mass_without_shape_has_no_moments(write):
    """At its own centre, and without moments; one of a mesh stays unknown."""
    file = write(
        heavy("a", MASS),
        heavy("b", MASS, "point3f physics:centerOfMass = (1, 0, 0)"),
        heavy("c", MASS, prim("Mesh", "mesh", apis="Collision")),
        *(hinge(name.upper(), "", name) for name in "abc"),
    )
    tree = read_tree(file)
    found = {name: (m.mass, *m.center, m.inertia.any()) for name, (m,) in tree.masses.items()}
    assert found == {"a": (6, 0, 0, 0, False), "b": (6, 1, 0, 0, False)}
    assert tree.unweighed == {"c"}


def test_newton_mimic_of_slide_counts_radians(write):
    """A slope has no degrees: converters of URDF and MJCF write that of their coordinates."""
    lines = "rel newton:mimicJoint = </r/A>", "float newton:mimicCoef1 = 0.25"
    nut = joint("Prismatic", "nut", "", "b", *lines, apis="NewtonMimicAPI")
    case = load(write(*ARM[:2], hinge("A", "", "a"), nut), DRIVE)
    shift = solution(case).points["b"].position[:, 1]
    assert shift == pytest.approx(0.25 * case.sweep.values, abs=EXACT)


def test_drive_motors_limits_and_starts(write):
    """In degrees and units of the stage; a drive without gains is no motor."""
    drive = """float drive:angular:physics:stiffness = 10
        float physics:lowerLimit = -30
        float physics:upperLimit = 60
        float drive:angular:physics:targetPosition = 45
        float drive:angular:physics:maxForce = 5"""
    off = """float drive:linear:physics:stiffness = 0
        float drive:linear:physics:damping = 0
        float physics:upperLimit = 20
        float state:linear:physics:position = 10"""
    file = write(
        *ARM[:2],
        hinge("A", "", "a", drive, apis="PhysicsDriveAPI:angular"),
        joint("Prismatic", "B", "a", "b", off, apis="PhysicsDriveAPI:linear"),
        units=CENTI,
    )
    found = undriven_file(file).coordinates
    turn, slide = found["A"], found["B"]
    assert (turn.actuated, slide.actuated) == (True, False)
    assert [turn.limit.lower, turn.limit.upper] == pytest.approx(np.radians([-30, 60]))
    assert (slide.limit.lower, slide.limit.upper) == (-math.inf, pytest.approx(0.2))
    assert turn.limit.effort == pytest.approx(5e-4)
    assert read_tree(file).starts == {"target": [f"A={math.radians(45)!r}"], "state": ["B=0.1"]}
    case = load(file, driven("A:0:1:3", hold=("B",), start=("keyframe:target",)))
    assert any("keyframe:target" in each for each in (case.source, *case.assembly))


def test_rods_and_disabled_joints(write):
    ends = "float physics:minDistance = 2", "float physics:maxDistance = 2"
    rod = joint("Distance", "rod", "a", "b", *ends, p=(0, 0, 1), axis=None)
    off = joint("Fixed", "off", "a", "b", "bool physics:jointEnabled = false", axis=None)
    tree = read_tree(write(body("a"), body("b", at=(0, 2, 1)), hinge("A", "", "a"), rod, off))
    (tie,) = tree.ties
    assert (tie.holds, tie.length) == ("distance", 2.0)
    assert any("</r/off> is switched off" in note for note in tree.notes)


MASS = "float physics:mass = 6"


def test_masses_of_bodies_and_colliders(write):
    """Of a box of 1, 2, 3 m, a ball, and own numbers in turned axes."""
    box = prim(
        "Cube",
        "box",
        "double size = 1",
        "double3 xformOp:scale = (1, 2, 3)",
        "double3 xformOp:translate = (0, 0, 1)",
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]',
        apis="Collision",
    )
    inside = "double radius = 0.1", "float physics:mass = 2"
    ball = prim("Sphere", "ball", *inside, apis="Collision Mass")
    inside = "double radius = 1", "double height = 2", 'uniform token axis = "X"'
    rod = prim("Cylinder", "rod", *inside, apis="Collision")
    file = write(
        heavy("a", MASS, box),
        body("b", ball),
        heavy("c", rod, "float physics:density = 3"),
        heavy(
            "d",
            MASS,
            "point3f physics:centerOfMass = (1, 0, 0)",
            "quatf physics:principalAxes = (0.70710677, 0, 0, 0.70710677)",
            "float3 physics:diagonalInertia = (1, 2, 3)",
            ops="double3 xformOp:scale = (2, 2, 2)",
        ),
        body("e", prim("Mesh", "mesh", apis="Collision")),
        *(hinge(name.upper(), "", name) for name in "abcde"),
    )
    tree = read_tree(file)
    found = {name: (m.mass, *m.center, *np.diag(m.inertia)) for name, (m,) in tree.masses.items()}
    mass = 3 * math.pi * 2
    expected = {
        "a": (6, 0, 0, 1, 6.5, 5, 2.5),
        "b": (2, 0, 0, 0, 0.008, 0.008, 0.008),
        "c": (mass, 0, 0, 0, mass / 2, mass * 7 / 12, mass * 7 / 12),
        "d": (6, 2, 0, 0, 2, 1, 3),
    }
    assert found == {name: pytest.approx(x, rel=1e-12, abs=EXACT) for name, x in expected.items()}
    assert tree.unweighed == {"e"}


def test_references_instances_and_variants(write, tmp_path):
    """A link in a file of its own, placed twice; a variant that moves a joint."""
    (tmp_path / "parts").mkdir()
    link = stage(prim("Xform", "geometry")).replace(
        'def Xform "r"', 'def Xform "r" (\nprepend apiSchemas = ["PhysicsRigidBodyAPI"]\n)'
    )
    (tmp_path / "parts" / "link.usda").write_text(
        link.replace("upAxis", 'defaultPrim = "r"\nupAxis')
    )
    named = [
        prim("Xform", name, metadata="instanceable = true\nprepend references = @parts/link.usda@")
        for name in "ab"
    ]
    tall = """variantSet "height" = {
        "low" { over "b" { } }
        "high" { over "J" { point3f physics:localPos0 = (0, 0, 5) } }
    }""".replace("{ ", "{\n").replace(" }", "\n}")
    text = stage(*named, hinge("A", "", "a"), hinge("J", "a", "b", p=None), tall)
    chosen = '(\nvariants = {\nstring height = "high"\n}\nprepend variantSets = "height"\n)'
    file = tmp_path / "m.usda"
    file.write_text(text.replace('def Xform "r"', f'def Xform "r" {chosen}'))
    tree = read_tree(file)
    assert [*tree.places["b"].at] == [0, 0, 5]
    assert "variants that are read: height high" in tree.notes
    copies = {}
    from pxr import Usd, UsdUtils

    for suffix in (".usdc", ".usdz", ".usd"):
        other = tmp_path / f"m{suffix}"
        flat = Usd.Stage.Open(str(file)).Flatten()
        if suffix == ".usdz":
            assert UsdUtils.CreateNewUsdzPackage(str(file), str(other))
        else:
            flat.Export(str(other))
        copies[suffix] = [*read_tree(other).places["b"].at]
    assert [*copies.values()] == [[0, 0, 5]] * 3


def turned_by(degrees):
    half = math.radians(degrees) / 2
    return f"quatd xformOp:orient = ({math.cos(half)}, 0, {math.sin(half)}, 0)"


def test_start_coordinates_follow_transforms(write):
    """In centimetres; the second joint counts the world on its body, and the third follows."""
    follow = ["rel newton:mimicJoint = </r/A>", "float newton:mimicCoef1 = 3"]
    up = (0, 0, 100), (0, 0, 200), (0, 0, 300)
    file = write(
        body("a", at=up[0], ops=turned_by(30)),
        body("b", at=up[1], ops=turned_by(-40)),
        body("c", at=(0, 7, 300), ops=turned_by(90)),
        hinge("A", "", "a", p=up[0]),
        hinge("B", "b", "", p=None, q=up[1]),
        hinge("C", "", "c", *follow, p=up[2], q=None, apis="NewtonMimicAPI"),
        units="metersPerUnit = 0.01",
    )
    tree = read_tree(file)
    found = [tree.moves[name].value for name in "ABC"]
    assert np.degrees(found) == pytest.approx([30, 40, 90], abs=1e-12)
    places = np.array([[*tree.places[name].at] for name in "abc"])
    assert places == pytest.approx(np.divide(up, 100), abs=EXACT)
    (tie,) = tree.ties
    assert tie.coefficients[0] == pytest.approx(0.0, abs=EXACT)
    assert any("c by 0.07 m and" in note and "a by" not in note for note in tree.notes)


def test_rod_length_after_joints_place_bodies(write):
    lengths = "float physics:minDistance = 1", "float physics:maxDistance = 1"
    rod = joint("Distance", "rod", "a", "b", *lengths, p=(0, 0, 1), q=None, axis=None)
    file = write(body("a", at=(9, 9, 9)), body("b", at=(0, 0, 2)), hinge("A", "", "a"), rod)
    (tie,) = read_tree(file).ties
    assert [*tie.places[0].at] == [0, 0, 1]


def placed(tree, start, name):
    place = read_start(tree, start).pose.as_tree().places[name]
    e0, *e = place.turn
    return [*place.at, *e, e0]


def test_chain_and_universal_joint_match_newton(write):
    """Poses of Newton 1.8 by its own reader, at equal coordinates, in single precision."""
    turn = "quatf physics:localRot{} = (0.9238795, {})"
    ends = turn.format(0, "0.3826834, 0, 0"), turn.format(1, "0, 0, 0.3826834")
    places = {"p": (0.5, 0, 0), "q": (0, 0.25, 0)}
    limits = [
        f"float limit:{axis}:physics:{end} = {sign}{size}"
        for axis, size in (("transY", 9), ("rotY", 170), ("rotZ", 170))
        for end, sign in (("low", "-"), ("high", ""))
    ]
    universal = joint("", "U", "a", "b", *ends, *limits, *locked("transX transZ rotX"), **places)
    tree = read_tree(write(*ARM[:2], hinge("A", "", "a"), universal))
    start = "A=0.3 U.transY=0.2 U.rotY=-0.7 U.rotZ=0.4".split()
    expected = [0.389729, 0.020423, -0.188806, 0.364771, -0.115834, -0.353477, 0.853568]
    assert placed(tree, start, "b") == pytest.approx(expected, abs=1e-6)
    assert any("rotY and then rotZ, a universal joint as in Newton" in x for x in tree.notes)
    at = (0.1, 0.2, 0.3)
    chain = [
        body("a", at=at, ops="double3 xformOp:scale = (2, 2, 2)"),
        body("b"),
        body("c"),
        hinge("A", "", "a", p=at),
        joint("Prismatic", "B", "a", "b", *ends, axis="Z", **places),
        hinge("C", "b", "c", turn.format(1, "0, 0.3826834, 0"), p=(0, 0, 1), q=None, axis="X"),
    ]
    expected = [1.100272, -0.773528, 0.747934, -0.111818, 0.029388, -0.261765, 0.958182]
    found = placed(read_tree(write(*chain)), ["A=0.3", "B=0.2", "C=-0.7"], "c")
    assert found == pytest.approx(expected, abs=1e-6)
