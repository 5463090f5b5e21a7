"""Rods that spin: links between two balls, whose rotation about their own line is held."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...algebra import Vec3, cross
from ...joints import (
    PerpendicularAxes,
)
from ...joints.base import triad
from ...trajectory import Array
from .place import coordinates
from .tree import Closure, Coupling, Move, Tree

# Points at a distance from the line through two others, over the distance of these, that rounding
# of composed frames leaves.
ON_LINE = 1e-9


@dataclass(frozen=True)
class End:
    """A point of a link held there, but free to turn.

    Attributes:
        other: link it is held by.
        by: the move or closure.
    """

    point: Vec3
    other: str
    by: Move | Closure

    @property
    def slides(self) -> bool:
        """Whether it is held at a distance only."""
        return isinstance(self.by, Closure) and self.by.holds == "distance"


@dataclass(frozen=True)
class Spin:
    """A link with a free turn about a line.

    Attributes:
        move: its ball or free move.
        ends: its held points, two of them apart.
        is_rod: whether it can be left out for a distance between the links at its ends.
    """

    move: Move
    ends: Sequence[End]
    is_rod: bool

    @property
    def arm(self) -> Vec3:
        """From the first end to the one farthest from it [m]."""
        return _longest(self.ends)

    @property
    def axis(self) -> Array:
        """The line's direction, shape (3,)."""
        a = np.array([*self.arm], dtype=np.float64)
        return a / np.linalg.norm(a)

    def lock(self, name: str, other: str) -> PerpendicularAxes:
        """Return a joint against the turn about the line, with another link."""
        f, g, _ = triad(coordinates(self.arm))
        axes = coordinates(f), coordinates(g)
        return PerpendicularAxes(name, other, self.move.inner, axes)


def find_spins(tree: Tree, fixed: Collection[str]) -> Mapping[str, Spin]:
    """Return the links free to turn about a line, by their moves' names.

    Args:
        fixed: held moves and links.
    """
    ends = _ends(tree)
    found: dict[str, Spin] = {}
    rods: set[str] = set()
    for move in tree.moves.values():
        held = ends[move.inner]
        if (
            move.is_axial
            or move.inner in tree.massless
            or {move.name, move.inner} & {*fixed}
            or held is None
            or not _on_line(held)
        ):
            continue
        others = {each.other for each in held}
        # a rod to the link it hangs on moves nothing, and two of them end to end are a chain that
        # only links can carry
        is_rod = (
            len(held) == len(others) == 2
            and not any(each.slides for each in held)
            and not others & rods
        )
        if is_rod:
            rods.add(move.inner)
        found[move.name] = Spin(move, held, is_rod)
    return found


def _ends(tree: Tree) -> dict[str, list[End] | None]:
    """Return the held points of each link; None if something keeps it from turning."""
    found: dict[str, list[End] | None] = {name: [] for name in tree.moving}

    def hold(link: str, end: End | None) -> None:
        known = found.get(link)
        if end is None and link in found:
            found[link] = None
        elif end is not None and known is not None:
            known.append(end)

    for move in tree.moves.values():
        if move.kind != "free":
            for link, other in ((move.outer, move.inner), (move.inner, move.outer)):
                hold(link, None if move.is_axial else End(move.point, other, move))
    for each in tree.ties:
        if isinstance(each, Coupling):
            continue
        pairs = zip(each.links, reversed(each.links), each.places, strict=True)
        for link, other, place in pairs:
            hold(link, None if each.holds == "frame" else End(place.at, other, each))
    return found


def _longest(ends: Sequence[End]) -> Vec3:
    return max((each.point - ends[0].point for each in ends), key=lambda a: a @ a)


def _on_line(ends: Sequence[End]) -> bool:
    """Return whether points are on one line, two of them apart, and one is held in place."""
    if len(ends) < 2 or all(each.slides for each in ends):
        return False
    longest = _longest(ends)
    size = longest @ longest
    off = [cross(longest, each.point - ends[0].point) for each in ends]
    return size > 0.0 and all(a @ a <= (ON_LINE * size) ** 2 for a in off)
