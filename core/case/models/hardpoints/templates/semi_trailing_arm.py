"""Semi-trailing arm: an arm on an oblique hinge carries the wheel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .....joints import Joint, Revolute
from .....mechanism.mechanism import GROUND, Vector
from .base import (
    KNUCKLE,
    SPRINGS,
    WHEEL,
    WHEEL_CENTER,
    Role,
    Template,
    between,
    spring_bodies,
    spring_roles,
)


def _joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    axis = between(at["arm_inner"], at["arm_outer"])
    return (Revolute("arm_pivot", GROUND, KNUCKLE, at["arm_inner"], axis),)


SEMI_TRAILING_ARM = Template(
    "semi_trailing_arm",
    ("SemiTrailingArm", "trailing_arm"),
    (
        Role(
            "arm_inner",
            "the arm's inner pivot on the chassis",
            ("Trailing Arm/Location Chassis Inner", "trailing_arm_inner"),
        ),
        Role(
            "arm_outer",
            "the arm's outer pivot on the chassis",
            ("Trailing Arm/Location Chassis Outer", "trailing_arm_outer"),
        ),
        WHEEL_CENTER,
    ),
    _joints,
    ("wheel_center", "arm_inner", "arm_outer"),
    {
        "arm_inner": (0.42, 0.3, 0.25),
        "arm_outer": (0.5, 0.6, 0.28),
        "wheel_center": (0.0, 0.75, 0.3),
        "wheel_contact": (0.0, 0.75, 0.0),
        "spring_lower": (0.05, 0.55, 0.2),
        "spring_upper": (0.06, 0.54, 0.5),
    },
    ahead=(("arm_inner", "wheel_center"), ("arm_outer", "wheel_center")),
    optional=(*WHEEL, *spring_roles("arm", "Location Arm")),
    springs=SPRINGS,
    bodies=spring_bodies(KNUCKLE),
)
