"""Caches of results for repeated calls; `clear_caches` empties them.

`cache_last` keeps the last results of a function, for the process or for each thread. `ThreadCache`
keeps the data of one object in each thread, such as lanes solved in place, and ends with the
object. Both are bounded: a new result replaces the least recently used one. `ByContent` makes a
large argument cheap to find again.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache, wraps
from threading import Lock, local
from typing import Any, ParamSpec, TypeVar
from weakref import WeakSet

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# A sweep asks for less than ten keys; a batch of designs binds lanes by the number of its variants.
KEYS = 16

_results: WeakSet[Any] = WeakSet()
_lock = Lock()


def cache_last(
    count: int, *, per_thread: bool = False, when: Callable[..., bool] | None = None
) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """Return a decorator to keep the last results of a function by its hashable arguments.

    Threads in need of a missing result at the same time may each compute it.

    Args:
        count: number of results.
        per_thread: keep them for each thread, because a thread changes them in place.
        when: whether the result of given arguments is kept; by default always.
    """

    def keep(function: Any) -> Any:
        recent: Any = _OfThread(count, function) if per_thread else _cache_results(count, function)
        if (is_kept := when) is None:
            return recent

        @wraps(function)
        def call(*args: Any) -> Any:
            return (recent if is_kept(*args) else function)(*args)

        return call

    return keep


def clear_caches() -> None:
    """Drop the results kept by `cache_last`, in all threads; the next calls compute them again.

    Long-running processes free memory by this. Results in use stay valid.
    """
    with _lock:
        every = list(_results)
    for each in every:
        each.cache_clear()


def _cache_results(count: int, function: Callable[..., Any]) -> Any:
    kept = lru_cache(maxsize=count)(function)
    with _lock:
        _results.add(kept)
    return kept


@dataclass(frozen=True, eq=False)
class ByContent:
    """A frozen data class of many parts: equal by them, and hashed once.

    Pickles and copies have its fields alone: a hash of texts holds in its own process only.
    """

    @cached_property
    def _content(self) -> Hashable:
        return tuple(vars(self)[each.name] for each in fields(self))

    @cached_property
    def _hash(self) -> int:
        return hash(self._content)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self._content == other._content

    def __getstate__(self) -> dict[str, Any]:
        return {each.name: vars(self)[each.name] for each in fields(self)}


class _OfThread(local):
    """A function with results of each thread, which end with the thread."""

    def __init__(self, count: int, function: Callable[..., Any]) -> None:
        self._call = _cache_results(count, function)

    def __call__(self, *args: Hashable) -> Any:
        return self._call(*args)


class ThreadCache(local):
    """Cache by key for each thread, which ends with the thread and with the cache."""

    def __init__(self) -> None:
        self._found: dict[Hashable, Any] = {}

    def __call__(self, key: Hashable, make: Callable[[], Result]) -> Result:
        """Return this thread's result under the key, or compute it now."""
        found = self._found
        value = found.pop(key) if key in found else make()
        found[key] = value  # the last one in order is the one used most recently
        if len(found) > KEYS:
            del found[next(iter(found))]
        return value
