"""Splines against the same conditions for their slopes, in fractions, and their refusals."""

import re

import numpy as np
import pytest
from kincheck import MechanismError, Spline

from ..support.examples import examples
from ..support.splines import through

(BAD_POINTS,) = examples(__file__, "bad_points")

X = (-1.3, -0.6, -0.1, 0.0, 0.4, 0.9)
Y = (-0.9, 0.7, -0.2, 0.0, 0.7, 0.8)


def spline(points, **options):
    return Spline("knee", ("slide", "hinge"), points, **options)


@pytest.mark.parametrize("count", range(2, 7))
def test_spline_equals_opensim_spline(count):
    """Two points have a line, three a parabola; beyond the ends it goes on straight."""
    points = (*zip(X[:count], Y[:count], strict=True),)
    found, expected = spline(points).function, through(points)
    for x in (-2.0, -1.29, -0.7, -0.4, -0.05, 0.2, 0.7, 3.0):
        assert found.at(x) == pytest.approx(expected(x), rel=1e-12, abs=1e-12)


def test_spline_of_cubic_is_cubic():
    """As by the third derivatives of its ends; a natural spline is not."""
    cubic = np.polynomial.Polynomial([0.3, -1.0, 0.5, 2.0])
    found = spline((*((x, float(cubic(x))) for x in X),)).function
    for x in np.linspace(X[0], X[-1], 23):
        expected = [cubic.deriv(k)(x) if k else cubic(x) for k in range(3)]
        inside = X[0] < x < X[-1]
        assert found.at(float(x))[: 3 if inside else 2] == pytest.approx(
            expected[: 3 if inside else 2], abs=1e-13
        )


def test_spline_in_units_and_origin():
    points = (*zip(X, Y, strict=True),)
    first = spline(points, freedoms=("translation", "rotation"))
    value, slope, bend = first.function.at(0.2)
    assert first.in_units(1e-3, 0.1).function.at(0.02) == pytest.approx(
        (1e-3 * value, 1e-2 * slope, 0.1 * bend)
    )
    assert first.in_units(1.0, -1.0).function.at(-0.2)[:2] == pytest.approx((value, -slope))
    assert first.counted_from(0.5, 0.2).function.at(0.0) == pytest.approx(
        (value - 0.5, slope, bend)
    )
    assert not first.notes
    (note,) = first.counted_from(0.5, 0.0).notes
    assert "'slide' begins at -0.5" in str(note)


@pytest.mark.parametrize(
    ("points", "message"),
    BAD_POINTS,
    ids=str,
)
def test_spline_of_bad_points_is_refused(points, message):
    with pytest.raises(MechanismError, match=re.escape(message)):
        spline(points)
