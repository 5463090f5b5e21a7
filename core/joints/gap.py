"""Residual of a joint at the design position."""

from __future__ import annotations

from ..algebra import ZERO
from ..primitives import GROUND_POSE
from .base import Attachment, Joint


def gap(joint: Joint) -> float:
    """Return the largest residual of a joint at the design position [m]; zero unless lengths
    contradict points.
    """
    here = Attachment(ZERO)
    return max(
        abs(x) for each in joint.primitives(here, here) for x in each.phi(GROUND_POSE, GROUND_POSE)
    )
