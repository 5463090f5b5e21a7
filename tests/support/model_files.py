"""Models as files, and how they are driven."""

from pathlib import Path

from kincheck import Supplied

from .case_texts import write


def driven(*drive, **options):
    """The options that drive a model."""
    return Supplied(drive=drive, **options)


GRIPPER = Path(__file__).parents[1] / "data" / "mjcf" / "robotiq_2f85.xml"
SPRINGS = ("right_spring_link_joint", "left_spring_link_joint")
DRIVEN = driven("right_driver_joint:0:0.8:17", hold=SPRINGS)
COUPLING = '<joint joint1="right_driver_joint" joint2="left_driver_joint" polycoef="0 1 0 0 0"'


def edited(folder, text, *edits, name="model.xml"):
    """A text with edits, each where it occurs first, as a file."""
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    return write(folder, text, name)
