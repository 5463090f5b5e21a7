"""Axes of joints: unit vectors, orthonormal triads and right angles."""

from __future__ import annotations

from collections.abc import Sequence

from ..algebra import Scalar, Vec3, X, Y, Z, cross, root, vec, where_larger
from ..errors import MechanismError
from ..failures import FailureKind


def unit(a: Sequence[Scalar]) -> Vec3:
    """Return the direction of a, length one."""
    v = vec(a)
    return (1.0 / root(v @ v)) * v


# Hardpoint tables carry three digits or more, so rounding tilts an axis by less than this; more
# is a mistake in the table. Within it the axes keep their design angle, as the two hinges of a
# simulator do.
ROUNDED_RIGHT_ANGLE = 1e-2


def require_perpendicular(joint: object, axes: Sequence[Sequence[float]]) -> None:
    """Raise MechanismError unless the two axes are perpendicular up to the rounding of a table."""
    cosine = unit(axes[0]) @ unit(axes[1])
    if abs(cosine) > ROUNDED_RIGHT_ANGLE:
        raise MechanismError(
            f"{joint}: the axes are not perpendicular, the cosine of their angle is {cosine:.3g}; "
            "expected 0 up to rounding of the table; give the two axes of the cross",
            kind=FailureKind.WRONG_ANGLE,
        )


def triad(axis: Sequence[Scalar]) -> tuple[Vec3, Vec3, Vec3]:
    """Return f, g, h: right-handed orthonormal, h along the axis (f x g = h)."""
    h = unit(axis)
    # the global axis most nearly perpendicular to h gives the best conditioned f
    nearest = X
    for e in (Y, Z):
        nearest = vec(
            [
                where_larger(nearest @ h, e @ h, new, old)
                for new, old in zip(e, nearest, strict=True)
            ]
        )
    f = unit(tuple(cross(nearest, h)))
    return f, cross(h, f), h
