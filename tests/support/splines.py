"""Splines of OpenSim by another way than the product: one equation for each condition, in truncated
powers.
"""

import numpy as np


def through(points):
    """The function x -> value, slope, second derivative of the spline of Forsythe, Malcolm and
    Moler; straight beyond its ends.
    """
    x, y = np.transpose(points).astype(float)
    inner, count = x[1:-1], len(x)
    degree = min(count - 1, 3)
    knots = inner if count > 4 else inner[:0]

    def terms(at, order):
        """Derivatives of 1, x, x^2, ... and of (x - knot)^3 where positive."""
        powers = [_derived(at - x[0], k, order) for k in range(degree + 1)]
        return [*powers, *(_derived(at - k, 3, order) * (at > k) for k in knots)]

    rows, right = [terms(at, 0) for at in x], [*y]
    if len(knots):
        ends = (x[:4], y[:4], x[0]), (x[-4:], y[-4:], x[-1])
        for near, values, at in ends:
            rows.append(terms(at, 3))
            right.append(6.0 * np.polyfit(near - near[0], values, 3)[0])
    factors = np.linalg.solve(np.array(rows, dtype=float), right)

    def value(at):
        within = np.clip(at, x[0], x[-1])
        zero, one, two = (float(factors @ terms(within, order)) for order in range(3))
        return zero + one * (at - within), one, two if within == at else 0.0

    return value


def _derived(x, power, order):
    factor = np.prod([power - k for k in range(order)])
    return factor * x ** max(power - order, 0) if power >= order else 0.0
