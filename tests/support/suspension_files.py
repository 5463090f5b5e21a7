"""Case files of suspensions as data to be changed, and the case of such data."""

import json
import tempfile
import tomllib
from copy import deepcopy
from pathlib import Path

import numpy as np
from kincheck import Supplied, cases
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.models.files import load
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

STRUT = tomllib.loads(cases.file("mcpherson_suspension").read_text())
AXES = {"convention": "iso8855", "forward": [1, 0, 0], "up": [0, 0, 1]}
MIRROR = np.diag([1, -1, 1])


TABLE = cases.file("mcpherson_suspension").with_suffix(".csv").read_text()


TOE = {"outputs": {"toe": {"type": "toe"}}}


def changed(table="suspension", data=STRUT, **keys):
    """The data with keys of a top-level table changed, or left out where None."""
    table_keys = (data[table] | keys).items()
    return data | {table: {key: value for key, value in table_keys if value is not None}}


def unreferenced(data):
    """The same data without true values."""
    return {key: value for key, value in data.items() if key not in ("reference", "truth")}


def loaded(data, csv=TABLE):
    """The case that a file with this data, and the strut's table beside it, describes."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "mcpherson_suspension.csv").write_text(csv)
        file = Path(folder) / "case.json"
        file.write_text(json.dumps(data))
        return load_case(file)


def strut_of_table(folder, travel, more="", **options):
    """The case of the sample table of a strut, with further rows, in car.csv."""
    file = folder / "car.csv"
    file.write_text(sample_table(TEMPLATES["mcpherson"]) + more)
    return load(file, Supplied(travel=travel, **options))


def mirrored(data, turn=MIRROR):
    """The same data in other axes, without a reference; a mirror image is a wheel of the other
    side.
    """
    data = deepcopy(unreferenced(data))

    def moved(table, *names):
        for name in names:
            if name in table:
                table[name] = (np.array(table[name], dtype=float) @ turn.T).tolist()

    for body in data["bodies"].values():
        moved(body, "origin")
        body.pop("euler_parameters", None)
    for joint in data["joints"].values():
        moved(joint, "point", "axis", "points")
    for point in data["points"].values():
        moved(point, "position")
    for driver in data["drivers"].values():
        moved(driver, "direction")
    moved(data["suspension"], "forward", "up")
    data["suspension"]["side"] = "left"
    return data
