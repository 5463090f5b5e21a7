"""Places: positions and turns of frames, as models of links give them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ...algebra import (
    IDENTITY,
    ZERO,
    Quat,
    Vec3,
    X,
    Y,
    Z,
    cross,
    quat,
    rotation_less_identity,
)
from ...case.io.document import SMALLEST
from ...mechanism.mechanism import Vector


@dataclass(frozen=True)
class Place:
    """Position and turn of a frame, in the frame around it or globally [m, -]."""

    at: Vec3 = ZERO
    turn: Quat = IDENTITY

    def __mul__(self, inner: Place) -> Place:
        """Return a frame given in this one, as this one is given."""
        return Place(self.point(inner.at), unit_quaternion(self.turn * inner.turn))

    def point(self, p: Vec3) -> Vec3:
        """Return a point given in this frame."""
        return self.at + self.direction(p)

    def direction(self, a: Vec3) -> Vec3:
        """Return a direction given in this frame."""
        return a + rotation_less_identity(self.turn) @ a

    def relative_to(self, outer: Place) -> Place:
        """Return this frame as the other one sees it, both given alike."""
        back = outer.turn.conjugate()
        return Place(Place(ZERO, back).direction(self.at - outer.at), back * self.turn)

    @property
    def inverse(self) -> Place:
        """The frame around this one, as this one sees it."""
        return ORIGIN.relative_to(self)


ORIGIN = Place()


def unit_quaternion(q: Quat) -> Quat:
    """Return the quaternion at length one; composing many would let it drift."""
    length = math.sqrt(sum(e * e for e in q))
    return quat([e / length for e in q])


def coordinates(a: Vec3) -> Vector:
    """Return a vector as the description of a mechanism has it; less than numbers may be is
    zero.
    """
    x, y, z = (float(x) if abs(x) >= SMALLEST else 0.0 for x in a)
    return x, y, z


def turn_about(axis: Vec3, angle: float) -> Quat:
    """Return the turn about a unit vector by an angle [rad]."""
    return Quat(math.cos(0.5 * angle), math.sin(0.5 * angle) * axis)


def rotation_vector(turn: Quat) -> Vec3:
    """Return the rotation vector of a quaternion, at most half a turn [rad]."""
    sine = math.sqrt(turn.e @ turn.e)
    sign = 1.0 if turn.e0 >= 0.0 else -1.0
    return (sign * (2.0 * math.atan2(sine, sign * turn.e0) / sine if sine > 0.0 else 2.0)) * turn.e


def turn_by(vector: Vec3) -> Quat:
    """Return the quaternion of a rotation vector [rad]."""
    angle = math.sqrt(vector @ vector)
    half = math.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    return unit_quaternion(Quat(math.cos(0.5 * angle), half * vector))


AXES = {"x": X, "y": Y, "z": Z}


def euler_turn(sequence: str, angles: Iterable[float]) -> Quat:
    """Return the turn of angles about a sequence of axes [rad]: small letters turn with the body,
    capital ones stand still.
    """
    found = IDENTITY
    for letter, angle in zip(sequence, angles, strict=True):
        one = turn_about(AXES[letter.lower()], angle)
        found = found * one if letter.islower() else one * found
    return found


def turn_to(axis: Vec3) -> Quat:
    """Return the shortest turn of z to an axis; half a turn about x if that is opposite."""
    normal = cross(Z, axis)
    sine = math.sqrt(normal @ normal)
    if sine < 1e-10:
        return IDENTITY if axis.z > 0.0 else Quat(0.0, X)
    return turn_about((1.0 / sine) * normal, math.atan2(sine, axis.z))


def turn_of_axes(x: Vec3, y: Vec3, z: Vec3) -> Quat:
    """Return the quaternion of a frame, from the largest of its components (Shepperd's choice),
    which cannot vanish.
    """
    trace = x.x + y.y + z.z
    squares = (
        1.0 + trace,
        1.0 + 2.0 * x.x - trace,
        1.0 + 2.0 * y.y - trace,
        1.0 + 2.0 * z.z - trace,
    )
    k = squares.index(max(squares))
    scaled = (
        (squares[0], y.z - z.y, z.x - x.z, x.y - y.x),
        (y.z - z.y, squares[1], x.y + y.x, z.x + x.z),
        (z.x - x.z, x.y + y.x, squares[2], y.z + z.y),
        (x.y - y.x, z.x + x.z, y.z + z.y, squares[3]),
    )[k]
    return unit_quaternion(quat(scaled))
