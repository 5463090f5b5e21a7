"""Options of commands that are no data classes yet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..options import measured as measured
from ..options import positive as positive
from ..options import whole as whole


def add_several(
    command: Any, option: str, meaning: str, metavar: str = "NAME", type: Callable[[str], Any] = str
) -> None:
    """Add an option that takes several values, and may be repeated; default: an empty list."""
    command.add_argument(
        option, nargs="+", action="extend", default=[], metavar=metavar, type=type, help=meaning
    )
