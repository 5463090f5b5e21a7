"""Joints, samples and starts of a case that Exudyn's own solvers cannot simulate; private to its
adapter.
"""

from __future__ import annotations

import numpy as np

from ...core import joints
from ...core.case.case import Case
from ...core.joints.base import unit
from ...core.kinematics import start_of
from ..shared.simulation import uneven

# Exudyn's objects keep products only at zero; a smaller value is round-off, below any residual.
NOTHING = 1e-12


def limitation_of(case: Case) -> str | None:
    """Return the reason why Exudyn's own solvers cannot simulate the case; None without one."""
    for joint in case.mechanism.joints:
        if isinstance(joint, joints.ConstantVelocity):
            return (
                f"{joint}: Exudyn's own solvers have no object that ties two products, which"
                " the joint needs"
            )
        kept = _kept(joint)
        if abs(kept) > NOTHING:
            return (
                f"{joint} keeps a product at {kept:.3g}, and Exudyn's own objects keep products at"
                " only zero; make its axes exact"
            )
    for coupler in case.mechanism.couplers:
        if coupler.curve:
            return f"{coupler}: Exudyn's own solvers have no object that keeps a polynomial"
    if (reason := uneven(case, "Exudyn")) is not None:
        return reason
    if case.mechanism.couplers and not start_of(case.mechanism, case.sweep.path).stands:
        return "turns of coupled joints count from the design, where this motion does not begin"
    return None


def _kept(joint: joints.Joint) -> float:
    """Return the constant value of the last row of a joint [m or -]."""
    if isinstance(joint, joints.Universal | joints.PerpendicularAxes):
        return unit(joint.axes[0]) @ unit(joint.axes[1])
    if isinstance(joint, joints.RevoluteSpherical):
        return float(np.array([*unit(joint.axis)]) @ np.subtract(joint.points[1], joint.points[0]))
    return 0.0
