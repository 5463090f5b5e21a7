"""Checks of input: numbers of a description are finite Python numbers, directions have a length,
arguments are real.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Complex
from typing import Any

import numpy as np

from .errors import MechanismError, SolveError, unknown
from .trajectory import Array

SHORTEST = 1e-150
"""Of a direction: the square of a shorter one has fewer digits than others, or none."""


def finite(number: Any) -> bool:
    """Whether it is a finite number, or an array that is one."""
    try:
        # numpy's complex numbers would be taken by their real part; most are floats, of which large
        # mechanisms have ten thousands
        return (isinstance(number, float) or not np.iscomplexobj(number)) and math.isfinite(number)
    except (TypeError, ValueError):  # of no number, or several
        return False


def triple(who: str, value: Any, expected: str) -> tuple[Any, Any, Any]:
    """Three numbers as a tuple, whatever sequence or array they are given as: that may change, a
    mechanism does not.

    Of an array they are Python's own numbers: numpy's divide by zero without a word, and print
    their type.

    Raises:
        MechanismError: there are not three.
    """
    x, y, z = held(who, value, 3, expected)
    return x, y, z


def require_finite(who: str, numbers: Sequence[Any], expected: str) -> None:
    """Raise MechanismError unless all are finite numbers, or of a kind that is computed with later
    (traced, balls).
    """
    if not all(finite(number) or _of_later(number) for number in numbers):
        raise MechanismError(
            f"{who} = {numbers if len(numbers) > 1 else numbers[0]} is not finite; give {expected}"
        )


def _of_later(number: Any) -> bool:
    return hasattr(number, "__neg__") and not isinstance(number, Complex | np.ndarray)


def plain(number: Any) -> Any:
    """A number as Python's own, where it is one of numpy's or an array that is one: arrays may
    change, and have no hash.
    """
    return number.item() if type(number).__module__ == "numpy" and np.size(number) == 1 else number


def require_direction(who: str, numbers: Sequence[float]) -> None:
    """Raise MechanismError unless a vector has a direction: its length is not zero, nor so small or
    large that its square is.
    """
    length = math.hypot(*numbers)
    if length == 0.0:
        raise MechanismError(f"{who} is zero; give a direction of any other length")
    if not SHORTEST <= length <= 1.0 / SHORTEST:
        raise MechanismError(
            f"{who} has length {length:.3g}, whose square is no number; give a direction of another"
            " length"
        )


def held(who: str, value: Any, count: int | None, expected: str) -> tuple[Any, ...]:
    """A value as a tuple of so many items, or of any number, or an error that names what was
    expected.
    """
    try:
        found = tuple(value.tolist() if hasattr(value, "tolist") else value)
    except TypeError:  # a number, or nothing
        found = None
    if found is None or count not in (None, len(found)) or isinstance(value, str):
        raise MechanismError(f"{who} is {value!r}, expected {expected}")
    return found


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
