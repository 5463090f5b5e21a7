"""What is compared where a file names no outputs: every coordinate of every point."""

from __future__ import annotations

from collections.abc import Sequence

from ...mechanism import Point
from ..case import Output
from .casefile import AXES
from .tolerance import DEFAULT_ATOL, DEFAULT_RTOL, DEFAULT_WHY


def all_coordinates(points: Sequence[Point]) -> tuple[Output, ...]:
    """x, y and z of all points, as POINT.x and so on, in the order of the points."""
    return tuple(
        Output(f"{point.name}.{axis}", point.name, along, False, DEFAULT_ATOL, DEFAULT_RTOL, DEFAULT_WHY)
        for point in points
        for axis, along in AXES.items()
    )
