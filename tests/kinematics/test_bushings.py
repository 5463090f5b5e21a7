"""Bushings and curves: wrenches in closed form, balance of power, all engines, and their keys.

Expected torques at one pose: gradients of energies in the angles of each law, computed by central
differences of long doubles and, for the Cardan law, read from a record of OpenSim's BushingForce.
"""

import re

import numpy as np
import pytest
from kincheck import GROUND, Body, KincheckError, Mechanism, MechanismError
from kincheck.adapters.shared.force_solution import curve_force, elastic_torque
from kincheck.core.algebra import ZERO, Quat, vec
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.doors import offers
from kincheck.core.kinematics.forces.equations import BodyStates, bushing, force_of
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.mechanism.loads import Bushing
from kincheck.core.primitives import Pose

from ..support.engine_motion import ENGINES, installed
from ..support.examples import examples
from ..support.loads import solved, traced
from ..support.mechanisms import ORIGIN

BUSHED, TORQUES, BAD_VALUES = examples(__file__, "bushed", "torques", "bad_values")

ROTATION = np.array([0.08, -0.05, 0.12])
TABLE = ((-0.01, -200.0), (0.0, 0.0), (0.005, 10.0), (0.02, 1000.0))


def rotated(vector):
    """Return the Euler parameters of a rotation vector."""
    angle = np.linalg.norm(vector)
    return Quat(float(np.cos(angle / 2)), vec((np.sin(angle / 2) / angle * vector).tolist()))


def at_pose(element, u, q):
    """Return an element between the ground and one body at work at a pose at rest."""
    mechanism = Mechanism("block", [Body("block")], [], forces=[element])
    states = BodyStates(frames(mechanism, 1.0), {"block": Pose.of(vec(u), q)}, {}, {})
    return bushing(element, states)


@pytest.mark.parametrize("law", TORQUES)
def test_bushing_torque_by_rotation_law(law):
    element = Bushing("b", GROUND, "block", ORIGIN, turning_stiffness=(100, 200, 50), law=law)
    found = at_pose(element, ORIGIN, rotated(ROTATION))
    assert [*found.wrenches[GROUND].torque] == pytest.approx(TORQUES[law], abs=6e-9)
    assert [*found.wrenches["block"].torque] == pytest.approx([-x for x in TORQUES[law]], abs=6e-9)


def test_bushing_force_and_moment_when_displaced():
    element = Bushing("b", GROUND, "block", ORIGIN, stiffness=(1e5, 2e5, 3e5), preload=(1, 2, 3))
    found = at_pose(element, (0.003, -0.002, 0.004), rotated(ROTATION))
    assert [*found.wrenches[GROUND].force] == pytest.approx([301.0, -398.0, 1203.0], rel=1e-14)
    # the force acts at the second body's point
    assert [*found.wrenches["block"].torque] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    expected = np.cross([0.003, -0.002, 0.004], [301.0, -398.0, 1203.0])
    assert [*found.wrenches[GROUND].torque] == pytest.approx(expected.tolist(), rel=1e-13)


@pytest.mark.parametrize("law", TORQUES)
@pytest.mark.parametrize("angle", [0.3, 1.4, 2.9])
def test_bushing_torque_equals_adapters_matrix_form(law, angle):
    """The adapters' torque, from a rotation matrix, against the one from Euler parameters."""
    axes = ((1.0, 2.0, 0.5), (2.0, -1.0, 0.0))
    element = Bushing("b", GROUND, "block", ORIGIN, axes, turning_stiffness=(30, 70, 110), law=law)
    direction = np.array([0.9, -0.1, 0.2] if law == "cardan" else [0.3, -0.8, 0.5])
    q = rotated(angle * direction / np.linalg.norm(direction))
    triad = np.array(element.triad)
    A = Pose.of(ZERO, q).A
    matrix = np.array([[*(A @ vec(column))] for column in np.eye(3).tolist()]).T
    own = elastic_torque(element, triad @ matrix @ triad.T)
    found = at_pose(element, ORIGIN, q).wrenches[GROUND].torque
    assert [*found] == pytest.approx((triad.T @ own).tolist(), abs=1e-12 * 330)


def test_force_curve_is_smooth_through_rows():
    for x, y in TABLE:
        assert force_of(TABLE, x) == pytest.approx(y, abs=1e-12)
    x = np.linspace(-0.05, 0.06, 2001)
    y = force_of(TABLE, x)
    assert np.diff(y).min() >= 0.0
    slopes = np.diff(y) / np.diff(x)
    # a jump of the slope would be as large as the slopes themselves
    assert np.abs(np.diff(slopes)).max() <= 0.02 * slopes.max()
    assert np.abs(np.diff(y[:3], 2)).max() <= 1e-11
    assert np.abs(np.diff(y[-3:], 2)).max() <= 1e-11
    expected = [curve_force(TABLE, float(each)) for each in x]
    assert y == pytest.approx(expected, abs=1e-11)


def bushed(tmp_path, law):
    """Return a driven arm and hand with a bushing between them, and a spring with a curve."""
    file = tmp_path / f"{law}.toml"
    file.write_text(BUSHED.replace("LAW", law))
    return load_case(file)


@pytest.mark.parametrize("law", TORQUES)
def test_bushing_power_is_balanced(tmp_path, law):
    case = bushed(tmp_path, law)
    for way in (solved, traced):
        forces = way(case.mechanism, case).forces
        assert np.abs(forces.power).max() <= 1e-12 * forces.largest_power.max()


@pytest.mark.parametrize("law", TORQUES)
@ENGINES
def test_bushing_forces_agree_in_all_engines(tmp_path, law, engine):
    engine, native = installed(engine), installed("native")
    case = bushed(tmp_path, law)
    expected, found = (
        each.solve(each.build(case), case, 1e-12).forces for each in (native, engine)
    )
    for name in case.mechanism.drivers:
        scale = np.abs(expected.drivers[name.name]).max()
        assert found.drivers[name.name] == pytest.approx(
            expected.drivers[name.name], abs=1e-11 * scale
        )
    for name in ("b", "s"):
        scale = np.abs(expected.elements[name]).max()
        assert found.elements[name] == pytest.approx(expected.elements[name], abs=1e-11 * scale)


def test_bushing_case_file_round_trip(tmp_path):
    case = bushed(tmp_path, "cardan")
    again = tmp_path / "again.toml"
    again.write_text(case_text(case))
    other = load_case(again).mechanism
    assert other.bushings == case.mechanism.bushings
    assert other.forces == case.mechanism.forces
    front = case.mechanism.bushings[0]
    assert front.name == "h.front"
    assert front.stiffness == (1e6, 2e6, 3e6)
    assert front.turning_stiffness == (1.0, 1.0, 1.0)
    assert case.mechanism.force("b").curve[1] == TABLE


@pytest.mark.parametrize(
    ("given", "expected"),
    BAD_VALUES,
)
def test_bushing_with_bad_values_is_refused(tmp_path, given, expected):
    file = tmp_path / "bad.toml"
    text = BUSHED.replace("LAW", "cardan").replace("stiffness = [1000, 2000, 3000]\n", given + "\n")
    file.write_text(text.replace("turning_stiffness = 1000\n", "").replace(AXES, ""))
    with pytest.raises(KincheckError, match=re.compile(expected, re.DOTALL)):
        load_case(file)


def test_spring_without_stiffness_is_refused(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(re.sub(r"curve = \[\[-50.*\n", "", BUSHED.replace("LAW", "cardan")))
    with pytest.raises(KincheckError, match="stiffness: missing"):
        load_case(file)


def test_bushing_on_unknown_body_is_refused():
    with pytest.raises(MechanismError, match="'wheel'"):
        Mechanism("m", [Body("a")], [], forces=[Bushing("b", "wheel", "a", ORIGIN, stiffness=1.0)])


@pytest.mark.parametrize("target", offers("writers"))
def test_writers_name_omitted_bushings_and_curves(tmp_path, target):
    written = pytest.importorskip("kincheck.core.extensions.exports.model_writer").written
    writer_of = pytest.importorskip("kincheck.core.extensions.exports.command").writer_of
    case = bushed(tmp_path, "cardan")
    text = "".join(map(str, written(case, writer_of(target)).values()))
    assert re.search(r"Left out:[^\n]*force 'b' \(bushing\)[^\n]*force 's'", text)


AXES = "axes = [[0, 1, 0], [0, 0, 1]]\n"
