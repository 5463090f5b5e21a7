"""A four-bar in URDF, and its file."""

import json

from kincheck import Supplied

from ..extensions.trees.fuzz import urdf as seeds

DRIVE = Supplied(drive=("A:0:0.5:5",))
FOUR_BAR = seeds.FOUR_BAR.decode()
LOOP = FOUR_BAR[FOUR_BAR.index("<constraint") : FOUR_BAR.index("</robot>")]
TREE = FOUR_BAR.replace(LOOP, "")


def robot(folder, text, **beside):
    """Return the file of a robot, and write the files beside it."""
    file = folder / "robot.urdf"
    file.write_text(text)
    for ending, content in beside.items():
        file.with_suffix(f".{ending.replace('_', '.')}").write_text(content)
    return file


COINCIDENT = {
    "joint": "C",
    "kind": "coincident",
    "i": {"link": "b", "point": [4.0, 0.0, 0.0]},
    "j": {"link": "c", "point": [-0.958851077208406, 0.0, 1.7551651237807455]},
}


def beside(folder, **changes):
    """The four-bar, closed by a file beside it."""
    schema = changes.pop("schema", "kincheck-constraints/1")
    table = {"schema": schema, "constraints": [COINCIDENT | changes]}
    return robot(folder, TREE, constraints_json=json.dumps(table))
