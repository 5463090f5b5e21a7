"""Roles of unnamed points by geometry: the assignment to a template's roles most like its
sample, over all possible axes of a table.

A sample is scaled to the wheel's distance from the middle. Places are compared with it, and then
directions: of rods, arms, pivots and the steering axis. Steering may be ahead of the wheel or
behind it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np
import scipy.optimize  # pyright: ignore[reportMissingTypeStubs]
from numpy.typing import NDArray

from ...trajectory import Array
from .templates import TEMPLATES, WHEEL_CENTER, WHEEL_CONTACT, Template

_optimize: Any = scipy.optimize
Indices: TypeAlias = NDArray[np.intp]
"""Of the point of each role; -1 without one."""
WORDS = ("forward", "rearward"), ("left", "right"), ("up", "down")
# A place as far from the sample's as this, and a direction as far from the sample's, cost 1. Cars
# differ by such lengths [m]; their links by some twenty degrees.
FAR, TURNED = 0.15, 0.06
# Heights differ most between cars: race cars are flat.
HEIGHTS = 0.6, 1.0, 1.5
# A point without a role costs this, so that a template with more roles is not left for a smaller.
UNUSED = 0.25
# Steering axes lean back: one that leans forward by this tangent costs 1.
AHEAD = 0.2
BEST = 16
"""Assignments by places that directions may improve."""


@dataclass(frozen=True)
class Fit:
    """An assignment of points to the roles of a template.

    Attributes:
        axes: directions of x, y and z of the table.
        roles: names of points by role.
        cost: per role; below 1 if all is like the sample.
    """

    template: Template
    axes: str
    roles: Mapping[str, str]
    cost: float


def every_axes(right_handed: bool = True) -> list[str]:
    """Return all possible axes of a table, usual ones first."""
    found = list[str]()
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            turned = np.zeros((3, 3))
            for row, (k, sign) in enumerate(zip(order, signs, strict=True)):
                turned[row, k] = sign
            if bool(np.linalg.det(turned) > 0.0) is right_handed:
                pairs = zip(order, signs, strict=True)
                found.append(",".join(WORDS[k][sign < 0] for k, sign in pairs))
    return found


def fits(
    tries: Iterable[tuple[Template, Mapping[str, Sequence[float]], Mapping[str, str]]],
    axes: Sequence[str],
) -> list[Fit]:
    """Return the best assignments, the best first.

    Args:
        tries: templates, each with coordinates by name, and points whose roles are known, by role.
        axes: possible ones.
    """
    starts = list[tuple[float, _Start, Indices]]()
    for template, points, known in tries:
        names = [*points]
        raw = np.array([*points.values()], dtype=float)
        fixed = {role: names.index(name) for role, name in known.items()}
        if len(template.roles) > len(names):
            continue
        for each in axes:
            at = _turned(raw, each)
            for sample in _samples(template.name):
                for place in _scaled(at, fixed, sample):
                    chosen = _by_places(place, sample, fixed)
                    start = _Start(template, each, names, at, place, sample, fixed)
                    starts.append((start.cost(chosen), start, chosen))
    found = list[Fit]()
    for _, start, chosen in sorted(starts, key=lambda each: each[0])[:BEST]:
        chosen, cost = start.improved(chosen)
        numbers: list[int] = chosen.tolist()
        pairs = zip(start.sample.roles, numbers, strict=True)
        roles = {role: start.names[k] for role, k in pairs if k >= 0}
        found.append(Fit(start.template, start.axes, roles, cost))
    return sorted(found, key=lambda each: each.cost)


@dataclass(frozen=True)
class _Sample:
    """Roles, those needed first; their places; the pairs of roles of links; and the lower and
    the upper end of a steering axis through two joints."""

    roles: Sequence[str]
    needed: int
    at: Array
    links: Indices
    kingpin: Sequence[int]


@cache
def _samples(name: str) -> Sequence[_Sample]:
    template = TEMPLATES[name]
    needed = [role.name for role in template.roles]
    roles = [*needed, *(r.name for r in template.optional if r.name in template.sample)]
    links = [row[3:5] for row in template.joint_rows.values() if len(row) == 5]
    links += [
        (role, f"{role.rpartition('_')[0]}_outer")
        for role in roles
        if role.endswith(("_front", "_rear"))
    ]
    kingpin = [each for each in template.kingpin or () if isinstance(each, str)]
    links += [kingpin] * bool(kingpin)
    links.append((WHEEL_CONTACT, WHEEL_CENTER))
    pairs = [
        (roles.index(str(a)), roles.index(str(b))) for a, b in links if a in roles and b in roles
    ]
    at = np.array([template.sample[role] for role in roles])
    behind = at.copy()
    for k, role in enumerate(roles):
        if role.startswith("tierod"):
            behind[k, 0] *= -1.0
    kinds = [at, behind] if any(role.startswith("tierod") for role in roles) else [at]
    steering = [*map(roles.index, kingpin)]
    return [_Sample(roles, len(needed), each, np.array(pairs), steering) for each in kinds]


def _turned(raw: Array, axes: str) -> Array:
    """Return points with x forward, y left of the middle if most are on one side, z up."""
    at = np.zeros_like(raw)
    for column, word in enumerate(axes.split(",")):
        k = next(k for k, words in enumerate(WORDS) if word in words)
        at[:, k] = raw[:, column] * (1.0 if word == WORDS[k][0] else -1.0)
    if at[:, 1].mean() < 0.0:
        at[:, 1] *= -1.0
    return at


def _scaled(at: Array, fixed: Mapping[str, int], sample: _Sample) -> Iterable[Array]:
    """Yield the points in the size of the sample, with the wheel at its place, by heights."""
    if WHEEL_CENTER in fixed:
        wheel = fixed[WHEEL_CENTER]
    else:  # the highest of the outermost
        outer = np.flatnonzero(at[:, 1] >= 0.97 * at[:, 1].max())
        wheel = outer[at[outer, 2].argmax()]
    center = sample.at[sample.roles.index(WHEEL_CENTER)]
    half = at[wheel, 1]
    if half > 0.0:
        moved = (at - at[wheel]) * center[1] / half
        for height in HEIGHTS:
            yield moved * (1.0, 1.0, 1.0 / height) + center


def _by_places(place: Array, sample: _Sample, fixed: Mapping[str, int]) -> Indices:
    """Return the point of each role by places, -1 without one."""
    gaps = place[None, :, :] - sample.at[:, None, :]
    cost = np.minimum((gaps * gaps).sum(axis=2) / FAR**2, 100.0)
    for role, point in fixed.items():
        if role in sample.roles:
            row = sample.roles.index(role)
            cost[row] += 1e4
            cost[:, point] += 1e4
            cost[row, point] = 0.0
    spare = np.full((len(cost), len(cost)), 1e6)
    spare[range(sample.needed, len(cost)), range(sample.needed, len(cost))] = 1.0
    rows, columns = _optimize.linear_sum_assignment(np.hstack([cost, spare]))
    chosen = np.full(len(cost), -1)
    chosen[rows] = np.where(columns < len(place), columns, -1)
    return chosen


def _place_cost(place: Array, chosen: Indices, sample: _Sample) -> float:
    used = chosen >= 0
    gaps = place[chosen[used]] - sample.at[used]
    return float(np.minimum((gaps * gaps).sum(axis=1) / FAR**2, 10.0).mean())


def _by_directions(at: Array, chosen: Indices, sample: _Sample) -> float:
    """Return the mean cost of the directions of links between points."""
    a, b = sample.links.T
    there = (chosen[a] >= 0) & (chosen[b] >= 0)
    a, b = a[there], b[there]
    found, wanted = at[chosen[b]] - at[chosen[a]], sample.at[b] - sample.at[a]
    size = np.linalg.norm(found, axis=1) * np.linalg.norm(wanted, axis=1)
    cosines = (found * wanted).sum(axis=1) / np.maximum(size, 1e-300)
    return float(((1.0 - cosines) / TURNED).mean())


@dataclass(frozen=True)
class _Start:
    """Points in axes and size of a sample, with the roles known already."""

    template: Template
    axes: str
    names: Sequence[str]
    at: Array
    place: Array
    sample: _Sample
    fixed: Mapping[str, int]

    def cost(self, chosen: Indices) -> float:
        """Return the cost of an assignment: of places, directions, and points without a role."""
        unused = len(self.at) - len({*chosen} - {-1})
        ahead = 0.0
        if self.sample.kingpin:
            low, high = self.at[chosen[[*self.sample.kingpin]]]
            ahead = max(0.0, float(high[0] - low[0])) / float(np.linalg.norm(high - low))
        return (
            _place_cost(self.place, chosen, self.sample)
            + _by_directions(self.at, chosen, self.sample)
            + UNUSED * unused
            + ahead / AHEAD
        )

    def improved(self, chosen: Indices) -> tuple[Indices, float]:
        """Return the assignment after all exchanges with a lower cost, and the cost."""
        roles, needed = self.sample.roles, self.sample.needed
        best, free = (
            self.cost(chosen),
            [k for k, each in enumerate(roles) if each not in self.fixed],
        )
        improving = True
        while improving:
            improving = False
            spare = [*({*range(len(self.at))} - {*chosen} - {*self.fixed.values()})]
            tries = [*itertools.combinations(free, 2), *itertools.product(free, spare)]
            swaps = len(free) * (len(free) - 1) // 2
            for n, (j, k) in enumerate(tries):
                other = chosen.copy()
                other[[j, k] if n < swaps else j] = other[[k, j]] if n < swaps else k
                if (other[:needed] >= 0).all() and (now := self.cost(other)) < best - 1e-12:
                    chosen, best, improving = other, now, True
                    break
        return chosen, best
