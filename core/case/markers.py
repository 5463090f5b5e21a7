"""Markers: the points on bodies by which outputs measure rotation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..mechanism.mechanism import Mechanism
from .quantity import Quantity


def with_markers(mechanism: Mechanism, outputs: Sequence[Quantity]) -> Mechanism:
    """Return the mechanism with the points that outputs read beyond its own."""
    added = {point.name: point for output in outputs for point in output.markers(mechanism)}
    known = {point.name for point in mechanism.points}
    new = [point for name, point in added.items() if name not in known]
    return replace(mechanism, points=[*mechanism.points, *new]) if new else mechanism
