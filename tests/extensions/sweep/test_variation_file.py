"""Files of variations, and their faults."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from kincheck.cases import load
from kincheck.core import CaseError
from kincheck.core.extensions.sweep.variation import Law
from kincheck.core.extensions.sweep.variation_file import read_variation

from ...support.case_texts import rows, validator, write
from ...support.fakes import crank
from ...support.variations import HEAD, moved, vary


@pytest.mark.needs("hardpoints")
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


@pytest.mark.needs("hardpoints")
def test_markers_follow_wheel_centre(tmp_path):
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


def test_variation_units_laws_and_kinds(tmp_path):
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


def test_length_varies_by_one_number(tmp_path):
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


def test_line_follows_its_positions(tmp_path):
    """The strut's slide goes from its foot to its top, and is as long as that in the case file."""
    ends = {"foot": {"at": "strut_slide", "sigma": 1.0}, "top": {"at": "strut_top", "sigma": 1.0}}
    line = {"axis": "joints.strut_slide.axis", "through": ["strut_slide", "strut_top"]}
    case = load("mcpherson_strut")
    offsets = {"foot__x": 0.01, "foot__z": -0.02, "top__y": 0.03}
    for through in (line["through"], line["through"][::-1]):
        found = moved(
            vary(tmp_path, case, tables={"lines": {"strut": {**line, "through": through}}}, **ends),
            **offsets,
        )
        np.testing.assert_allclose(
            found["joints.strut_slide.axis"], [-0.01, 0.03, 0.02], atol=1e-12
        )
    assert "joints.strut_slide.axis" not in moved(vary(tmp_path, case, **ends), **offsets)


# Wrong files of variations, and the messages


FAULTS = [
    *rows(
        """
schema = 'kincheck-case/1' | schema: found 'kincheck-case/1', expected "kincheck-vary/1"
mode = 'random' | mode: found 'random', expected one of monte_carlo, grid, one_at_a_time
hardpoints = {} | hardpoints: found {}, expected a table of at least one hardpoint
units = {} | units.length: missing, expected "m" or "mm" for hardpoints.tip
units = {length = 'inch'} | units.length: found 'inch', expected "m" or "mm"
hardpoints.tip = {sigma = 1.0} | hardpoints.tip.at: missing
hardpoints.tip = {at = 'tip', sigma = 1.0, law = 'normal'} | hardpoints.tip.law: unknown key
hardpoints.tip = {at = 'tipp', sigma = 1.0}
    | hardpoints.tip.at: found 'tipp', expected a position, direction, length,
hardpoints.tip = {at = '', sigma = 1.0}
    | hardpoints.tip.at: found '', expected a text that is not empty
hardpoints.tip = {at = 'tip', sigma = -1.0}
    | hardpoints.tip.sigma: found -1.0, expected a number that is not negative, or three
hardpoints.tip = {at = 'tip', sigma = [1.0, 2.0]}
    | hardpoints.tip.sigma: found [1.0, 2.0], expected
hardpoints.tip = {at = 'tip', sigma = [1.0, -2.0, 0.0]}
    | hardpoints.tip.sigma: found [1.0, -2.0, 0.0], expected
hardpoints.tip = {at = 'tip'}
    | hardpoints.tip: found none of them, expected for monte_carlo: sigma, or half_width
hardpoints.tip = {at = 'tip', sigma = 1, half_width = 1}
    | hardpoints.tip: found half_width and sigma, expected for monte_carlo
hardpoints.tip = {at = 'tip', sigma = 0} | hardpoints: nothing varies
mode = 'grid'\\nhardpoints.tip = {at = 'tip', sigma = 1}
    | found sigma, expected for grid: values, or half_width and steps
mode = 'grid'\\nhardpoints.tip = {at = 'tip', values = [[1], [2]]}
    | hardpoints.tip.values: found [[1.0], [2.0]], expected a list
mode = 'grid'\\nhardpoints.tip = {at = 'tip', values = [1, 1]}
    | hardpoints.tip.values: found an offset twice
mode = 'grid'\\nhardpoints.tip = {at = 'tip', half_width = 1, steps = 1}
    | hardpoints.tip.steps: found 1, expected a whole number
hardpoints.tip = {at = 'tip', sigma = 1}\\nhardpoints.same = {at = 'tip', sigma = 1}
    | hardpoints.same: moves points.tip.position, as does hardpoints.tip, expected one
hardpoints.tip = {at = 'tip', sigma = 1, only = ['pivot']}
    | hardpoints.tip.only: found 'joints.pivot.point', which is not at points.tip.pos
lines.a = {axis = 'joints.pivot.axis', through = ['pivot', 'tip']}
    | lines.a.through: found joints.pivot.axis, which does not go through joints.pivot.point
lines.a = {axis = 'pivot', through = ['pivot', 'tip']}
    | lines.a.axis: found joints.pivot.point, a point [x, y, z], expected a direction
hardpoints.tip = {at = 'tip', sigma = 1.0, distribution = 'triangular'}
    | found sigma, expected for distribution triangular: half_width
hardpoints.tip = {at = 'tip', half_width = 1.0, distribution = 'weibull'}
    | found 'weibull', expected "normal"
hardpoints.tip = {at = 'tip', sigma = 1.0, half_width = 1.0}
    | or both with distribution = "truncated_normal". Correct the keys
limits.y = {} | limits.y: found neither low nor high
limits.y = {low = 2, high = 1} | limits.y: found low = 2 and high = 1
limits.yy = {low = 2} | limits.yy: there is no output 'yy' of the case
correlations.a = {coordinates = ['tip.x', 'tip.y'], matrix = [[1, 0.5]]}
    | correlations.a.matrix: found 1 rows of 2 numbers, expected 2 rows of 2
correlations.a = {coordinates = ['tip.x', 'tip.y'], matrix = [[1, 0.5], [0.4, 1]]}
    | correlations.a.matrix: found 0.5 for tip.x and tip.y, but 0.4 for tip.y and tip.x, expected
correlations.a = {coordinates = ['tip.x', 'tip.y'], matrix = [[2, 0.5], [0.5, 1]]}
    | correlations.a.matrix: found 2 for tip.x and tip.x, expected a number from -1 to 1
correlations.a = {coordinates = ['tip.x', 'tip.y'], matrix = [[0.9, 0.5], [0.5, 1]]}
    | correlations.a.matrix: found 0.9 on the diagonal for tip.x, expected 1
""",
        named=False,
    ),
]


@pytest.mark.parametrize(("change", "message"), FAULTS)
def test_invalid_variation_file_is_refused(tmp_path, change, message):
    tip = {"tip": {"at": "tip", "sigma": 1.0}}
    tables = {**HEAD, "mode": "monte_carlo", "hardpoints": tip} | tomllib.loads(change)
    path = tmp_path / "vary.json"
    path.write_text(json.dumps(tables))
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


def test_absolute_driver_of_varied_point_refused(tmp_path):
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


def test_variation_is_named_with_line(tmp_path):
    text = 'schema = "kincheck-vary/1"\nmode = "monte_carlo"\n[hardpoints.tip]\nsigmma = 1\n'
    with pytest.raises(CaseError, match=r"vary\.toml: line 4: hardpoints\.tip\.sigmma: "):
        read_variation(write(tmp_path, text, "vary.toml"), crank())


def test_variation_schema():
    vary = validator("variation")
    tables = {
        "schema": "kincheck-vary/1",
        "mode": "monte_carlo",
        "units": {"length": "mm"},
        "hardpoints": {"ball": {"at": "joints.ball.point", "sigma": [0.5, 0.5, 0]}},
        "lines": {"slide": {"axis": "joints.slide.axis", "through": ["a", "b"]}},
    }
    assert [*vary.iter_errors(tables)] == []
    for wrong in ({"mode": "many"}, {"hardpoints": {"ball": {"sigma": 0.5}}}, {"lines": {"a": {}}}):
        assert [*vary.iter_errors(tables | wrong)]
