"""Wrong files of variations, and the messages."""

import json
import tomllib
from dataclasses import replace

import pytest
from kincheck.cases import load
from kincheck.core import CaseError
from kincheck.core.studies.variation.variation_file import read_variation

from ..support.fakes import crank
from .test_vary import HEAD, vary

MATRIX = "matrix = [[1, 0.5], [0.5, 1]]"
FAULTS = [
    ("schema = 'kincheck-case/1'", "schema: found 'kincheck-case/1', expected \"kincheck-vary/1\""),
    ("mode = 'random'", "mode: found 'random', expected one of monte_carlo, grid, one_at_a_time"),
    ("hardpoints = {}", "hardpoints: found {}, expected a table of at least one hardpoint"),
    ("units = {}", 'units.length: missing, expected "m" or "mm" for hardpoints.tip'),
    ("units = {length = 'inch'}", 'units.length: found \'inch\', expected "m" or "mm"'),
    ("hardpoints.tip = {sigma = 1.0}", "hardpoints.tip.at: missing"),
    (
        "hardpoints.tip = {at = 'tip', sigma = 1.0, law = 'normal'}",
        "hardpoints.tip.law: unknown key",
    ),
    (
        "hardpoints.tip = {at = 'tipp', sigma = 1.0}",
        "hardpoints.tip.at: found 'tipp', expected a position, direction, length,",
    ),
    (
        "hardpoints.tip = {at = '', sigma = 1.0}",
        "hardpoints.tip.at: found '', expected a text that is not empty",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = -1.0}",
        "hardpoints.tip.sigma: found -1.0, expected a number that is not negative, or three",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = [1.0, 2.0]}",
        "hardpoints.tip.sigma: found [1.0, 2.0], expected",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = [1.0, -2.0, 0.0]}",
        "hardpoints.tip.sigma: found [1.0, -2.0, 0.0], expected",
    ),
    (
        "hardpoints.tip = {at = 'tip'}",
        "hardpoints.tip: found none of them, expected for monte_carlo: sigma, or half_width",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = 1, half_width = 1}",
        "hardpoints.tip: found half_width and sigma, expected for monte_carlo",
    ),
    ("hardpoints.tip = {at = 'tip', sigma = 0}", "hardpoints: nothing varies"),
    (
        "mode = 'grid'\nhardpoints.tip = {at = 'tip', sigma = 1}",
        "found sigma, expected for grid: values, or half_width and steps",
    ),
    (
        "mode = 'grid'\nhardpoints.tip = {at = 'tip', values = [[1], [2]]}",
        "hardpoints.tip.values: found [[1.0], [2.0]], expected a list",
    ),
    (
        "mode = 'grid'\nhardpoints.tip = {at = 'tip', values = [1, 1]}",
        "hardpoints.tip.values: found an offset twice",
    ),
    (
        "mode = 'grid'\nhardpoints.tip = {at = 'tip', half_width = 1, steps = 1}",
        "hardpoints.tip.steps: found 1, expected a whole number",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = 1}\nhardpoints.same = {at = 'tip', sigma = 1}",
        "hardpoints.same: moves points.tip.position, as does hardpoints.tip, expected one",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = 1, only = ['pivot']}",
        "hardpoints.tip.only: found 'joints.pivot.point', which is not at points.tip.pos",
    ),
    (
        "lines.a = {axis = 'joints.pivot.axis', through = ['pivot', 'tip']}",
        "lines.a.through: found joints.pivot.axis, which does not go through joints.pivot.point",
    ),
    (
        "lines.a = {axis = 'pivot', through = ['pivot', 'tip']}",
        "lines.a.axis: found joints.pivot.point, a point [x, y, z], expected a direction",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = 1.0, distribution = 'triangular'}",
        "found sigma, expected for distribution triangular: half_width",
    ),
    (
        "hardpoints.tip = {at = 'tip', half_width = 1.0, distribution = 'weibull'}",
        "found 'weibull', expected \"normal\"",
    ),
    (
        "hardpoints.tip = {at = 'tip', sigma = 1.0, half_width = 1.0}",
        'or both with distribution = "truncated_normal". Correct the keys',
    ),
    ("limits.y = {}", "limits.y: found neither low nor high"),
    ("limits.y = {low = 2, high = 1}", "limits.y: found low = 2 and high = 1"),
    ("limits.yy = {low = 2}", "limits.yy: there is no output 'yy' of the case"),
    *(
        (
            f"correlations.a = {{coordinates = {['tip.x', 'tip.y', 'tip.z'][:size]},"
            f" matrix = {matrix}}}",
            f"correlations.a.matrix: {message}",
        )
        for size, matrix, message in (
            (2, "[[1, 0.5]]", "found 1 rows of 2 numbers, expected 2 rows of 2"),
            (
                2,
                "[[1, 0.5], [0.4, 1]]",
                "found 0.5 for tip.x and tip.y, but 0.4 for tip.y and tip.x, expected",
            ),
            (
                2,
                "[[2, 0.5], [0.5, 1]]",
                "found 2 for tip.x and tip.x, expected a number from -1 to 1",
            ),
            (2, "[[0.9, 0.5], [0.5, 1]]", "found 0.9 on the diagonal for tip.x, expected 1"),
            (
                3,
                "[[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]",
                "found the eigenvalue -0.8, expected a positive semidefinite matrix",
            ),
        )
    ),
    (
        f"correlations.a = {{coordinates = ['tip.x', 'tip.w'], {MATRIX}}}",
        "correlations.a.coordinates: there is no coordinate that varies 'tip.w'",
    ),
    (
        f"[correlations.a]\ncoordinates = ['tip.x', 'tip.y']\n{MATRIX}\n"
        f"[correlations.b]\ncoordinates = ['tip.y', 'tip.z']\n{MATRIX}",
        "correlations.b.coordinates: found 'tip.y' here and in correlations.a",
    ),
    (
        "mode = 'grid'\nhardpoints.tip = {at = 'tip', values = [-1, 1]}\n"
        f"correlations.a = {{coordinates = ['tip.x', 'tip.y'], {MATRIX}}}",
        "correlations: found some, expected none, for grid draws nothing",
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
