"""What is made of many variants: extremes, moments, quantiles and gradients, held against closed
forms.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from kincheck.cases import load
from kincheck.core import solve
from kincheck.core.case.case import Output
from kincheck.core.case.measures import Component, JointAngle, Orientation
from kincheck.core.case.quantity import with_markers
from kincheck.core.studies.tolerance.statistics import (
    QUANTILES,
    merged,
    nothing,
    quantiles,
    summary_of,
)
from kincheck.core.studies.tolerance.study import Ready, Study, gradients

from ..support.fakes import crank
from .test_vary import vary

BALL = {"at": "ball", "sigma": 1.0}
AXIS = {"at": "joints.lca_pivot.axis", "sigma": 0.1}


def test_summaries_of_parts_are_the_summary_of_all():
    """Ten thousand times as far from zero as they are apart: the sum of squares must not be a
    difference of large numbers.
    """
    random = np.random.default_rng(1)
    values = 1e4 + random.normal(size=(2, 3, 100))
    values[0, 1, random.random(100) < 0.3] = np.nan
    values[1, 2] = np.nan
    values[1, 0, 40:70] = np.nan
    for cuts in ([0, 100], [0, 1, 40, 70, 71, 100], [0, 55, 100]):
        whole = nothing(2, 3)
        for a, b in pairwise(cuts):
            whole = merged(whole, summary_of(values[:, :, a:b], a))
        np.testing.assert_array_equal(whole.count, (~np.isnan(values)).sum(axis=2))
        some = whole.count > 0
        with np.errstate(all="ignore"):
            np.testing.assert_array_equal(whole.least[some], np.nanmin(values[some], axis=1))
            np.testing.assert_array_equal(whole.most[some], np.nanmax(values[some], axis=1))
            np.testing.assert_allclose(
                whole.mean[some], np.nanmean(values[some], axis=1), rtol=1e-14
            )
            np.testing.assert_allclose(
                whole.deviation[some], np.nanstd(values[some], axis=1, ddof=1), rtol=1e-9
            )
        assert np.isnan(
            [each[1, 2] for each in (whole.least, whole.most, whole.mean, whole.deviation)]
        ).all()
        for q in range(2):
            low, high = whole.extremes[q]
            assert np.nanmin(values[q]) in values[q, :, low]
            assert np.nanmax(values[q]) in values[q, :, high]
    assert nothing(1, 2).extremes.tolist() == [[-1, -1]]


def test_quantiles_and_their_standard_errors():
    """The spread of quantiles over many samples is the standard error that each of them is given,
    to the fifth of it.
    """
    random = np.random.default_rng(2)
    kept = random.normal(size=(300, 1000))
    found = quantiles([kept[:, :600], kept[:, 600:]], exact=False)
    np.testing.assert_allclose(found.values, np.quantile(kept, QUANTILES, axis=1), rtol=1e-13)
    np.testing.assert_allclose(found.errors.mean(axis=1), found.values.std(axis=1), rtol=0.2)
    assert quantiles([kept], exact=True).errors is None
    holes = kept[:4].copy()
    holes[1, ::2], holes[2] = np.nan, np.nan
    some = quantiles([holes], exact=True).values
    np.testing.assert_allclose(some[:, 1], np.quantile(kept[1, 1::2], QUANTILES), rtol=1e-13)
    assert np.isnan(some[:, 2]).all()


def rotated(axis, angle, arm):
    """Rodrigues' formula for complex numbers: an imaginary step in them gives derivatives to
    round-off.
    """
    h = axis / np.sqrt(axis @ axis)
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return arm * c + np.cross(h, arm) * s + h * (h @ arm) * (1 - c)


def test_gradients_are_the_closed_form(tmp_path):
    """Of a crank by its tip, its pivot, and the components of its axis, at the samples and at
    design.
    """
    case = crank()
    case = replace(
        case, outputs=(*case.outputs, Output("z", "tip", (0.0, 0.0, 1.0), False, 1e-9, 0.0, "test"))
    )
    variation = vary(
        tmp_path, case, tip={"at": "tip", "sigma": 1}, axis={"at": "joints.pivot.axis", "sigma": 1}
    )
    ready = Ready.of(Study(case, variation, 1, 0))
    found = gradients(ready)
    angle = np.append(case.sweep.change, 0.0)
    for k in range(6):
        step = np.zeros(6, dtype=complex)
        step[k] = 1e-30j
        tip, axis = np.array([0.5, 0.0, 0.0]) + step[:3], np.array([0.0, 0.0, 1.0]) + step[3:]
        at = rotated(axis, angle, tip)
        right = np.stack([at[:, 0] - tip[0], at[:, 1], at[:, 2]]).imag / 1e-30
        np.testing.assert_allclose(found.along[k], right[:, :-1], rtol=0, atol=1e-10)
        np.testing.assert_allclose(found.design[k], right[:, -1], rtol=0, atol=1e-10)
    assert found.accurate.all()
    assert (found.error < 1e-7).all()


def test_coarse_sweep_variants_count_nominal_turns(tmp_path):
    """At the samples and at design, where gradients are read too."""
    output = JointAngle("turned", 1e-9, 0.0, "test", "pivot")
    attitude = Orientation("e0", 1e-9, 0.0, "test", "arm", Component.E0)
    case, values = crank(), np.array([0.0, 20.0, 61.0])
    case = replace(
        case,
        mechanism=with_markers(case.mechanism, [output, attitude]),
        sweep=replace(case.sweep, values=values),
        outputs=(output, attitude),
        reference={},
    )
    ready = Ready.of(Study(case, vary(tmp_path, case, tip={"at": "tip", "sigma": 1}), 1, 0))
    rows, *_ = ready.values(np.full((3, 2), 1e-3))
    wanted = np.array([values, np.cos(0.5 * values)])[:, :, None] + np.zeros(2)
    np.testing.assert_allclose(rows, wanted, rtol=0, atol=1e-12)
    found = gradients(ready)
    assert not np.abs(found.along).max() > 1e-9
    assert not np.abs(found.design).max() > 1e-9


def test_gradients_that_are_rough_say_so(tmp_path, monkeypatch):
    from kincheck.core.studies.tolerance import study as room

    monkeypatch.setattr(room, "STEP", 0.2)
    case = load("mcpherson_strut")
    assert not gradients(
        Ready.of(Study(case, vary(tmp_path, case, axis=AXIS), 1, 0))
    ).accurate.all()


def test_gradients_agree_with_differences_of_whole_sweeps(tmp_path):
    """Of the strut, against `solve` of mechanisms made anew, over another step."""
    case = load("mcpherson_strut")
    study = Study(case, vary(tmp_path, case, ball=BALL), 1, 0)
    found = gradients(Ready.of(study))
    h, values = 1e-4, case.sweep.change
    for k in range(3):
        sides = []
        for sign in (1, -1):
            offset = np.zeros(3)
            offset[k] = sign * h
            joint = replace(
                case.mechanism.joint("ball"),
                point=tuple(np.array(case.mechanism.joint("ball").point) + offset),
            )
            joints = [joint if each.name == "ball" else each for each in case.mechanism.joints]
            sides.append(
                solve(replace(case.mechanism, joints=joints), "stroke", values)
                .points["wheel_center"]
                .position
            )
        rough = (sides[0] - sides[1]) / (2 * h)
        np.testing.assert_allclose(found.along[k, 0], rough[:, 1], rtol=0, atol=1e-7)
        np.testing.assert_allclose(found.along[k, 1], rough[:, 0], rtol=0, atol=1e-7)
