"""Readers of the numbers in options."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """Return a reader of whole numbers between two limits: 1000000, 1_000_000 or 1e6."""
    expected = f"of {least} or more" if most is None else f"from {least} to {most}"

    def read(text: str) -> int:
        found = _whole(text)
        if found is None or found < least or (most is not None and found > most):
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number {expected}; give one")
        return found

    return read


def _whole(text: str) -> int | None:
    """Return the whole number in a text; None if it holds none."""
    try:
        return int(text)
    except ValueError:
        pass
    try:
        found = float(text)
    except ValueError:
        return None
    return int(found) if found.is_integer() else None


def positive(text: str) -> float:
    """Return the positive number in the text of an option."""
    found = _number(text)
    if not found > 0:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a positive number; give one such as 1, 0.5 or 1e-12"
        )
    return found


def number(text: str) -> float:
    """Return the finite number in the text of an option."""
    found = _number(text)
    if math.isnan(found):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a number; give one such as -1, 0.5 or 1e-12"
        )
    return found


def _number(text: str) -> float:
    """Return the finite number in a text; NaN if it holds none."""
    try:
        found = float(text)
    except ValueError:
        return math.nan
    return found if math.isfinite(found) else math.nan
