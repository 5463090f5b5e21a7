"""Datasets of Adams Solver: statements, joints, motions, springs and refusals.

Joints are judged by the motions that Adams' documentation lets them make, written down by hand.
"""

import math

import numpy as np
import pytest
from kincheck import CaseError
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.extensions.residuals.replay import residuals
from kincheck.core.kinematics import NativeSolver
from scipy.spatial.transform import Rotation

from ...support.adams_texts import AT, AXES, HALF, MM, UNITS, Deck, X, Y, Z, about, driven, jointed
from ...support.case_texts import complains, rows, write
from ...support.examples import examples
from ...support.written_again import written_again

(FAULTS,) = examples(__file__, "faults")


def read(tmp_path, text, **options):
    text = text if isinstance(text, str) else text.text
    return load(write(tmp_path, text, "deck.adm"), Supplied(**options))


def refused(tmp_path, text, **options):
    with pytest.raises(CaseError) as found:
        read(tmp_path, text, **options)
    return str(found.value)


NONE, TURN = np.zeros(3), Rotation.identity()
ANY = about(np.array([0.3, -0.5, 0.8]), 0.7)
PLANE, AWAY = 20.0 * X - 15.0 * Y, np.array([20.0, 30.0, -40.0])
CROSSED = {"of_i": AXES * Rotation.from_euler("x", 90.0, degrees=True)}
# Statement: a motion that it allows, and some that it does not.
MOTIONS = {
    "JOINT/1, REVOLUTE": [(NONE, about(Z, 0.8)), (0.01 * Z, TURN), (NONE, about(X, 1e-3))],
    "JOINT/1, TRANSLATIONAL": [(35.0 * Z, TURN), (0.01 * X, TURN), (NONE, about(Z, 1e-3))],
    "JOINT/1, CYLINDRICAL": [(35.0 * Z, about(Z, 0.8)), (0.01 * X, TURN), (NONE, about(Y, 1e-3))],
    "JOINT/1, SPHERICAL": [(NONE, ANY), (0.01 * X, TURN)],
    "JOINT/1, FIXED": [(NONE, TURN), (0.01 * X, TURN), (NONE, about(Z, 1e-3))],
    "JOINT/1, PLANAR": [(PLANE, about(Z, 0.8)), (0.01 * Z, TURN), (NONE, about(X, 1e-3))],
    "JOINT/1, SCREW, PITCH = 12.0": [
        (12.0 / (2.0 * np.pi) * 0.8 * Z, about(Z, 0.8)),
        (0.01 * Z, TURN),
        (NONE, about(Z, 1e-2)),
    ],
    "JPRIM/1, ATPOINT": [(NONE, ANY), (0.01 * Z, TURN)],
    "JPRIM/1, INLINE": [(35.0 * Z, ANY), (0.01 * X, ANY)],
    "JPRIM/1, INPLANE": [(PLANE, ANY), (0.01 * Z, ANY)],
    "JPRIM/1, ORIENTATION": [(AWAY, TURN), (NONE, about(Z, 1e-3))],
    "JPRIM/1, PARALLEL_AXES": [(AWAY, about(Z, 0.8)), (NONE, about(X, 1e-3))],
}


def left(tmp_path, deck, shift, turn):
    """What a motion of part 2 about the joint's place leaves of the rows [m]."""
    mechanism = read(tmp_path, deck, recorded=True).mechanism
    poses = {"PART_2": deck.poses((shift, turn, AT))}
    return residuals(mechanism, poses).worst("position").value


@pytest.mark.parametrize("ground_first", [False, True])
@pytest.mark.parametrize("statement", MOTIONS)
def test_adams_joint_allows_only_its_motions(tmp_path, statement, ground_first):
    deck = jointed(statement, ground_first=ground_first)
    for k, (shift, turn) in enumerate(MOTIONS[statement]):
        if ground_first:  # a line, plane or axis is J's: it moves with part 2
            shift, turn = -turn.inv().apply(shift), turn.inv()
        rest = left(tmp_path, deck, shift, turn)
        assert rest > 1e-6 if k else rest < 1e-12


def test_adams_hooke_crosses_y_and_x(tmp_path):
    deck = jointed("JOINT/1, HOOKE")
    allowed = about(Y, 0.6) * about(X, 0.9)
    assert left(tmp_path, deck, NONE, allowed) < 1e-12
    assert left(tmp_path, deck, NONE, about(X, 0.6) * about(Y, 0.9)) > 1e-3
    assert left(tmp_path, deck, NONE, about(Z, 0.01)) > 1e-4


@pytest.mark.parametrize("statement", ["JOINT/1, UNIVERSAL", "JPRIM/1, PERPENDICULAR"])
def test_adams_universal_crosses_z_axes(tmp_path, statement):
    deck = jointed(statement, **CROSSED)
    z_i = CROSSED["of_i"].apply([0.0, 0.0, 1.0])
    assert left(tmp_path, deck, NONE, about(Z, 0.6) * about(z_i, 0.9)) < 1e-12
    assert left(tmp_path, deck, NONE, about(np.cross(Z, z_i), 0.01)) > 1e-4


def test_adams_convel_bends_without_twist(tmp_path):
    """Both z axes point away from the centre; the x axes are parallel."""
    deck = jointed("JOINT/1, CONVEL", of_i=HALF * AXES)
    bend = about(math.cos(0.4) * X + math.sin(0.4) * Y, 0.6)
    assert left(tmp_path, deck, NONE, bend) < 1e-12
    assert left(tmp_path, deck, NONE, about(Z, 0.01)) > 1e-4


def test_adams_gcon_keeps_distance(tmp_path):
    deck = Deck(1).part(2).marker(11, 2, AT + 50.0 * X, AXES).marker(12, 1, AT, AXES)
    deck.add("GCON/4, I = 11, FUNCTION = 2*(DM(11, 12) - 20.0) - 60")
    assert left(tmp_path, deck, NONE, ANY) < 1e-12
    assert left(tmp_path, deck, 0.01 * X, TURN) > 5e-6


def solved(case, names=("PART_2",)):
    solver = NativeSolver(order=2).prepare(case.mechanism, case.sweep.path, bodies=names)
    motion = solver(1e-12)
    assert motion.solved.all()
    return {name: (each.r, each.p) for name, each in motion.bodies.items()}


TIMES = np.linspace(0.0, 1.5, 7)
RAMP = np.clip((TIMES - 0.5) / 0.5, 0, 1)
FUNCTIONS = {
    "0.2+30D*TIME": 0.2 + np.pi / 6 * TIMES,
    "2*sin(3*time+10D)/4 - cos(PI*TIME)**2": (
        0.5 * np.sin(3 * TIMES + np.pi / 18) - np.cos(np.pi * TIMES) ** 2
    ),
    "POLY(TIME, 0.5, 1, -2, 3.0E-1)": 1 - 2 * (TIMES - 0.5) + 0.3 * (TIMES - 0.5) ** 2,
    "STEP(TIME, 0.5, 0, 1, 30D)": np.pi / 6 * RAMP**2 * (3 - 2 * RAMP),
    "-(1D3 - 999.5)*TIME*2": -TIMES,
}


def turns(deck, poses):
    """AZ(11, 12): the turn of I from J about J's z."""
    (_, i), (_, j) = deck.placed(11, poses), deck.placed(12, poses)
    x, y = (j.inv() * i).apply([1.0, 0.0, 0.0])[:, :2].T
    return np.arctan2(y, x)


@pytest.mark.parametrize(("function", "expected"), FUNCTIONS.items(), ids=FUNCTIONS)
def test_adams_motion_function_turns_i(tmp_path, function, expected):
    """The function is the angle between markers, which stand 0.4 rad apart in the dataset."""
    deck = driven(function)
    case = read(tmp_path, deck, drive=("time:0:1.5:7",))
    off = turns(deck, solved(case)) - expected
    assert np.abs(np.sin(0.5 * off)).max() < 1e-12


def test_adams_translation_in_file_units(tmp_path):
    units = "UNITS/LENGTH=INCH, MASS=POUND_MASS, FORCE=POUND_FORCE, TIME=MILLISECOND"
    deck = driven("5 + 2*SIN(TIME/100)", "TRANSLATION", "TRANSLATIONAL", units, 0.0, 5.0)
    case = read(tmp_path, deck, drive=("time:0:1.5:7",))
    poses = solved(case)
    factor = 0.0254 / MM  # the deck's places are inches
    poses = {name: (r / factor, p) for name, (r, p) in poses.items()}
    (i, _), (j, axes) = deck.placed(11, poses), deck.placed(12, poses)
    slid = axes.inv().apply(i - j)[:, 2] / MM
    assert slid == pytest.approx(5.0 + 2.0 * np.sin(10.0 * TIMES), abs=1e-11)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("VELOCITY, FUNCTION = 2 + 3*TIME", 0.4 + 2 * TIMES + 1.5 * TIMES**2),
        ("VELOCITY, ICDISP = 0.1\n, FUNCTION = 90D", 0.1 + 0.5 * np.pi * TIMES),
        (
            "ACCELERATION, ICVEL = -1\n, FUNCTION = POLY(TIME, 1, 2, 3)",
            0.4 - TIMES - 0.5 * TIMES**2 + 0.5 * TIMES**3,
        ),
    ],
)
def test_adams_motion_integrates_rates(tmp_path, arguments, expected):
    deck = driven("0")
    deck.lines[-2:] = [f"MOTION/7, ROTATION, JOINT = 1, {arguments}"]
    case = read(tmp_path, deck, drive=("time:0:1.5:7",))
    assert np.abs(np.sin(0.5 * (turns(deck, solved(case)) - expected))).max() < 1e-12


def test_adams_motion_between_markers(tmp_path):
    deck = Deck(5).part(2).marker(11, 2, AT + 7.0 * Z, AXES).marker(12, 1, AT, AXES)
    deck.add("JOINT/1, CYLINDRICAL, I = 11, J = 12", "MOTION/1, I = 11, J = 12, Z, FUNC = 7+TIME")
    deck.add("MOTION/2, I = 11, J = 12, B3, FUNCTION = 90D*TIME")
    case = read(tmp_path, deck, drive=("time:0:1.5:7",))
    poses = solved(case)
    (i, _), (j, axes) = deck.placed(11, poses), deck.placed(12, poses)
    assert axes.inv().apply(i - j)[:, 2] / MM == pytest.approx(7.0 + TIMES, abs=1e-10)
    assert np.unwrap(turns(deck, poses)) == pytest.approx(0.5 * np.pi * TIMES, abs=1e-12)


def test_adams_deck_as_case_file(tmp_path):
    deck = driven("STEP(TIME, 0.5, 0, 1, 30D) + 0.1*SIN(TIME)")
    case = read(tmp_path, deck, drive=("time:0:1.5:7",))
    again = written_again(case, tmp_path)
    for one, other in zip(solved(case)["PART_2"], solved(again)["PART_2"], strict=True):
        assert one == pytest.approx(other, abs=1e-14)


def test_adams_part_inertia_about_centre(tmp_path):
    """A body of six point masses, whose integrals are summed by hand, about a marker elsewhere."""
    rng = np.random.default_rng(2)
    points, masses = rng.uniform(-100.0, 100.0, (6, 3)), rng.uniform(0.5, 2.0, 6)
    centre = masses @ points / masses.sum()
    at, turn = np.array([30.0, -20.0, 10.0]), Rotation.random(random_state=rng)
    x, y, z = turn.inv().apply(points - at).T
    pairs = (y * y + z * z, x * x + z * z, x * x + y * y, x * y, x * z, y * z)
    ip = ", ".join(repr(float(masses @ each)) for each in pairs)
    deck = Deck(7)
    deck.part(2, f", MASS = {float(masses.sum())!r}, CM = 20, IM = 21, IP = {ip}")
    deck.marker(20, 2, centre, Rotation.random(random_state=rng)).marker(21, 2, at, turn)
    deck.joint(1, "REVOLUTE", 2).add("MOTION/1, ROT, JOINT = 1, FUNCTION = TIME")
    (body,) = read(tmp_path, deck).mechanism.bodies
    a = MM * (points - centre)
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, a, strict=True))
    xx, yy, zz, xy, yz, xz = body.inertia
    assert np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) == pytest.approx(tensor, abs=1e-14)
    assert body.center_of_mass == pytest.approx(MM * centre, abs=1e-15)


SPRINGS = [
    "SFORCE/1, TRANSLATIONAL, I = 11, J = 13\n, FUNC = -12*(DM(13,11)-50)\n, -0.4*VR(11,13)",
    "SPRINGDAMPER/1, TRANSLATION, I = 11, J = 13, K = 12, C = 0.4, LENGTH = 50",
    "SPRINGDAMPER/1, TRANSL, I=11, J=13, K=12, C=0.4, LENGTH=45, FORCE=60",
]


def sprung(line):
    deck = Deck(5).part(2, ", MASS = 2, CM = 11, IP = 900, 900, 900")
    deck.joint(1, "TRANSLATIONAL", 2, at=AT + 30.0 * X).marker(13, 1, AT + 110.0 * X, AXES)
    deck.add("ACCGRAV/, KGRAV = -9806.65", line)
    return deck.add("MOTION/1, TRANSLATION, JOINT = 1, FUNCTION = 10*TIME")


@pytest.mark.parametrize("line", SPRINGS)
def test_adams_spring_in_si_units(tmp_path, line):
    (spring,) = read(tmp_path, sprung(line)).mechanism.forces
    found = spring.stiffness, spring.damping, spring.free_length
    assert found == pytest.approx((12000.0, 400.0, 0.05))


TORSIONS = """
as written | 11 | 12 | -3*(AZ(11, 12)-10D) - 0.2*WZ(11, 12, 12) | 10
other way | 12 | 11 | -3*(AZ(12, 11)-10D) - 0.2*WZ(12, 11, 11) | -10
angle of j | 11 | 12 | 3*(AZ(12, 11)+10D) + 0.2*WZ(12, 11, 12) | 10
"""


@pytest.mark.parametrize(("i", "j", "function", "free"), rows(TORSIONS))
def test_adams_torsion_spring_about_z(tmp_path, i, j, function, free):
    """T on I = -3 (AZ(I, J) - 10D) - 0.2 WZ, in N mm: from the markers, in both orders."""
    deck = driven("0.4+TIME")
    deck.add(f"SFORCE/1, ROTATIONAL, I = {i}, J = {j}", f", FUNCTION = {function}")
    mechanism = read(tmp_path, deck).mechanism
    (spring,) = mechanism.forces
    assert mechanism.joint("JOINT_1").bodies == ("ground", "PART_2")
    assert spring.stiffness == pytest.approx(3e-3)
    assert spring.damping == pytest.approx(2e-4)
    # the turn of part 2, 0.4 rad at the start, at which the spring has no torque
    assert spring.free_angle == pytest.approx(math.radians(float(free)) - 0.4)


def test_adams_loads_in_milliseconds(tmp_path):
    """A damper of 0.4 N ms/mm, and gravity in mm/ms^2."""
    deck = sprung("SPRINGDAMPER/1, TRANSL, I=11, J=13, K=12, C=0.4, LENGTH=50")
    deck.lines[deck.lines.index("ACCGRAV/, KGRAV = -9806.65")] = "ACCGRAV/KGRAV = -9.80665E-3"
    deck.units = UNITS.replace("TIME = SECOND", "TIME = MILLISECOND")
    mechanism = read(tmp_path, deck).mechanism
    assert mechanism.forces[0].damping == pytest.approx(0.4)
    assert mechanism.gravity == pytest.approx((0.0, 0.0, -9.80665))


def test_adams_recorded_deck_drives_all_freedoms(tmp_path):
    deck = driven("TIME").part(3).joint(2, "REVOLUTE", 3, 2)
    case = read(tmp_path, deck, recorded=True)
    assert not case.sweep.motions
    assert [each.name for each in case.mechanism.drivers] == ["MOTION_7", "JOINT_2"]
    assert case.unforced == ("JOINT_2",)
    assert any("all follow the recording" in each for each in case.assembly)


def coupled(statement, kinds=("REVOLUTE", "REVOLUTE"), reverse=False):
    deck = Deck(8).part(2).part(3)
    deck.joint(1, kinds[0], 2).joint(2, kinds[1], 3, at=AT + 60 * X)
    if reverse:
        deck.lines[-1] = deck.lines[-1].replace("I = 21, J = 22", "I = 22, J = 21")
    deck.add(statement, f"MOTION/1, {'ROTATION' if kinds[0][0] == 'R' else 'TRANSLATION'}, JOINT=1")
    return deck.add(", FUNCTION = TIME")


def second(tmp_path, deck, number=(21, 22)):
    """Turn and slide of the second joint's marker from the ground, at time 1."""
    poses = solved(read(tmp_path, deck, drive=("time:0:1:2",)), ("PART_2", "PART_3"))
    (i, of_i), (j, of_j) = (deck.placed(each, poses) for each in number)
    x, y = (of_j.inv() * of_i).apply([1.0, 0.0, 0.0])[-1, :2]
    return math.atan2(y, x), float((of_j.inv().apply(i - j) / MM)[-1, 2])


def test_adams_coupler_of_two_joints(tmp_path):
    """r1 q1 + r2 q2 = 0."""
    deck = coupled("COUPLER/1, JOINTS = 1, 2, SCALES = 1, -2")
    assert second(tmp_path, deck)[0] == pytest.approx(0.5)
    deck = coupled("COUPLER/1, JOINTS = 1, 2, TYPE = R:T, SCALES = 30", ("REVOLUTE", "CYLIND"))
    deck.add("MOTION/2, ROT, JOINT = 2, FUNC = 0.1*TIME")
    assert second(tmp_path, deck) == pytest.approx((0.1, -1.0 / 30.0))
    deck = coupled("COUPLER/1, JOINTS = 1, 2, SCALES = 1, 4", ("TRANSLATIONAL", "TRANSLATIONAL"))
    assert second(tmp_path, deck)[1] == pytest.approx(-0.25)


def test_adams_coupler_of_three_joints(tmp_path):
    """r1 q1 + r2 q2 + r3 q3 = 0, the third one driven too."""
    deck = coupled("COUPLER/1, JOINTS = 1, 2, 3, TYPE = R:R:T, SCALES = 1, -2, 3").part(4)
    deck.joint(3, "TRANSLATIONAL", 4, at=AT + 90 * X)
    deck.add("MOTION/3, TRANSLATION, JOINT = 3", ", FUNCTION = 0.2*TIME")
    assert second(tmp_path, deck)[0] == pytest.approx(0.5 * (1.0 + 3.0 * 0.2))


@pytest.mark.parametrize("reverse", [False, True])
def test_adams_gear_ratio_by_pitch_point(tmp_path, reverse):
    """The pitch point is 20 mm from the first axis and 40 mm from the second: w2 = -w1 / 2."""
    deck = coupled("GEAR/1, JOINTS = 1, 2, CV = 30", reverse=reverse)
    tangent = Rotation.from_matrix(np.stack([Z, X, Y], axis=1))
    deck.marker(30, 1, AT + 20.0 * X, tangent)
    assert second(tmp_path, deck)[0] == pytest.approx(-0.5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_adams_rack_rolls_beside_marker(tmp_path, side):
    """The pitch point, 25 mm off along y, moves by 25 mm a radian, along x against the sense."""
    along = Rotation.from_matrix(np.stack([Y, Z, X], axis=1))
    deck = Deck(8).part(2).part(3).joint(1, "REVOLUTE", 2)
    deck.joint(2, "TRANSLATIONAL", 3, at=AT + side * 25.0 * Y, axes=along)
    deck.add("JOINT/3, RACKPIN, I = 11, J = 21, PD = 50", "MOTION/1, ROT, JOINT=1, FUN = TIME")
    assert second(tmp_path, deck)[1] == pytest.approx(-side * 25.0)
    hidden = deck.text.replace("PD = 50", "PD = 90")
    assert "half of PD" in refused(tmp_path, hidden)


def test_adams_marker_by_points_on_axes(tmp_path):
    text = f"""Points
{UNITS}PART/1, GROUND
MARKER/12, PART = 1, QP = 10, 20, 30, ZP = 10, 25, 30, XP = 10, 20, 37
PART/2, QG = 5, 0, 0, ZG = 5, 0, 4, XG = 5, 3, 2
MARKER/11, PART = 2, QP = 20, -5, 30, XP = 20, -5, 36, ZP = 27, -5, 33, USEXP
JOINT/1, REVOLUTE, I = 11, J = 12
MOTION/1, ROTATION, JOINT = 1, FUNCTION = TIME
"""
    (joint,) = read(tmp_path, text).mechanism.joints
    assert joint.axis == pytest.approx((0.0, 1.0, 0.0), abs=1e-15)
    assert joint.point == pytest.approx((0.01, 0.02, 0.03))


def test_adams_marker_relative_to_marker(tmp_path):
    """RM: QP and REULER are those in the marker's frame."""
    plain = driven("TIME")
    moved = "MARKER/12, PART = 1, RM = 13, QP = 1, 2, 3, REULER = 40D, 30D, 20D"
    turn = Rotation.from_euler("ZXZ", [40.0, 30.0, 20.0], degrees=True)
    _, at, axes = plain.markers[12]
    base = axes * turn.inv()
    plain.marker(13, 1, at - base.apply([1.0, 2.0, 3.0]), base)
    text = "\n".join(
        moved if line.startswith("MARKER/12") else line for line in plain.text.split("\n")
    )
    (one,), (other,) = (read(tmp_path, each).mechanism.joints for each in (plain, text))
    assert one.axis == pytest.approx(other.axis, abs=1e-14)
    assert one.point == pytest.approx(other.point, abs=1e-14)


def test_adams_exact_part_stays(tmp_path):
    """Of two parts whose markers are 2 mm apart, the one with EXACT coordinates keeps them."""
    deck = Deck(4).part(2, ", EXACT = X:Y:Z:PSI:THETA:PHI").part(3)
    deck.marker(11, 2, AT, AXES).marker(12, 1, AT, AXES)
    deck.marker(21, 3, AT + 2.0 * X, AXES).marker(22, 2, AT, AXES)
    deck.marker(31, 3, AT + 90.0 * Y, AXES).marker(32, 1, AT - 90.0 * Y, AXES)
    deck.add("JPRIM/1, INPLANE, I = 11, J = 12", "JOINT/2, FIXED, I = 21, J = 22")
    case = read(tmp_path, deck, recorded=True)
    one, other = case.mechanism.bodies
    assert one.origin == pytest.approx(MM * deck.parts[2][0], abs=1e-15)
    assert other.origin == pytest.approx(MM * (deck.parts[3][0] - 2.0 * X), abs=1e-14)
    assert any("JOINT_2 by 0.002 m" in each for each in case.assembly)


def test_adams_dialects_read_alike(tmp_path):
    """Abbreviations, continuations, comments, letters, separators."""
    plain = driven("30D*TIME").text
    case = read(tmp_path, plain)
    others = [
        plain.replace("REULER", "REU").replace("PART =", "PA=").replace("JOINT", "joint"),
        plain.replace(", I = 11, J = 12", "\n  , I = 11 ! of part 2\n!, I = 12\n\n, J = 012"),
        plain.replace(", I = 11, J = 12", ", I = 11,\n, J = 12"),
        plain.replace("QP =", "\n& QP ="),
        plain.replace("A deck", "! written by hand\nA deck"),
        plain.replace("\n", "\r\n"),
        plain.replace("END", "REQUEST/1, F2 = AZ(11,12)\\, C = a ) comment\nEND\nJUNK here"),
        plain.replace("END", "GRAPHICS/1, CYLINDER, CM = 11 ; OUTPUT/REQSAVE\nRESULTS/XRF\nEND"),
    ]
    for each in others:
        found = read(tmp_path, each)
        assert found.mechanism.joints == case.mechanism.joints
        assert found.sweep.motions == case.sweep.motions
    assert "GRAPHICS (1), OUTPUT (1), RESULTS (1)" in found.source


def test_adams_separate_markers_are_assembled(tmp_path):
    """A four-bar whose last marker is 0.5 mm and 0.2 degrees off."""
    deck = Deck(4).part(2).part(3).part(4)
    deck.joint(1, "REVOLUTE", 2).joint(2, "SPHERICAL", 3, 2, AT + 80 * Y)
    deck.joint(3, "CYLINDRICAL", 4, 3, AT + 200 * X + 150 * Y)
    last, off = AT + 200 * X, AXES * Rotation.from_euler("x", 0.2, degrees=True)
    deck.marker(41, 4, last + 0.5 * X, off).marker(42, 1, last, AXES)
    deck.add("JOINT/4, REVOLUTE, I = 41, J = 42", "MOTION/1, ROT, JOINT = 1, FUNCTION = 0.1*TIME")
    case = read(tmp_path, deck)
    (note,) = [each for each in case.assembly if "assembled" in each]
    assert "JOINT_4 by 0.0005 m and 0.2 degrees" in note
    names = ("PART_2", "PART_3", "PART_4")
    poses = solved(case, names)
    for k in (1, 2, 3, 4):
        (i, of_i), (j, of_j) = deck.placed(10 * k + 1, poses), deck.placed(10 * k + 2, poses)
        apart = of_j.inv().apply(i - j)
        assert np.abs(apart[:, :2] if k == 3 else apart).max() < 1e-12
        if k != 2:
            z = [0.0, 0.0, 1.0]
            assert np.abs((of_j.inv() * of_i).apply(z)[:, :2]).max() < 1e-12


def test_adams_unclosable_markers_are_refused(tmp_path):
    deck = jointed("JOINT/1, FIXED")
    deck.marker(13, 2, AT + 3.0 * X, AXES).marker(14, 1, AT, AXES)
    deck.add("JPRIM/2, ATPOINT, I = 13, J = 14")
    deck.marker(15, 1, AT + 200.0 * X, AXES).marker(16, 2, AT + 200.0 * X, AXES)
    deck.add("GCON/1, I = 15, FUNCTION = DM(15, 12) - 200", "JPRIM/3, ATPOINT, I = 16, J = 15")
    message = refused(tmp_path, deck)
    assert "cannot be brought together" in message
    assert "line " in message


@pytest.mark.parametrize(
    ("of_i", "words"),
    [
        (HALF * AXES, "180 degrees apart, expected the same direction"),
        (about(X, 0.5) * AXES, "28.6 degrees apart at the start"),
    ],
)
def test_adams_distant_markers_are_refused(tmp_path, of_i, words):
    assert words in refused(tmp_path, jointed("JOINT/1, REVOLUTE", of_i=of_i), recorded=True)


PLAIN = driven("TIME").text


@pytest.mark.parametrize(("line", "message"), rows(FAULTS, named=False))
def test_adams_fault_states_line_and_remedy(tmp_path, line, message):
    text = PLAIN.replace("END", f"{line}\nEND")
    number = text.split("\n").index(line) + 1
    place = "MOTION" if line.startswith("MOTION") else f"line {number}"
    file = write(tmp_path, text, "deck.adm")
    complains(file, f"{place} ... {message} ... ; ", Supplied())


UNREADABLE = """
IF(TIME-1: 0, 0, 1) | IF, which is not read
AKISPL(TIME, 0, 1) | AKISPL, which is not read
DM(11, 12) | DM, which is not read
30D* | its end
__import__('os').system('id') | found
TIME(2) | TIME with 1 arguments
"""


@pytest.mark.parametrize(("function", "message"), rows(UNREADABLE, named=False))
def test_adams_unreadable_motion_is_refused(tmp_path, function, message):
    file = write(tmp_path, driven(function).text, "deck.adm")
    complains(file, f"{message} ... MOTION/7 ... --recorded", Supplied())


def test_adams_ambiguous_continuation_is_refused(tmp_path):
    ends = "POLY(TIME, 0, 1,\n, -2)"
    assert read(tmp_path, driven(ends)).sweep.motions
    kept = read(tmp_path, driven("POLY(TIME, 0, 1\n, 2)")).sweep.motions["MOTION_7"]
    assert kept.at(np.array([1.0]))[1] == pytest.approx(2.0)
    message = refused(tmp_path, driven("POLY(TIME, 0, 1\n, -2)"))
    assert "may be a sum or the next number" in message


def test_adams_without_omits_forces(tmp_path):
    text = PLAIN.replace("END", "BUSHING/3, I = 11, J = 12\nBEAM/1\nBLOB/1, I = 11\nEND")
    case = read(tmp_path, text, without=("BUSHING/3", "beam", "BLOB"))
    assert "left out by --without: BEAM, BLOB, BUSHING/3" in case.assembly
    assert "BUSHING" in refused(tmp_path, text, without=("BEAM", "BLOB"))
    assert "found 'FIELD'" in refused(tmp_path, text, without=("BUSHING", "BEAM", "BLOB", "FIELD"))


def test_adams_deck_without_motion_lists_freedoms(tmp_path):
    deck = jointed("JOINT/1, CYLINDRICAL")
    message = refused(tmp_path, deck)
    assert "2 freedoms left" in message
    assert "JOINT_1.rotation, JOINT_1.translation" in message
    assert "--drive JOINT_1.rotation:START:STOP" in message
    drive = {"drive": ("JOINT_1.rotation:0:0.5:5",)}
    assert "--hold JOINT_1.translation" in refused(tmp_path, deck, **drive)
    case = read(tmp_path, deck, **drive, hold=("JOINT_1.translation",))
    assert turns(deck, solved(case)) == pytest.approx(np.linspace(0.0, 0.5, 5))
    rest = read(tmp_path, deck, **drive, hold_rest=True)
    assert [each.name for each in rest.mechanism.drivers] == [
        "JOINT_1.rotation",
        "JOINT_1.translation",
    ]
    assert "3 of PART_2" in refused(tmp_path, jointed("JOINT/1, SPHERICAL"))


def test_adams_drive_counts_from_marker_axes(tmp_path):
    deck = driven("0")
    deck.lines = deck.lines[:-2]
    case = read(tmp_path, deck, drive=("JOINT_1:0.1:0.9:5",))
    assert turns(deck, solved(case)) == pytest.approx(np.linspace(0.1, 0.9, 5))


def test_adams_first_line_is_title(tmp_path):
    assert "takes for the title" in refused(tmp_path, PLAIN.split("\n", 1)[1])
    assert "'A deck'" in read(tmp_path, PLAIN).source


def test_adams_default_and_factor_units(tmp_path):
    bare = PLAIN.replace(UNITS.strip(), "")
    assert any("no UNITS" in each for each in read(tmp_path, bare).assembly)
    spring = sprung("SPRINGDAMPER/1, TRANSL, I=11, J=13, K=12, LENGTH=50")
    spring.units = "UNITS/LENGTH = MILLIMETER, MASS = KILOGRAM, TIME = SECOND, UCF = 1000"
    case = read(tmp_path, spring)
    assert case.mechanism.forces[0].stiffness == pytest.approx(12000.0)
    assert case.mechanism.gravity == pytest.approx((0.0, 0.0, -9.80665))
