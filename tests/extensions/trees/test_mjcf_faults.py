"""MJCF models that are cut, mistyped, open, or beyond what joints can say: one message each, of
file, line, found and remedy.
"""

import pytest

from ...support.case_texts import complains, write
from ...support.examples import examples
from ...support.model_files import DRIVEN, GRIPPER, edited

FAULTS, ALSO = examples(__file__, "faults", "also")


@pytest.mark.parametrize("kind", FAULTS)
def test_mjcf_fault_is_one_message(tmp_path, kind):
    *edit, said = FAULTS[kind]
    edits = [edit, ALSO[kind]] if kind in ALSO else [edit]
    complains(edited(tmp_path, GRIPPER.read_text(), *edits), said, DRIVEN)


WHOLE = GRIPPER.read_text()
TEXTS = {
    "document type": ("<!DOCTYPE mujoco>" + WHOLE, "line 1 ... <!DOCTYPE> ... remove it"),
    "entities": (
        '<!DOCTYPE a [<!ENTITY b "c"><!ENTITY d "&b;&b;&b;&b;">]>' + WHOLE,
        "line 1 ... <!DOCTYPE> ... entities",
    ),
    "external entity": (
        '<!DOCTYPE a SYSTEM "file:///etc/hostname">' + WHOLE,
        "line 1 ... <!DOCTYPE>",
    ),
    "empty": ("", "line 1 ... no element found"),
    "cut": (WHOLE[:3000], "not valid XML"),
    "other document": ("<scene name='a'/>", "<scene> 'a' ... expected a model <mujoco>"),
    "no joint": ("<mujoco><worldbody/></mujoco>", "no body with a joint"),
    "nested": ("<mujoco>" + "<a>" * 300 + "</a>" * 300 + "</mujoco>", "nested more than 200 deep"),
    "undefined entity": ("<mujoco>&bomb;</mujoco>", "undefined entity"),
    "attribute twice": ("<mujoco a='1' a='2'/>", "duplicate attribute"),
    "control characters": (
        "<mujoco><worldbody><body name='&#133;'/></worldbody></mujoco>",
        "control characters",
    ),
    "too large": (" " * 4_000_001, "larger than 4000000 bytes"),
}


@pytest.mark.parametrize("kind", TEXTS)
def test_text_without_mjcf_model_is_refused(tmp_path, kind):
    text, said = TEXTS[kind]
    complains(write(tmp_path, text, "model.xml"), said, DRIVEN)
