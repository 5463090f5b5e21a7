"""Wrong files of variations, and the messages."""

import json
from dataclasses import replace

import pytest
from kincheck.cases import load
from kincheck.core import CaseError
from kincheck.core.studies.variation.variation_file import read_variation

from ..support.fakes import crank
from .test_vary import HEAD, vary

FAULTS = [
    (
        {"schema": "kincheck-case/1"},
        "schema: found 'kincheck-case/1', expected \"kincheck-vary/1\"",
    ),
    ({"mode": "random"}, "mode: found 'random', expected one of monte_carlo, grid, one_at_a_time"),
    ({"hardpoints": {}}, "hardpoints: found {}, expected a table of at least one hardpoint"),
    ({"units": {}}, 'units.length: missing, expected "m" or "mm" for hardpoints.tip'),
    ({"units": {"length": "inch"}}, 'units.length: found \'inch\', expected "m" or "mm"'),
    ({"tip": {"sigma": 1.0}}, "hardpoints.tip.at: missing"),
    ({"tip": {"at": "tip", "sigma": 1.0, "law": "normal"}}, "hardpoints.tip.law: unknown key"),
    (
        {"tip": {"at": "tipp", "sigma": 1.0}},
        (
            "hardpoints.tip.at: found 'tipp', expected a position, direction, length, mass or load"
            " of the case;"
        ),
    ),
    (
        {"tip": {"at": "", "sigma": 1.0}},
        "hardpoints.tip.at: found '', expected a text that is not empty",
    ),
    (
        {"tip": {"at": "tip", "sigma": -1.0}},
        "hardpoints.tip.sigma: found -1.0, expected a number that is not negative, or three",
    ),
    (
        {"tip": {"at": "tip", "sigma": [1.0, 2.0]}},
        "hardpoints.tip.sigma: found [1.0, 2.0], expected",
    ),
    (
        {"tip": {"at": "tip", "sigma": [1.0, -2.0, 0.0]}},
        "hardpoints.tip.sigma: found [1.0, -2.0, 0.0], expected",
    ),
    (
        {"tip": {"at": "tip"}},
        "hardpoints.tip: found none of them, expected for monte_carlo: sigma, or half_width",
    ),
    (
        {"tip": {"at": "tip", "sigma": 1, "half_width": 1}},
        "hardpoints.tip: found half_width and sigma, expected for monte_carlo",
    ),
    ({"tip": {"at": "tip", "sigma": 0}}, "hardpoints: nothing varies"),
    (
        {"mode": "grid", "tip": {"at": "tip", "sigma": 1}},
        "found sigma, expected for grid: values, or half_width and steps",
    ),
    (
        {"mode": "grid", "tip": {"at": "tip", "values": [[1], [2]]}},
        "hardpoints.tip.values: found [[1.0], [2.0]], expected a list",
    ),
    (
        {"mode": "grid", "tip": {"at": "tip", "values": [1, 1]}},
        "hardpoints.tip.values: found an offset twice",
    ),
    (
        {"mode": "grid", "tip": {"at": "tip", "half_width": 1, "steps": 1}},
        "hardpoints.tip.steps: found 1, expected a whole number",
    ),
    (
        {"tip": {"at": "tip", "sigma": 1}, "same": {"at": "tip", "sigma": 1}},
        (
            "hardpoints.same: moves points.tip.position, as does hardpoints.tip, expected one of"
            " them to"
        ),
    ),
    (
        {"tip": {"at": "tip", "sigma": 1, "only": ["pivot"]}},
        (
            "hardpoints.tip.only: found 'joints.pivot.point', which is not at points.tip.position"
            " at design"
        ),
    ),
    (
        {
            "tip": {"at": "tip", "sigma": 1},
            "lines": {"a": {"axis": "joints.pivot.axis", "through": ["pivot", "tip"]}},
        },
        (
            "lines.a.through: found joints.pivot.axis, which does not go through joints.pivot.point"
            " and points.tip.position at design"
        ),
    ),
    (
        {
            "tip": {"at": "tip", "sigma": 1},
            "lines": {"a": {"axis": "pivot", "through": ["pivot", "tip"]}},
        },
        "lines.a.axis: found joints.pivot.point, a point [x, y, z], expected a direction",
    ),
]


@pytest.mark.parametrize(("change", "message"), FAULTS)
def test_invalid_variation_file_is_refused(tmp_path, change, message):
    change = dict(change)
    tables = {**HEAD, "mode": "monte_carlo", "hardpoints": {}}
    tables["hardpoints"] = {name: change.pop(name) for name in ("tip", "same") if name in change}
    if not tables["hardpoints"] and "hardpoints" not in change:
        tables["hardpoints"] = {"tip": {"at": "tip", "sigma": 1.0}}
    path = tmp_path / "vary.json"
    path.write_text(json.dumps(tables | change))
    with pytest.raises(CaseError) as error:
        read_variation(path, crank())
    assert str(error.value).startswith(f"{path}: ")
    assert message in str(error.value)


def test_ambiguous_place_is_refused(tmp_path):
    with pytest.raises(
        CaseError,
        match=(
            r"which may be joints.tie_rod.points.0 or joints.tie_rod.points.1, expected one place"
        ),
    ):
        vary(tmp_path, load("mcpherson_strut"), rod={"at": "tie_rod", "sigma": 1.0})


def test_absolute_driver_of_varied_point_is_refused(tmp_path):
    """Its value is another distance from the design for every variant."""
    case = load("mcpherson_strut")
    drivers = [replace(case.mechanism.driver("stroke"), relative=False)]
    absolute = replace(case, mechanism=replace(case.mechanism, drivers=drivers))
    with pytest.raises(
        CaseError,
        match=(
            r"driver 'stroke' of the case gives the absolute position of 'wheel_center', which"
            r" varies"
        ),
    ):
        vary(tmp_path, absolute, wc={"at": "wheel_center", "sigma": 1.0})
    vary(tmp_path, absolute, ball={"at": "ball", "sigma": 1.0})
