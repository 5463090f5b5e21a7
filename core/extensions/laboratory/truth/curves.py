"""Functions of coordinates in extended precision: polynomials, and splines solved for in fractions.

The unknowns of a spline are its slopes at the points, not the second derivatives that are usual.
With widths h and steps d, the second derivatives of neighbours agree at an inner point,

    h_k s_(k-1) + 2 (h_(k-1) + h_k) s_k + h_(k-1) s_(k+1) = 3 (h_k d_(k-1) + h_(k-1) d_k)

and at an end the third derivative is that of the cubic through four points, whose divided
difference is f: s_0 + s_1 = 2 d_0 + h_0^2 f. Three points have a parabola, for which f is zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Real: TypeAlias = NDArray[Any]
"""Array of longdoubles; see `rows`."""


@dataclass(frozen=True, eq=False)
class Function:
    """Polynomials, each from its start on, the first also before.

    Attributes:
        starts: shape (pieces,).
        powers: coefficients of powers of the distance from the start, shape (powers, pieces).
    """

    starts: Real
    powers: Real

    @staticmethod
    def of(coupler: Any) -> Function:
        """Return the function by which the first joint of a coupler follows the second one."""
        if coupler.type == "polynomial":
            powers = np.array(coupler.coefficients, dtype=np.longdouble)
            return Function(np.zeros(1, dtype=np.longdouble), powers[:, None])
        starts, pieces = _spline([(Fraction(x), Fraction(y)) for x, y in coupler.points])
        return Function(_extended(starts), np.transpose([_extended(each) for each in pieces]))

    def at(self, x: Real) -> tuple[Real, Real, Real]:
        """Return value, slope and second derivative at coordinates, shape (n,)."""
        piece = np.maximum(np.searchsorted(self.starts, x, side="right") - 1, 0)
        s, powers = x - self.starts[piece], [*self.powers[:, piece]]
        found = list[Real]()
        for _ in range(3):
            found.append(sum((c * s**k for k, c in enumerate(powers)), np.zeros_like(x)))
            powers = [k * c for k, c in enumerate(powers)][1:]
        return found[0], found[1], found[2]


def _extended(values: Sequence[Fraction]) -> Real:
    return np.array([np.longdouble(str(Decimal(x.numerator) / x.denominator)) for x in values])


def _spline(
    points: Sequence[tuple[Fraction, Fraction]],
) -> tuple[list[Fraction], list[list[Fraction]]]:
    """Return starts and powers of the pieces, those beyond the ends too."""
    x, y = map(list, zip(*points, strict=True))
    h = [b - a for a, b in pairwise(x)]
    d = [(b - a) / width for (a, b), width in zip(pairwise(y), h, strict=True)]
    s = _slopes(points, h, d)
    pieces = [
        [y[k], s[k], (3 * d[k] - 2 * s[k] - s[k + 1]) / w, (s[k] + s[k + 1] - 2 * d[k]) / w**2]
        for k, w in enumerate(h)
    ]
    none = Fraction(0)
    return [x[0], *x], [[y[0], s[0], none, none], *pieces, [y[-1], s[-1], none, none]]


def _slopes(
    points: Sequence[tuple[Fraction, Fraction]], h: Sequence[Fraction], d: Sequence[Fraction]
) -> list[Fraction]:
    """Return the slopes at the points, by elimination from the first to the last."""
    if len(points) == 2:
        return [d[0], d[0]]
    first, last = (
        _third(each) if len(points) > 3 else Fraction(0) for each in (points[:4], points[-4:])
    )
    one, none = Fraction(1), Fraction(0)
    rows = [(none, one, one, 2 * d[0] + h[0] ** 2 * first)]
    for k in range(1, len(h)):
        right = 3 * (h[k] * d[k - 1] + h[k - 1] * d[k])
        rows.append((h[k], 2 * (h[k - 1] + h[k]), h[k - 1], right))
    rows.append((one, one, none, 2 * d[-1] + h[-1] ** 2 * last))
    ahead = list[tuple[Fraction, Fraction]]()  # s_k = b - a s_(k+1)
    a = b = none
    for before, own, after, right in rows:
        pivot = own - before * a
        a, b = after / pivot, (right - before * b) / pivot
        ahead.append((a, b))
    found = [b]
    for a, b in ahead[-2::-1]:
        found.append(b - a * found[-1])
    return found[::-1]


def _third(points: Sequence[tuple[Fraction, Fraction]]) -> Fraction:
    """Return the divided difference of four points, by Lagrange's form."""
    found = Fraction(0)
    for x, y in points:
        product = Fraction(1)
        for other, _ in points:
            product *= x - other if other != x else 1
        found += y / product
    return found
