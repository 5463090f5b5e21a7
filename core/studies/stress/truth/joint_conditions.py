"""Rows of each joint type, as `conditions` writes them (formulation section 6)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ....joints import Screw
from .constraint_rows import Writer
from .long_double import GROUND_AXES, Real, extended, triad, unit


def _meet(w: Writer, joint: Any) -> None:
    """Keep the point of both bodies together."""
    i, j = w.ends(joint)
    # a fixed joint may have no point: any point works
    point = joint.point if joint.point is not None else w.origin
    for axis in GROUND_AXES:
        w.slide(w.row(joint.name), 0, j, axis, point, point)
        w.slide(len(w.owners) - 1, 0, i, axis, point, point, -1.0)


def _parallel(w: Writer, joint: Any) -> None:
    """Keep the direction of the axis in both bodies."""
    f, g, h = triad(joint.axis)
    for a in (f, g):
        w.dot(w.row(joint.name), *w.ends(joint), a, h)


def _alike(w: Writer, joint: Any) -> None:
    """Keep the relative orientation of the bodies."""
    f, g, h = triad(getattr(joint, "axis", (0.0, 0.0, 1.0)))
    for a, b in ((g, h), (h, f), (f, g)):
        w.dot(w.row(joint.name), *w.ends(joint), a, b)


def _line(w: Writer, joint: Any) -> None:
    """Keep the point of j on the line of i."""
    for a in triad(joint.axis)[:2]:
        w.slide(w.row(joint.name), *w.ends(joint), a, joint.point, joint.point)


def _plane(w: Writer, joint: Any) -> None:
    """Keep the distance of the point of j from the plane of i at its design value."""
    first, second = getattr(joint, "points", None) or (joint.point, joint.point)
    w.slide(w.row(joint.name), *w.ends(joint), triad(joint.axis)[2], first, second, held=True)


def _angle(w: Writer, joint: Any) -> None:
    """Keep the angle between the axes."""
    a, b = (unit(extended(axis)) for axis in joint.axes)
    w.dot(w.row(joint.name), *w.ends(joint), a, b, held=True)


def _length(w: Writer, joint: Any) -> None:
    """Keep the distance between the points."""
    first, second = joint.points
    w.rod(w.row(joint.name), *w.ends(joint), first, second, getattr(joint, "length", None))


def _twistless(w: Writer, joint: Any) -> None:
    """Write f_i . g_j = g_i . f_j. The axes of shaft j are those of shaft i, turned by the shortest
    rotation.
    """
    f, g, h = triad(joint.axes[0])
    k = unit(extended(joint.axes[1]))
    n = np.cross(h, k)

    def carried(a: Real) -> Real:
        return a + np.cross(n, a) + np.cross(n, np.cross(n, a)) / (1.0 + h @ k)

    row = w.row(joint.name)
    i, j = w.ends(joint)
    w.dot(row, i, j, f, carried(g))
    w.dot(row, i, j, g, carried(f), -1.0)


def _thread(w: Writer, joint: Screw) -> None:
    """Set the displacement to the lead times the turns."""
    pitch = joint.lead / (2.0 * math.pi)
    row = w.row(joint.name)
    w.coordinate(row, joint, "translation", 1.0)
    w.coordinate(row, joint, "rotation", -pitch / w.unit)


def _all(*parts: Callable[[Writer, Any], None]) -> Callable[[Writer, Any], None]:
    def stated(w: Writer, joint: Any) -> None:
        for part in parts:
            part(w, joint)

    return stated


JOINTS: Mapping[str, Callable[[Writer, Any], None]] = {
    "revolute": _all(_meet, _parallel),
    "spherical": _meet,
    "universal": _all(_meet, _angle),
    "translational": _all(_alike, _line),
    "fixed": _all(_meet, _alike),
    "distance": _length,
    "cylindrical": _all(_parallel, _line),
    "screw": _all(_parallel, _line, _thread),
    "planar": _all(_parallel, _plane),
    "inline": _line,
    "in_plane": _plane,
    "parallel_axes": _parallel,
    "perpendicular_axes": _angle,
    "orientation_lock": _alike,
    "revolute_spherical": _all(_length, _plane),
    "constant_velocity": _all(_meet, _twistless),
}
"""Joint type -> writer of its rows."""
