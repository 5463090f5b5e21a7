"""Suspension templates: roles of hardpoints, and the joints at their places.

Places are in metres, x forward, y left, z up. A template describes the left side; the chassis is
the ground, and the steering is locked.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from ....joints import Joint
from ....mechanism.mechanism import GROUND, Point, Vector

KNUCKLE = "knuckle"
"""The wheel carrier in every template."""

_SIDES = (
    re.compile(r"(?P<name>.+?)_(?P<side>left|right|l|r|fl|fr|rl|rr)"),
    re.compile(r"(?P<side>left|right|fl|fr|rl|rr)_(?P<name>.+)"),
)
"""Side or corner at the end of a normal name, or at its start."""

Kingpin: TypeAlias = tuple[str, str] | tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Role:
    """A hardpoint of a template.

    Attributes:
        meaning: description of the hardpoint, for messages.
        also: other names of the hardpoint; one point may fill several roles.
    """

    name: str
    meaning: str
    also: Sequence[str] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All names of the hardpoint, in their compact form."""
        return tuple(map(compact, (self.name, *self.also)))


@dataclass(frozen=True)
class Template:
    """A kind of suspension.

    Attributes:
        also: other names of the template in files.
        joints: function from places by role to joints; the joints name the bodies.
        watched: roles of non-collinear points of the knuckle; outputs compare their motion, and
            with it the knuckle's.
        above, ahead: pairs of roles, to detect wrong axes; in any car the first is above the
            second, or in front of it.
        sample: places by role for a sample table [m], invented.
        optional: roles of points for outputs only.
        kingpin: the steering axis: roles of its lower and its upper point, or of the ends of its
            four rods, see `Vehicle`; None without steering.
        steered: the joint with its first end on the rack, if there is steering.
        springs: roles of the ends of springs and dampers by the names of their motion ratios.
        bodies: the body of each role among the points of the case, unless it is the knuckle.
    """

    name: str
    also: Sequence[str]
    roles: Sequence[Role]
    joints: Callable[[Mapping[str, Vector]], Sequence[Joint]]
    watched: Sequence[str]
    sample: Mapping[str, Vector]
    above: Sequence[tuple[str, str]] = ()
    ahead: Sequence[tuple[str, str]] = ()
    optional: Sequence[Role] = ()
    kingpin: Kingpin | None = None
    steered: str = ""
    springs: Mapping[str, tuple[str, str]] = field(default_factory=dict[str, tuple[str, str]])
    bodies: Mapping[str, str] = field(default_factory=dict[str, str])

    def points(self, at: Mapping[str, Vector]) -> list[Point]:
        """Return the points for outputs, from the roles with a place."""
        read = [*self.watched, *flattened(self.kingpin or ())]
        read += [role for ends in self.springs.values() if all(map(at.get, ends)) for role in ends]
        read += [role.name for role in WHEEL if role.name in at]
        return [
            Point(role, self.bodies.get(role, KNUCKLE), at[role]) for role in dict.fromkeys(read)
        ]


def normal(name: str) -> str:
    """Return a hardpoint's name in normal form: without differences in case, blanks, the prefix of
    Adams/Car, and the spelling of centre.
    """
    plain = (
        re.sub(r"[^a-z0-9]+", "_", name.lower())
        .strip("_")
        .replace("centre", "center")
        .replace("tie_rod", "tierod")
    )
    return re.sub(r"^hp[ls]_", "", plain)


def compact(name: str) -> str:
    """Return a hardpoint's name in normal form without separators, also of words written together:
    `upperBallJoint`.
    """
    return normal(name).replace("_", "")


def side_of(name: str) -> tuple[str, str]:
    """Return a hardpoint's normal name without its side or corner, and the side: "left", "right" or
    an empty text.
    """
    plain = normal(name)
    for pattern in _SIDES:
        if found := pattern.fullmatch(plain):
            side = found["side"]
            return found["name"], "left" if side in ("left", "l", "fl", "rl") else "right"
    return plain, ""


def flattened(kingpin: Kingpin | tuple[()]) -> list[str]:
    """Return the roles of a steering axis."""
    return [role for each in kingpin for role in ([each] if isinstance(each, str) else each)]


def prefixed(prefix: str, kingpin: Kingpin | None) -> Kingpin | None:
    """Return the steering axis with a prefix before each name of a point."""
    if kingpin is None:
        return None
    ends: list[Any] = [
        prefix + each if isinstance(each, str) else (prefix + each[0], prefix + each[1])
        for each in kingpin
    ]
    return tuple(ends)


def between(a: Vector, b: Vector) -> Vector:
    """Return the vector from a to b."""
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]


_ARMS = ("{}_arm", "{}_wishbone", "{}_a_arm", "{}_control_arm", "{0[0]}ca", "{0[0]}wb")
_ENDS: Mapping[str, Sequence[str]] = {
    end: (
        *(f"{word}{joined}" for word in words for joined in ("", "_pivot", "_inboard", "_inner")),
        *(f"{before}_{word}" for word in words for before in ("inboard", "inner", "chassis")),
        short,
    )
    for end, words, short in (("front", ("front", "fore"), "if"), ("rear", ("rear", "aft"), "ir"))
} | {"outer": ("outer", "outboard", "outer_ball_joint", "ball_joint", "knuckle", "upright", "o")}
_RODS = ("tierod", "trackrod", "track_rod", "steering_rod", "tr")
_ROD_ENDS: Mapping[str, Sequence[str]] = {
    "inner": ("inner", "inboard", "chassis", "rack", "i", "inner_ball_joint"),
    "outer": ("outer", "outboard", "upright", "knuckle", "hub", "o", "outer_ball_joint"),
}


def arm_names(level: str, end: str) -> tuple[str, ...]:
    """Return names of a point of a wishbone in tables of Adams/Car, Lotus Suspension Analysis,
    suspension-explorer, OptimumK and others.

    Args:
        level: upper or lower.
        end: front, rear or outer.
    """
    optimum = {"front": "CHAS_{}For", "rear": "CHAS_{}Aft", "outer": "UPRI_{}Pnt"}[end]
    balls = (f"{level}_ball_joint", f"{level[0]}bj") if end == "outer" else ()
    arms = [arm.format(level) for arm in _ARMS]
    named = [f"{arm}_{name}" for arm in arms for name in _ENDS[end]]
    return (*named, *balls, optimum.format(level[:3].capitalize()))


def rod_names(end: str) -> tuple[str, ...]:
    """Return names of an end of the tie rod: inner or outer."""
    return tuple(f"{rod}_{name}" for rod in _RODS for name in _ROD_ENDS[end])


WHEEL_CENTER = Role(
    "wheel_center", "the wheel's centre", ("wheel", "wc", "Spindle/COM", "wheel_center_point")
)
TIEROD_INNER = Role(
    "tierod_inner",
    "the tie rod's joint on the rack or chassis",
    (
        "Tierod/Location Chassis",
        *rod_names("inner"),
        "Inner track rod ball joint",
        "CHAS_TiePnt",
    ),
)
TIEROD_OUTER = Role(
    "tierod_outer",
    "the tie rod's joint on the knuckle",
    (
        "Tierod/Location Upright",
        *rod_names("outer"),
        "Outer track rod ball joint",
        "UPRI_TiePnt",
    ),
)
WHEEL_CONTACT = Role(
    "wheel_contact",
    "the wheel's contact with the road",
    ("contact_patch", "tire_contact", "tyre_contact", "wheel_ground"),
)
WHEEL_AXIS = Role(
    "wheel_axis",
    "a point of the wheel's axis of rotation, outboard of its centre",
    ("spindle_outer", "wheel_spin_axis", "spindle_align"),
)
WHEEL = (WHEEL_CONTACT, WHEEL_AXIS)
"""Optional roles of every template."""


def spring_roles(lower: str, section: str) -> tuple[Role, ...]:
    """Return the optional roles of a spring and a damper between the chassis and another body.

    Args:
        lower: the body of the lower ends, in words.
        section: the key of Project Chrono for the lower ends.
    """
    return tuple(
        Role(f"{name}_{end}", f"the {name}'s joint on the {body}", (f"{chrono}/{key}", *also))
        for name, chrono in (("spring", "Spring"), ("damper", "Shock"))
        for end, body, key, also in (
            ("lower", lower, section, (f"lwr_{name}_mount",)),
            ("upper", "chassis", "Location Chassis", (f"upr_{name}_mount",)),
        )
    )


SPRINGS: Mapping[str, tuple[str, str]] = {
    "spring_ratio": ("spring_lower", "spring_upper"),
    "damper_ratio": ("damper_lower", "damper_upper"),
}


def spring_bodies(lower: str) -> Mapping[str, str]:
    """Return the bodies of the ends of spring and damper."""
    return {
        role: body
        for low, high in SPRINGS.values()
        for role, body in ((low, lower), (high, GROUND))
    }
