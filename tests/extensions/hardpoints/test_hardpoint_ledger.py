"""What tables of hardpoints and files beside them have is read, listed, or stops by name."""

import json
import re

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

from ...support.case_texts import write

NAME = "zq_unknown"
BUSHINGS = "[bushings.uca_front]\nstiffness = 5e6\n"
WRONG_BUSHINGS = {
    "table": ("bushings", "bushing"),
    "key": ("stiffness", "stifness"),
    "role": ("uca_front", "uca_frnt"),
    "more": ("[bushings", "[forces.spring]\nq = 1\n[bushings"),
    "no table": (BUSHINGS, "bushings = 5\n"),
    "singular joint": (BUSHINGS, "[joint.uca.bushings.a]\nstiffness = 1\n"),
    "key of joint": (BUSHINGS, "[joints.uca_pivot]\nstiffness = 1\n"),
}


@pytest.mark.parametrize("fault", WRONG_BUSHINGS)
def test_unknown_name_of_bushings_is_named(fault, tmp_path):
    table = write(tmp_path, sample_table(TEMPLATES["double_wishbone"]), "car.csv")
    right = write(tmp_path, BUSHINGS, "right.toml")
    assert load(table, Supplied(bushings=right)).mechanism.bushings
    old, new = WRONG_BUSHINGS[fault]
    file = write(tmp_path, BUSHINGS.replace(old, new), "wrong.toml")
    wrong = re.split(r"[.\]\s]", new.lstrip("["))[0]
    with pytest.raises(CaseError, match=f"wrong.toml: .*{wrong}"):
        load(table, Supplied(bushings=file))


def test_unknown_name_in_names_is_named(tmp_path):
    table = write(tmp_path, sample_table(TEMPLATES["double_wishbone"]), "car.csv")
    for text in (f'{NAME} = "uca_front"\n', f'uca_front = "{NAME}"\n', f"[{NAME}]\na = 1\n"):
        with pytest.raises(CaseError, match=NAME):
            load(table, Supplied(names=write(tmp_path, text, "names.toml")))


def test_unknown_name_of_table_is_listed(tmp_path):
    sample = sample_table(TEMPLATES["double_wishbone"])
    rows = [line.split(",") for line in sample.splitlines() if not line.startswith("#")][1:]
    tree = {name: [float(each) for each in numbers[:3]] for name, *numbers in rows}
    facts = dict(re.findall(r"# (units|axes): ([\w,]+)", sample))
    for name, text in {
        "car.csv": f"{sample.rstrip()}\n{NAME},1,2,3\n",
        "car.json": json.dumps({**facts, **tree, NAME: 5, "setup": {NAME: "x"}}),
        "car.toml": "".join(
            f"{key} = {json.dumps(value)}\n" for key, value in {**facts, **tree, NAME: 5}.items()
        ),
    }.items():
        case = load(write(tmp_path, text, name), Supplied(template="double_wishbone"))
        assert NAME in case.source, name
