"""Variants of one joint: bodies exchanged, both bodies moved together, scaled, far from the origin,
in other unknowns.

A motion admitted by the specimen must be admitted by the variant too: position,
velocity and acceleration.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...algebra import quat, rotation_less_identity
from ...joints import AxialJoint
from ...kinematics import Style
from ...trajectory import Array
from ..findings import Finding, Verdict, judged
from .checks import AMPLIFIED, AMPLIFIED_WHY, ROUND_OFF, ROUND_OFF_WHY, Specimen, defects, times
from .driver import coordinate
from .manifold import min_norm, newton, rank
from .specimens import moved, stretched
from .traced import COLUMNS, POSES, Place, TracedJoint

FACTORS = (1e-6, 1e-3, 1e3)
# Offset of a joint a thousand kilometres from the global origin [m].
AWAY = 1e6


def exchange(s: Specimen) -> Iterator[Finding]:
    """Check the same motion with both bodies exchanged."""
    if not s.joint.symmetric:
        yield Finding(
            "exchange",
            Verdict.SKIP,
            message="symmetric = False: geometry belongs to one of the bodies",
        )
        return
    back = replace(s.joint.reversed(), i=s.joint.i, j=s.joint.j)
    other = TracedJoint(back, Place((s.place.origins[1], s.place.origins[0]), s.place.unit))

    def exchanged(a: Array, half: int) -> Array:
        # a coordinate describes body j relative to body i
        return np.concatenate([a[half : 2 * half], a[:half], -a[2 * half :]])

    motion = (
        exchanged(s.state, POSES // 2),
        exchanged(s.rate, COLUMNS),
        exchanged(s.acceleration, COLUMNS),
    )
    yield _same(
        "exchange",
        s,
        other,
        motion,
        "the joint is another one with its bodies exchanged: set symmetric = False, or repair it",
    )


def rigid_motion(s: Specimen) -> Iterator[Finding]:
    """Check the same motion with both bodies turned and shifted together, and residuals
    off the manifold.
    """
    q = s.rng.normal(size=4)
    turn = quat((q / np.linalg.norm(q)).tolist())
    change = rotation_less_identity(turn)
    rotation = np.eye(3) + np.array([[*change.x], [*change.y], [*change.z]])
    shift = s.rng.normal(size=(3, 1))

    def pose(state: Array) -> Array:
        parts: list[Array] = []
        for k, origin in enumerate(s.traced.origins[:, :, None]):
            u, e = state[7 * k : 7 * k + 3], state[7 * k + 3 : 7 * k + 7]
            turned = turn * quat(e)
            parts += [rotation @ (origin + u) + shift - origin, np.stack([*turned])]
        return np.concatenate([*parts, state[POSES:]])

    def rates(a: Array) -> Array:
        return np.concatenate(
            [*(rotation @ a[3 * k : 3 * k + 3] for k in range(4)), a[2 * COLUMNS :]]
        )

    remedy = (
        "it must not matter where the two bodies are together: check which body each arm and axis"
        " belongs to"
    )
    yield _same(
        "rigid motion", s, s.traced, (pose(s.state), rates(s.rate), rates(s.acceleration)), remedy
    )
    off = s.traced.retract(s.state, 0.3 * s.rng.normal(size=s.rate.shape))
    here, there = s.traced.phi(off), s.traced.phi(pose(off))
    parts = s.traced.parts
    apart = np.array(
        [
            np.abs(np.linalg.norm(here[a:b], axis=0) - np.linalg.norm(there[a:b], axis=0))
            for a, b in parts
        ]
    )
    names = [s.traced.names[first].split(" row")[0] for first, _ in parts]
    yield judged("residual elsewhere", apart, ROUND_OFF, ROUND_OFF_WHY, names, remedy=remedy)


def axis_lengths(s: Specimen) -> Iterator[Finding]:
    """Check the same motion with longer directions, and the same residuals off the manifold.

    A multiple of a row has the same solutions; but a row may become so small or large that no
    solution meets its tolerance.
    """
    long = TracedJoint(stretched(s.joint, 137.0), s.place)
    remedy = "a direction may have any length: use unit() or triad()"
    met = _same("axis lengths", s, long, (s.state, s.rate, s.acceleration), remedy)
    off = s.traced.retract(s.state, 0.3 * s.rng.normal(size=s.rate.shape))
    apart = np.abs(s.traced.phi(off) - long.phi(off))
    unmet = judged(
        "axis lengths",
        apart,
        ROUND_OFF,
        ROUND_OFF_WHY,
        s.traced.names,
        "where it is not met",
        remedy,
    )
    yield max(met, unmet, key=lambda each: each.badness)


def size_and_place(s: Specimen) -> Iterator[Finding]:
    """Check the same motion of the joint scaled up and down, and far from the origin."""
    remedy = (
        "a length that is not declared so is not scaled: declare it by position(), positions() or"
        " length()"
    )
    worst: list[Finding] = []
    for factor in FACTORS:
        large = TracedJoint(s.joint.scaled(factor), s.place.scaled(factor))
        lengths = np.array(
            [name.endswith(".translation") for name in s.traced.coordinates], dtype=bool
        )
        state, units = s.state.copy(), np.ones(s.traced.columns)
        for numbers in (state[:3], state[7:10], units[:3], units[6:9]):
            numbers *= factor * s.place.unit
        state[POSES:][lengths] *= factor * s.place.unit
        units[2 * COLUMNS :][lengths] *= factor * s.place.unit
        worst.append(
            _same(
                "size",
                s,
                large,
                (state, s.rate, s.acceleration),
                remedy,
                units[:, None],
                f"worst at x {factor:g}",
            )
        )
    yield max(worst, key=lambda each: each.badness)
    (a, b), unit = s.place.origins, s.place.unit
    away = Place((tuple(x + AWAY for x in a), tuple(x + AWAY for x in b)), unit)
    remedy = "take arms from the bodies' origins: i.arm(P), j.arm(P), never P itself"
    yield _same(
        "place",
        s,
        TracedJoint(moved(s.joint, AWAY), away),
        (s.state, s.rate, s.acceleration),
        remedy,
    )


def named_coordinates(s: Specimen) -> Iterator[Finding]:
    """Check the same motion by the mixed formulation: the joint's coordinates are unknowns."""
    if not isinstance(s.joint, AxialJoint):
        yield Finding(
            "mixed style", Verdict.SKIP, message="no AxialJoint: it has no coordinates of its own"
        )
        return
    mixed = TracedJoint(s.joint, s.place, Style.MIXED)
    own = slice(2 * COLUMNS, None)
    state = np.concatenate([s.state[:POSES], np.zeros((len(mixed.coordinates), s.lanes))])
    state, _ = newton(mixed, state, mixed.rows, 30, own)
    jacobian = mixed.rows(state)
    rate = np.concatenate([s.rate[: 2 * COLUMNS], np.zeros_like(state[POSES:])])
    rate[own] = min_norm(jacobian, mixed.nu(state) - times(jacobian, rate), own)
    acceleration = np.concatenate([s.acceleration[: 2 * COLUMNS], np.zeros_like(state[POSES:])])
    acceleration[own] = min_norm(
        jacobian, mixed.gamma(state, rate) - times(jacobian, acceleration), own
    )
    said = _same(
        "mixed style",
        s,
        mixed,
        (state, rate, acceleration),
        "mixed() must say the same as primitives(): define both",
    )
    speed = 1.0 + np.linalg.norm(rate, axis=0)
    named = judged(
        "mixed style",
        np.array(
            [
                np.abs(coordinate(s, s.joint, name.rpartition(".")[2])[0][1] - own_rate) / speed
                for name, own_rate in zip(mixed.coordinates, rate[own], strict=True)
            ]
        ),
        AMPLIFIED,
        AMPLIFIED_WHY,
        mixed.coordinates,
        remedy="mixed() must name the joint's own coordinates, body j relative to body i",
    )
    yield max(said, named, key=lambda each: each.badness)


def _same(
    check: str,
    s: Specimen,
    other: TracedJoint,
    motion: tuple[Array, Array, Array],
    remedy: str,
    units: Any = 1.0,
    message: str = "",
) -> Finding:
    """Check that a motion of the specimen satisfies other equations too, and that these leave the
    same number of freedoms.
    """
    worst = np.max(defects(other, *motion, units), axis=0)
    mine = rank(s.exact) - len(s.traced.coordinates)
    theirs = rank(other.rows(motion[0]) * np.reshape(units, (1, 1, -1))) - len(other.coordinates)
    figures = np.vstack([worst, np.abs(theirs - mine)])
    return judged(check, figures, AMPLIFIED, AMPLIFIED_WHY, [*other.names, "rank"], message, remedy)
