"""How an MJCF model is said to be driven: what is wrong with it is one message."""

import math
from dataclasses import replace

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load

from ...support.case_texts import complains, write
from ...support.model_files import COUPLING, DRIVEN, GRIPPER, SPRINGS, driven, edited

DRIVES = {
    "nothing said": (
        Supplied(),
        "3 degrees of freedom ... nothing says what drives it ... JOINT:START:STOP ... 2 more",
    ),
    "one short": (
        Supplied(drive=DRIVEN.drive, hold=SPRINGS[:1]),
        "3 degrees of freedom, and 2 driven or held ... --hold JOINT for 1 more",
    ),
    "one too many": (
        Supplied(drive=DRIVEN.drive, hold=(*SPRINGS, "left_coupler_joint")),
        "4 driven or held ... fewer --hold, by 1",
    ),
    "only held": (Supplied(hold=SPRINGS), "2 driven or held ... --drive JOINT:START:STOP"),
    "misspelt": (driven("right_drive_joint:0:1"), "--drive ... 'right_driver_joint'"),
    "no range": (
        driven("right_driver_joint"),
        "--drive ... JOINT:START:STOP ... rad or m ... right_driver_joint:START:STOP",
    ),
    "no end": (
        driven("right_driver_joint:0"),
        "say from where to where: right_driver_joint:START:STOP",
    ),
    "misspelt, no range": (
        driven("right_drive_joint"),
        "did you mean 'right_driver_joint'?",
    ),
    "too many samples": (
        driven("right_driver_joint:0:1:2000000"),
        "2 to 1000000 samples; correct the numbers",
    ),
    "no numbers": (
        driven("right_driver_joint:0:wide"),
        "--drive ... correct the numbers",
    ),
    "no samples": (
        driven("right_driver_joint:0:1:0"),
        "--drive ... correct the numbers",
    ),
    "degrees without a unit": (
        driven("right_driver_joint:0:360:9"),
        "would turn 57.3 times ... :0:360deg:9 for degrees ... right_driver_joint:0:360rad:9",
    ),
    "another quantity": (
        driven("right_driver_joint:0:40mm"),
        "--drive ... correct the numbers",
    ),
    "nowhere": (driven("right_driver_joint:1:1"), "--drive ... correct the numbers"),
    "two": (
        driven("right_driver_joint:0:1", "left_driver_joint:0:1"),
        "2 driven or held ... --hold JOINT for 2 more ... others for 1 that depend on each other",
    ),
    "hold misspelt": (
        Supplied(drive=DRIVEN.drive, hold=("right_spring_link",)),
        "--hold ... 'right_spring_link_joint'",
    ),
    "hold driven": (
        Supplied(drive=DRIVEN.drive, hold=("right_driver_joint",)),
        "--hold ... which is driven",
    ),
}


@pytest.mark.parametrize(
    ("supplied", "found"),
    [
        (
            DRIVEN,
            (
                "--drive: found 'right_driver_joint', which an equality of the file locks, expected"
                " a joint that moves; name another"
            ),
        ),
        (
            driven("left_driver_joint:0:0.8", hold=("right_driver_joint",)),
            "joint that moves; leave it out",
        ),
    ],
)
def test_locked_joint_is_not_driven(tmp_path, found, supplied):
    complains(
        edited(tmp_path, GRIPPER.read_text(), (COUPLING, '<joint joint1="right_driver_joint"')),
        found,
        supplied,
    )


@pytest.mark.needs("hardpoints")
def test_driven_model_takes_no_template():
    complains(GRIPPER, "--template", Supplied("mcpherson", drive=DRIVEN.drive))
    complains(GRIPPER, "--units ... a model ... --drive, --hold", Supplied(units="mm"))


@pytest.mark.parametrize("kind", DRIVES)
def test_drive_and_hold_faults(kind):
    supplied, said = DRIVES[kind]
    complains(GRIPPER, said, supplied)


@pytest.mark.parametrize("drive", ["0:20deg:5", "0:0.3490658503988659rad:5"])
def test_drive_takes_angle_unit(drive):
    case = load(GRIPPER, replace(DRIVEN, drive=(f"right_driver_joint:{drive}",)))
    assert case.sweep.values[-1] - case.sweep.values[0] == pytest.approx(math.radians(20.0))


CHAIN = """<mujoco><worldbody><body name="base"><joint name="ja" axis="0 0 1"/>
<geom size="0.02"/><body name="upper" pos="0.5 0 0"><joint name="shoulder" type="ball"/>
<geom size="0.02"/><body name="lower" pos="0.2 0 0"><joint name="elbow" type="ball"/>
<geom size="0.02" pos="0.1 0 0"/></body></body></body></worldbody></mujoco>"""


def test_hold_rest_holds_balls_of_rods(tmp_path):
    """A link between two balls is a rod, unless both are held."""
    file = write(tmp_path, CHAIN, "model.xml")
    held = load(file, driven("ja:0:0.3:3", hold=("shoulder", "elbow")))
    rest = load(file, driven("ja:0:0.3:3", hold_rest=True))
    assert rest.mechanism == held.mechanism
    assert any(
        each.startswith("warning: held by --hold-rest, without a motor: shoulder, elbow")
        for each in rest.assembly
    )
