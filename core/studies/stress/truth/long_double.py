"""Extended precision for the truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ....errors import KincheckError

Real: TypeAlias = NDArray[Any]
"""Array of longdoubles, which numpy's own type hints lose next to a plain number. On x86 they have
a 64-bit mantissa: a two-thousandth of the round-off of the judged doubles.
"""


def extended(values: Any) -> Real:
    """Return doubles as extended numbers, exactly, or a text with all its digits."""
    return np.asarray(values, dtype=np.longdouble)


GROUND_AXES = np.eye(3, dtype=np.longdouble)
PI = extended("3.14159265358979323846264338327950288")


def require_extended() -> None:
    """Raise KincheckError if this machine has no extended precision in hardware."""
    if np.finfo(np.longdouble).eps > 1e-18:
        raise KincheckError(
            "kincheck stress: numpy's longdouble is no wider than a double on this machine, so"
            " the truth has no extra digits; run it on x86-64 Linux"
        )


def unit(a: Real) -> Real:
    """Return the direction of a."""
    return a / np.sqrt(a @ a)


def triad(axis: Sequence[float]) -> tuple[Real, Real, Real]:
    """Return f, g, h: orthonormal and right-handed, with h along the axis."""
    h = unit(extended(axis))
    across: Real = np.cross(h, GROUND_AXES[int(np.abs(h).argmin())])
    f = unit(across)
    return f, np.cross(h, f), h
