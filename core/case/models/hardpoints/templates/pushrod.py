"""Double wishbones with spring and damper on a rocker; a pushrod or a pullrod turns the rocker."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from .....joints import Distance, Joint, Revolute
from .....mechanism.mechanism import GROUND, Vector
from .base import KNUCKLE, WHEEL, Role, Template, between
from .double_wishbone import DOUBLE_WISHBONE

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


def _joints(body: str) -> Callable[[Mapping[str, Vector]], Sequence[Joint]]:
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
        joints=_joints(body),
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
