"""What callers give functions: real numbers where numbers are expected, or an error that says what was found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import SolveError, unknown
from ..given import finite
from ..trajectory import Array


def require_positive(who: str, what: str, number: Any) -> None:
    """Raise SolveError unless a number is positive and finite."""
    if not (finite(number) and number > 0):
        raise SolveError(f"{who}: {what} is {number!r}, expected a positive number")


def no_such(who: str, what: str, name: str, known: Sequence[str]) -> SolveError:
    """The error that there is nothing of a name."""
    return SolveError(f"{who}: {unknown(what, name, known)}")


def real(who: str, what: str, given: Any, expected: str) -> Array:
    """Numbers as an array of their own; an imaginary part is none to be lost.

    Raises:
        SolveError: they are no real numbers.
    """
    try:
        found = np.asarray(given)
        if not np.iscomplexobj(found):
            return np.array(found, dtype=np.float64)
    except (TypeError, ValueError):
        pass
    raise SolveError(f"{who}: {what} are {given!r}, expected numbers: {expected}")
