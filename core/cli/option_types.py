"""Readers of the numbers in options, and options that several commands have."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable
from typing import Any


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
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not 0.0 < found < math.inf:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a positive number; give one such as 1, 0.5 or 1e-12"
        )
    return found


def measured(text: str) -> str:
    """Return the text of an option that is a number, with or without a unit."""
    if not re.fullmatch(r"\s*[-+]?[\d.]*\d\.?(?:[eE][-+]?\d+)?\s*[A-Za-z]*\s*", text):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a number; give one such as 0.02, 20mm or -3deg"
        )
    return text


def add_several(
    command: Any, option: str, meaning: str, metavar: str = "NAME", type: Callable[[str], Any] = str
) -> None:
    """Add an option that takes several values, and may be repeated; default: an empty list.

    Args:
        command: its parser, or a group of its options.
    """
    command.add_argument(
        option, nargs="+", action="extend", default=[], metavar=metavar, type=type, help=meaning
    )


def add_json(command: argparse.ArgumentParser, what: str = "the results") -> None:
    """Add the option --json."""
    command.add_argument(
        "--json", metavar="FILE", help=f"write {what} as JSON; - for standard output"
    )
