"""Five links: the knuckle on five rods. Two rods replace an arm with two pivots and one ball; the
motion of the wheel is the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .....joints import Distance, Joint
from .....mechanism.mechanism import GROUND, Vector
from .base import (
    KNUCKLE,
    SPRINGS,
    TIEROD_INNER,
    TIEROD_OUTER,
    WHEEL,
    WHEEL_CENTER,
    Role,
    Template,
    spring_bodies,
    spring_roles,
)

LINKS = ("upper_front", "upper_rear", "lower_front", "lower_rear", "tierod")


def _joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    return [
        Distance(link, GROUND, KNUCKLE, (at[f"{link}_inner"], at[f"{link}_outer"]))
        for link in LINKS
    ]


def _link(link: str, inner: Sequence[str], outer: Sequence[str]) -> tuple[Role, Role]:
    name = f"the {link.replace('_', ' ')} link's joint"
    links = (link, f"{link}_link")
    return Role(
        f"{link}_inner",
        f"{name} on the chassis",
        (*inner, *(f"{each}_{end}" for each in links for end in ("inboard", "chassis"))),
    ), Role(
        f"{link}_outer",
        f"{name} on the knuckle",
        (*outer, *(f"{each}_{end}" for each in links for end in ("outboard", "upright"))),
    )


def _chrono(link: str) -> tuple[Sequence[str], Sequence[str]]:
    return (f"{link}/Location Chassis", f"{link} chassis", f"{link} inner"), (
        f"{link}/Location Upright",
        f"{link} outer",
    )


_UPPER_ARM = ("Upper Arm/Location Upright", "uca_outer")

FIVE_LINK = Template(
    "five_link",
    ("MultiLink", "multi_link"),
    (
        *_link("upper_front", ("Upper Arm/Location Chassis Front", "uca_front"), _UPPER_ARM),
        *_link("upper_rear", ("Upper Arm/Location Chassis Back", "uca_rear"), _UPPER_ARM),
        *_link("lower_front", *_chrono("Trailing Link")),
        *_link("lower_rear", *_chrono("Lateral")),
        TIEROD_INNER,
        TIEROD_OUTER,
        WHEEL_CENTER,
    ),
    _joints,
    ("wheel_center", "tierod_outer", "lower_rear_outer"),
    {
        "upper_front_inner": (0.1, 0.4, 0.52),
        "upper_front_outer": (0.02, 0.65, 0.53),
        "upper_rear_inner": (-0.15, 0.42, 0.51),
        "upper_rear_outer": (-0.02, 0.66, 0.525),
        "lower_front_inner": (0.25, 0.38, 0.25),
        "lower_front_outer": (0.03, 0.69, 0.2),
        "lower_rear_inner": (-0.06, 0.35, 0.2),
        "lower_rear_outer": (-0.02, 0.7, 0.18),
        "tierod_inner": (-0.18, 0.36, 0.26),
        "tierod_outer": (-0.15, 0.69, 0.25),
        "wheel_center": (0.0, 0.75, 0.32),
        "wheel_contact": (0.0, 0.75, 0.0),
        "spring_lower": (-0.01, 0.64, 0.21),
        "spring_upper": (-0.02, 0.56, 0.62),
    },
    above=(("upper_front_outer", "lower_rear_outer"),),
    optional=(*WHEEL, *spring_roles("knuckle", "Location Upright")),
    kingpin=tuple((f"{link}_inner", f"{link}_outer") for link in LINKS if link != "tierod"),
    steered="tierod",
    springs=SPRINGS,
    bodies={**spring_bodies(KNUCKLE), **{f"{link}_inner": GROUND for link in LINKS}},
)
