"""Written models as a time stepper moves them, against free motion, which is integrated to
round-off.
"""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from kincheck.core import Body, Cylindrical, Mechanism, Point, Revolute, Translational
from kincheck.core.extensions.exports.command import writer_of
from kincheck.core.extensions.exports.model_writer import written
from kincheck.core.extensions.free.free_dynamics import free_motion

from ...support.engine_motion import motion_case
from ...support.mechanisms import ORIGIN

mujoco = pytest.importorskip("mujoco")

Z, DOWN = (0.0, 0.0, 1.0), (0.0, -9.80665, 0.0)
TIMES = np.linspace(0.0, 0.5, 26)

LINKS = [
    Body(name, mass=mass, center_of_mass=center, inertia=(*inertia, 0, 0, 0))
    for name, mass, center, inertia in (
        ("crank", 1.0, (0.0, 0.15, 0.0), (0.0075, 0.0004, 0.0075)),
        ("coupler", 2.0, (0.4, 0.5, 0.0), (0.009, 0.06, 0.06)),
        ("rocker", 1.5, (0.85, 0.35, 0.0), (0.06, 0.005, 0.06)),
    )
]


def four_bar():
    joints = [
        Revolute("A", "ground", "crank", ORIGIN, Z),
        Revolute("B", "crank", "coupler", (0.0, 0.3, 0.0), Z),
        Revolute("C", "coupler", "rocker", (0.8, 0.7, 0.0), Z),
        Revolute("D", "ground", "rocker", (0.9, 0.0, 0.0), Z),
    ]
    point = Point("P", "coupler", (0.8, 0.7, 0.0))
    return Mechanism("four_bar", LINKS, joints, [point], [], gravity=DOWN)


def wedges(last):
    """A loop of slides alone, which only a whole frame closes, with a pendulum.

    Args:
        last: the slide that closes it.
    """
    slides = {
        "across": Translational("across", "ground", "crank", ORIGIN, (1.0, 0.0, 0.0)),
        "slope": Translational("slope", "crank", "coupler", (0.2, 0.3, 0.0), (2.0, 1.0, 0.0)),
        "up": Translational("up", "coupler", "ground", (0.4, 0.5, 0.0), (0.0, 1.0, 0.0)),
    }
    closing = slides.pop(last)
    pin = Revolute("pin", "coupler", "rocker", (0.4, 0.5, 0.0), Z)
    point = Point("P", "rocker", (0.8, 0.7, 0.0))
    joints = [*slides.values(), closing, pin]
    return Mechanism("wedges", LINKS, joints, [point], [], gravity=DOWN)


PLAIN = """<mujoco><option gravity="0 -9.80665 0"/><worldbody><body name="crank">
<inertial pos="0 .15 0" mass="1" diaginertia=".0075 .0004 .0075"/><joint axis="0 0 1"/>
<body><inertial pos=".4 .5 0" mass="2" diaginertia=".009 .06 .06"/>
<joint pos="0 .3 0" axis="0 0 1"/>
<site name="P" pos=".8 .7 0"/><body name="rocker">
<inertial pos=".85 .35 0" mass="1.5" diaginertia=".06 .005 .06"/><joint pos=".8 .7 0" axis="0 0 1"/>
</body></body></body></worldbody><equality><connect body1="rocker" body2="world" anchor=".9 0 0"/>
</equality></mujoco>"""


def texts_of(mechanism, to):
    return written(motion_case(mechanism, [0.0, 1.0]), writer_of(to))


def text_of(mechanism):
    return texts_of(mechanism, "mjcf")[".xml"]


def error(text, mechanism, dt=1e-3):
    """Return the largest distance of a point from its free motion; Runge-Kutta, stiff ties."""
    found = free_motion(mechanism, TIMES)
    expected = found.motion.points["P"].position[found.samples]
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, dt
    model.opt.tolerance, model.opt.iterations = 1e-12, 200
    model.eq_solref[:], model.eq_solimp[:] = (2 * dt, 1.0), (0.9999, 0.9999, 0.001, 0.5, 2.0)
    data, apart = mujoco.MjData(model), 0.0
    for at in expected[1:]:
        mujoco.mj_step(model, data, round((TIMES[1] - TIMES[0]) / dt))
        mujoco.mj_forward(model, data)
        apart = max(apart, float(np.abs(data.site("P").xpos - at).max()))
    return apart


def test_written_hinge_loop_moves_freely():
    mechanism = four_bar()
    assert error(text_of(mechanism), mechanism) < 1.05 * error(PLAIN, mechanism)


@pytest.mark.parametrize("last", ["slope", "up"])
def test_written_weld_loop_moves_freely(last):
    """With a link of 1e-6 kg under the weld the error is 2e-3 m."""
    mechanism = wedges(last)
    text = text_of(mechanism)
    assert "<weld" in text
    assert error(text, mechanism) < 1e-7


@pytest.mark.parametrize(
    "mechanism",
    [four_bar(), wedges("slope"), wedges("up")],
    ids=["hinges", "weld at slope", "weld at guide"],
)
def test_written_mjcf_has_no_armature(mechanism):
    root = ET.fromstring(text_of(mechanism))
    assert "armature" not in {key for each in root.iter() for key in each.attrib}
    masses = [float(each.get("mass")) for each in root.iter("inertial")]
    assert sum(masses) == pytest.approx(4.5, abs=1e-15)


def test_written_urdf_gives_every_mass():
    """Some take 1 kg for a link without a mass: points and links between freedoms too."""
    joint = Cylindrical("guide", "ground", "crank", ORIGIN, Z)
    mechanism = Mechanism("one", LINKS[:1], [joint], [Point("P", "crank", Z)], [])
    root = ET.fromstring(texts_of(mechanism, "urdf")[".urdf"])
    masses = {each.get("name"): each.find("inertial/mass") for each in root.iter("link")}
    assert masses.pop("ground") is None
    weights = {name: float(mass.get("value")) for name, mass in masses.items()}
    assert weights == {"guide.translation.link": 1e-9, "crank": 1.0}
