"""OpenSim: poses by chains of frames against rotation matrices, custom joints, constraints."""

import importlib.util
import math
import re
import sys

import numpy as np
import pytest
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.exports import model_writer
from kincheck.core.extensions.exports.command import writer_of
from kincheck.core.extensions.same.undriven import undriven_file
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.extensions.trees.tree import Spring
from scipy.spatial.transform import Rotation

from ...support import case_texts
from ...support.examples import examples
from ...support.model_files import driven
from ...support.model_poses import EXACT, near, solution
from ...support.model_poses import coordinate as since_design
from ...support.osim_texts import (
    FOUR_BAR,
    axis,
    coordinate,
    joint,
    line,
    model,
    tagged,
    texts,
)
from ...support.splines import through

FAULTS, SLOTS, FORWARD, DOWN = examples(__file__, "faults", "slots", "forward", "down")

DRIVE = driven("A:0:0.5:5")
P = (0.1, 0.2, 0.3), (0.3, -0.2, 0.5)
C = (0.1, -0.3, 0.2), (0.2, 0.4, -0.1)
Q = (0.2, -0.4, 0.7, 0.1, 0.5, -0.3)
NONE = (0.0, 0.0, 0.0)


@pytest.fixture
def write(tmp_path):
    return lambda text, name="m.osim": case_texts.write(tmp_path, text, name)


def transform(at=NONE, angles=NONE):
    """The frame of a translation and of turns about x, y, z of the body."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_euler("XYZ", angles).as_matrix()
    found[:3, 3] = at
    return found


BACK = np.linalg.inv(transform(*C))


def joined(motion):
    """The frame of a body behind a joint, by its motion between both frames."""
    return transform(*P) @ motion @ BACK


"""What coordinates are: turns about x, y, z, and displacements along them."""


def placed(tree, name):
    e0, *e = tree.places[name].turn
    return transform([*tree.places[name].at], Rotation.from_quat([*e, e0]).as_euler("XYZ"))


@pytest.mark.parametrize("locked", ["", "<locked>true</locked>"])
@pytest.mark.parametrize("kind", SLOTS)
def test_joint_places_child_by_coordinates(write, kind, locked):
    """On a link that turns, and of one that a second joint carries."""
    count = len(SLOTS[kind])
    names = [coordinate(f"q{k}", Q[k], locked * (k == 0)) for k in range(count)]
    text = model(
        "abc",
        [
            joint("PinJoint", "first", "", "a", coordinate("turn", 0.3), P, C),
            joint(kind, "j", "a", "b", "".join(names), P, C),
            joint("SliderJoint", "last", "b", "c"),
        ],
    )
    tree = read_tree(write(text))
    six = np.zeros(6)
    six[SLOTS[kind]] = Q[:count]
    expected = joined(transform(angles=(0, 0, 0.3))) @ joined(transform(six[3:], six[:3]))
    for name in "bc":
        assert near(placed(tree, name), expected)
    values = {name: move.value for name, move in tree.moves.items() if move.is_axial}
    assert values["turn"] == 0.3
    assert "last_coord_0" in values
    if kind not in ("BallJoint", "FreeJoint") or locked:
        assert [values[f"q{k}"] for k in range(count)] == [*Q[:count]]
    assert len(tree.ties) == (bool(locked) and count > 0)


@pytest.mark.parametrize("text", [FOUR_BAR, FOUR_BAR.replace('<Ground name="ground"/>', "")])
def test_point_constraint_closes_loop(write, text):
    case = load(write(text), DRIVE)
    turned = [since_design(case, solution(case), x) for x in "ABD"]
    expected = np.outer([1, -1, 1], case.sweep.values)
    assert np.array(turned) == pytest.approx(expected, abs=EXACT)
    assert case.source.split(LEFT_OUT)[1] == "nothing"


def custom(coordinates, *axes):
    given = {each.split('"')[1] for each in axes}
    rest = [
        axis(f"{kind}{k}", tuple(float(k == each) for each in (1, 2, 3)))
        for kind in ("rotation", "translation")
        for k in (1, 2, 3)
        if f"{kind}{k}" not in given
    ]
    inside = tagged("SpatialTransform", "".join((*axes, *rest)))
    return joint("CustomJoint", "knee", "", "a", coordinates, P, C, inside=inside)


SQUARE = tagged("PolynomialFunction", texts(coefficients=(0.3, 0.2, 0.1)))


def half(function):
    return tagged("MultiplierFunction", f"<function>{function}</function><scale>0.5</scale>")


def test_custom_joint_axes_follow_coordinates(write):
    """A hinge against its axis and off zero, a slide by a line, one by a curve, one that stands."""
    axes = (
        axis("rotation1", (0, 0, 2), line(-1, 0.4), "bend"),
        axis("rotation2", (1, 0, 0), tagged("Constant", "<value>0.25</value>")),
        axis("translation1", (1, 1, 0), SQUARE, "bend"),
        axis("translation2", (0, 1, 0), half(line(1, 2)), "bend"),
        axis("translation3", (0, 0, 1), line(1, 0), "lift"),
    )
    file = write(model("a", [custom(coordinate("bend", 0.7) + coordinate("lift", -0.2), *axes)]))

    def expected(bend, lift):
        at = (0.3 * bend**2 + 0.2 * bend + 0.1) * np.array([1, 1, 0]) / math.sqrt(2)
        at += np.array([0, 0.5 * bend + 1, lift])
        turn = Rotation.from_euler("ZX", (0.4 - bend, 0.25)).as_euler("XYZ")
        return joined(transform(at, turn))

    assert near(placed(read_tree(file), "a"), expected(0.7, -0.2))
    case = load(file, driven("bend:0.7:1.2:5", hold=("lift",)))
    found = solution(case)
    for bend, at in zip(np.linspace(0.7, 1.2, 5), found.bodies["a"].r, strict=True):
        assert near(at, expected(bend, -0.2)[:3, 3])
    assert any("bend 0.7" in note for note in case.assembly)


# The knee of gait2392 of https://github.com/opensim-org/opensim-models (CC BY 3.0):
# displacements of the shank [m] over the angle [rad].


def table(kind, x, y):
    return tagged(kind, texts(x=x, y=y))


FORWARD_SPLINE, DOWN_SPLINE = table("SimmSpline", *FORWARD), table("SimmSpline", *DOWN)
forward, down = (through(np.transpose(each)) for each in (FORWARD, DOWN))
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
HINGE = axis("rotation1", Z, line(1, 0), "q")


def test_knee_of_splines_follows_table(write):
    """From where it is bent in the file, past the end of its table."""
    axes = (
        HINGE,
        axis("translation1", X, FORWARD_SPLINE, "q"),
        axis("translation2", Y, half(DOWN_SPLINE), "q"),
    )
    case = load(
        write(model("a", [custom(coordinate("q", -0.4), *axes)])),
        driven("q:-0.3:-2.5:12"),
    )
    found = solution(case).bodies["a"]
    size = np.linalg.norm(C[0])
    for k, q in enumerate(np.linspace(-0.3, -2.5, 12)):
        (x, v, a), (y, w, b) = forward(q), down(q)
        place = joined(transform((x, 0.5 * y, 0), (0, 0, q)))
        assert near(found.r[k], place[:3, 3])
        # at one radian a second, of a point at rest in the hinge's frame
        turn = transform(*P)[:3, :3]
        arm = transform(angles=(0, 0, q))[:3, :3] @ BACK[:3, 3]
        spin = np.cross((0, 0, 1), arm)
        speed = turn @ (np.array([v, 0.5 * w, 0]) + spin)
        bend = turn @ (np.array([a, 0.5 * b, 0]) + np.cross((0, 0, 1), spin))
        assert np.allclose(found.v[k, :3], speed, rtol=0, atol=1e-12 * size)
        assert np.allclose(found.a[k, :3], bend, rtol=0, atol=1e-11 * size)


def test_coordinate_of_splines_alone_is_coupled(write):
    """As of a patella: it has no axis of its own, and follows the knee's."""
    axes = (
        axis("rotation3", (0, 0, 1), DOWN_SPLINE, "beta"),
        axis("translation1", X, FORWARD_SPLINE, "beta"),
    )
    knee = joint("PinJoint", "K", "", "b", coordinate("A"))
    tie = coupler("A", "beta", line(1, 0))
    case = load(
        write(model("ab", [knee, custom(coordinate("beta"), *axes)], tie)),
        driven("A:0:-1.5:4"),
    )
    found = solution(case)
    for k, q in enumerate(np.linspace(0, -1.5, 4)):
        place = joined(transform((forward(q)[0], 0, 0), (0, 0, down(q)[0])))
        assert np.allclose(found.bodies["a"].r[k], place[:3, 3], rtol=0, atol=1e-12)


def test_tables_on_a_line_are_linear(write):
    for kind in ("SimmSpline", "PiecewiseLinearFunction"):
        slide = axis("translation1", X, table(kind, (-1, 0, 0.5), (-2.5, -0.5, 0.5)), "q")
        (tie,) = read_tree(write(model("a", [custom(coordinate("q"), HINGE, slide)]))).ties
        assert tie.is_linear
        assert tie.weights == {"knee.translation1": 1.0, "q": -2.0}


def coupler(leaders, follower, function, scale=""):
    return tagged(
        "CoordinateCouplerConstraint",
        f"<coupled_coordinates_function>{function}</coupled_coordinates_function>"
        + texts(independent_coordinate_names=leaders, dependent_coordinate_name=follower)
        + scale,
        "tie",
    )


PINS = [
    joint("PinJoint", x, "", x.lower(), coordinate(x, v))
    for x, v in zip("ABC", (0.1, 0.4, 0.3), strict=True)
]


@pytest.mark.parametrize(
    ("tie", "law"),
    [
        (coupler("A", "B", line(2, 0.2)), lambda a: 2 * a + 0.2),
        (
            coupler("A", "B", line(2, 0.2), "<scale_factor>-1</scale_factor>"),
            lambda a: -2 * a - 0.2,
        ),
        (coupler("A", "B", SQUARE), lambda a: 0.3 * a * a + 0.2 * a + 0.1),
        (
            coupler("A", "B", DOWN_SPLINE, "<scale_factor>-1</scale_factor>"),
            lambda a: -down(a)[0],
        ),
        (coupler("A C", "B", line(2, 3, 0.1)), lambda a: 2 * a + 0.9 + 0.1),
    ],
    ids="line scaled curve spline two".split(),
)
def test_coupled_coordinate_follows_leader(write, tie, law):
    """From where the file has it to where the coupler wants it, at the start and later."""
    case = load(write(model("abc", PINS, tie)), driven("A:0:0.5:5", hold=("C",)))
    (start,) = re.findall(r"B (-?[\d.]+)", next(x for x in case.assembly if "model's zero" in x))
    zero = law(0.1)
    assert float(start) == pytest.approx(zero, rel=1e-8)
    turned = since_design(case, solution(case), "B") + zero
    assert turned == pytest.approx([law(a) for a in np.linspace(0, 0.5, 5)], abs=1e-9)


def test_welds_and_rods_tie_frames(write):
    weld = """<WeldConstraint name="weld"><socket_frame1>one</socket_frame1>
        <socket_frame2>/bodyset/b</socket_frame2><frames><PhysicalOffsetFrame name="one">
        <socket_parent>/bodyset/a</socket_parent><translation>1 0 0</translation>
        <orientation>0.1 0 0</orientation></PhysicalOffsetFrame></frames></WeldConstraint>"""
    rod = """<ConstantDistanceConstraint name="rod"><socket_body_1>/bodyset/a</socket_body_1>
        <socket_body_2>/ground</socket_body_2><constant_distance>2</constant_distance>
        <location_body_2>2 0 0</location_body_2></ConstantDistanceConstraint>"""
    off = coupler("A", "A", line(1, 0), "<isEnforced>false</isEnforced>")
    tree = read_tree(write(model("abc", PINS, weld + rod + off)))
    ties = {each.name: each for each in tree.ties}
    assert (ties["weld"].holds, ties["rod"].holds, ties["rod"].length) == ("frame", "distance", 2.0)
    assert [*ties["rod"].places[1].at] == [2, 0, 0]
    assert ties["weld"].links == ("a", "b")
    assert tree.left_out["constraints that are not enforced"] == 1


def test_masses_springs_limits_and_markers(write):
    heavy = """<Body name="a"><mass>2</mass><mass_center>0.1 0.2 0.3</mass_center>
        <inertia>1 2 2.5 0.1 0.2 0.3</inertia></Body>"""
    bounded = "<range>-0.5 0.75</range><clamped>true</clamped>"
    pin = joint("PinJoint", "A", "", "a", coordinate("A", 0.0, bounded))
    forces = """<SpringGeneralizedForce name="s"><coordinate>A</coordinate><stiffness>5</stiffness>
        <rest_length>0.1</rest_length><viscosity>0.5</viscosity></SpringGeneralizedForce>
        <CoordinateActuator name="motor"><coordinate>A</coordinate></CoordinateActuator>
        <Millard2012EquilibriumMuscle name="muscle"/>
        <PointToPointSpring name="p"><socket_body1>/ground</socket_body1>
        <socket_body2>/bodyset/a</socket_body2><point1>0 1 0</point1><stiffness>7</stiffness>
        <rest_length>0.5</rest_length></PointToPointSpring>"""
    more = """<MarkerSet name="markerset"><objects><Marker name="tip">
        <socket_parent_frame>/bodyset/a</socket_parent_frame><location>0 1 0</location></Marker>
        </objects></MarkerSet><gravity>0 0 -3</gravity>"""
    file = write(model([heavy], [pin], forces=forces, more=more))
    tree = read_tree(file)
    (mass,) = tree.masses["a"]
    assert (mass.mass, [*mass.center], mass.inertia[0, 2]) == (2.0, [0.1, 0.2, 0.3], 0.2)
    assert tree.springs["A"].rest == 0.1
    assert [(each.spring.stiffness, [*each.places[0].at]) for each in tree.struts] == [
        (7.0, [0, 1, 0])
    ]
    assert tree.left_out == {"CoordinateActuator": 1, "Millard2012EquilibriumMuscle": 1}
    assert tree.gravity == (0, 0, -3)
    assert [*tree.sites["tip"][1].at] == [0, 1, 0]
    found = undriven_file(file).coordinates["A"]
    assert (found.limit.lower, found.limit.upper, found.actuated) == (-0.5, 0.75, True)
    assert load(file).sweep.driver == "A"
    of_export = """<ExpressionBasedPointToPointForce name="e"><body1>/ground</body1>
        <body2>/bodyset/a</body2><point1>0 1 0</point1>
        <expression>20*(d-1.5)+{}*ddot</expression></ExpressionBasedPointToPointForce>"""
    tree = read_tree(write(model(["a"], [pin], forces=of_export.format(2e-3))))
    (strut,) = tree.struts
    assert strut.spring == Spring(20.0, 2e-3, 1.5)
    assert tree.gravity == (0.0, -9.80665, 0.0)
    other = read_tree(write(model(["a"], [pin], forces=of_export.format("2*d"))))
    assert not other.struts
    assert other.left_out == {"ExpressionBasedPointToPointForce": 1}


WHOLE = model(
    "abc",
    [*PINS[1:], custom(coordinate("q"), axis("rotation1", X, DOWN_SPLINE, "q"))],
    coupler("B", "C", line(1, 0)),
)


@pytest.mark.parametrize("fault", FAULTS)
def test_osim_fault_is_one_message(write, fault):
    old, new, said = FAULTS[fault]
    assert old in WHOLE
    case_texts.complains(write(WHOLE.replace(old, new)), said, driven("B:0:0.5:5"))


def test_constraint_left_out_by_name(write):
    text = model("abc", PINS, tagged("PointOnLineConstraint", "", "tie"))
    tree = read_tree(write(text), ["tie"])
    assert any("PointOnLineConstraint" in note for note in tree.notes)


OLD = """<OpenSimDocument Version="30000"><Model name="old"><BodySet><objects>
<Body name="ground"/><Body name="a"><mass>2</mass><Joint><PinJoint name="A">
<parent_body>ground</parent_body><location_in_parent>0 1 0</location_in_parent>
<orientation_in_parent>0 0.5 0</orientation_in_parent><location>0 0 2</location>
<CoordinateSet><objects><Coordinate name="q"><default_value>0.3</default_value></Coordinate>
</objects></CoordinateSet></PinJoint></Joint></Body></objects></BodySet></Model></OpenSimDocument>
"""


def test_older_document_needs_opensim(write, monkeypatch):
    monkeypatch.setitem(sys.modules, "opensim", None)
    with pytest.raises(CaseError, match=r"found 30000, expected 40000 or more; .* pip install"):
        read_tree(write(OLD))


@pytest.mark.skipif(importlib.util.find_spec("opensim") is None, reason="no OpenSim")
def test_older_document_is_updated_by_opensim(write):
    tree = read_tree(write(OLD))
    expected = transform((0, 1, 0), (0, 0.5, 0)) @ transform(angles=(0, 0, 0.3))
    expected = expected @ transform((0, 0, -2))
    assert near(placed(tree, "a"), expected)
    assert tree.moves["q"].value == 0.3


@pytest.mark.parametrize("to", ["osim", "mjcf", "urdf", "sdf"])
def test_exports_keep_joint_limits(write, tmp_path, to):
    """From a start at which they count from another zero; a slide too."""
    limits = "<range>{} {}</range><clamped>true</clamped>".format
    joints = [
        joint("PinJoint", "A", "", "a", coordinate("A", 0.2, limits(-0.5, 0.75))),
        joint("SliderJoint", "B", "a", "b", coordinate("B", 0.05, limits(-0.1, 0.3))),
    ]
    case = load(write(model("ab", joints)), driven("A:0.2:0.6:3", hold=("B",)))
    zeros = {"osim": (0.0, 0.0), "mjcf": (0.0, 0.0), "urdf": (0.2, 0.05), "sdf": (0.4, 0.05)}[to]
    files = model_writer.written(case, writer_of(to), 0.4)
    file = write(next(text for end, text in files.items() if end != ".constraints.json"), f"w.{to}")
    found = undriven_file(file).coordinates
    for name, limits, zero in zip("AB", ((-0.5, 0.75), (-0.1, 0.3)), zeros, strict=True):
        limit = found[name].limit
        assert (limit.lower + zero, limit.upper + zero) == pytest.approx(limits, abs=1e-12)


def test_start_or_drive_beyond_limits(write):
    bounded = "<range>-0.5 0.75</range><clamped>true</clamped>"
    joints = [
        joint("PinJoint", x, "", x.lower(), coordinate(x, v, bounded))
        for x, v in (("A", 0.0), ("B", 0.9), ("C", 0.75))
    ]
    file = write(model("abc", joints))
    case = load(file, driven("A:0:1:5", hold=("B", "C")))
    (note,) = (each for each in case.assembly if "beyond their limits" in each)
    assert note == (
        "joints beyond their limits: A at 0 to 1, limits -0.5 to 0.75; B at 0.9, limits -0.5 to"
        " 0.75"
    )
    assert "beyond" not in " ".join(load(write(model("a", joints[:1])), DRIVE).assembly)


@pytest.mark.parametrize("named", ["", ' name=""'])
def test_components_without_names_are_read(write, named):
    """As OpenSim 4.6 has them: one multiplier for the coupler, and joints that move."""
    coupled = texts(independent_coordinate_names="qa", dependent_coordinate_name="qb") + tagged(
        "coupled_coordinates_function", line(-2.0, 0.0)
    )
    pins = [
        joint("PinJoint", "A", "", "a", coordinate("qa", 0.3)),
        joint("PinJoint", "B", "", "b", coordinate("qb", 0.3)),
    ]
    text = model("ab", pins, tagged("CoordinateCouplerConstraint", coupled))
    text = re.sub(r'(<PinJoint) name="."', rf"\1{named}", text)
    text = text.replace("<CoordinateCouplerConstraint", f"<CoordinateCouplerConstraint{named}")
    case = load(write(text), driven("qa:0.3:0.5:3"))
    assert since_design(case, solution(case), "qb") == pytest.approx([0.0, -0.2, -0.4], abs=EXACT)


@pytest.mark.parametrize("inside", ["locked", "prescribed"])
def test_prescribed_constant_is_its_value(write, inside):
    function = "<prescribed_function><Constant><value>0.4</value></Constant></prescribed_function>"
    still = {
        "locked": coordinate("q2", 0.4, "<locked>true</locked>"),
        "prescribed": coordinate("q2", 0.1, f"{function}<prescribed>true</prescribed>"),
    }
    pins = [
        joint("PinJoint", "A", "", "a", coordinate("q1")),
        joint("PinJoint", "B", "a", "b", still[inside], p=[(1, 0, 0)], c=[(-1, 0, 0)]),
    ]
    case = load(write(model("ab", pins)), driven("q1:0:0.5:3"))
    there = solution(case).points["b"].position[0]
    assert near(there[None], [[1 + math.cos(0.4), math.sin(0.4), 0.0]])


def test_prescribed_motion_is_refused(write):
    function = "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"
    moved = f"<prescribed_function>{function}</prescribed_function><prescribed>true</prescribed>"
    pin = joint("PinJoint", "A", "", "a", coordinate("q", 0.0, moved))
    with pytest.raises(CaseError, match="prescribed by a LinearFunction of time"):
        read_tree(write(model("a", [pin])))
    read_tree(write(model("a", [pin.replace("<prescribed>true", "<prescribed>false")])))


@pytest.mark.parametrize("around", ["Joint", "Constraint", "Body"])
def test_unknown_component_of_set_is_refused(write, around):
    text = FOUR_BAR.replace(f"</objects></{around}Set>", f"<Odd/></objects></{around}Set>")
    assert text != FOUR_BAR
    with pytest.raises(CaseError, match="<Odd>: unknown in <objects>"):
        read_tree(write(text))
