"""A cache with a store for each thread: what is made of something is kept with it, and solved in
place by one thread only.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from threading import local
from typing import Any, TypeVar

Made = TypeVar("Made")


class ThreadCache(local):
    """What is made of something, by key: once for each thread. It lives as long as the thread and
    the cache do.
    """

    def __init__(self) -> None:
        self._found: dict[Hashable, Any] = {}

    def __call__(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """What was made under this key for this thread before; or is made now."""
        if key not in self._found:
            self._found[key] = make()
        return self._found[key]
