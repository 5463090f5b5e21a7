"""Readers of options as argparse takes them."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from .. import options
from ..errors import KincheckError


def reader(read: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a reader whose messages argparse prints."""
    if read is str:
        return str

    def read_text(text: str) -> Any:
        try:
            return read(text)
        except KincheckError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    read_text.__name__ = read.__name__  # in argparse's own messages
    return read_text


positive = reader(options.positive)


def whole(least: int) -> Callable[[str], Any]:
    """Return a reader of whole numbers from a least one."""
    return reader(options.whole(least))


def add_several(
    command: Any, option: str, meaning: str, metavar: str = "NAME", type: Callable[[str], Any] = str
) -> None:
    """Add an option that takes several values, and may be repeated; default: an empty list."""
    command.add_argument(
        option, nargs="+", action="extend", default=[], metavar=metavar, type=type, help=meaning
    )
