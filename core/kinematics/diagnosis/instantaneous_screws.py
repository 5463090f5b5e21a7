"""Motions in words: how each body moves at given rates of the unknowns, as a turn about an axis, a
screw or a shift.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...algebra import Vec3, cross, triple
from ...errors import shortened
from ...mechanism.mechanism import Vector
from ...primitives.base import Twist
from ...trajectory import Array
from ..formulation.constraints import Frames
from ..formulation.formulation import Configuration, Formulation

# Parts of a motion below this share of its largest are left out: round-off of a null vector is far
# below, what moves is above.
STILL = 1e-6
# Components below this [- or m] are printed as zero: they are round-off, of which a reader would
# see a direction askew.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Screw:
    """The motion of a body, relative to the fastest body.

    Attributes:
        turn: about the axis [rad], 0 for a pure shift.
        axis: unit vector, global, of the turn, or of the shift without a turn.
        through: a point of the axis, global [m].
        shift: along the axis [m].
    """

    body: str
    turn: float
    axis: Vector
    through: Vector
    shift: float

    def __str__(self) -> str:
        along = _numbers(self.axis)
        if not self.turn:
            return f"{self.body!r} shifts along {along}"
        how = "screws" if self.shift else "turns"
        lead = f", {self.shift / self.turn:.3g} m per rad" if self.shift else ""
        return f"{self.body!r} {how} about {along} through {_numbers(self.through)}{lead}"


def screws(formulation: Formulation, at: Configuration, frame: Frames, rates: Array) -> list[Screw]:
    """Return the motion of each moving body at the rates of the unknowns, shape (unknowns,), the
    fastest first.

    Rates have either sign: the fastest body's axis points along x, y or z rather than against it.
    """
    twists = formulation.twists(at, rates.tolist())
    speeds = {name: max(_size(twist.v), _size(twist.w)) for name, twist in twists.items()}
    fastest = max(speeds.values(), default=0.0)
    moving = sorted(
        (name for name, speed in speeds.items() if speed > STILL * fastest),
        key=lambda name: -speeds[name],
    )
    if moving:
        first = twists[moving[0]]
        leading = max([*(first.w if _size(first.w) > STILL * fastest else first.v)], key=abs)
        fastest = math.copysign(fastest, leading)
    return [_screw(name, twists[name], at, frame, fastest) for name in moving]


def free_motions(matrix: Array) -> Array:
    """Return a basis of the null space of a matrix, shape (motions, columns), with the fewest
    bodies in each motion.

    The orthonormal basis mixes independent motions; reduced to echelon form, each has a column of
    its own, and a spinning rod spins alone.
    """
    from ..structure.redundancy import RANK_TOLERANCE

    values, basis = np.linalg.svd(matrix, full_matrices=True)[1:]
    rank = int((values > RANK_TOLERANCE * max(1.0, values.max(initial=0.0))).sum())
    left = basis[rank:].copy()
    for k in range(len(left)):
        column = int(np.abs(left[k:]).max(axis=0).argmax())
        row = k + int(np.abs(left[k:, column]).argmax())
        left[[k, row]] = left[[row, k]]
        left[k] /= left[k, column]
        others = np.arange(len(left)) != k
        left[others] -= np.outer(left[others, column], left[k])
    return left


def describe_screws(found: Sequence[Screw], most: int = 4) -> str:
    """The motions of the fastest bodies, in words."""
    return shortened([*map(str, found)], most)


def _screw(name: str, twist: Twist, at: Configuration, frame: Frames, fastest: float) -> Screw:
    v, w = (1.0 / fastest) * twist.v, (1.0 / fastest) * twist.w
    origin = frame.origins[name] + at.poses[name].u
    turn = _size(w)
    if turn <= STILL:
        size = _size(v)
        return Screw(
            name, 0.0, triple((1.0 / size) * v), triple(frame.unit * origin), frame.unit * size
        )
    axis = (1.0 / turn) * w
    foot = origin + (1.0 / (turn * turn)) * cross(w, v)
    along = axis @ v
    return Screw(
        name,
        turn,
        triple(axis),
        triple(frame.unit * foot),
        frame.unit * along if abs(along) > STILL else 0.0,
    )


def _size(a: Vec3) -> float:
    return float(np.linalg.norm([*a]))


def _numbers(a: Sequence[float]) -> str:
    return "(" + ", ".join(f"{x if abs(x) > ROUND_OFF else 0.0:.4g}" for x in a) + ")"
