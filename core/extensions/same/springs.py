"""Springs, bushings and tendons between links that one file lacks or has otherwise."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import zip_longest

import numpy as np

from ...mechanism.mechanism import GROUND
from ...trajectory import Array
from ..free.free_poses import Poses
from ..trees.laws import SPRINGS, TENDONS, UNSAID
from ..trees.tree import Spring, Strut
from .links import Match
from .motion import SIDES, Placement, rotate_vectors, times
from .undriven import Undriven

# Numbers that files print in fewest digits are equal within this part [-].
PRINTED = 1e-5


def equal(p: float, q: float) -> bool:
    """Return whether two numbers are the same but for printed digits."""
    return p == q or abs(p - q) <= PRINTED * max(1.0, abs(p))


def lost_in(file: Undriven, what: str, names: Sequence[str], said: str = "") -> str:
    """Return the sentence on what a file has not; whether its format has words for it.

    Args:
        said: group of the format's words, if it is not `what`.
    """
    title, unsaid = UNSAID.get(file.root, ("", set[str]()))
    why = f" ({title} cannot say it)" if (said or what) in unsaid else ""
    return f"lost in {file.name}: {what} of {', '.join(names)}{why}"


def between_links(
    a: Undriven, b: Undriven, match: Match, place: Placement, poses: Poses, enough: float
) -> Iterator[str]:
    """Yield lost and changed springs, bushings and tendons.

    Args:
        poses: of the second file, the first of which is the first file's design.
        enough: lengths [m] are equal within this.
    """
    first, second = (
        _by_links(a, match.partner),
        _by_links(b, {y: y for y in match.partner.values()}),
    )
    for links in dict.fromkeys((*first, *second)):
        for x, y in zip_longest(first.get(links, ()), second.get(links, ())):
            if x is None or y is None:
                for file, strut in ((b, x), (a, y)):
                    if strut is not None:
                        yield lost_in(file, strut.described, [strut.name], SPRINGS)
                continue
            for (what, p), (_, q) in zip(_numbers(x), _numbers(y), strict=True):
                if not equal(p, q):
                    yield f"{what} of {x.name}: {p:.6g} against {q:.6g}"
            own = [place.shift + rotate_vectors(place.turn, each) for each in _ends(x)]
            there = [*map(partial(_moved, b, poses), y.links, _ends(y))]
            off = min(
                max(float(np.linalg.norm(p - q)) for p, q in zip(own, each, strict=True))
                for each in (there, there[::-1])
            )
            if off > enough + PRINTED * b.mechanism.size:
                yield f"ends of {x.name}: {off:.2g} m apart"
    for name in dict.fromkeys((*a.tendons, *b.tendons)):
        own, theirs = a.tendons.get(name), b.tendons.get(name)
        if own is None or theirs is None:
            said = own or theirs or {}
            yield lost_in((a, b)[theirs is None], ", ".join(said), [f"tendon {name}"], TENDONS)
            continue
        for key in dict.fromkeys((*own, *theirs)):
            p, q = ([*map(float, each.get(key, "").split())] for each in (own, theirs))
            if len(p) != len(q) or not all(map(equal, p, q)):
                texts = (" ".join(f"{x:.6g}" for x in each) or "nothing" for each in (p, q))
                yield f"{key} of tendon {name}: {' against '.join(texts)}"


def _by_links(file: Undriven, partner: Mapping[str, str]) -> dict[frozenset[str], list[Strut]]:
    """Return the struts of a file by the partners of their links, in order of their laws."""
    whole = _wholes(file)
    found: dict[frozenset[str], list[Strut]] = {}
    for strut in sorted(file.struts, key=lambda each: [x for _, x in _numbers(each)]):
        names = (whole.get(name, GROUND) for name in strut.links)
        links = frozenset(partner.get(name, name) for name in names)
        kind = type(strut.spring).__name__
        found.setdefault(links | {kind}, []).append(strut)
    return found


def _numbers(strut: Strut) -> list[tuple[str, float]]:
    """Return the numbers of a law, with their names."""
    law = strut.spring
    if isinstance(law, Spring):
        return [("stiffness", law.stiffness), ("damping", law.damping), ("free length", law.rest)]
    return [
        (f"{name.replace('_', ' ')} {axis}", x)
        for name, three in vars(law).items()
        for axis, x in zip("xyz", three, strict=True)
    ]


def _ends(strut: Strut) -> list[Array]:
    return [np.array([*each.at], dtype=np.float64) for each in strut.places]


def _moved(file: Undriven, poses: Poses, link: str, point: Array) -> Array:
    """Return a point of a link, moved from the file's design to the first of some poses."""
    name = _wholes(file).get(link, GROUND)
    if name not in poses:
        return point
    body, pose = file.mechanism.body(name), poses[name][0]
    turn = times(pose[3:], SIDES * np.array(body.euler_parameters))
    return pose[:3] + rotate_vectors(turn, point - np.array(body.origin))


def _wholes(file: Undriven) -> dict[str, str]:
    """Return the link of each of its parts."""
    return {part: name for name, parts in file.parts.items() for part in parts}
