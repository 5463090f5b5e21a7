"""Models as files, how they are driven, and the one message of a faulty one."""

import re
from pathlib import Path

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError


def driven(*drive, **options):
    """The options that drive a model."""
    return Supplied(drive=drive, **options)


GRIPPER = Path(__file__).parents[1] / "data" / "mjcf" / "robotiq_2f85.xml"
SPRINGS = ("right_spring_link_joint", "left_spring_link_joint")
DRIVEN = driven("right_driver_joint:0:0.8:17", hold=SPRINGS)
COUPLING = '<joint joint1="right_driver_joint" joint2="left_driver_joint" polycoef="0 1 0 0 0"'


def complains(file, supplied, said, read=load):
    """A file is refused in one line that begins with it; " ... " stands for any text there."""
    with pytest.raises(CaseError) as caught:
        read(file, supplied)
    parts = f"{file}: ... {said} ... ".split(" ... ")
    assert re.fullmatch(".*".join(map(re.escape, parts)), str(caught.value)), caught.value


def written(folder, text, name="model.xml"):
    """A text as a file."""
    file = folder / name
    file.write_text(text)
    return file


def edited(folder, text, *edits, name="model.xml"):
    """A text with edits, each where it occurs first, as a file."""
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    return written(folder, text, name)
