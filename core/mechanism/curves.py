"""Curves of force over deflection: progressive rates and bump stops.

A curve is a table of pairs. The monotone cubic of Fritsch and Butland connects them: it is smooth
to its first derivative, and rises wherever the table rises. Beyond its ends it goes on straight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import Field, field
from functools import cache
from itertools import pairwise
from typing import Any, TypeAlias

from ..errors import MechanismError
from ..input_checks import finite
from .body import Dimension

Curve: TypeAlias = tuple[tuple[float, float], ...]
"""Pairs of deflection and force, deflections increasing."""


def curve(deflection: Dimension, force: Dimension) -> Any:
    """Return a field of a force element: a curve, or None for a constant stiffness."""
    return field(default=None, metadata={"curve": (deflection, force)})


def dimensions_of(each: Field[Any]) -> tuple[Dimension, Dimension] | None:
    """Return the dimensions of a field of curves; None for another field."""
    return each.metadata.get("curve")


def checked_curve(who: str, key: str, given: Any) -> Curve:
    """Return a table as a curve.

    Raises:
        MechanismError: it is no table of pairs with increasing deflections, or has no zero of the
            force.
    """
    expected = "a table [[deflection, force], ...] of two rows or more"
    try:
        table = tuple((float(x), float(force)) for x, force in given)
    except (TypeError, ValueError):
        raise MechanismError(f"{who} is {given!r}, expected {expected}", key) from None
    if len(table) < 2 or not all(finite(number) for row in table for number in row):
        raise MechanismError(f"{who} is {given!r}, expected {expected}", key)
    deflections, forces = zip(*table, strict=True)
    for one, other in pairwise(deflections):
        if other <= one:
            raise MechanismError(
                f"{who}: deflection {other!r} follows {one!r}; deflections must increase", key
            )
    if min(forces) > 0.0 or max(forces) < 0.0:
        raise MechanismError(
            f"{who}: no force of it is zero; add the row of the free element, with force 0", key
        )
    return table


@cache
def pieces(table: Curve) -> tuple[tuple[float, float, float, float, float], ...]:
    """Return start, width and the coefficients of s, s^2, s^3 of each piece, from its start."""
    # slow to import, and few mechanisms have curves
    from scipy.interpolate import PchipInterpolator  # pyright: ignore[reportMissingTypeStubs]

    x, y = zip(*table, strict=True)
    cubic: Any = PchipInterpolator(x, y)
    rows = zip(x, x[1:], *cubic.c[2::-1].tolist(), strict=False)
    return tuple((start, stop - start, *powers) for start, stop, *powers in rows)


def scaled(value: Any, factors: Sequence[float]) -> Any:
    """Return a curve, or the curves of all axes, with deflections and forces times factors."""
    if value and not isinstance(value[0], tuple):
        return tuple(factor * x for factor, x in zip(factors, value, strict=True))
    return tuple(scaled(each, factors) for each in value)
