"""The search for changes along a row of releases."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TypeVar

T = TypeVar("T")


def changes(
    count: int,
    state: Callable[[int], T | None],
    differ: Callable[[T, T], bool],
    *,
    every: bool = False,
) -> Iterator[tuple[int, int]]:
    """Yield the places of successive different states, in order.

    Between two equal states nothing is looked at, unless `every` asks for all of them. Each change
    takes as many states as the binary logarithm of the row.

    Args:
        count: number of places.
        state: state of a place; None for a place without one, which is passed over.
        differ: whether two states differ.
    """
    if every:
        known = [(place, each) for place in range(count) if (each := state(place)) is not None]
        yield from ((i, j) for (i, a), (j, b) in pairwise(known) if differ(a, b))
        return
    low = next((place for place in range(count) if state(place) is not None), count)
    high = next((place for place in range(count)[::-1] if state(place) is not None), -1)
    waiting = [(low, high)] if low < high else []
    while waiting:
        low, high = waiting.pop()
        first, last = state(low), state(high)
        if first is None or last is None or not differ(first, last):
            continue
        inner = sorted(range(low + 1, high), key=lambda each: abs(2 * each - low - high))
        middle = next((each for each in inner if state(each) is not None), None)
        if middle is None:
            yield low, high
        else:
            waiting += [(middle, high), (low, middle)]
