"""Places and orientations as MJCF has them: quaternions, angles and axes, Euler angles in any
sequence.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from ....algebra import (
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
    vec,
)
from ....mechanism.mechanism import Vector
from ...io.document import SMALLEST, shown
from .attributes import KNOWN, ORIENTATION
from .elements import Element

_AXES = {"x": X, "y": Y, "z": Z}


@dataclass(frozen=True)
class Compiler:
    """How a model writes its angles.

    Attributes:
        degrees: angles are in degrees, as they are unless the model says otherwise.
        sequence: three letters, the axes of Euler angles: small ones turn with the body, capital
            ones stand still.
        align: the frames of free bodies are moved to their inertia, unless a joint says otherwise.
    """

    degrees: bool = True
    sequence: str = "xyz"
    align: bool = False

    def angle(self, value: float) -> float:
        """An angle of the file [rad]."""
        return math.radians(value) if self.degrees else value


def read_compiler(root: Element) -> Compiler:
    """The settings of all <compiler> elements, the last of which counts.

    Raises:
        CaseError: an unknown setting, or global coordinates, which MuJoCo does not read any more.
    """
    found = Compiler()
    for element in root.only("compiler"):
        element.require_known(KNOWN["compiler"])
        degrees = (
            element.choice("angle", ("degree", "radian"), "degree" if found.degrees else "radian")
            == "degree"
        )
        sequence = element.attributes.get("eulerseq", found.sequence)
        if len(sequence) != 3 or not all(letter.lower() in _AXES for letter in sequence):
            raise element.fault(
                f"eulerseq: found {shown(sequence)}, expected three of x, y, z, X, Y, Z; correct it"
            )
        if element.attributes.get("coordinate") == "global":
            raise element.fault(
                "coordinate: found 'global', which MuJoCo does not read any more (since 2.3.4),"
                " expected local coordinates; convert the model by MuJoCo 2.3.3 or older, whose"
                " mj_saveLastXML writes local ones, and give that file"
            )
        element.choice("coordinate", ("local",), "local")
        align = (
            element.choice("alignfree", ("true", "false"), "true" if found.align else "false")
            == "true"
        )
        found = Compiler(degrees, sequence, align)
    return found


@dataclass(frozen=True)
class Place:
    """Position and turn of a frame, in the frame around it or globally [m, -]."""

    at: Vec3 = ZERO
    turn: Quat = IDENTITY

    def then(self, inner: Place) -> Place:
        """A frame given in this one, as this one is given."""
        return Place(self.point(inner.at), unit_quaternion(self.turn * inner.turn))

    def point(self, p: Vec3) -> Vec3:
        """A point given in this frame."""
        return self.at + self.direction(p)

    def direction(self, a: Vec3) -> Vec3:
        """A direction given in this frame."""
        return a + rotation_less_identity(self.turn) @ a

    def seen_from(self, outer: Place) -> Place:
        """This frame as the other one sees it, both given alike."""
        back = outer.turn.conjugate()
        return Place(Place(ZERO, back).direction(self.at - outer.at), back * self.turn)


HERE = Place()
ROUND_OFF = 2.0 * sys.float_info.epsilon
"""Error of the length of a unit vector by the rounding of its components."""


def unit_quaternion(q: Quat) -> Quat:
    """The quaternion at length one; composing many would let it drift."""
    length = math.sqrt(sum(e * e for e in q))
    return quat([e / length for e in q])


def unit_vector(numbers: Sequence[float]) -> Vec3:
    """The direction of three numbers, length one; unchanged if they have it to the last digit, so
    that a file keeps its own numbers. Not for zero.
    """
    length = math.hypot(*numbers)
    if abs(length - 1.0) <= ROUND_OFF:
        return vec(numbers)
    return vec([each / length for each in numbers])


def coordinates(a: Vec3) -> Vector:
    """A vector as the description of a mechanism has it; less than numbers may be is zero."""
    x, y, z = (float(x) if abs(x) >= SMALLEST else 0.0 for x in a)
    return x, y, z


def read_place(element: Element, compiler: Compiler) -> Place:
    """The place given by pos and one kind of orientation.

    Raises:
        CaseError: several orientations, or a meaningless one: zero or parallel axes, a zero
            quaternion.
    """
    if "fromto" in element.attributes:  # of a site; its z axis points from the second to the first
        numbers = element.numbers("fromto", (6,))
        first, second = vec(numbers[:3]), vec(numbers[3:])
        axis = _direction(element, "fromto", (*(first - second),))
        return Place(0.5 * (first + second), _z_towards(axis))
    at = vec(element.numbers("pos", (3,), (0.0, 0.0, 0.0)))
    given = [name for name in ORIENTATION if name in element.attributes]
    if len(given) > 1:
        raise element.fault(
            f"found {' and '.join(given)}, expected one orientation; remove the others"
        )
    return Place(at, _orientation(element, given[0], compiler) if given else IDENTITY)


def _orientation(element: Element, name: str, compiler: Compiler) -> Quat:
    numbers = element.numbers(name, ({"quat": 4, "axisangle": 4, "xyaxes": 6}.get(name, 3),))
    if name == "euler":
        return euler_turn(numbers, compiler)
    if name == "quat":
        _require_nonzero(element, name, numbers)
        return unit_quaternion(quat(numbers))
    if name == "axisangle":
        return _about(_direction(element, name, numbers[:3]), compiler.angle(numbers[3]))
    if name == "zaxis":
        return _z_towards(_direction(element, name, numbers))
    x = _direction(element, name, numbers[:3])
    y = vec(numbers[3:])
    y = _direction(element, name, (*(y - (x @ y) * x),))
    return of_axes(x, y, cross(x, y))


def euler_turn(angles: Sequence[float], compiler: Compiler) -> Quat:
    """Return the turn of three Euler angles as the model writes them."""
    found = IDENTITY
    for letter, value in zip(compiler.sequence, angles, strict=True):
        one = _about(_AXES[letter.lower()], compiler.angle(value))
        found = found * one if letter.islower() else one * found
    return found


def _require_nonzero(element: Element, name: str, numbers: Sequence[float]) -> None:
    if math.hypot(*numbers) < 1e-10:  # as MuJoCo has it: shorter axes point anywhere
        raise element.fault(
            f"{name}: found axes of no direction, expected ones that span a frame; correct the"
            " attribute"
        )


def _direction(element: Element, name: str, numbers: Sequence[float]) -> Vec3:
    """The direction of three numbers, length one."""
    _require_nonzero(element, name, numbers)
    return unit_vector(numbers)


def _about(axis: Vec3, angle: float) -> Quat:
    return Quat(math.cos(0.5 * angle), math.sin(0.5 * angle) * axis)


def _z_towards(axis: Vec3) -> Quat:
    """The shortest turn of z towards the axis; half a turn about x if the axis is opposite."""
    normal = cross(Z, axis)
    sine = math.sqrt(normal @ normal)
    if sine < 1e-10:
        return IDENTITY if axis.z > 0.0 else Quat(0.0, X)
    return _about((1.0 / sine) * normal, math.atan2(sine, axis.z))


def of_axes(x: Vec3, y: Vec3, z: Vec3) -> Quat:
    """The quaternion of a frame, from the largest of its components (Shepperd's choice), which
    cannot vanish.
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


def joint_axis(element: Element) -> Vec3:
    """The axis of a joint in its body's frame, length one; z unless given."""
    return _direction(element, "axis", element.numbers("axis", (3,), (0.0, 0.0, 1.0)))
