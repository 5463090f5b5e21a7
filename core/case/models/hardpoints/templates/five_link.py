"""Five links: the knuckle on five rods. An arm with two pivots and one ball is two of them, which
move the wheel alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .....joints import Distance, Joint
from .....mechanism.mechanism import GROUND, Vector
from .base import KNUCKLE, TIEROD_INNER, TIEROD_OUTER, WHEEL_CENTER, Role, Template

LINKS = ("upper_front", "upper_rear", "lower_front", "lower_rear", "tierod")


def _joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    return [
        Distance(link, GROUND, KNUCKLE, (at[f"{link}_inner"], at[f"{link}_outer"]))
        for link in LINKS
    ]


def _link(link: str, inner: Sequence[str], outer: Sequence[str]) -> tuple[Role, Role]:
    name = f"the {link.replace('_', ' ')} link's joint"
    return Role(f"{link}_inner", f"{name} on the chassis", inner), Role(
        f"{link}_outer", f"{name} on the knuckle", outer
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
    "upper_front_outer",
    "lower_rear_outer",
)
