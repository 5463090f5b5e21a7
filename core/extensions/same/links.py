"""Partners among the links of two files: by name, by place, by the graph of joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import KincheckError, UnknownNameError
from ...mechanism.mechanism import GROUND
from ..trees.tree import COPY
from .undriven import Undriven, plain_name

# Places and distances of one model are equal within this part of its size.
NEAR = 1e-4


@dataclass(frozen=True)
class Match:
    """Links of a first file and their partners in a second one.

    Attributes:
        partner: by link of the first file.
        how: how they were found, in words.
        alone: links of each file, with names of their own, without a partner.
    """

    partner: Mapping[str, str]
    how: str
    alone: tuple[tuple[str, ...], tuple[str, ...]]

    @property
    def reversed(self) -> Match:
        """The same seen from the second file."""
        back = {b: a for a, b in self.partner.items()}
        return Match(back, self.how, (self.alone[1], self.alone[0]))


def match_links(a: Undriven, b: Undriven, given: Mapping[str, str]) -> Match:
    """Return the partners of the links of two files.

    Args:
        given: partners named by the user.

    Raises:
        KincheckError: one of those is no link, or is named twice.
    """
    for names, file in ((given.keys(), a), (given.values(), b)):
        known = [body.name for body in file.mechanism.moving]
        for name in names:
            if name not in known:
                raise UnknownNameError(f"link of {file.name}", name, known)
        if len({*names}) < len(names):
            raise KincheckError("--match: found a link twice, expected one partner of each")
    found = dict(given)
    ways = ["as given"] * bool(given)
    ways += ["by name"] * _by_name(a, b, found)
    for way, features in (("by place", _places), ("by the graph of joints", _graph)):
        added = False
        while _by_feature(features(a, found), features(b, {y: x for x, y in found.items()}), found):
            added = True
        ways += [way] * added
    alone = (
        tuple(x for x in a.links if x not in found),
        tuple(y for y in b.links if y not in found.values()),
    )
    return Match(found, " and ".join(ways) or "not at all", alone)


def _by_name(a: Undriven, b: Undriven, found: dict[str, str]) -> bool:
    """Add partners of one name, or with parts of one name; return whether there is one."""
    before = len(found)
    for same, parts in ((str, 1), (plain_name, 1), (str, None), (plain_name, None)):
        first, second = (
            {
                x: {same(part) for part in file.parts.get(x, (x,))[:parts] if COPY not in part}
                for x in file.links
                if x not in done
            }
            for file, done in ((a, {*found}), (b, {*found.values()}))
        )
        for x, names in first.items():
            fits = [y for y, others in second.items() if names & others]
            if len(fits) == 1 and sum(bool(second[fits[0]] & each) for each in first.values()) == 1:
                found[x] = fits[0]
    return len(found) > before


def _by_feature(
    first: Mapping[str, object], second: Mapping[str, object], found: dict[str, str]
) -> bool:
    """Add the partners whose feature no other link of either file has."""
    new = {
        x: fits[0]
        for x, feature in first.items()
        if [*first.values()].count(feature) == 1
        and len(fits := [y for y, other in second.items() if other == feature]) == 1
    }
    found.update(new)
    return bool(new)


def _places(file: Undriven, found: Mapping[str, str]) -> dict[str, object]:
    """Return the places of the joints of each link without a partner."""
    grid = NEAR * file.mechanism.size
    return {
        link: tuple(
            sorted(
                tuple(round(x / grid) for x in point)
                for joint in file.mechanism.joints_on.get(link, ())
                for point in joint.points_on(link)[:1]
            )
        )
        for link in file.links
        if link not in found
    }


def _graph(file: Undriven, found: Mapping[str, str]) -> dict[str, object]:
    """Return kinds and neighbours of the joints of each link without a partner, and the distances
    of their points. Partners have one name in both files.
    """
    mechanism = file.mechanism
    ground = {GROUND, *(body.name for body in mechanism.bodies if body.fixed)}
    colors = {body.name: 0 for body in mechanism.moving}
    colors |= {name: hash(frozenset((name, other))) for name, other in found.items()}
    colors |= dict.fromkeys(ground, hash(GROUND))
    grid = NEAR * mechanism.size
    still = {*found, *ground}
    for _ in range(len(mechanism.moving)):  # as far as neighbours tell links apart
        fresh = {
            name: color
            if name in still
            else hash(
                (
                    color,
                    *sorted(
                        hash((joint.freedoms, colors[joint.j if joint.i == name else joint.i]))
                        for joint in mechanism.joints_on.get(name, ())
                    ),
                )
            )
            for name, color in colors.items()
        }
        if len({*fresh.values()}) == len({*colors.values()}):
            break
        colors = fresh
    features: dict[str, object] = {}
    for link in file.links:
        if link not in found:
            joints = mechanism.joints_on.get(link, ())
            points = [p for joint in joints for p in joint.points_on(link)[:1]]
            apart = [np.linalg.norm(np.subtract(p, q)) for p in points for q in points]
            features[link] = colors[link], tuple(sorted(round(x / grid) for x in apart))
    return features
