"""Functions of OpenSim as curves, and the coordinates that they depend on."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.polynomial import Polynomial

from ...joints import PiecewisePolynomial, Spline
from ..trees.tree import (
    require_spline,
)
from ..xml.element import Element, words

FUNCTIONS = (
    *words("Constant LinearFunction PolynomialFunction MultiplierFunction"),
    *words("SimmSpline PiecewiseLinearFunction"),
)
ON_LINE = 1e-12
"""Distance of points from a line, over the largest value, that rounding in doubles leaves."""


def polynomial(*coefficients: float) -> PiecewisePolynomial:
    """Return a polynomial, the constant first, without zeros at its end."""
    trimmed = Polynomial(coefficients).trim()
    return PiecewisePolynomial((0.0,), (tuple(trimmed.coef.tolist()),))


ZERO = polynomial(0.0)


def is_own(curve: PiecewisePolynomial) -> bool:
    """Return whether a curve is a line of slope 1 or -1."""
    powers = curve.powers[0]
    return not curve.knots and len(powers) == 2 and abs(powers[1]) == 1.0


def curve_of(axis: Element, coordinates: Mapping[str, Element]) -> tuple[str, PiecewisePolynomial]:
    """Return the coordinate of an axis of a custom joint, empty without one, and its curve."""
    names = axis.child_text("coordinates").split()
    around = axis.child("function")
    functions = [
        each.take() for each in (around or axis).children if each.tag not in ("coordinates", "axis")
    ]
    if not functions and not names:
        return "", ZERO
    if len(functions) != 1 or len(names) > 1:
        raise axis.fault(
            f"found {len(functions)} functions of {len(names)} coordinates, expected one of one;"
            " correct it"
        )
    curve = function(functions[0])
    moves = len(curve.powers[0]) > 1
    if not (moves and names):
        if moves:
            raise axis.fault("has no coordinate, expected one for its function; add it")
        return "", curve
    if names[0] not in coordinates:
        raise axis.unknown_name("coordinates", names[0], coordinates, "a coordinate of the joint")
    return names[0], curve


def function(element: Element) -> PiecewisePolynomial:
    """Return a function of one coordinate."""
    match element.tag:
        case "Constant":
            return polynomial(element.child_number("value", 0.0))
        case "LinearFunction":
            return polynomial(*element.value("coefficients", 2)[::-1])
        case "PolynomialFunction":
            count = len(element.child_text("coefficients").split())
            return polynomial(*element.value("coefficients", max(count, 1))[::-1])
        case "MultiplierFunction":
            scale = element.child_number("scale", 1.0)
            around = element.child("function")
            inner = [each.take() for each in (around or element).children if each.tag != "scale"]
            if len(inner) != 1:
                raise element.fault(f"found {len(inner)} functions, expected one; correct it")
            found = function(inner[0]).scaled(1.0, scale)
            return found if found.knots else polynomial(*found.powers[0])
        case "SimmSpline" | "PiecewiseLinearFunction":
            return _table(element)
        case _:
            raise element.fault(
                f"is a {element.tag}, a curve for which there is no joint, expected one of"
                f" {', '.join(FUNCTIONS)}; fit a SimmSpline"
            )


def _table(element: Element) -> PiecewisePolynomial:
    """Return the function through points, a line where they are on one."""
    count = max(len(element.child_text("x").split()), 2)
    x, y = (element.value(key, count) for key in "xy")
    points = tuple(zip(x, y, strict=True))
    require_spline(element, points)
    slope = (y[-1] - y[0]) / (x[-1] - x[0])
    off = max(abs(b - y[0] - slope * (a - x[0])) for a, b in points)
    if off <= ON_LINE * max(map(abs, y)):
        return polynomial(y[0] - slope * x[0], slope)
    if element.tag == "PiecewiseLinearFunction":
        raise element.fault(
            "has corners, where velocities jump, expected points on one line; give a SimmSpline"
        )
    return Spline("spline", ("driven", "driving"), points).function
