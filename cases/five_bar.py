"""Closed form of a five-bar robot: circles about the cranks' pins intersect at the tool."""

from __future__ import annotations

from .jet import Jet, Motion
from .vectors import Circle, meet_in_plane

# At design [m], in the x-y plane: pivots, pins and the tool.
LEFT, RIGHT = (0.0, 0.0, 0.0), (0.3, 0.0, 0.0)
LEFT_PIN, RIGHT_PIN = (-0.1, 0.2, 0.0), (0.38, 0.19, 0.0)
TOOL = (0.17, 0.45, 0.0)
Z = (0.0, 0.0, 1.0)


def motion(left: Jet, right: Jet) -> Motion:
    """Return the tool with the cranks turned from the design by angles about z [rad]."""
    a, b = (
        Circle.about(LEFT, Z, LEFT_PIN).turned(left),
        Circle.about(RIGHT, Z, RIGHT_PIN).turned(right),
    )
    squares = (
        sum((t - p) ** 2 for t, p in zip(TOOL, pin, strict=True)) for pin in (LEFT_PIN, RIGHT_PIN)
    )
    aa, bb = squares
    return {"tool": meet_in_plane(a, aa, b, bb, 1.0)}
