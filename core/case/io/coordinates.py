"""Default outputs: the coordinates of points; for models, the motion of every body and joint."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from ...mechanism.mechanism import Vector
from ..case import Case, Output, Quantity, size
from ..measures import Component, JointAngle, JointDisplacement, Orientation
from ..quantity import with_markers
from .tolerance import default

AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def with_all_coordinates(case: Case, points: Iterable[str] | None = None) -> Case:
    """Return the case with outputs POINT.x, .y and .z and default tolerances.

    Args:
        points: names of points; None for all.
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


def with_all_motions(case: Case) -> Case:
    """Return the case with the motion of every part as outputs, with default tolerances.

    The outputs are the coordinates of all points, the angle or displacement of every joint with
    such a freedom, and the Euler parameters of every moving body.
    """
    mechanism, extent = case.mechanism, size(case)
    outputs: list[Quantity] = [*with_all_coordinates(case).outputs]
    for joint in mechanism.joints:
        for what, cls in (("angle", JointAngle), ("displacement", JointDisplacement)):
            if cls.freedom in joint.freedoms:
                given = default(extent, cls.measure)
                outputs.append(cls(f"{joint.name}.{what}", *given, joint=joint.name))
    outputs += [
        Orientation(f"{body.name}.{each}", *default(extent, "1"), body=body.name, component=each)
        for body in mechanism.moving
        for each in Component
        if each.startswith("e")
    ]
    return replace(case, mechanism=with_markers(mechanism, outputs), outputs=tuple(outputs))
