"""Masses and force elements as the options of Exudyn's objects."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.mechanism.body import Body
from ...core.mechanism.loads import (
    Axes,
    Bushing,
    Force,
    ForceElement,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)
from . import loads


def inertial(body: Body) -> tuple[float, list[float], list[float]]:
    """Return mass, centre of mass and inertia of a body, relative to its origin and parallel to the
    global axes at design; Exudyn puts the product yz first.
    """
    xx, yy, zz, xy, xz, yz = loads.six(loads.inertia_at_origin(body))
    center = np.subtract(loads.center_of(body), body.origin)
    return loads.mass_of(body), center.tolist(), [xx, yy, zz, yz, xz, xy]


def known(element: ForceElement) -> bool:
    """Return whether a script has the element: Exudyn's own bushing has a law of other angles, and
    its springs have no curve.
    """
    return not isinstance(element, Bushing) and not getattr(element, "curve", None)


def options(element: ForceElement) -> dict[str, Any]:
    """Return the options of the object or load."""
    match element:
        case Force() | Torque():
            turns = element.frame is Axes.BODY
            return {"loadVector": element.vector, "bodyFixed": turns}
        case SpringDamper():
            own = {"referenceLength": element.free_length}
        case TorsionSpringDamper():
            own = {"offset": element.free_angle}
        case _:
            raise NotImplementedError(f"{element}: give its options in Exudyn here")
    return {"stiffness": element.stiffness, "damping": element.damping, **own}
