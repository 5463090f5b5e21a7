"""Points of a wheel in [suspension]: its axis of rotation and its contact, instead of numbers."""

from copy import deepcopy

import numpy as np
import pytest
from kincheck.core import CaseError
from kincheck.core.case.io.case_file import case_text
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES, sample_table

from ..support.rods_of_templates import solved
from ..support.suspension_files import STRUT, loaded, unreferenced

CENTER = np.array(STRUT["points"]["wheel_center"]["position"])
TOE, CAMBER = 0.01, -0.02


def pointed(**changes):
    """The strut's wheel, a right one with x rearward, with points for its radius and axis."""
    data = deepcopy(unreferenced(STRUT))
    spin = [-np.cos(CAMBER) * np.sin(TOE), np.cos(CAMBER) * np.cos(TOE), -np.sin(CAMBER)]
    for name, place in {
        "hub": CENTER + 0.1 * np.array(spin),
        "road": CENTER - [0.0, 0.0, 0.3],
        "inboard": CENTER - [0.0, 0.1, 0.0],
    }.items():
        data["points"][name] = {"body": "knuckle", "position": place.tolist()}
    del data["suspension"]["wheel_radius"]
    data["suspension"] |= {"wheel_axis": "hub", "wheel_contact": "road"} | changes
    return data


def test_points_give_what_the_numbers_give():
    data = deepcopy(unreferenced(STRUT))
    data["suspension"] |= {"static_toe": TOE, "static_camber": CAMBER}
    expected = solved(loaded(data))
    for name, values in solved(loaded(pointed())).items():
        np.testing.assert_allclose(values, expected[name], rtol=1e-12, atol=1e-12, err_msg=name)


FAULTS = [
    ({"wheel_axis": "hubb"}, "suspension.wheel_axis", "did you mean 'hub'"),
    ({"static_toe": 0.01}, "suspension.wheel_axis", "beside static_toe and static_camber"),
    ({"wheel_radius": 0.3}, "suspension.wheel_contact", "beside wheel_radius"),
    ({"wheel_axis": "inboard"}, "suspension.wheel_axis", "not outboard of the wheel's centre"),
    ({"wheel_contact": "strut_top"}, "suspension.wheel_contact", "'strut', expected a point of"),
    ({"wheel_contact": "wheel_center"}, "suspension.wheel_contact", "at the wheel's centre"),
]


@pytest.mark.parametrize(("changes", "key", "words"), FAULTS)
def test_wrong_point_is_told(changes, key, words):
    with pytest.raises(CaseError) as caught:
        loaded(pointed(**changes))
    assert key in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.parametrize("axle", [None, "roll"])
def test_case_file_of_a_table_keeps_the_points(tmp_path, axle):
    table, file = tmp_path / "car.csv", tmp_path / "car.toml"
    table.write_text(sample_table(TEMPLATES["mcpherson"]) + "wheel_axis,1,790,309,\n")
    case = load(table, Supplied(travel="0.04:3", axle=axle))
    file.write_text(case_text(case))
    again = load(file)
    assert (again.mechanism, again.outputs) == (case.mechanism, case.outputs)
    vehicle = again.outputs[0].vehicle
    side = "left_" if axle else ""
    assert (vehicle.wheel_axis, vehicle.wheel_contact) == (
        f"{side}wheel_axis",
        f"{side}wheel_contact",
    )
    assert vehicle.wheel_radius == pytest.approx(0.31)
