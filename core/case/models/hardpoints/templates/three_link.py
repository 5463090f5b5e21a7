"""Three links: a trailing arm on a ball of the chassis carries the wheel; two rods guide it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .....joints import Distance, Joint, Spherical
from .....mechanism.mechanism import GROUND, Vector
from .base import (
    KNUCKLE,
    SPRINGS,
    WHEEL,
    WHEEL_CENTER,
    Role,
    Template,
    spring_bodies,
    spring_roles,
)


def _joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    """Return the joints. A rod replaces each of Chrono's links between a universal joint and a
    ball; the motion of the wheel is the same.
    """
    return (
        Spherical("arm_pivot", GROUND, KNUCKLE, at["arm_pivot"]),
        Distance("upper", GROUND, KNUCKLE, (at["upper_inner"], at["upper_outer"])),
        Distance("lower", GROUND, KNUCKLE, (at["lower_inner"], at["lower_outer"])),
    )


def _link(link: str) -> tuple[Role, Role]:
    chrono, name = f"{link.capitalize()} Link", f"the {link} link's joint"
    return (
        Role(f"{link}_inner", f"{name} on the chassis", (f"{chrono}/Location Chassis",)),
        Role(f"{link}_outer", f"{name} on the arm", (f"{chrono}/Location Arm",)),
    )


THREE_LINK = Template(
    "three_link",
    ("ThreeLinkIRS", "three_link_irs"),
    (
        Role(
            "arm_pivot",
            "the trailing arm's ball joint on the chassis",
            ("Trailing Arm/Location Chassis", "trailing_arm_pivot"),
        ),
        *_link("upper"),
        *_link("lower"),
        WHEEL_CENTER,
    ),
    _joints,
    ("wheel_center", "upper_outer", "lower_outer"),
    {
        "arm_pivot": (0.6, 0.55, 0.28),
        "upper_inner": (-0.05, 0.3, 0.45),
        "upper_outer": (-0.03, 0.65, 0.43),
        "lower_inner": (-0.1, 0.25, 0.22),
        "lower_outer": (-0.08, 0.66, 0.2),
        "wheel_center": (0.0, 0.75, 0.3),
        "wheel_contact": (0.0, 0.75, 0.0),
        "spring_lower": (0.02, 0.58, 0.22),
        "spring_upper": (0.03, 0.56, 0.6),
    },
    above=(("upper_outer", "lower_outer"),),
    ahead=(("arm_pivot", "wheel_center"),),
    optional=(*WHEEL, *spring_roles("arm", "Location Arm")),
    springs=SPRINGS,
    bodies=spring_bodies(KNUCKLE),
)
