"""Conditions that close loops, as data of a JSON file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

from ..shared.frame_constraints import (
    Coincident,
    Condition,
    Difference,
    Direction,
    Dot,
    Length,
)


def as_data(condition: Condition) -> Iterator[dict[str, Any]]:
    """Yield a condition as data, by the links of its frames and points in their axes."""

    def end(frame: Any) -> dict[str, Any]:
        return {"link": frame.link, "point": frame.point}

    def along(direction: Direction) -> dict[str, Any]:
        return {"link": cast(Any, direction.frame).link, "direction": direction.a0.tolist()}

    match condition:
        case Coincident(Difference(i, j)):
            yield {"kind": "coincident", "i": end(i), "j": end(j)}
        case Length(Difference(i, j), length):
            yield {"kind": "distance", "i": end(i), "j": end(j), "value": length}
        case Dot(Direction() as x, Direction() as y, value):
            yield {"kind": "directions", "x": along(x), "y": along(y), "value": value}
        case Dot(Direction() as x, Difference(i, j), value):
            yield {"kind": "offset", "x": along(x), "i": end(i), "j": end(j), "value": value}
        case _:
            raise NotImplementedError(f"{type(condition).__name__}: give its kind here")
