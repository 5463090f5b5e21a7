"""A robot: links, joints and closures of loops, all global in its zero pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from ....algebra import Vec3
from ..mjcf.elements import Element
from ..mjcf.frames import HERE, Place

Kind: TypeAlias = Literal["hinge", "slide", "ball"]


@dataclass(frozen=True, eq=False)
class Described(Element):
    """An element with its own words in messages, such as the place of its origin.

    Attributes:
        words: its place in the file.
    """

    words: str = ""

    def __str__(self) -> str:
        return self.words


@dataclass(frozen=True)
class Move:
    """One freedom of a joint, or the three of a ball.

    Attributes:
        name: of its coordinate; a ball has none.
        point: on the axis, or the centre of the ball [m]; without meaning for a slide.
        axis: unit vector [-]; without meaning for a ball.
    """

    kind: Kind
    name: str
    point: Vec3
    axis: Vec3

    @property
    def reversed(self) -> Move:
        """The same freedom with the bodies exchanged; its coordinate keeps its value."""
        return Move(self.kind, self.name, self.point, -self.axis)


@dataclass(frozen=True)
class Connection:
    """A joint: the second link moves on the first by a chain of freedoms; without any it is fixed.

    Attributes:
        free: the second link is not held at all.
    """

    name: str
    links: tuple[str, str]
    moves: tuple[Move, ...]
    element: Element
    free: bool = False

    @property
    def reversed(self) -> Connection:
        """The same joint with the links exchanged; its coordinates keep their values."""
        moves = tuple(move.reversed for move in reversed(self.moves))
        return Connection(self.name, (self.links[1], self.links[0]), moves, self.element)


@dataclass(frozen=True)
class Loop:
    """A joint of a loop, between a frame of each link.

    Attributes:
        frames: on the first link behind the freedoms, and on the second one; None for a joint
            without a gap in the zero pose.
    """

    joint: Connection
    frames: tuple[Place, Place] | None = None


@dataclass(frozen=True)
class Rod:
    """Two points of two links at a constant distance [m]."""

    name: str
    links: tuple[str, str]
    points: tuple[Vec3, Vec3]
    element: Element


@dataclass(frozen=True)
class Spring:
    """A linear spring and damper.

    Attributes:
        stiffness: [N/m or N m/rad].
        damping: [N s/m or N m s/rad].
        rest: coordinate or length without force [m or rad].
    """

    stiffness: float
    damping: float
    rest: float


@dataclass(frozen=True)
class Strut:
    """A spring and damper between two points of two links [m]."""

    name: str
    links: tuple[str, str]
    points: tuple[Vec3, Vec3]
    element: Element
    spring: Spring


@dataclass(frozen=True)
class Coupling:
    """A weighted sum of coordinates, constantly zero [rad, m]."""

    name: str
    weights: Mapping[str, float]
    element: Element


@dataclass(frozen=True)
class Mimic:
    """A coordinate as a polynomial of another one.

    Attributes:
        coefficients: from the constant on [rad or m].
    """

    name: str
    joints: tuple[str, str]
    coefficients: Sequence[float]
    element: Element


@dataclass(frozen=True)
class Inertial:
    """Mass of a link.

    Attributes:
        place: centre of mass and axes of the inertia, in the frame of the link.
        mass: [kg]; None if it cannot be read.
        inertia: entries xx, yy, zz, xy, xz, yz of the matrix about the centre [kg m^2].
    """

    place: Place = HERE
    mass: float | None = None
    inertia: Sequence[float] = ()


@dataclass
class Robot:
    """A robot of a file.

    Attributes:
        format: the file's, for messages and notes: "URDF robot".
        links: places of the links.
        fixed: links of the world.
        inertials: masses of links.
        gravity: [m/s^2].
        springs: those of joints, by coordinate.
        frames: names of places on links, for outputs: link and place.
        actuated: coordinates with a motor.
        left_out: number of omitted items, by name.
        beside: names of the files read beside this one.
        paired: whether one of them pairs frames that the zero pose need not bring together.
    """

    format: str
    root: Element
    links: dict[str, Place] = field(default_factory=dict[str, Place])
    elements: dict[str, Element] = field(default_factory=dict[str, Element])
    fixed: set[str] = field(default_factory=set[str])
    inertials: dict[str, Inertial] = field(default_factory=dict[str, Inertial])
    gravity: Sequence[float] = (0.0, 0.0, -9.81)
    joints: list[Connection] = field(default_factory=list[Connection])
    loops: list[Loop] = field(default_factory=list[Loop])
    rods: list[Rod] = field(default_factory=list[Rod])
    couplings: list[Coupling] = field(default_factory=list[Coupling])
    mimics: list[Mimic] = field(default_factory=list[Mimic])
    springs: dict[str, Spring] = field(default_factory=dict[str, Spring])
    struts: list[Strut] = field(default_factory=list[Strut])
    frames: dict[str, tuple[str, Place]] = field(default_factory=dict[str, tuple[str, Place]])
    actuated: list[str] = field(default_factory=list[str])
    left_out: dict[str, int] = field(default_factory=dict[str, int])
    beside: list[str] = field(default_factory=list[str])
    paired: bool = False

    def count(self, what: str) -> None:
        """Count one more omitted item."""
        self.left_out[what] = self.left_out.get(what, 0) + 1
