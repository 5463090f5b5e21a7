"""Checks of input: finite Python numbers, directions with a length, real arguments."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from numbers import Complex
from typing import Any, cast

import numpy as np

from .errors import MechanismError, SolveError, brief, unknown, with_article
from .failures import FailureKind
from .trajectory import Array

SHORTEST = 1e-150
"""Shortest direction: the square of a shorter one loses digits or underflows."""


def finite(number: Any) -> bool:
    """Return whether it is a finite number, or an array of a single one."""
    try:
        # numpy's complex numbers would be taken by their real part; most are floats, of which large
        # mechanisms have ten thousands
        return (isinstance(number, float) or not np.iscomplexobj(number)) and math.isfinite(number)
    except (TypeError, ValueError):  # of no number, or several
        return False


def triple(who: str, value: Any, expected: str) -> tuple[Any, Any, Any]:
    """Return three numbers as a tuple, from any sequence or array: those may change, a mechanism
    may not.

    Elements of an array become Python numbers: numpy's divide by zero silently, and print their
    type.

    Raises:
        MechanismError: there are not three.
    """
    x, y, z = held(who, value, 3, expected)
    return x, y, z


def require_finite(who: str, numbers: Sequence[Any], expected: str) -> None:
    """Raise MechanismError unless all are finite numbers, or scalars of later evaluation (traced,
    balls).
    """
    if not all(finite(number) or _of_later(number) for number in numbers):
        raise MechanismError(
            f"{who} = {numbers if len(numbers) > 1 else numbers[0]} is not finite; give {expected}",
            kind=FailureKind.NOT_FINITE,
        )


def finite_numbers(who: str, value: Any, count: int, expected: str) -> Any:
    """Return so many finite numbers as a tuple, see `triple`."""
    found = held(who, value, count, expected)
    require_finite(who, found, expected)
    return found


def _of_later(number: Any) -> bool:
    return hasattr(number, "__neg__") and not isinstance(number, Complex | np.ndarray)


def plain(number: Any) -> Any:
    """Return a numpy number or one-element array as Python's own: arrays are mutable and
    unhashable.
    """
    return number.item() if type(number).__module__ == "numpy" and np.size(number) == 1 else number


def require_direction(who: str, numbers: Sequence[float]) -> None:
    """Raise MechanismError unless a vector has a direction: its squared length must be normal."""
    if not all(map(finite, numbers)):  # scalars of later evaluation have no length yet
        return
    length = math.hypot(*numbers)
    if length == 0.0:
        raise MechanismError(
            f"{who} is zero; give a direction of any other length", kind=FailureKind.NO_LENGTH
        )
    if not SHORTEST <= length <= 1.0 / SHORTEST:
        raise MechanismError(
            f"{who} has length {length:.3g}, whose square is no number; give a direction of another"
            " length"
        )


def held(who: str, value: Any, count: int | None, expected: str) -> tuple[Any, ...]:
    """Return a value as a tuple of `count` items (None: any number), or raise an error with the
    expected form.
    """
    try:
        found = tuple(value.tolist() if hasattr(value, "tolist") else value)
    except TypeError:  # a number, or nothing
        found = None
    if found is None or count not in (None, len(found)) or isinstance(value, str):
        raise MechanismError(f"{who} is {value!r}, expected {expected}")
    return found


def require_kind(who: str, what: str, given: Any, kind: type) -> None:
    """Raise SolveError unless an argument is of a class."""
    if not isinstance(given, kind):
        raise SolveError(
            f"{who}: {what} is {brief(repr(given))}, expected {with_article(kind.__name__)}; check"
            " the order of the arguments"
        )


def require_positive(who: str, what: str, number: Any) -> None:
    """Raise SolveError unless a number is positive and finite."""
    if not (finite(number) and number > 0):
        raise SolveError(f"{who}: {what} is {number!r}, expected a positive number")


def require_known(
    who: str,
    what: str,
    names: Iterable[Any],
    known: Iterable[Any],
    first: Callable[[], None] | None = None,
) -> None:
    """Raise SolveError unless all names are of known members.

    Args:
        first: called before, for what is a better explanation.
    """
    there = [each.name for each in known]
    for name in names:
        if name not in there:
            if first is not None:
                first()
            raise no_such(who, what, name, there)


def no_such(who: str, what: str, name: Any, known: Sequence[str]) -> SolveError:
    """Return the error for an unknown name, or for another thing in place of a name."""
    if not isinstance(name, str):
        return SolveError(f"{who}: {what} is {name!r}, expected a name; known: {', '.join(known)}")
    return SolveError(f"{who}: {unknown(what, name, known)}")


def names_of(who: str, what: str, given: Any) -> tuple[str, ...]:
    """Return a list of names as a tuple.

    Raises:
        SolveError: it is one name alone, whose letters are no names, or no list.
    """
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise SolveError(f"{who}: {what} is {given!r}, expected a list of names")
    return tuple(cast("Iterable[str]", given))


def real(who: str, what: str, given: Any, expected: str) -> Array:
    """Return numbers as a new array; an imaginary part is an error, never dropped.

    Raises:
        SolveError: they are not real numbers.
    """
    try:
        found = np.asarray(given)
        if not np.iscomplexobj(found):
            return np.array(found, dtype=np.float64)
    except (TypeError, ValueError):
        pass
    raise SolveError(f"{who}: {what} are {given!r}, expected numbers: {expected}")
