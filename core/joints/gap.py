"""How far a joint is from holding at the design position."""

from __future__ import annotations

from ..algebra import ZERO
from ..primitives import GROUND_POSE
from .base import Attachment, Joint


def gap(joint: Joint) -> float:
    """Largest residual of a joint at the design position [m]: zero, but where lengths contradict
    points.
    """
    here = Attachment(ZERO)
    return max(
        abs(x) for each in joint.primitives(here, here) for x in each.phi(GROUND_POSE, GROUND_POSE)
    )
