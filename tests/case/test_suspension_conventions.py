"""Suspension outputs of the mirror image, in the other convention and in other axes; what they
are without velocities.
"""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.case.case import Output
from kincheck.core.case.suspension import (
    Convention,
)
from kincheck.core.harness.compare import deviations, output_series

from ..support.suspension_files import STRUT, loaded, mirrored, unreferenced
from ..support.suspension_outputs import ROUND_OFF, TOL, hinged, solved

ONE_SIGN = {"steer_angle", "wheel_center_y"}
"""Outputs that tell left from right, or one convention from the other."""


def test_mirror_image_is_the_other_wheel():
    right, left = solved(loaded(STRUT)), solved(loaded(mirrored(STRUT)))
    assert right.keys() == left.keys()
    for name, series in right.items():
        sign = -1.0 if name.split(".")[0] in ONE_SIGN else 1.0
        for here, there in (
            (series.position, left[name].position),
            (series.velocity, left[name].velocity),
        ):
            if here is not None:
                assert there == pytest.approx(sign * here, abs=ROUND_OFF)
    assert np.ptp(right["toe"].position) > 0.05  # and it is no strut at rest


def test_sae_turns_what_has_axes():
    iso, sae = (
        loaded(unreferenced(STRUT | {"suspension": STRUT["suspension"] | {"convention": each}}))
        for each in Convention
    )
    assert "y left, z up" in iso.signs
    assert "y right, z down" in sae.signs
    found, turned = solved(iso), solved(sae)
    for name, series in found.items():
        assert turned[name].position == pytest.approx(
            (-1.0 if name.split(".")[0] in ONE_SIGN else 1.0) * series.position, abs=1e-15
        )
    senses = [{output.name: output.sense for output in case.outputs} for case in (iso, sae)]
    assert {name for name, sense in senses[0].items() if senses[1][name] != sense} == {
        name for name in found if name.split(".")[0] in ONE_SIGN
    }


def test_axes_of_the_file_do_not_matter():
    """The same car drawn with x to the left, y rearward and z up, or with z down."""
    for turn in (np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.diag([1, -1, -1])):
        turned = mirrored(STRUT, turn)
        turned["suspension"] |= {"side": "right"}
        found, expected = solved(loaded(turned)), solved(loaded(STRUT))
        for name, series in expected.items():
            assert found[name].position == pytest.approx(series.position, abs=ROUND_OFF)


def test_without_velocities_there_are_positions_and_no_slopes():
    case = loaded(STRUT)
    engine = Native()
    full = engine.solve(engine.build(case), case, TOL)
    bare = replace(
        full,
        points={
            name: replace(each, velocity=None, acceleration=None)
            for name, each in full.points.items()
        },
    )
    found = {output.name: output_series(case, output, bare) for output in case.outputs}
    assert np.isfinite(found["toe"].position).all()
    assert found["toe"].velocity is None
    for name in ("toe.per_travel", "roll_center_height", "motion_ratio"):
        assert np.isnan(found[name].position).all()


def test_slopes_where_the_wheel_stands_still_are_unknown():
    """A swing axle whose wheel passes the top of its way: travel stops there, and camber does
    not.
    """
    angles = np.linspace(np.pi / 2 - 0.2, np.pi / 2 + 0.2, 5)
    found = hinged(
        (0.0, 0.75, 0.0), (0.0, 0.2, 0.0), (1, 0, 0), angles, ["camber", "roll_center_height"]
    )
    assert np.isfinite(found["camber"].position).all()
    for name in ("camber.per_travel", "roll_center_height"):
        assert np.isnan(found[name].position).tolist() == [False, False, True, False, False]


def test_markers_do_not_widen_tolerances():
    case = loaded(STRUT)
    plain = replace(
        case,
        outputs=(
            Output("x", "wheel_center", (1.0, 0.0, 0.0), True, 1e-9, case.outputs[0].rtol, "test"),
        ),
    )
    one = next(islice((output for output in case.outputs if output.name == "toe.per_travel"), 1))
    series = solved(case)["toe"]
    tolerance = deviations(plain, plain.outputs[0], series, [("x", series)]).velocity.tolerance
    assert deviations(
        case, case.outputs[0], series, [("x", series)]
    ).velocity.tolerance == pytest.approx(tolerance)
    assert one.atol == pytest.approx(1e-9 / 0.61)  # the strut from ball to top


def test_relative_is_measured_from_the_design():
    """A wheel with static angles, each output once as it is and once relative."""
    data = STRUT | {
        "suspension": STRUT["suspension"] | {"static_toe": 0.02, "static_camber": -0.03}
    }
    types = ("toe", "camber", "caster", "scrub_radius")
    outputs = {
        f"{each}{end}": {"type": each, "relative": bool(end)}
        for each in types
        for end in ("", "_change")
    }
    found = solved(loaded(unreferenced(data | {"outputs": outputs})))
    middle = 16  # the design is the middle of the sweep
    for each, design in zip(types, (0.02, -0.03, 0.05306489, 0.0), strict=True):
        absolute, relative = found[each], found[f"{each}_change"]
        assert relative.position == pytest.approx(
            absolute.position - absolute.position[middle], abs=ROUND_OFF
        )
        assert relative.velocity == pytest.approx(absolute.velocity, abs=ROUND_OFF)
        if design:
            assert absolute.position[middle] == pytest.approx(design, abs=1e-8)  # the digits above
