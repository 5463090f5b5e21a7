"""Spline: one joint's coordinate is a spline of another's, as in knees of muscle models. 1 row
between two joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Self

import numpy as np

from ..errors import MechanismError
from ..input_checks import finite, plain
from .coupler import Follower, PiecewisePolynomial

MOST = 1000
"""Most points: the solver selects among all pieces at every sample."""


@dataclass(frozen=True)
class Spline(Follower):
    """The first joint (driven) follows the cubic spline through points of the second one's
    coordinate and its own.

    It is OpenSim's SimmSpline, which is that of Forsythe, Malcolm and Moler (Computer methods for
    mathematical computations, 1977): the third derivative at each end is that of the cubic through
    the four points there. Two points have a line, three a parabola. Beyond the ends it goes on
    straight, so the second derivative jumps there.

    Attributes:
        points: pairs of the second joint's coordinate and the first one's, the former increasing
            [m or rad].

    Raises:
        MechanismError: no two pairs of finite numbers, or they do not increase, or are too close.
    """

    type = "spline"
    points: tuple[tuple[float, float], ...]

    def check(self) -> None:
        expected = f"pairs [[driving, driven], ...], from two to {MOST}"
        try:
            points = tuple((plain(x), plain(y)) for x, y in self.points)
        except (TypeError, ValueError):
            points = ()
        if not 2 <= len(points) <= MOST or not all(map(finite, sum(points, ()))):
            raise MechanismError(f"{self}: points: found {self.points}, expected {expected}")
        for (one, _), (other, _) in pairwise(points):
            if not one < other:
                raise MechanismError(
                    f"{self}: points: {other!r} follows {one!r}; the first numbers must increase"
                )
        object.__setattr__(self, "points", points)
        with np.errstate(all="ignore"):
            try:
                sound = all(map(finite, sum(self.function.powers, ())))
            except ValueError:  # points so close that no difference is left
                sound = False
        if not sound:
            raise MechanismError(
                f"{self}: points are too close or too large for a spline; leave some out"
            )
        super().check()

    def in_units(self, length: float, angle: float) -> Self:
        driven, driving = (length if each == "translation" else angle for each in self.freedoms)
        # a mirror image turns the order round
        points = sorted((x * driving, y * driven) for x, y in self.points)
        return replace(self, points=tuple(points))

    def counted_from(self, driven: float, driving: float) -> Self:
        return replace(self, points=tuple((x - driving, y - driven) for x, y in self.points))

    @property
    def function(self) -> PiecewisePolynomial:
        return _through(self.points)


# scipy's make_interp_spline takes third derivatives at the ends too: the same curve, but only to
# 1e-10 where points are uneven, and OpenSim's is met to 4e-14 here.
@cache
def _through(points: tuple[tuple[float, float], ...]) -> PiecewisePolynomial:
    x, y = np.array(points).T
    n, h = len(x), np.diff(x)
    d = np.diff(y) / h
    A, right = np.eye(n), np.zeros(n)  # of the second derivatives at the points
    if n > 2:
        k = np.arange(1, n - 1)
        A[k, k - 1], A[k, k], A[k, k + 1] = h[:-1], 2.0 * (h[:-1] + h[1:]), h[1:]
        right[1:-1] = 6.0 * np.diff(d)
        A[0, :2] = A[-1, -2:] = -1.0, 1.0
    if n > 3:
        right[0], right[-1] = h[0] * _third(points[:4]), h[-1] * _third(points[-4:])
    bends = np.linalg.solve(A, right)
    slopes = d - h * (2.0 * bends[:-1] + bends[1:]) / 6.0
    end = float(d[-1] + h[-1] * (bends[-2] + 2.0 * bends[-1]) / 6.0)
    columns = y[:-1], slopes, 0.5 * bends[:-1], np.diff(bends) / (6.0 * h)
    pieces: list[tuple[float, ...]] = [(*row,) for row in np.transpose(columns).tolist()]
    first, last = (
        (float(c), float(slope), 0.0, 0.0) for c, slope in ((y[0], slopes[0]), (y[-1], end))
    )
    starts = x.tolist()
    return PiecewisePolynomial((starts[0], *starts), (first, *pieces, last))


def _third(points: Sequence[tuple[float, float]]) -> float:
    """Return the third derivative of the cubic through four points, by divided differences."""
    x, y = map(np.array, zip(*points, strict=True))
    for k in (1, 2, 3):
        y = np.diff(y) / (x[k:] - x[:-k])
    return 6.0 * float(y[0])
