"""The gripper's model, changed, and its one message."""

from pathlib import Path

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError

GRIPPER = Path(__file__).parents[1] / "data" / "mjcf" / "robotiq_2f85.xml"
SPRINGS = ("right_spring_link_joint", "left_spring_link_joint")
DRIVEN = Supplied(drive=("right_driver_joint:0:0.8:17",), hold=SPRINGS)


def complains(file, supplied, *fragments):
    """Exactly a CaseError, on one line, that begins with the file and contains all the
    fragments.
    """
    with pytest.raises(CaseError) as caught:
        load(file, supplied)
    message = str(caught.value)
    assert message.startswith(f"{file}: ")
    assert "\n" not in message
    assert [fragment for fragment in fragments if fragment not in message] == [], message


def edited(tmp_path, *edits):
    text = GRIPPER.read_text()
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    file = tmp_path / GRIPPER.name
    file.write_text(text)
    return file


COUPLING = '<joint joint1="right_driver_joint" joint2="left_driver_joint" polycoef="0 1 0 0 0"'
