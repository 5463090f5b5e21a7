"""Coordinates of points as outputs, compared by default."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from ...mechanism.mechanism import Vector
from ..case import Case, Output, size
from .tolerance import default

AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def with_all_coordinates(case: Case, points: Iterable[str] | None = None) -> Case:
    """Return the case with outputs POINT.x, .y and .z of all or the named points, with default
    tolerances.
    """
    given, names = (
        default(size(case)),
        [point.name for point in case.mechanism.points] if points is None else points,
    )
    outputs = [
        Output(f"{name}.{axis}", name, along, False, *given)
        for name in names
        for axis, along in AXES.items()
    ]
    return replace(case, outputs=tuple(outputs))
