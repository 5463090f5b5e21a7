"""Templates of suspensions: the roles of their hardpoints, functions from their places to joints,
and a sample table of each.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ....errors import CaseError, unknown
from ....joints import Distance, Joint, Revolute, Spherical, Translational
from ....mechanism.mechanism import GROUND, Vector
from .roles import (
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
    compact,
    spring_bodies,
    spring_roles,
)


def _mcpherson_joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
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
    _mcpherson_joints,
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


def _double_wishbone_joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
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
    _double_wishbone_joints,
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


ROCKER = "rocker"
_ROCKER_ROLES = (
    Role("pushrod_inner", "the pushrod's joint on the rocker", ("pushrod_inboard", "ROCK_RodPnt")),
    Role("rocker_pivot", "a point of the rocker's axis", ("rocker_axis_a", "CHAS_RocPiv")),
    Role("rocker_axis", "another point of the rocker's axis", ("rocker_axis_b", "CHAS_RocAxi")),
    Role("rocker_spring", "the spring's joint on the rocker", ("strut_bottom", "ROCK_CoiPnt")),
    Role("spring_inner", "the spring's joint on the chassis", ("strut_top", "CHAS_AttPnt")),
)
_DAMPER = (
    Role("rocker_damper", "the damper's joint on the rocker"),
    Role("damper_inner", "the damper's joint on the chassis"),
)


def _pushrod_joints(body: str) -> Callable[[Mapping[str, Vector]], Sequence[Joint]]:
    """Return the function from places to joints, for a pushrod on a body."""

    def joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
        axis = between(at["rocker_pivot"], at["rocker_axis"])
        return (
            *DOUBLE_WISHBONE.joints(at),
            Revolute("rocker_pivot", GROUND, ROCKER, at["rocker_pivot"], axis),
            Distance("pushrod", body, ROCKER, (at["pushrod_outer"], at["pushrod_inner"])),
        )

    return joints


def _template(mount: str, body: str, what: str, outer: Vector) -> Template:
    """Return the template with the pushrod on a body.

    Args:
        what: the body, in words.
        outer: place of the pushrod's joint on this body in the sample [m].
    """
    role = Role(
        "pushrod_outer",
        f"the joint of the pushrod or pullrod on {what}",
        ("pullrod_outer", "pushrod_outboard", "pullrod_outboard", "NSMA_PPAttPnt"),
    )
    without = {key: at for key, at in DOUBLE_WISHBONE.sample.items() if "spring" not in key}
    return replace(
        DOUBLE_WISHBONE,
        name=f"pushrod_{mount}",
        also=(f"pullrod_{mount}",),
        roles=(*DOUBLE_WISHBONE.roles, role, *_ROCKER_ROLES),
        joints=_pushrod_joints(body),
        sample={
            **without,
            "pushrod_outer": outer,
            "pushrod_inner": (0.0, 0.31, 0.45),
            "rocker_pivot": (-0.02, 0.25, 0.41),
            "rocker_axis": (0.02, 0.25, 0.41),
            "rocker_spring": (0.0, 0.23, 0.48),
            "spring_inner": (0.0, 0.05, 0.5),
        },
        optional=(*WHEEL, *_DAMPER),
        springs={
            "spring_ratio": ("rocker_spring", "spring_inner"),
            "damper_ratio": ("rocker_damper", "damper_inner"),
        },
        bodies={
            "rocker_spring": ROCKER,
            "spring_inner": GROUND,
            "rocker_damper": ROCKER,
            "damper_inner": GROUND,
        },
    )


PUSHROD_LOWER_ARM = _template("lower_arm", "lca", "the lower arm", (0.0, 0.53, 0.14))
PUSHROD_UPPER_ARM = _template("upper_arm", "uca", "the upper arm", (-0.01, 0.5, 0.31))
PUSHROD_KNUCKLE = _template("knuckle", KNUCKLE, "the knuckle", (0.0, 0.56, 0.14))


LINKS = ("upper_front", "upper_rear", "lower_front", "lower_rear", "tierod")


def _five_link_joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    return [
        Distance(link, GROUND, KNUCKLE, (at[f"{link}_inner"], at[f"{link}_outer"]))
        for link in LINKS
    ]


def _link_of_five(link: str, inner: Sequence[str], outer: Sequence[str]) -> tuple[Role, Role]:
    name = f"the {link.replace('_', ' ')} link's joint"
    links = (link, f"{link}_link_of_five")
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
        *_link_of_five(
            "upper_front", ("Upper Arm/Location Chassis Front", "uca_front"), _UPPER_ARM
        ),
        *_link_of_five("upper_rear", ("Upper Arm/Location Chassis Back", "uca_rear"), _UPPER_ARM),
        *_link_of_five("lower_front", *_chrono("Trailing Link")),
        *_link_of_five("lower_rear", *_chrono("Lateral")),
        TIEROD_INNER,
        TIEROD_OUTER,
        WHEEL_CENTER,
    ),
    _five_link_joints,
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


def _three_link_joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
    """Return the joints. A rod replaces each of Chrono's links between a universal joint and a
    ball; the motion of the wheel is the same.
    """
    return (
        Spherical("arm_pivot", GROUND, KNUCKLE, at["arm_pivot"]),
        Distance("upper", GROUND, KNUCKLE, (at["upper_inner"], at["upper_outer"])),
        Distance("lower", GROUND, KNUCKLE, (at["lower_inner"], at["lower_outer"])),
    )


def _link_of_three(link: str) -> tuple[Role, Role]:
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
        *_link_of_three("upper"),
        *_link_of_three("lower"),
        WHEEL_CENTER,
    ),
    _three_link_joints,
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


def _semi_trailing_arm_joints(at: Mapping[str, Vector]) -> Sequence[Joint]:
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
    _semi_trailing_arm_joints,
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


TEMPLATES = {
    template.name: template
    for template in (
        MCPHERSON,
        DOUBLE_WISHBONE,
        REDUCED_DOUBLE_WISHBONE,
        PUSHROD_LOWER_ARM,
        PUSHROD_UPPER_ARM,
        PUSHROD_KNUCKLE,
        FIVE_LINK,
        THREE_LINK,
        SEMI_TRAILING_ARM,
    )
}
"""Templates by name, as for --template."""

TEMPLATE_NAMES = {
    compact(name): template
    for template in TEMPLATES.values()
    for name in (template.name, *template.also)
}
"""Templates by all their names, in their compact form."""

ROLES = frozenset(
    name
    for template in TEMPLATES.values()
    for role in (*template.roles, *template.optional)
    for name in role.names
)
"""All names of all roles, in their compact form."""


AXES = "forward,left,up"


def sample_tables(names: Sequence[str]) -> list[str]:
    """Return the sample tables of the templates of these names; of all templates without names.

    Raises:
        CaseError: there is no such template.
    """
    for name in names:
        if name not in TEMPLATES:
            raise CaseError(unknown("template", name, TEMPLATES))
    return [sample_table(TEMPLATES[name]) for name in names or TEMPLATES]


def sample_table(template: Template) -> str:
    """Return the text of a table to begin one's own with, in mm; its numbers are invented."""
    text = io.StringIO()
    text.write(f"# template: {template.name}\n# units: mm\n# axes: {AXES}\n")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("name", "x", "y", "z", "meaning"))
    for roles, note in ((template.roles, ""), (template.optional, "optional: ")):
        for role in roles:
            if role.name in template.sample:
                place = (f"{1000.0 * x:.6g}" for x in template.sample[role.name])
                rows.writerow((role.name, *place, f"{note}{role.meaning}"))
    return text.getvalue()
