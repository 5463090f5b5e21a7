"""Sections of a tree of hardpoints: the points of one suspension among those of a car."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from ....errors import remedy, shortened
from ...io.document import fault, shown
from .roles import normal

Keys: TypeAlias = tuple[str, ...]
"""Path of a point: the keys of the tree from its root."""

SECTION = "--sheet NAME"
_CONTAINERS = ("hardpoints", "hard_points", "hardpoint", "points", "coordinates", "geometry")

_OF = "axle|suspension|hardpoints|points|geometry|corner|wheel"
_LEFT = re.compile(r"(?:.+_)?left|[fr]?l|l[fr]")
_RIGHT = re.compile(r"(?:.+_)?right|[fr]?r|r[fr]")
_AXLES = [
    re.compile(rf"{axle}(?:_(?:left|{_OF}))?|(?:{_OF})_{axle}|{axle[0]}l?|l{axle[0]}")
    for axle in ("front", "rear")
]


def chosen_points(
    file: Path, paths: Sequence[Keys], wanted: str | None
) -> tuple[dict[Keys, str], list[str]]:
    """Return the names of the points of one suspension by their paths, and what was left out."""
    left_out: list[str] = []
    kept = {keys: keys for keys in paths}
    contained = {keys: k for keys in paths if (k := _container(keys)) is not None}
    if contained:
        outside = [".".join(keys) for keys in paths if keys not in contained]
        if outside:
            left_out.append(f"values {shortened(outside, 8)}")
        kept = {keys: (*keys[:k], *keys[k + 1 :]) for keys, k in contained.items()}
    if wanted is not None:
        inside = {keys: _below(short, wanted) for keys, short in kept.items()}
        found = {keys: short for keys, short in inside.items() if short}
        if not found:
            known = {".".join(short[:k]) for short in kept.values() for k in range(1, len(short))}
            raise fault(
                file,
                "--sheet",
                f"found no section {shown(wanted)}, expected one with points;"
                f" {remedy(wanted, known)}",
            )
        if others := len(kept) - len(found):
            left_out.append(f"{others} points of other sections")
        kept = found
    sided = {keys: _side(short) for keys, short in kept.items()}
    if "left" in sided.values() and "right" in sided.values():
        right = [keys for keys, side in sided.items() if side == "right"]
        left_out.append(f"{len(right)} points of the right side")
        kept = {keys: short for keys, short in kept.items() if sided[keys] != "right"}
    shared = _shared([*kept.values()])
    kept = {keys: short[shared:] for keys, short in kept.items()}
    sections = dict.fromkeys(short[0] for short in kept.values() if len(short) > 1)
    axles = [[each for each in sections if axle.fullmatch(normal(each))] for axle in _AXLES]
    if all(axles):
        raise fault(
            file,
            "",
            f"found points in {', '.join(map(shown, sections))}, expected those of one suspension;"
            f" choose a section by {SECTION}",
        )
    names = {
        keys: ".".join(
            each for k, each in enumerate(short) if k == len(short) - 1 or normal(each) != "left"
        )
        for keys, short in kept.items()
    }
    return names, left_out


def _container(keys: Keys) -> int | None:
    """Return the index of the first key that is a word for hardpoints; None without one."""
    return next((k for k, key in enumerate(keys[:-1]) if normal(key) in _CONTAINERS), None)


def _below(keys: Keys, wanted: str) -> Keys:
    """Return the keys below a section; none if the path is not in it."""
    for first in range(len(keys) - 1):
        for last in range(first + 1, len(keys)):
            if normal(".".join(keys[first:last])) == normal(wanted):
                return keys[last:]
    return ()


def _side(keys: Keys) -> str:
    """Return the side that a key above the point's names; empty without one."""
    for key in map(normal, keys[:-1]):
        for side, pattern in (("left", _LEFT), ("right", _RIGHT)):
            if pattern.fullmatch(key):
                return side
    return ""


def _shared(paths: Sequence[Keys]) -> int:
    """Return the number of leading keys that all paths share, but for their last ones."""
    first, most = paths[0], min(map(len, paths)) - 1
    return next(
        (k for k in range(most) if any(keys[k] != first[k] for keys in paths)), max(most, 0)
    )
