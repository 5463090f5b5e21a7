"""Outputs of a model without outputs: all its motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...case.case import Case, Quantity, size
from ...case.io.outputs import default, with_all_coordinates
from ...case.measures import Component, JointAngle, JointDisplacement, Orientation
from ...case.quantity import with_markers


def with_all_motions(case: Case, at_design: Mapping[str, float] | None = None) -> Case:
    """Return the case with the motion of every part as outputs, with default tolerances.

    The outputs are the coordinates of all points, the angle or displacement of every joint with
    such a freedom, and the Euler parameters of every moving body.

    Args:
        at_design: coordinates of a model's joints where they are not zero; their outputs are named
            JOINT.qpos [m or rad].
    """
    mechanism, extent = case.mechanism, size(case)
    outputs: list[Quantity] = [*with_all_coordinates(case).outputs]
    for joint in mechanism.joints:
        for what, cls in (("angle", JointAngle), ("displacement", JointDisplacement)):
            if cls.freedom in joint.freedoms:
                given = default(extent, cls.measure)
                outputs.append(cls(f"{joint.name}.{what}", *given, joint=joint.name))
                if value := (at_design or {}).get(joint.name):
                    name = f"{joint.name}.qpos"
                    outputs.append(cls(name, *given, joint=joint.name, at_design=value))
    outputs += [
        Orientation(f"{body.name}.{each}", *default(extent, "1"), body=body.name, component=each)
        for body in mechanism.moving
        for each in Component
        if each.startswith("e")
    ]
    return replace(case, mechanism=with_markers(mechanism, outputs), outputs=tuple(outputs))
