"""McPherson strut: an arm, the knuckle, a strut, a tie rod. The strut slides on the knuckle, and
turns in its top mount.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .....joints import Distance, Joint, Revolute, Spherical, Translational
from .....mechanism.mechanism import GROUND, Vector
from .base import (
    KNUCKLE,
    TIEROD_INNER,
    TIEROD_OUTER,
    WHEEL,
    WHEEL_CENTER,
    Role,
    Template,
    arm_names,
    between,
)


def _joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    """Return the joints. The strut has a translational and a spherical joint, as in SAE 943745;
    Chrono's cylindrical and universal joints give the same motion of the wheel.
    """
    return (
        Revolute(
            "lca_pivot", GROUND, "lca", at["lca_rear"], between(at["lca_rear"], at["lca_front"])
        ),
        Spherical("lower_ball", "lca", KNUCKLE, at["lca_outer"]),
        Translational(
            "strut_slide",
            KNUCKLE,
            "strut",
            at["strut_lower"],
            between(at["strut_lower"], at["strut_upper"]),
        ),
        Spherical("strut_top", GROUND, "strut", at["strut_upper"]),
        Distance("tie_rod", GROUND, KNUCKLE, (at["tierod_inner"], at["tierod_outer"])),
    )


MCPHERSON = Template(
    "mcpherson",
    ("macpherson", "MacPhersonStrut"),
    (
        Role(
            "lca_front",
            "the arm's front pivot on the chassis",
            ("Control Arm/Location Chassis Front", *arm_names("lower", "front")),
        ),
        Role(
            "lca_rear",
            "the arm's rear pivot on the chassis",
            ("Control Arm/Location Chassis Back", *arm_names("lower", "rear")),
        ),
        Role(
            "lca_outer",
            "the arm's ball joint on the knuckle",
            ("Control Arm/Location Upright", *arm_names("lower", "outer")),
        ),
        Role(
            "strut_lower",
            "a point of the strut's axis on the knuckle",
            (
                "Spring/Location Upright",
                "strut_lwr_mount",
                "lwr_strut_mount",
                "strut_lower_mount",
                "strut_bottom",
            ),
        ),
        Role(
            "strut_upper",
            "the strut's mount on the chassis",
            ("Spring/Location Chassis", "top_mount", "strut_top", "strut_upper_mount"),
        ),
        TIEROD_INNER,
        TIEROD_OUTER,
        WHEEL_CENTER,
    ),
    _joints,
    ("wheel_center", "tierod_outer", "lca_outer"),
    {
        "lca_front": (0.15, 0.35, 0.19),
        "lca_rear": (-0.18, 0.36, 0.185),
        "lca_outer": (0.005, 0.7, 0.17),
        "strut_lower": (-0.01, 0.64, 0.4),
        "strut_upper": (-0.03, 0.56, 0.86),
        "tierod_inner": (-0.12, 0.33, 0.23),
        "tierod_outer": (-0.13, 0.69, 0.24),
        "wheel_center": (0.0, 0.75, 0.31),
        "wheel_contact": (0.0, 0.75, 0.0),
    },
    above=(("strut_upper", "lca_outer"),),
    optional=WHEEL,
    kingpin=("lca_outer", "strut_upper"),
    steered="tie_rod",
    springs={"spring_ratio": ("strut_lower", "strut_upper")},
    bodies={"strut_upper": GROUND},
)
