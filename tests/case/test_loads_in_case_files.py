"""Masses and loads of a case file, and forces where rows are redundant within its digits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kincheck import Body, Case, adapters
from kincheck.core.case.case import Sweep, Truth
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.io.outputs import with_all_coordinates
from kincheck.core.harness.run import run
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper

from ..support.case_texts import complains, edited, write
from ..support.engine_forces import force_case
from ..support.examples import examples
from ..support.loaded_slider_crank import loaded
from ..support.loads import loaded as with_loads
from ..support.loads import six
from ..support.mechanisms import BRANCH, chain

WRONG, PLAIN, FORCES = examples(__file__, "wrong", "plain", "forces")

MASS = """mass = 2.5
center_of_mass = [150.0, 0.0, 0.0]
inertia = [250.0, 7300.0, 7400.0, 3.0, -20.0, 0.125]
"""
ALL = PLAIN.replace("[units]", "gravity = [0.0, 0.0, -9806.65]\n[units]") + MASS + FORCES


def test_loads_in_millimetres_and_degrees(tmp_path):
    """kg, s and N are the same everywhere; each number is that of the file in SI, rounded once."""
    mechanism = load_case(write(tmp_path, ALL)).mechanism
    assert mechanism.gravity == (0.0, 0.0, -9.80665)
    arm = mechanism.body("arm")
    assert (arm.mass, arm.center_of_mass) == (2.5, (0.15, 0.0, 0.0))
    assert arm.inertia == (2.5e-4, 7.3e-3, 7.4e-3, 3e-6, -2e-5, 1.25e-7)
    assert mechanism.force("spring") == SpringDamper(
        *("spring", "ground", "arm"),
        points=((0.1, 0.0, 0.3), (0.1, 0.0, 0.0)),
        stiffness=25300.0,
        damping=1700.0,
        free_length=0.2901,
    )
    clock = mechanism.force("clock")
    per_radian = 180.0 / np.pi
    np.testing.assert_allclose(
        [clock.stiffness, clock.damping, clock.free_angle],
        [0.9 * per_radian, 0.018 * per_radian, -np.pi / 4],
        rtol=1e-15,
    )
    assert mechanism.force("push") == Force(
        "push", "arm", (0.3, 0.0, 0.0), (0.0, 0.0, -40.0), "body"
    )
    assert mechanism.force("twist") == Torque("twist", "arm", (0.0, 0.7005, 0.0))


def test_loads_in_si_units(tmp_path):
    in_si = ALL.replace('length = "mm"\nangle = "deg"', "")
    mechanism = load_case(write(tmp_path, in_si)).mechanism
    assert mechanism.gravity == (0.0, 0.0, -9806.65)
    assert mechanism.body("arm").inertia == (250.0, 7300.0, 7400.0, 3.0, -20.0, 0.125)
    assert mechanism.force("clock") == TorsionSpringDamper("clock", "pin", 900.0, 18.0, -45.0)


def test_loads_with_defaults(tmp_path):
    """A mass is a point at the body's origin, a spring is as long as at design."""
    short = ALL.replace(MASS, "mass = 2.5\norigin = [10.0, 0.0, 0.0]\n")
    short = short.replace("free_length = 290.1\n", "").replace("damping = 1.7\n", "")
    mechanism = load_case(write(tmp_path, short)).mechanism
    assert mechanism.body("arm") == Body("arm", (0.01, 0.0, 0.0), mass=2.5)
    spring = mechanism.force("spring")
    assert (spring.damping, spring.free_length) == (0.0, 0.3)


@pytest.mark.parametrize("name", WRONG)
def test_wrong_load_is_refused(name, tmp_path):
    old, new, fragments = WRONG[name]
    complains(write(tmp_path, edited((old, new), base=ALL)), fragments)


def test_torsion_spring_needs_rotation(tmp_path):
    rail = '[joints.rod]\ntype = "spherical"\nbodies = ["ground", "arm"]\npoint = [0, 0, 0]\n'
    text = ALL.replace('joint = "pin"\nstiff', 'joint = "rod"\nstiff') + rail
    complains(write(tmp_path, text), "forces.clock.joint ... has no rotation")


def test_case_text_without_loads(tmp_path):
    text = case_text(load_case(write(tmp_path, PLAIN)))
    assert not any(word in text for word in ("mass", "inertia", "gravity", "forces"))


number = st.floats(-1e6, 1e6).map(lambda x: x if abs(x) > 1e-90 else 0.0)
size = number.map(abs)
vector = st.tuples(number, number, number)
GRID = np.linspace(0.0, 0.25, 3)


@st.composite
def inertia(draw):
    """Return the inertia of a cloud of points, which is that of a rigid body."""
    points = np.array(
        draw(st.lists(st.tuples(*3 * [st.integers(-99, 99)]), min_size=4, max_size=6))
    )
    points = np.vstack([points, np.eye(3)])
    matrix = (points**2).sum() * np.eye(3) - points.T @ points
    return tuple(map(float, six(matrix)))


@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_written_loads_round_trip(tmp_path, data):
    draw = data.draw
    mass = draw(size)
    body = {"mass": mass, "center_of_mass": draw(vector)}
    if mass and draw(st.booleans()):
        body["inertia"] = draw(inertia())
    frame = draw(st.sampled_from(["global", "body"]))
    forces = (
        SpringDamper(
            *("s", "slider", "crank"),
            (draw(vector), (0.5, 0.25, 2e6)),
            draw(size),
            draw(size),
            draw(st.none() | size),
        ),
        TorsionSpringDamper("t", "pin", draw(size), draw(size), draw(number)),
        Force("f", "crank", draw(vector), draw(vector), frame),
        Torque("a name of two", "ground", draw(vector), frame),
    )
    bodies = [Body("crank", **body), *loaded().bodies[1:]]
    mechanism = replace(loaded(), bodies=bodies, gravity=draw(vector), forces=forces)
    case = Case("loaded", "test", Truth.CONSENSUS_ONLY, mechanism, Sweep("turn", GRID), ())
    text = case_text(with_all_coordinates(case))
    assert load_case(write(tmp_path, text)).mechanism == mechanism


def test_missing_forces_are_reported():
    case = force_case(with_loads(chain(1)), [0.0, 0.7, 1.4, BRANCH, 2.3, 3.0])
    (record,) = run([case], [adapters.engine("native")], tol=1e-12).records
    assert (record.solved, record.samples) == (6, 6)
    assert "no forces at 1 sample" in record.message
