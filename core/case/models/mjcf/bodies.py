"""Bodies of a mechanism, with the masses of a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ....algebra import Quat
from ....errors import shortened
from ....mechanism.body import Body
from ....mechanism.mechanism import Vector
from .elements import Element
from .frames import coordinates
from .masses import Mass, together, weighed
from .parts import Parts
from .rods import Spin
from .tree import Tree

EARTH = (0.0, 0.0, -9.81)
"""Gravity unless a model gives it [m/s^2]."""
MOST_NAMED = 8
# Of a rod's length, what the digits of a file leave between its centre of mass and its end.
AT_END = 1e-5


@dataclass(frozen=True)
class Bodies:
    """The bodies, and what is left out of their masses, in words.

    Attributes:
        weighed: whether a body has a mass.
    """

    bodies: list[Body]
    left_out: list[str]

    @property
    def weighed(self) -> bool:
        """Whether a body has a mass."""
        return any(body.mass for body in self.bodies)


def bodies_of(tree: Tree, parts: Parts, spins: Mapping[str, Spin]) -> Bodies:
    """Return the bodies of a mechanism with their masses.

    A rod that is a distance has its mass at its ends, which is right for its weight and not for its
    inertia.
    """
    masses = {
        name: [each.seen_in(place) for each in tree.masses.get(name, ())]
        for name, place in parts.bodies.items()
    }
    unknown = {name for name in tree.unweighed if name not in parts.fixed}
    lumped: list[str] = []
    for spin in spins.values():
        if spin.is_rod and (rod := tree.masses.get(spin.joint.inner)):
            whole = together(rod).seen_in(tree.moving[spin.joint.inner])
            if _lump(whole, spin, masses):
                lumped.append(spin.joint.inner)
            else:
                unknown.add(spin.joint.inner)
    bodies: list[Body] = []
    for name, place in parts.bodies.items():
        fixed = name in parts.fixed
        body = Body(name, coordinates(place.at), _euler_parameters(place.turn), fixed)
        mass = None if fixed or not masses[name] else together(masses[name])
        if (heavy := weighed(body, mass)) is None:
            unknown.add(name)
        bodies.append(heavy or body)
    left_out = [
        f"{what} {shortened(sorted(names), MOST_NAMED)}"
        for what, names in (
            ("masses that cannot be read, of", unknown),
            ("moments of inertia of rods, whose masses are at their ends:", lumped),
        )
        if names
    ]
    return Bodies(bodies, left_out)


def gravity_of(root: Element) -> Vector:
    """Return the gravity of a model [m/s^2]; the last option counts.

    Raises:
        CaseError: it is not three numbers.
    """
    found: Vector = EARTH
    for option in root.only("option"):
        if any(flag.attributes.get("gravity") == "disable" for flag in option.only("flag")):
            return (0.0, 0.0, 0.0)
        x, y, z = option.numbers("gravity", (3,), found)
        found = x, y, z
    return found


def _lump(rod: Mass, spin: Spin, masses: dict[str, list[Mass]]) -> bool:
    """Add a rod's mass to the bodies at its ends; return whether its centre is between them."""
    first, second = spin.ends
    arm = second.point - first.point
    share = float(((rod.center - first.point) @ arm) / (arm @ arm))
    if not -AT_END <= share <= 1.0 + AT_END:
        return False
    share = min(1.0, max(0.0, share))
    for end, part in ((first, 1.0 - share), (second, share)):
        if end.other in masses and part > 0.0:
            masses[end.other].append(Mass(part * rod.mass, end.point, np.zeros((3, 3))))
    return True


def _euler_parameters(turn: Quat) -> tuple[float, float, float, float]:
    e0, e1, e2, e3 = turn
    return float(e0), float(e1), float(e2), float(e3)
