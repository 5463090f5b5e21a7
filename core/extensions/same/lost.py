"""Facts beside motion that one file lacks or has otherwise: limits, motors, senses and zeros of
coordinates, masses, gravity.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from ...algebra import triple, vec
from ...joints import Fixed
from ...mechanism.body import Body, inertia_matrix
from ...mechanism.mechanism import GROUND
from ...trajectory import Array
from ..free.free_poses import Poses
from ..trees.tree import Mass, sum_of_masses
from .links import Match
from .motion import SIDES, Placement, joints_of_both, measurable, rotate_vectors, times, values
from .undriven import Coordinate, Undriven

# Numbers that files print in fewest digits are equal within this part [-].
PRINTED = 1e-5
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
    lost: dict[str, list[str]] = {}
    changed: list[str] = []
    for joint, other in joints_of_both(a, b, match):
        first, second = a.coordinates.get(joint.name), b.coordinates.get(other.name)
        if first is None or second is None:
            continue
        if measurable(a, joint.name) and measurable(b, other.name):
            x = values(a, joint.name, first, poses[0])
            y = values(b, other.name, second, poses[1])
            sense, zero = _relation(x, y, turns=first.turns)
            if sense < 0.0:
                changed.append(f"sense of {joint.name}: reversed in {b.name}")
            if abs(zero) > enough + PRINTED:
                unit = "rad" if first.turns else "m"
                changed.append(f"zero of {joint.name}: moved by {zero:.4g} {unit} in {b.name}")
            second = _in_terms_of(second, sense, zero)
        if not (a.is_model and b.is_model):
            continue
        for what, where, text in _of_joint(first, second):
            if text:
                changed.append(f"{what} of {joint.name}: {text}")
            else:
                file = (a, b)[where].name
                lost.setdefault(f"lost in {file}: {what} of", []).append(joint.name)
    return [
        *(f"{what} {', '.join(names)}" for what, names in lost.items()),
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


def _in_terms_of(coordinate: Coordinate, sense: float, zero: float) -> Coordinate:
    """Return a coordinate y = sense x + zero with its limits as those of x."""
    given = coordinate.limit
    bounds = sorted((sense * (given.lower - zero), sense * (given.upper - zero)))
    limit = replace(given, lower=bounds[0], upper=bounds[1])
    return replace(coordinate, limit=limit)


def _of_joint(a: Coordinate, b: Coordinate) -> Iterator[tuple[str, int, str]]:
    """Yield differences of a joint: the fact, the file without it, and both values if both have
    one.
    """
    for what, x, y in (
        ("limits", (a.limit.lower, a.limit.upper), (b.limit.lower, b.limit.upper)),
        ("effort limit", (a.limit.effort,), (b.limit.effort,)),
        ("velocity limit", (a.limit.velocity,), (b.limit.velocity,)),
    ):
        if all(
            p == q or abs(p - q) <= PRINTED * max(1.0, abs(p)) for p, q in zip(x, y, strict=True)
        ):
            continue
        free = [not any(map(math.isfinite, each)) for each in (x, y)]
        first, second = (" to ".join(f"{n:.6g}" for n in each) for each in (x, y))
        ratios = {abs(q / p) for p, q in zip(x, y, strict=True) if p and math.isfinite(q / p)}
        degrees = any(
            abs(r / math.degrees(1.0) - 1.0) < PRINTED or abs(r * math.degrees(1.0) - 1.0) < PRINTED
            for r in ratios
        )
        why = ", as between degrees and radians" * (degrees and a.turns)
        yield what, int(free[1]), "" if any(free) else f"{first} against {second}{why}"
    if a.actuated != b.actuated:
        yield "motor", int(a.actuated), ""


def _masses(
    a: Undriven, b: Undriven, match: Match, place: Placement, enough: float
) -> Iterator[str]:
    """Yield the links whose masses differ."""
    lost: dict[str, list[str]] = {}
    for x, y in match.partner.items():
        body, other = _whole(a, x, match.partner), _whole(b, y, match.partner.values())
        if not body.mass or not other.mass:
            if body.mass != other.mass:
                lost.setdefault((a, b)[bool(body.mass)].name, []).append(x)
            continue
        if abs(body.mass - other.mass) > PRINTED * body.mass:
            yield f"mass of {x}: {body.mass:.6g} against {other.mass:.6g} kg"
        there = place.put(np.array([[*body.origin, *body.euler_parameters]]), body, other)[0]
        center, inertia = _mass_in_pose(other, there)
        own = place.shift + rotate_vectors(place.turn, np.array(body.center_of_mass or body.origin))
        if (far := float(np.linalg.norm(center - own))) > enough + PRINTED * _arm(body):
            yield f"centre of mass of {x}: {far:.2g} m apart"
        axes = _matrix(place.turn)
        first = axes @ _inertia(body) @ axes.T
        if (off := float(np.abs(first - inertia).max())) > 3.0 * PRINTED * np.abs(first).max():
            yield f"inertia of {x}: {off:.2g} kg m^2 apart"
    for file, names in lost.items():
        yield f"lost in {file}: masses of {', '.join(names)}"


def _whole(file: Undriven, link: str, matched: Collection[str]) -> Body:
    """Return a link with the masses of others that are fixed to it, and are links of no other file:
    some models close a loop between two halves of a body.
    """
    mechanism, found = file.mechanism, [file.mechanism.body(link)]
    for joint in mechanism.joints:
        for one, other in (joint.bodies, joint.bodies[::-1]):
            if isinstance(joint, Fixed) and one == link and other not in (GROUND, *matched):
                found.append(mechanism.body(other))
    if len(found) == 1 or not all(body.mass for body in found):
        return found[0]
    whole = sum_of_masses(
        [Mass(body.mass, vec(body.center_of_mass or body.origin), _inertia(body)) for body in found]
    )
    xx, yy, zz, xy, xz, yz = whole.inertia[np.triu_indices(3)][[0, 3, 5, 1, 2, 4]].tolist()
    six = (xx, yy, zz, xy, yz, xz)
    return replace(found[0], mass=whole.mass, center_of_mass=triple(whole.center), inertia=six)


def _arm(body: Body) -> float:
    return float(np.linalg.norm(np.subtract(body.center_of_mass or body.origin, body.origin)))


def _inertia(body: Body) -> Array:
    return np.zeros((3, 3)) if body.inertia is None else inertia_matrix(body.inertia)


def _matrix(turn: Array) -> Array:
    return rotate_vectors(turn, np.eye(3)).T


def _mass_in_pose(body: Body, pose: Array) -> tuple[Array, Array]:
    """Return centre of mass and inertia of a body, global in a pose."""
    q = times(pose[3:], SIDES * np.array(body.euler_parameters))
    arm = np.subtract(body.center_of_mass or body.origin, body.origin)
    axes = _matrix(q)
    return pose[:3] + rotate_vectors(q, arm), axes @ _inertia(body) @ axes.T


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
