"""Facts beside motion that one file lacks or has otherwise: limits, motors, springs, friction,
senses and zeros of coordinates, masses, gravity.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ...joints import Joint
from ...mechanism.body import Body, inertia_matrix
from ...trajectory import Array
from ..free.free_poses import Poses
from ..trees.laws import EFFORT, REFERENCE, SPEED, Laws
from .links import Match
from .motion import (
    SIDES,
    Placement,
    joints_by_links,
    joints_of_both,
    measurable,
    rotate_vectors,
    times,
    values,
)
from .springs import PRINTED, between_links, equal, lost_in
from .undriven import Coordinate, Undriven

# A coordinate that moves less tells neither sense nor zero [rad or m].
MOVES = 1e-3
# Of gravity: 9.8, 9.80665 and 9.81 are one.
GRAVITY = 3e-3


def lost_items(
    a: Undriven,
    b: Undriven,
    match: Match,
    place: Placement,
    poses: tuple[Poses, Poses],
    enough: float,
) -> list[str]:
    """Return lost and changed facts.

    Args:
        poses: of the first file, and the same as those of the second one.
        enough: lengths [m] and angles [rad] are equal within this.
    """
    lost: dict[tuple[int, str], list[str]] = {}
    changed: list[str] = []
    pairs = joints_of_both(a, b, match)
    for joint, other in pairs:
        first, second = a.coordinates.get(joint.name), b.coordinates.get(other.name)
        own, theirs = a.laws.get(joint.name, {}), b.laws.get(other.name, {})
        if first and second and measurable(a, joint.name) and measurable(b, other.name):
            x = values(a, joint.name, first, poses[0])
            y = values(b, other.name, second, poses[1])
            sense, zero = _relation(x, y, turns=first.turns)
            if sense < 0.0:
                changed.append(f"sense of {joint.name}: reversed in {b.name}")
            if abs(zero) > enough + PRINTED:
                unit = "rad" if first.turns else "m"
                changed.append(f"zero of {joint.name}: moved by {zero:.4g} {unit} in {b.name}")
            second, theirs = _in_terms_of(second, theirs, sense, zero)
        if not (a.is_model and b.is_model):
            continue
        turns = first is None or first.turns
        for what, where, text in _differences(_facts(first, own), _facts(second, theirs), turns):
            if text:
                changed.append(f"{what} of {joint.name}: {text}")
            else:
                lost.setdefault((where, what), []).append(joint.name)
    if a.is_model and b.is_model:
        for where, what, name in _alone(a, b, match, pairs):
            lost.setdefault((where, what), []).append(name)
        changed += between_links(a, b, match, place, poses[1], enough)
    return [
        *(lost_in((a, b)[k], what, names) for (k, what), names in lost.items()),
        *changed,
        *_masses(a, b, match, place, enough),
        *_gravity(a, b, place),
    ]


def _relation(x: Array, y: Array, *, turns: bool) -> tuple[float, float]:
    """Return sense and zero of a coordinate y = sense x + zero."""
    if float(np.ptp(x)) < MOVES:
        return 1.0, 0.0
    found: list[tuple[float, float, float]] = []
    for sense in (1.0, -1.0):
        zero = y - sense * x
        if turns:
            zero = zero[0] + np.angle(np.exp(1j * (zero - zero[0])))
        found.append((float(np.ptp(zero)), sense, float(np.mean(zero))))
    _, sense, zero = min(found)
    return sense, math.remainder(zero, 2.0 * math.pi) if turns else zero


def _in_terms_of(
    coordinate: Coordinate, laws: Laws, sense: float, zero: float
) -> tuple[Coordinate, Laws]:
    """Return a coordinate y = sense x + zero with its limits, and its laws, as those of x."""
    given = coordinate.limit
    bounds = sorted((sense * (given.lower - zero), sense * (given.upper - zero)))
    limit = replace(given, lower=bounds[0], upper=bounds[1])
    if REFERENCE in laws:
        laws = {**laws, REFERENCE: sense * (laws[REFERENCE] - zero)}
    return replace(coordinate, limit=limit), laws


Facts: TypeAlias = Mapping[str, tuple[float, ...]]
"""Numbers of a joint by what they are; a motor has none."""


def _facts(coordinate: Coordinate | None, laws: Laws) -> Facts:
    found: dict[str, tuple[float, ...]] = {}
    if coordinate is not None:
        limit = coordinate.limit
        found = {
            "limits": (limit.lower, limit.upper),
            EFFORT: (limit.effort,),
            SPEED: (limit.velocity,),
        }
        found = {what: each for what, each in found.items() if any(map(math.isfinite, each))}
        found |= {"motor": ()} if coordinate.actuated else {}
    return found | {law: (number,) for law, number in laws.items()}


def _differences(a: Facts, b: Facts, turns: bool) -> Iterator[tuple[str, int, str]]:
    """Yield different facts: which, the file without it, and both values if both have one."""
    for what in dict.fromkeys((*a, *b)):
        if what not in a or what not in b:
            yield what, int(what in a), ""
            continue
        x, y = a[what], b[what]
        if all(map(equal, x, y)):
            continue
        first, second = (" to ".join(f"{n:.6g}" for n in each) for each in (x, y))
        ratios = {abs(q / p) for p, q in zip(x, y, strict=True) if p and math.isfinite(q / p)}
        degrees = any(
            abs(r / math.degrees(1.0) - 1.0) < PRINTED or abs(r * math.degrees(1.0) - 1.0) < PRINTED
            for r in ratios
        )
        why = ", as between degrees and radians" * (degrees and turns)
        yield what, 0, f"{first} against {second}{why}"


def _alone(
    a: Undriven, b: Undriven, match: Match, pairs: Sequence[tuple[Joint, Joint]]
) -> Iterator[tuple[int, str, str]]:
    """Yield facts of joints that have no partner in the other file, as of a loop that is closed by
    points: the file without them, the fact, and the joint.
    """
    for k, (file, other, partner) in enumerate(
        ((a, b, match.partner), (b, a, match.reversed.partner))
    ):
        paired = {pair[k].name for pair in pairs}
        theirs = joints_by_links(other, {y: y for y in partner.values()})
        for links, joints in joints_by_links(file, partner).items():
            told = any(_facts_of(other, each) for each in theirs.get(links, ()))
            for joint in joints:
                if "" not in links and joint.name not in paired and not told:
                    for what in _facts_of(file, joint):
                        yield 1 - k, what, joint.name


def _facts_of(file: Undriven, joint: Joint) -> Facts:
    return _facts(file.coordinates.get(joint.name), file.laws.get(joint.name, {}))


def _masses(
    a: Undriven, b: Undriven, match: Match, place: Placement, enough: float
) -> Iterator[str]:
    """Yield the links whose masses differ."""
    lost: dict[str, list[str]] = {}
    for x, y in match.partner.items():
        body, other = a.mechanism.body(x), b.mechanism.body(y)
        if not body.mass or not other.mass:
            if body.mass != other.mass:
                lost.setdefault((a, b)[bool(body.mass)].name, []).append(x)
            continue
        if abs(body.mass - other.mass) > PRINTED * body.mass:
            yield f"mass of {x}: {body.mass:.6g} against {other.mass:.6g} kg"
        there = place.put(np.array([[*body.origin, *body.euler_parameters]]), body, other)[0]
        center, inertia = _mass_in_pose(other, there)
        own = place.shift + rotate_vectors(place.turn, np.array(body.center))
        if (far := float(np.linalg.norm(center - own))) > enough + PRINTED * _arm(body):
            yield f"centre of mass of {x}: {far:.2g} m apart"
        axes = _matrix(place.turn)
        first = axes @ inertia_matrix(body.inertia) @ axes.T
        if (off := float(np.abs(first - inertia).max())) > 3.0 * PRINTED * np.abs(first).max():
            yield f"inertia of {x}: {off:.2g} kg m^2 apart"
    for file, names in lost.items():
        yield f"lost in {file}: masses of {', '.join(names)}"


def _arm(body: Body) -> float:
    return float(np.linalg.norm(np.subtract(body.center, body.origin)))


def _matrix(turn: Array) -> Array:
    return rotate_vectors(turn, np.eye(3)).T


def _mass_in_pose(body: Body, pose: Array) -> tuple[Array, Array]:
    """Return centre of mass and inertia of a body, global in a pose."""
    q = times(pose[3:], SIDES * np.array(body.euler_parameters))
    arm = np.subtract(body.center, body.origin)
    axes = _matrix(q)
    return pose[:3] + rotate_vectors(q, arm), axes @ inertia_matrix(body.inertia) @ axes.T


def _gravity(a: Undriven, b: Undriven, place: Placement) -> Iterator[str]:
    """Yield different gravities, if both files can say them and have masses."""
    if (
        a.says_gravity
        and b.says_gravity
        and all(any(body.mass for body in each.mechanism.moving) for each in (a, b))
    ):
        first, second = (np.array(each.mechanism.gravity) for each in (a, b))
        if np.linalg.norm(rotate_vectors(place.turn, first) - second) > GRAVITY * np.linalg.norm(
            first
        ):
            texts = (" ".join(f"{x:.5g}" for x in each) for each in (first, second))
            yield f"gravity: {' against '.join(texts)} m/s^2"
