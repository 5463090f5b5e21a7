"""Rods between two balls: bodies of a model with a turn about themselves, driven by nothing."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....algebra import Vec3, cross
from ....joints import Distance, PerpendicularAxes
from ....joints.base import triad
from ....trajectory import Array
from .equalities import Connect, Equality, Relation, Rod
from .frames import coordinates
from .tree import ModelJoint, Tree

# Points at a distance from the line through two others, over the distance of these, that rounding
# of composed frames leaves.
ON_LINE = 1e-9


@dataclass(frozen=True)
class End:
    """A point of a body held there, but free to turn.

    Attributes:
        other: body it is held by.
        by: the joint or equality.
    """

    point: Vec3
    other: str
    by: ModelJoint | Equality


@dataclass(frozen=True)
class Spin:
    """A body with a free turn about a line.

    Attributes:
        joint: its ball or free joint.
        ends: its held points, two of them apart.
        is_rod: whether it can be left out for a distance between the bodies at its ends.
    """

    joint: ModelJoint
    ends: Sequence[End]
    is_rod: bool

    @property
    def arm(self) -> Vec3:
        """From the first end to the one farthest from it [m]."""
        here = self.ends[0].point
        return max((each.point - here for each in self.ends), key=lambda a: a @ a)

    @property
    def axis(self) -> Array:
        """The line's direction, shape (3,)."""
        a = np.array([*self.arm], dtype=np.float64)
        return a / np.linalg.norm(a)

    def as_distance(self) -> Distance:
        """Return the distance between the bodies at both ends, under the joint's name."""
        (first, second) = self.ends
        points = coordinates(first.point), coordinates(second.point)
        return Distance(self.joint.name, first.other, second.other, points)

    def lock(self, name: str) -> PerpendicularAxes:
        """Return a joint against the turn about the line, with the body of the first end."""
        f, g, _ = triad(coordinates(self.arm))
        return PerpendicularAxes(
            name, self.ends[0].other, self.joint.inner, (coordinates(f), coordinates(g))
        )


def spins(tree: Tree, equalities: Sequence[Equality], fixed: Collection[str]) -> Mapping[str, Spin]:
    """Return the bodies free to turn about a line, by their joints' names.

    Args:
        fixed: held joints and bodies.
    """
    ends = _ends(tree, equalities)
    found: dict[str, Spin] = {}
    rods: set[str] = set()
    for joint in tree.chain:
        held = ends[joint.inner]
        if (
            joint.type not in ("ball", "free")
            or joint.inner in tree.massless
            or {joint.name, joint.inner} & {*fixed}
            or held is None
            or not _on_line(held)
        ):
            continue
        others = {each.other for each in held}
        # a rod to the body it hangs on moves nothing, and two of them end to end are a chain that
        # only bodies can carry
        is_rod = (
            len(held) == len(others) == 2
            and not any(isinstance(each.by, Rod) for each in held)
            and not others & rods
        )
        if is_rod:
            rods.add(joint.inner)
        found[joint.name] = Spin(joint, held, is_rod)
    return found


def _ends(tree: Tree, equalities: Sequence[Equality]) -> dict[str, list[End] | None]:
    """Return the held points of each body; None if something keeps it from turning."""
    found: dict[str, list[End] | None] = {name: [] for name in tree.moving}

    def hold(body: str, end: End | None) -> None:
        known = found.get(body)
        if known is not None:
            if end is None:
                found[body] = None
            else:
                known.append(end)

    for joint in tree.chain:
        for body, other in ((joint.outer, joint.inner), (joint.inner, joint.outer)):
            if joint.type == "ball":
                hold(body, End(joint.point, other, joint))
            elif joint.type != "free":
                hold(body, None)
    for each in equalities:
        if isinstance(each, Relation):
            continue
        pairs = zip((each.i, each.j), (each.j, each.i), each.points, strict=True)
        turning = not isinstance(each, Connect) or each.turns is None
        for body, other, point in pairs:
            hold(body, End(point, other, each) if turning else None)
    return found


def _on_line(ends: Sequence[End]) -> bool:
    """Return whether points are on one line, two of them apart, and one is held in place."""
    if len(ends) < 2 or all(isinstance(each.by, Rod) for each in ends):
        return False
    here = ends[0].point
    arms = [each.point - here for each in ends]
    longest = max(arms, key=lambda a: a @ a)
    size = longest @ longest
    return size > 0.0 and all(
        (off := cross(longest, a)) @ off <= (ON_LINE * size) ** 2 for a in arms
    )
