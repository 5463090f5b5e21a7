"""Double wishbone: two arms, the knuckle between them, a tie rod; also with two rods for each
arm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from .....joints import Distance, Joint, Revolute, Spherical
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
    arm_names,
    between,
    spring_bodies,
    spring_roles,
)


def _joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    return (
        Revolute(
            "uca_pivot", GROUND, "uca", at["uca_rear"], between(at["uca_rear"], at["uca_front"])
        ),
        Revolute(
            "lca_pivot", GROUND, "lca", at["lca_rear"], between(at["lca_rear"], at["lca_front"])
        ),
        Spherical("upper_ball", "uca", KNUCKLE, at["uca_outer"]),
        Spherical("lower_ball", "lca", KNUCKLE, at["lca_outer"]),
        _tie_rod(at),
    )


def _tie_rod(at: Mapping[str, Vector]) -> Joint:
    return Distance("tie_rod", GROUND, KNUCKLE, (at["tierod_inner"], at["tierod_outer"]))


def _rods(at: Mapping[str, Vector]) -> Sequence[Joint]:
    ends = [(f"{arm}_{end}", f"{arm}_outer") for arm in ("uca", "lca") for end in ("front", "rear")]
    return [Distance(inner, GROUND, KNUCKLE, (at[inner], at[outer])) for inner, outer in ends] + [
        _tie_rod(at)
    ]


def _arm(arm: str, level: str) -> tuple[Role, Role, Role]:
    chrono = f"{level.capitalize()} Control Arm"
    return (
        Role(
            f"{arm}_front",
            f"the {level} arm's front pivot on the chassis",
            (f"{chrono}/Location Chassis Front", *arm_names(level, "front")),
        ),
        Role(
            f"{arm}_rear",
            f"the {level} arm's rear pivot on the chassis",
            (f"{chrono}/Location Chassis Back", *arm_names(level, "rear")),
        ),
        Role(
            f"{arm}_outer",
            f"the {level} arm's ball joint on the knuckle",
            (f"{chrono}/Location Upright", *arm_names(level, "outer")),
        ),
    )


DOUBLE_WISHBONE = Template(
    "double_wishbone",
    ("DoubleWishbone",),
    (*_arm("uca", "upper"), *_arm("lca", "lower"), TIEROD_INNER, TIEROD_OUTER, WHEEL_CENTER),
    _joints,
    ("wheel_center", "tierod_outer", "lca_outer"),
    {
        "uca_front": (0.09, 0.26, 0.285),
        "uca_rear": (-0.11, 0.265, 0.28),
        "uca_outer": (-0.015, 0.54, 0.312),
        "lca_front": (0.12, 0.21, 0.125),
        "lca_rear": (-0.13, 0.215, 0.12),
        "lca_outer": (0.005, 0.575, 0.118),
        "tierod_inner": (0.07, 0.22, 0.15),
        "tierod_outer": (0.075, 0.56, 0.148),
        "wheel_center": (0.0, 0.612, 0.228),
        "wheel_contact": (0.0, 0.612, 0.0),
        "spring_lower": (0.0, 0.45, 0.13),
        "spring_upper": (-0.01, 0.33, 0.48),
    },
    above=(("uca_outer", "lca_outer"),),
    optional=(*WHEEL, *spring_roles("lower arm", "Location Arm")),
    kingpin=("lca_outer", "uca_outer"),
    steered="tie_rod",
    springs=SPRINGS,
    bodies=spring_bodies("lca"),
)

REDUCED_DOUBLE_WISHBONE = replace(
    DOUBLE_WISHBONE,
    name="reduced_double_wishbone",
    also=("DoubleWishboneReduced",),
    joints=_rods,
    optional=(*WHEEL, *spring_roles("knuckle", "Location Upright")),
    bodies=spring_bodies(KNUCKLE),
)
"""Massless arms, as in Project Chrono: each is two rods. Spring and damper are on the knuckle."""
