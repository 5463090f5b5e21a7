"""What is made of something once, and kept with it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Made = TypeVar("Made")


class Bound:
    """What is made of something, by key and thread: made once, and kept."""

    def __init__(self) -> None:
        self._found: dict[Any, Any] = {}

    def __call__(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """What was made under this key for this thread before; or is made now."""
        key = threading.get_ident(), key
        if key not in self._found:
            self._found[key] = make()
        return self._found[key]
