"""USD: joints between frames of scaled and nested prims, against closed forms and MJCF."""

import importlib.util
import math
from functools import partial

import numpy as np
import pytest
from kincheck.core.case.models.files import load, read_tree
from kincheck.core.case.models.trees.driving import read_start
from kincheck.core.case.models.undriven import undriven_file
from kincheck.core.studies.same import compare

from ..support.model_files import driven
from ..support.model_poses import coordinate, solution
from ..support.usd_texts import ARM, EXCLUDED, FOUR_BAR, body, joint, locked, prim, stage, written

pytestmark = pytest.mark.skipif(importlib.util.find_spec("pxr") is None, reason="no usd-core")
EXACT = 1e-13
SINGLE = 3e-7
DRIVE = driven("A:0:0.5:5")


@pytest.fixture
def write(tmp_path):
    return partial(written, tmp_path)


def tree_of(file):
    return read_tree(file)


def test_excluded_joint_closes_loop(write):
    """A parallelogram of 2 and 4: the coupler does not turn, the crank and the rocker do alike."""
    case = load(write(*FOUR_BAR), DRIVE)
    found = solution(case)
    turned = np.array([coordinate(case, found, x) for x in "ABDC"])
    assert turned == pytest.approx(np.outer([1, -1, 1, 1], case.sweep.values), abs=EXACT)
    pin = np.stack([np.sin(case.sweep.values), 0 * case.sweep.values, np.cos(case.sweep.values)])
    assert np.allclose(found.points["b"].position, 2 * pin.T, rtol=0, atol=EXACT)


def test_mujoco_equality_closes_loop(write):
    prims = [*FOUR_BAR]
    prims[5] = (
        prims[5]
        .replace(EXCLUDED, "")
        .replace(" (\n", ' (\nprepend apiSchemas = ["MjcEqualityConnectAPI"]', 1)
    )
    prims[3], prims[5] = prims[5], prims[3]  # a tree would take the first ones
    assert [tie.name for tie in tree_of(write(*prims)).ties] == ["C.closure"]


CENTIMETRES = (
    prim("PhysicsScene", "scene"),
    body("a", (0, 0, 0)),
    body("b", (0, 200, 0)),
    body("c", (400, 0, 0)),
    joint("Revolute", "A", "", "a", axis="Z"),
    joint("Revolute", "B", "a", "b", (0, 200, 0), axis="Z"),
    joint("Revolute", "C", "b", "c", (400, 0, 0), (0, 200, 0), EXCLUDED, axis="Z"),
    joint("Revolute", "D", "", "c", (400, 0, 0), axis="Z"),
)
"""The same with y up, in the units that USD has unless a stage says others."""
SCALED = (
    body("a", ops="double3 xformOp:scale = (0.5, 2, 4)"),
    body("b", (0, 0, 2), ops="double3 xformOp:scale = (8, 1, 1)"),
    body("c", (4, 0, 0)),
    joint("Revolute", "A", "", "a"),
    joint("Revolute", "B", "a", "b", (0, 0, 0.5)),
    joint("Revolute", "C", "b", "c", (0.5, 0, 0), (0, 0, 2), EXCLUDED),
    joint("Revolute", "D", "", "c", (4, 0, 0)),
)
APART = (
    *(body("a", (7, 7, 7)), body("b", (1, 0, 3)), body("c", (4, 0, 0))),
    *FOUR_BAR[3:],
)
"""Places that their joints do not have."""
NESTED = (
    prim(
        "Xform",
        "arm",
        lines=[
            "double3 xformOp:translate = (0, 0, 1)",
            'uniform token[] xformOpOrder = ["xformOp:translate"]',
            body("a", (0, 0, -1)),
            *(body("b", (0, 0, 1)), body("c", (4, 0, -1))),
        ],
    ),
    joint("Revolute", "A", "", "arm/a"),
    joint("Revolute", "B", "arm/a", "arm/b", (0, 0, 2)),
    joint("Revolute", "C", "arm/b", "arm/c", (4, 0, 0), (0, 0, 2), EXCLUDED),
    joint("Revolute", "D", "arm/c", "", (0, 0, 0), (4, 0, 0)),
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
    heavy = "float physics:mass = 1\n"
    prims = [*CENTIMETRES]
    prims[1] = body(
        "a",
        (0, 0, 0),
        heavy + "float3 physics:diagonalInertia = (1e4, 1e4, 1e4)",
        "point3f physics:centerOfMass = (0, 10, 0)",
        apis="RigidBody Mass",
    )
    case = load(write(*prims, units=""), DRIVE)
    assert case.mechanism.gravity == (0.0, -9.81, 0.0)
    assert case.mechanism.body("a").mass == 1.0
    assert case.mechanism.body("a").center_of_mass == pytest.approx((0, 0.1, 0), abs=EXACT)
    assert case.mechanism.body("a").inertia[:3] == pytest.approx((1, 1, 1), abs=EXACT)
    assert any("metersPerUnit is not given" in note for note in case.assembly)
    scene = "vector3f physics:gravityDirection = (0, 0, 2)\nfloat physics:gravityMagnitude = 162"
    prims[0] = prim("PhysicsScene", "scene", lines=[scene])
    moon = load(write(*prims, units=""), DRIVE).mechanism.gravity
    assert moon == pytest.approx((0, 0, 1.62), abs=EXACT)


KINDS = {
    "": "slide slide slide ball",
    "transX transY transZ": "ball",
    "transX transY transZ rotX rotY": "hinge",
    "rotX rotY rotZ": "slide slide slide",
    "transY transZ rotX rotY rotZ": "slide",
    "transX rotX rotY": "slide slide hinge",
    "transX transZ rotX rotZ": "slide hinge",
    "transX transY transZ rotX rotY rotZ": "",
}


@pytest.mark.parametrize("lock", KINDS)
def test_generic_joint_frees_unlocked_axes(write, lock):
    carrier = joint("Revolute", "base", "", "a")
    file = write(
        body("a"), body("b"), carrier, joint("", "j", "a", "b", (0, 0, 0), (0, 0, 0), *locked(lock))
    )
    tree = tree_of(file)
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
        [
            "rel physxMimicJoint:rotY:referenceJoint = </r/A>",
            "float physxMimicJoint:rotY:gearing = -2",
            "float physxMimicJoint:rotY:offset = 30",
        ],
        lambda q: 2 * q - math.radians(30),
    ),
    "newton": (
        "NewtonMimicAPI",
        [
            "rel newton:mimicJoint = </r/A>",
            "float newton:mimicCoef0 = 30",
            "float newton:mimicCoef1 = -0.5",
        ],
        lambda q: math.radians(30) - 0.5 * q,
    ),
    "mujoco": (
        "NewtonMimicAPI MjcEqualityJointAPI",
        [
            "rel newton:mimicJoint = </r/A>",
            "rel mjc:target = </r/A>",
            "float newton:mimicCoef0 = 7",
            "double mjc:coef0 = 0.1",
            "double mjc:coef1 = -0.5",
            "double mjc:coef3 = 0.25",
        ],
        lambda q: 0.1 - 0.5 * q + 0.25 * q**3,
    ),
    "mujoco on newton": (
        "MjcEqualityJointAPI",
        ["rel newton:mimicJoint = </r/A>", "float newton:mimicCoef1 = 2", "double mjc:coef2 = 1"],
        lambda q: 2 * q + q**2,
    ),
}


@pytest.mark.parametrize("dialect", MIMICS)
def test_mimic_joint_follows_leader(write, dialect):
    api, lines, law = MIMICS[dialect]
    follower = joint("Revolute", "B", "a", "b", (0, 0, 1), (0, 0, 0), *lines, apis=api)
    file = write(body("a"), body("b", (0, 0, 1)), joint("Revolute", "A", "", "a"), follower)
    found = solution(case := load(file, DRIVE))
    zero = law(0.0)
    turned = coordinate(case, found, "B") + zero
    assert turned == pytest.approx(law(case.sweep.values), abs=EXACT)
    assert not zero or any(f"B {zero:.9g}" in note for note in case.assembly)


def test_mujoco_equality_in_stage_units(write):
    """In centimetres: x = 3 + 2 q, and a turn of 0.1 x^2 of that."""
    lines = "rel mjc:target = </r/A>", "double mjc:coef0 = 3", "double mjc:coef1 = 2"
    turn = "rel mjc:target = </r/x>", "double mjc:coef1 = 0", "double mjc:coef2 = 0.1"
    ends, api = [(0, 0, 0)] * 2, "MjcEqualityJointAPI"
    file = write(
        *(body(each) for each in "abc"),
        joint("Revolute", "A", "", "a"),
        joint("Prismatic", "x", "", "b", *ends, *lines, apis=api),
        joint("Revolute", "C", "", "c", *ends, *turn, apis=api),
        units='metersPerUnit = 0.01\n    upAxis = "Z"',
    )
    tree = tree_of(file)
    slide, hinge = ([*each.coefficients] for each in tree.ties)
    assert slide == pytest.approx([0.03, 0.02, 0, 0, 0])
    assert hinge == pytest.approx([0, 0, 1000.0, 0, 0])


def test_mass_without_shape_has_no_moments(write):
    """At its own centre, and without moments; one of a mesh stays unknown."""
    center = "point3f physics:centerOfMass = (1, 0, 0)"
    file = write(
        body("a", (0, 0, 0), MASS, apis="RigidBody Mass"),
        body("b", (0, 0, 0), MASS, center, apis="RigidBody Mass"),
        body("c", (0, 0, 0), MASS, prim("Mesh", "mesh", "Collision"), apis="RigidBody Mass"),
        *(joint("Revolute", name.upper(), "", name) for name in "abc"),
    )
    tree = tree_of(file)
    found = {name: (m.mass, *m.center, m.inertia.any()) for name, (m,) in tree.masses.items()}
    assert found == {"a": (6, 0, 0, 0, False), "b": (6, 1, 0, 0, False)}
    assert tree.unweighed == {"c"}


def test_newton_mimic_of_slide_counts_degrees(write):
    """A thread of 0.36 m in a turn: a thousandth of the stage's unit in a degree."""
    nut = joint(
        "Prismatic",
        "nut",
        "",
        "b",
        *[(0, 0, 0)] * 2,
        "rel newton:mimicJoint = </r/A>",
        "float newton:mimicCoef1 = 0.001",
        apis="NewtonMimicAPI",
    )
    case = load(write(body("a"), body("b"), joint("Revolute", "A", "", "a"), nut), DRIVE)
    shift = solution(case).points["b"].position[:, 1]
    assert shift == pytest.approx(0.36 / math.tau * case.sweep.values, abs=EXACT)


def test_drive_motors_limits_and_starts(write):
    """In degrees and units of the stage; a drive without gains is no motor."""
    drive = [
        "float drive:angular:physics:stiffness = 10",
        "float physics:lowerLimit = -30",
        "float physics:upperLimit = 60",
        "float drive:angular:physics:targetPosition = 45",
        "float drive:angular:physics:maxForce = 5",
    ]
    off = [
        "float drive:linear:physics:stiffness = 0",
        "float drive:linear:physics:damping = 0",
        "float physics:upperLimit = 20",
        "float state:linear:physics:position = 10",
    ]
    file = write(
        body("a"),
        body("b"),
        joint("Revolute", "A", "", "a", *[(0, 0, 0)] * 2, *drive, apis="PhysicsDriveAPI:angular"),
        joint("Prismatic", "B", "a", "b", *[(0, 0, 0)] * 2, *off, apis="PhysicsDriveAPI:linear"),
        units='metersPerUnit = 0.01\n    upAxis = "Z"',
    )
    found = undriven_file(file).coordinates
    turn, slide = found["A"], found["B"]
    assert (turn.actuated, slide.actuated) == (True, False)
    assert [turn.limit.lower, turn.limit.upper] == pytest.approx(np.radians([-30, 60]))
    assert (slide.limit.lower, slide.limit.upper) == (-math.inf, pytest.approx(0.2))
    assert turn.limit.effort == pytest.approx(5e-4)
    tree = tree_of(file)
    assert tree.starts == {"target": [f"A={math.radians(45)!r}"], "state": ["B=0.1"]}
    case = load(file, driven("A:0:1:3", hold=("B",), start=("keyframe:target",)))
    assert any("keyframe:target" in each for each in (case.source, *case.assembly))


def test_rods_and_disabled_joints(write):
    rod = joint(
        "Distance",
        "rod",
        "a",
        "b",
        (0, 0, 1),
        (0, 0, 0),
        "float physics:minDistance = 2",
        "float physics:maxDistance = 2",
        axis=None,
    )
    off = joint(
        "Fixed", "off", "a", "b", *[(0, 0, 0)] * 2, "bool physics:jointEnabled = false", axis=None
    )
    tree = tree_of(
        write(body("a"), body("b", (0, 2, 1)), joint("Revolute", "A", "", "a"), rod, off)
    )
    (tie,) = tree.ties
    assert (tie.holds, tie.length) == ("distance", 2.0)
    assert any("</r/off> is switched off" in note for note in tree.notes)


MASS = "float physics:mass = 6"
SHAPE = '{kind} "{name}"'


def test_masses_of_bodies_and_colliders(write):
    """Of a box of 1, 2, 3 m, a ball, and own numbers in turned axes."""
    box = prim(
        "Cube",
        "box",
        "Collision",
        [
            "double size = 1",
            "double3 xformOp:scale = (1, 2, 3)",
            "double3 xformOp:translate = (0, 0, 1)",
            'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]',
        ],
    )
    ball = prim(
        "Sphere", "ball", "Collision Mass", ["double radius = 0.1", "float physics:mass = 2"]
    )
    rod = prim(
        "Cylinder",
        "rod",
        "Collision",
        ["double radius = 1", "double height = 2", 'uniform token axis = "X"'],
    )
    turned = "quatf physics:principalAxes = (0.70710677, 0, 0, 0.70710677)"
    file = write(
        body("a", (0, 0, 0), MASS, box, apis="RigidBody Mass"),
        body("b", (0, 0, 0), ball),
        body("c", (0, 0, 0), rod, "float physics:density = 3", apis="RigidBody Mass"),
        body(
            "d",
            (0, 0, 0),
            MASS,
            "point3f physics:centerOfMass = (1, 0, 0)",
            turned,
            "float3 physics:diagonalInertia = (1, 2, 3)",
            apis="RigidBody Mass",
            ops="double3 xformOp:scale = (2, 2, 2)",
        ),
        body("e", (0, 0, 0), prim("Mesh", "mesh", "Collision")),
        *(joint("Revolute", name.upper(), "", name) for name in "abcde"),
    )
    tree = tree_of(file)
    found = {name: (m.mass, *m.center, *np.diag(m.inertia)) for name, (m,) in tree.masses.items()}
    volume = math.pi * 2
    across = 3 * volume * (3 + 4) / 12
    assert found == {
        "a": pytest.approx((6, 0, 0, 1, 6.5, 5, 2.5), abs=EXACT),
        "b": pytest.approx((2, 0, 0, 0, *[0.4 * 2 * 0.01] * 3), abs=EXACT),
        "c": pytest.approx(
            (3 * volume, 0, 0, 0, 3 * volume / 2, across, across), rel=1e-12, abs=EXACT
        ),
        "d": pytest.approx((6, 2, 0, 0, 2, 1, 3), abs=EXACT),
    }
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
    text = stage(
        *named, joint("Revolute", "A", "", "a"), joint("Revolute", "J", "a", "b", None), tall
    )
    chosen = '(\nvariants = {\nstring height = "high"\n}\nprepend variantSets = "height"\n)'
    file = tmp_path / "m.usda"
    file.write_text(text.replace('def Xform "r"', f'def Xform "r" {chosen}'))
    tree = tree_of(file)
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
        copies[suffix] = [*tree_of(other).places["b"].at]
    assert [*copies.values()] == [[0, 0, 5]] * 3


def test_random_chain_matches_mjcf(write, tmp_path):
    """Turned frames in single precision, with a loop by a ball."""
    rng = np.random.default_rng(0)

    def quaternion(x):
        q = np.asarray(x, dtype=float)
        return q / np.linalg.norm(q)

    bodies, joints, xml = [], [], ""
    last, around = "", (np.zeros(3), np.array([1.0, 0, 0, 0]))
    for k in range(4):
        at, turn, axis = (
            rng.normal(size=3),
            quaternion(rng.normal(size=4)),
            quaternion(rng.normal(size=3)),
        )
        name = f"l{k}"
        xml += (
            f'<body name="{name}" pos="{" ".join(map(repr, at.tolist()))}"'
            f' quat="{" ".join(map(repr, turn.tolist()))}"><joint name="j{k}"'
            f' axis="{" ".join(map(repr, axis.tolist()))}"/>'
        )
        # the frame whose x is the axis, in the body
        half = quaternion([1.0 + axis[0], 0.0, -axis[2], axis[1]])
        ends = [
            f"quatf physics:localRot0 = {tuple(product(turn, half).tolist())}",
            f"quatf physics:localRot1 = {tuple(half.tolist())}",
        ]
        joints.append(
            joint("Revolute", f"j{k}", last, name, tuple(at.tolist()), (0, 0, 0), *ends, axis="X")
        )
        around = (around[0] + turned(around[1], at), product(around[1], turn))
        bodies.append(
            body(
                name, around[0].tolist(), ops=f"quatd xformOp:orient = {tuple(around[1].tolist())}"
            )
        )
        last = name
    point = around[0] + turned(around[1], np.array([0.1, 0.2, 0.3]))
    joints.append(
        joint("Spherical", "loop", "", "l3", tuple(point.tolist()), (0.1, 0.2, 0.3), EXCLUDED)
    )
    other = tmp_path / "m.xml"
    other.write_text(
        f"<mujoco><worldbody>{xml}{'</body>' * 4}</worldbody><equality><connect"
        f' body1="l3" anchor="0.1 0.2 0.3"/></equality></mujoco>'
    )
    found = compare(undriven_file(write(*bodies, *joints)), undriven_file(other), {})
    assert found.verdict == "same", found.reason
    assert EXACT < found.largest < SINGLE * 10


def product(p, q):
    (a, *u), (b, *v) = p, q
    u, v = np.array(u), np.array(v)
    return np.array([a * b - u @ v, *(a * v + b * u + np.cross(u, v))])


def turned(q, x):
    return product(product(q, np.array([0.0, *x])), q * [1, -1, -1, -1])[1:]


TURN = "quatd xformOp:orient = ({}, 0, {}, 0)"


def turned_by(degrees):
    half = math.radians(degrees) / 2
    return TURN.format(math.cos(half), math.sin(half))


def test_start_coordinates_follow_transforms(write):
    """In centimetres; the second joint counts the world on its body, and the third follows."""
    follow = ["rel newton:mimicJoint = </r/A>", "float newton:mimicCoef1 = 3"]
    file = write(
        body("a", (0, 0, 100), ops=turned_by(30)),
        body("b", (0, 0, 200), ops=turned_by(-40)),
        body("c", (0, 7, 300), ops=turned_by(90)),
        joint("Revolute", "A", "", "a", (0, 0, 100)),
        joint("Revolute", "B", "b", "", None, (0, 0, 200)),
        joint("Revolute", "C", "", "c", (0, 0, 300), None, *follow, apis="NewtonMimicAPI"),
        units="metersPerUnit = 0.01",
    )
    tree = tree_of(file)
    found = [tree.moves[name].value for name in "ABC"]
    assert np.degrees(found) == pytest.approx([30, 40, 90], abs=1e-12)
    places = np.array([[*tree.places[name].at] for name in "abc"])
    assert places == pytest.approx(np.array([[0, 0, 1], [0, 0, 2], [0, 0, 3]]), abs=EXACT)
    (tie,) = tree.ties
    assert tie.coefficients[0] == pytest.approx(0.0, abs=EXACT)
    assert any("c by 0.07 m and" in note and "a by" not in note for note in tree.notes)


def test_rod_length_after_joints_place_bodies(write):
    rod = joint("Distance", "rod", "a", "b", (0, 0, 1), None, axis=None)
    lengths = "float physics:minDistance = 1\nfloat physics:maxDistance = 1\n}"
    file = write(
        body("a", (9, 9, 9)),
        body("b", (0, 0, 2)),
        joint("Revolute", "A", "", "a"),
        rod.removesuffix("}") + lengths,
    )
    (tie,) = tree_of(file).ties
    assert [*tie.places[0].at] == [0, 0, 1]


def placed(tree, start, name):
    place = read_start(tree, start).pose.as_tree().places[name]
    e0, *e = place.turn
    return [*place.at, *e, e0]


def test_chain_and_universal_joint_match_newton(write):
    """Poses of Newton 1.8 by its own reader, at equal coordinates, in single precision."""
    turn = "quatf physics:localRot{} = (0.9238795, {})"
    ends = turn.format(0, "0.3826834, 0, 0"), turn.format(1, "0, 0, 0.3826834")
    limits = [
        f"float limit:{axis}:physics:{end} = {sign}{size}"
        for axis, size in (("transY", 9), ("rotY", 170), ("rotZ", 170))
        for end, sign in (("low", "-"), ("high", ""))
    ]
    file = write(
        *(body("a"), body("b"), joint("Revolute", "A", "", "a")),
        joint(
            "",
            "U",
            "a",
            "b",
            (0.5, 0, 0),
            (0, 0.25, 0),
            *ends,
            *limits,
            *locked("transX transZ rotX"),
        ),
    )
    tree = tree_of(file)
    start = "A=0.3 U.transY=0.2 U.rotY=-0.7 U.rotZ=0.4".split()
    expected = [0.389729, 0.020423, -0.188806, 0.364771, -0.115834, -0.353477, 0.853568]
    assert placed(tree, start, "b") == pytest.approx(expected, abs=1e-6)
    assert any("rotY and then rotZ, a universal joint as in Newton" in x for x in tree.notes)
    scaled = body("a", (0.1, 0.2, 0.3), ops="double3 xformOp:scale = (2, 2, 2)")
    slide = joint("Prismatic", "B", "a", "b", (0.5, 0, 0), (0, 0.25, 0), *ends, axis="Z")
    last = joint(
        "Revolute",
        "C",
        "b",
        "c",
        (0, 0, 1),
        None,
        "quatf physics:localRot1 = (0.9238795, 0, 0.3826834, 0)",
        axis="X",
    )
    first = joint("Revolute", "A", "", "a", (0.1, 0.2, 0.3))
    tree = tree_of(write(scaled, body("b"), body("c"), first, slide, last))
    expected = [1.100272, -0.773528, 0.747934, -0.111818, 0.029388, -0.261765, 0.958182]
    assert placed(tree, ["A=0.3", "B=0.2", "C=-0.7"], "c") == pytest.approx(expected, abs=1e-6)
