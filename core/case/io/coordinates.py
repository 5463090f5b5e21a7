"""Coordinates of points as outputs: what is compared where nothing else is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from ...mechanism.mechanism import Vector
from ..case import Case, Output, size
from .tolerance import default

AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def with_all_coordinates(case: Case, points: Iterable[str] | None = None) -> Case:
    """The case with x, y and z of its points, or of those named, as outputs POINT.x and so on;
    tolerances are the default ones.
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
