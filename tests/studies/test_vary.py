"""Files that say what varies: what moves together, units, draws by seed and index."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from kincheck.cases import load
from kincheck.core import CaseError
from kincheck.core.studies.variation.variation import Law
from kincheck.core.studies.variation.variation_file import read_variation

from ..support.fakes import crank

HEAD = {"schema": "kincheck-vary/1", "units": {"length": "mm", "angle": "deg"}}


def vary_file(folder, hardpoints, mode="monte_carlo", **tables):
    """A file of these hardpoints, in millimetres and degrees."""
    path = folder / "vary.json"
    path.write_text(json.dumps({**HEAD, "mode": mode, "hardpoints": hardpoints, **tables}))
    return path


def vary(tmp_path, case, mode="monte_carlo", lines=None, **hardpoints):
    """The variation that a file of these hardpoints gives."""
    return read_variation(vary_file(tmp_path, hardpoints, mode, lines=lines or {}), case)


def moved(variation, **offsets):
    """Values of the places that move, with these offsets of coordinates [SI]; dots are written as
    two underscores.
    """
    names = [each.name.replace(".", "__") for each in variation.coordinates]
    column = np.array([offsets.pop(name, 0.0) for name in names])
    assert not offsets
    before = variation.values(np.zeros(len(names)))
    return {
        place: np.subtract(value, before[place])
        for place, value in variation.values(column).items()
    }


def test_coincident_places_move_together(tmp_path):
    case = load("mcpherson_suspension")
    together = moved(vary(tmp_path, case, ball={"at": "ball", "sigma": [1, 0, 2]}), ball__x=0.25)
    assert set(together) == {"joints.ball.point", "points.lower_ball.position"}
    for change in together.values():
        np.testing.assert_allclose(change, [0.25, 0, 0], atol=1e-16)
    alone = vary(
        tmp_path, case, ball={"at": "lower_ball", "sigma": 1.0, "only": ["joints.ball.point"]}
    )
    assert set(alone.places) == {"joints.ball.point"}


def test_markers_go_with_the_wheel_centre(tmp_path):
    """Else the wheel's axis of rotation, which goes through both, would turn."""
    found = moved(
        vary(tmp_path, load("mcpherson_suspension"), wc={"at": "wheel_center", "sigma": 1.0}),
        wc__y=0.5,
    )
    assert set(found) == {
        f"points.{name}.position"
        for name in ("wheel_center", "~wheel_center.spin", "~wheel_center.top")
    }
    assert all(np.allclose(change, [0, 0.5, 0], atol=1e-15) for change in found.values())


def test_units_laws_and_kinds_of_places(tmp_path):
    found = vary(
        tmp_path,
        load("modelica_four_bar_distance"),
        pivot={"at": "joints.slide.point", "half_width": [1.0, 0.0, 2.0]},
        axis={"at": "joints.slide.axis", "sigma": 0.5},
    )
    assert [(each.name, each.unit, each.law) for each in found.coordinates] == [
        ("pivot.x", "m", Law.UNIFORM),
        ("pivot.z", "m", Law.UNIFORM),
        *((f"axis.{axis}", "rad", Law.NORMAL) for axis in "xyz"),
    ]
    assert [each.scale for each in found.coordinates] == pytest.approx(
        [1e-3, 2e-3] + [np.radians(0.5)] * 3
    )


def test_a_length_varies_by_one_number(tmp_path):
    case = load("modelica_four_bar_distance")
    joints = [
        replace(joint, length=1.1) if joint.name == "rod" else joint
        for joint in case.mechanism.joints
    ]
    rod = replace(case, mechanism=replace(case.mechanism, joints=joints))
    found = vary(tmp_path, rod, "grid", rod={"at": "joints.rod.length", "values": [-1, 2]})
    assert [found.values(found.of_variant(0, k))["joints.rod.length"] for k in range(2)] == [
        pytest.approx((1.099,)),
        pytest.approx((1.102,)),
    ]
    with pytest.raises(
        CaseError,
        match=r"hardpoints.rod: found \[1.0, 1.0, 1.0\], expected one number, for it is a length",
    ):
        vary(tmp_path, rod, rod={"at": "joints.rod.length", "sigma": [1, 1, 1]})
    with pytest.raises(
        CaseError, match=r"hardpoints.rod.values: .+ expected a list of offsets, for it is a length"
    ):
        vary(tmp_path, rod, "grid", rod={"at": "joints.rod.length", "values": [[1], [1], [1]]})


def test_a_line_follows_the_positions_it_goes_through(tmp_path):
    """The strut's slide goes from its foot to its top, and is as long as that in the case file."""
    ends = {"foot": {"at": "strut_slide", "sigma": 1.0}, "top": {"at": "strut_top", "sigma": 1.0}}
    line = {"axis": "joints.strut_slide.axis", "through": ["strut_slide", "strut_top"]}
    case = load("mcpherson_strut")
    offsets = {"foot__x": 0.01, "foot__z": -0.02, "top__y": 0.03}
    for through in (line["through"], line["through"][::-1]):
        found = moved(
            vary(tmp_path, case, lines={"strut": {**line, "through": through}}, **ends), **offsets
        )
        np.testing.assert_allclose(
            found["joints.strut_slide.axis"], [-0.01, 0.03, 0.02], atol=1e-12
        )
    assert "joints.strut_slide.axis" not in moved(vary(tmp_path, case, **ends), **offsets)


def test_a_grid_has_every_combination_once(tmp_path):
    ends = {
        "tip": {"at": "tip", "values": [[-1, 0, 1], [0, 2], [0.5]]},
        "pivot": {"at": "pivot", "half_width": [5, 0, 0], "steps": 5},
    }
    found = vary(tmp_path, crank(), "grid", **ends)
    assert found.count == 3 * 2 * 1 * 5
    rows = (found.offsets(0, 0, found.count).T * 1e3).tolist()
    expected = [[*each] for each in product((-1, 0, 1), (0, 2), (0.5,), (-5, -2.5, 0, 2.5, 5))]
    np.testing.assert_allclose(rows, expected, atol=1e-15)
    # as many digits as it takes
    pivot = {"at": "pivot", "half_width": 1, "steps": 10_000}
    huge = vary(
        tmp_path, crank(), "grid", tip={"at": "tip", "half_width": 1, "steps": 10_000}, pivot=pivot
    )
    assert huge.count == 10**24


def test_one_at_a_time_begins_with_the_nominal_design(tmp_path):
    points = {
        "tip": {"at": "tip", "sigma": [1, 0, 2]},
        "pivot": {"at": "pivot", "values": [[-3, 0, 3], [4], [5]]},
    }
    found = vary(tmp_path, crank(), "one_at_a_time", **points)
    assert found.count == 1 + 2 + 2 + 2 + 1 + 1
    offsets = found.offsets(0, 0, found.count) * 1e3
    assert not offsets[:, 0].any()
    assert [(int(np.flatnonzero(c)[0]), round(c.sum())) for c in offsets.T[1:]] == [
        *((0, -1), (0, 1), (1, -2), (1, 2), (2, -3), (2, 3), (3, 4), (4, 5))
    ]
