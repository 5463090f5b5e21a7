"""The tree of links of a model: the content of a model in any format, and all that
its case is made of.

A link without a move of its own is part of the link around it. A link with several moves hangs on a
chain of massless ones, a move each. Loops are closed by ties.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from ...algebra import ZERO, Vec3, X, Y, Z
from ...case.io.document import LARGEST, decimal, fault, shown
from ...errors import CaseError, MechanismError
from ...joints import PiecewisePolynomial, Spline
from ...mechanism.loads import Law
from ...mechanism.mechanism import GROUND, Vector
from ...trajectory import Array
from ..xml.element import Account, Apart, Element, Names, settle
from .place import ORIGIN, Place

WORLD = "world"
# Scenes have many links. The freedom of all that move is counted at once, in a time that grows with
# the square of their number: 1,000 take 25 s, as many as these some minutes. The rows of ties are
# solved together, in some seconds.
MOST_LINKS, MOST_MOVING, MOST_TIES = 20_000, 2_500, 6_000
STAND_IN = 1e-6, 1e-6
"""Mass and moments written by kincheck for a body without a mass [kg, kg m^2]."""
BETWEEN = 1e-9, 1e-12
"""Those for a link between the freedoms of a joint, in a file with masses: no simulator sees them
in the motion of what it carries.
"""

COPY = ".copy"
"""End of the name of a link moved by the joint of a loop, and held to another link."""

Kind: TypeAlias = Literal["hinge", "slide", "ball", "free"]
UNKNOWNS: Mapping[str, int] = {"hinge": 1, "slide": 1, "ball": 3, "free": 6}
"""Unknowns of a move, by its kind."""


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

    def beside(self, other: Spring) -> Spring:
        """Return the spring and damper that acts as this and another one together."""
        stiffness = self.stiffness + other.stiffness
        force = self.stiffness * self.rest + other.stiffness * other.rest
        rest = force / stiffness if stiffness else 0.0
        return Spring(stiffness, self.damping + other.damping, rest)


@dataclass(frozen=True)
class BushingLaw:
    """Stiffness and damping along and about the axes of a bushing's first frame, three each [N/m,
    N m/rad, N s/m, N m s/rad], and the law of its torque.
    """

    stiffness: Vector
    turning_stiffness: Vector
    damping: Vector
    turning_damping: Vector
    law: Law = Law.EULER_PARAMETERS


INFINITE = 1e15
"""Simulators write numbers beyond this for no limit; SDF has 1e16."""


@dataclass(frozen=True)
class Limit:
    """Bounds of a joint with one coordinate; infinite without one.

    Attributes:
        lower, upper: of its coordinate [rad or m].
        effort: of its motor, by size [N m or N].
        velocity: by size [rad/s or m/s].
    """

    lower: float = -math.inf
    upper: float = math.inf
    effort: float = math.inf
    velocity: float = math.inf

    @property
    def is_range(self) -> bool:
        """Whether its coordinate has two bounds, the lower one first."""
        return self.lower < self.upper and math.isfinite(self.upper - self.lower)


NO_LIMIT = Limit()
Ends: TypeAlias = tuple[Place, Place]
"""A frame of each of two links."""


def limit_of(element: Element, texts: Mapping[str, str]) -> Limit:
    """Return the limit of the texts of its numbers, which may be missing or too large for one.

    Raises:
        CaseError: one is no number.
    """
    found = dict(vars(NO_LIMIT))
    for key, none in vars(NO_LIMIT).items():
        try:
            number = decimal(texts.get(key) or str(none))
        except ValueError:
            number = math.nan
        if math.isnan(number):
            raise element.fault(f"found {shown(texts[key])}, expected a number; correct the limit")
        found[key] = number if abs(number) < INFINITE else none
    return Limit(**found)


@dataclass(frozen=True)
class Move:
    """A hinge, a slide, a ball, or the six freedoms of a link that nothing holds; global in the
    pose of the tree [m].

    Attributes:
        point: on the axis, or the centre of the ball; without meaning for a slide.
        axis: unit vector [-]; without meaning for a ball and a free link.
        element: its place in the file.
        reference: its coordinate in the zero pose [rad or m].
        limit: of its one coordinate.
        moved: change of its coordinate since the zero pose [rad or m].
        outer, inner: links it joins; the inner one moves on the outer.
    """

    name: str
    kind: Kind
    point: Vec3
    axis: Vec3
    element: Element
    reference: float = 0.0
    limit: Limit = NO_LIMIT
    moved: float = 0.0
    outer: str = ""
    inner: str = ""

    @property
    def value(self) -> float:
        """Its coordinate in the pose of the tree [rad or m]."""
        return self.reference + self.moved

    @property
    def is_axial(self) -> bool:
        """Whether it has one coordinate."""
        return self.kind in ("hinge", "slide")


@dataclass(frozen=True)
class Closure:
    """A frame of each of two links, global in the pose of the tree, that are held together.

    Attributes:
        holds: "point", their origins coincide; "frame", their axes too; "distance", their origins
            have a constant distance.
        length: the distance [m].
    """

    name: str
    links: tuple[str, str]
    places: tuple[Place, Place]
    element: Element
    holds: Literal["point", "frame", "distance"] = "frame"
    length: float = 0.0


@dataclass(frozen=True)
class Coupling:
    """Changes of coordinates since the zero pose [rad, m]: a weighted sum, by move, follows a
    polynomial or a spline of another.

    Attributes:
        coefficients: of the polynomial, from the constant on.
        points: of the spline in its place, between two moves; see `Spline`.
    """

    name: str
    driven: Mapping[str, float]
    driving: Mapping[str, float]
    coefficients: Sequence[float]
    element: Element
    points: tuple[tuple[float, float], ...] = ()

    @cached_property
    def function(self) -> PiecewisePolynomial:
        """The polynomial or spline."""
        if not self.points:
            return PiecewisePolynomial((0.0,), (tuple(self.coefficients),))
        return Spline(self.name, (*self.driven, *self.driving), self.points).function

    @property
    def is_linear(self) -> bool:
        """Whether no power above the first takes part."""
        return not (self.driving and (self.points or any(self.coefficients[2:])))

    @property
    def is_curve(self) -> bool:
        """Whether it is between two moves."""
        return len(self.driven) == len(self.driving) == len(self.moves) - 1

    @property
    def moves(self) -> set[str]:
        """The moves it ties to one another, or locks."""
        return {*(self.weights if self.is_linear else (*self.driven, *self.driving))}

    @property
    def weights(self) -> dict[str, float]:
        """Of a linear coupling, the weights of the constant sum; without zeros."""
        found = dict(self.driven)
        for move, weight in self.driving.items():
            slope = self.coefficients[1] if len(self.coefficients) > 1 else 0.0
            found[move] = found.get(move, 0.0) - slope * weight
        return {move: weight for move, weight in found.items() if weight}


def require_spline(element: Element, points: tuple[tuple[float, float], ...]) -> None:
    """Raise CaseError at an element whose points, if any, have no spline."""
    try:
        if points:
            Spline("spline", ("driven", "driving"), points)
    except MechanismError as error:
        raise element.fault(str(error)) from None


Tie: TypeAlias = Closure | Coupling
Keyframe: TypeAlias = tuple[Element, Sequence[str] | None]
"""Coordinates of all moves in order, as written, and their place; None for the zero pose."""


@dataclass(frozen=True)
class Strut:
    """A spring and damper, or a bushing, between frames of two links, global in the pose of the
    tree [m].

    Attributes:
        described: its name in the list of parts left out.
    """

    name: str
    links: tuple[str, str]
    places: tuple[Place, Place]
    spring: Spring | BushingLaw
    element: Element
    described: str


@dataclass(frozen=True, eq=False)
class Mass:
    """A mass in a frame.

    Attributes:
        mass: [kg].
        center: centre of mass [m].
        inertia: about the centre, in the axes of the frame [kg m^2], shape (3, 3).
    """

    mass: float
    center: Vec3
    inertia: Array

    @property
    def is_stand_in(self) -> bool:
        """Whether it is what kincheck itself writes for none."""
        return any(
            self.mass == mass
            # moments that were turned into the axes of a body
            and np.allclose(self.inertia, moment * np.eye(3), rtol=0, atol=1e-9 * moment)
            for mass, moment in (STAND_IN, BETWEEN)
        )

    def in_frame(self, place: Place) -> Mass:
        """Return the mass in another frame, in which the place of its own one is given."""
        axes = np.array([[*place.direction(axis)] for axis in (X, Y, Z)]).T
        return Mass(self.mass, place.point(self.center), axes @ self.inertia @ axes.T)


def sum_of_masses(masses: Sequence[Mass]) -> Mass:
    """Return several masses in a frame as one."""
    total = sum(each.mass for each in masses)
    if len(masses) == 1 or total == 0.0:
        return masses[0] if masses else Mass(0.0, ZERO, np.zeros((3, 3)))
    center = sum(((each.mass / total) * each.center for each in masses), ZERO)
    inertia = np.zeros((3, 3))
    for each in masses:
        arm = np.array([*(each.center - center)], dtype=np.float64)
        inertia += each.inertia + each.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Mass(total, center, inertia)


@dataclass(eq=False)
class Tree:
    """The links of a model, global in its zero pose, until it is posed; a reader fills it.

    Attributes:
        described: the model and its file, for the source of the case.
        zero: its zero pose, in words.
        closes: whether it is meant to close.
        digits: significant digits of the numbers of the file.
        gravity: [m/s^2].
        places: of all links of the file, global.
        carriers: by link of the file, the moving one it is part of.
        moving: places of the moving links, global; the massless ones of chains too.
        massless: the names of those.
        moves: by name, outer ones first.
        free: by name, of the move or of its link, links held by nothing.
        sites: by name, the moving link they are on, and their global places.
        masses: of moving links with a mass, in the frame of each; several of links that move as
            one.
        unweighed: moving links whose masses cannot be read.
        springs: by move; others are of no move of the tree.
        tendons: of MJCF, with their default classes, by name.
        actuated: moves with a motor.
        motors: numbers of parts of motors and of limits of their moves, by their names in
            `left_out`, where they are unless they say what drives the model.
        keyframes: by name.
        starts: keyframes of some moves alone, as --start takes their values.
        left_out: numbers of parts without a meaning for kinematics, by name.
        notes: of its reader, beside every verdict.
        without: names by which the user leaves out elements.
        account: of the whole file, when it is read.
    """

    file: Path
    described: str
    zero: str
    closes: bool = True
    digits: int = 0
    gravity: Vector = (0.0, 0.0, -9.81)
    places: dict[str, Place] = field(default_factory=lambda: {WORLD: ORIGIN})
    carriers: dict[str, str] = field(default_factory=lambda: {WORLD: GROUND})
    moving: dict[str, Place] = field(default_factory=dict[str, Place])
    massless: set[str] = field(default_factory=set[str])
    moves: dict[str, Move] = field(default_factory=dict[str, Move])
    free: dict[str, str] = field(default_factory=dict[str, str])
    sites: dict[str, tuple[str, Place]] = field(default_factory=dict[str, tuple[str, Place]])
    masses: dict[str, list[Mass]] = field(default_factory=dict[str, list[Mass]])
    unweighed: set[str] = field(default_factory=set[str])
    ties: list[Tie] = field(default_factory=list[Tie])
    springs: dict[str, Spring] = field(default_factory=dict[str, Spring])
    struts: list[Strut] = field(default_factory=list[Strut])
    tendons: dict[str, Element] = field(default_factory=dict[str, Element])
    actuated: set[str] = field(default_factory=set[str])
    motors: Counter[str] = field(default_factory=Counter[str])
    starts: dict[str, list[str]] = field(default_factory=dict[str, list[str]])
    keyframes: dict[str, Keyframe] = field(default_factory=dict[str, Keyframe])
    left_out: Counter[str] = field(default_factory=Counter[str])
    notes: list[str] = field(default_factory=list[str])
    without: set[str] = field(default_factory=set[str])
    names: Names = field(default_factory=Names)
    account: Account | None = None

    @cached_property
    def joints(self) -> Mapping[str, Move]:
        """The moves of links held by something."""
        return {name: move for name, move in self.moves.items() if move.kind != "free"}

    def fault(self, option: str, problem: str) -> CaseError:
        """Return the error to raise: 'FILE: OPTION: PROBLEM'."""
        return fault(self.file, option, problem)

    def count(self, what: str) -> None:
        """Count one more omitted item."""
        self.left_out[what] += 1

    def leave(self, element: Element, what: str) -> None:
        """Count one more omitted element, with all in it."""
        element.leave()
        self.count(what)

    def settled(self, root: Element, apart: Apart) -> Tree:
        """Return the tree, with the unread names of its file among the parts left out.

        Raises:
            CaseError: one of them may mean something for kinematics; see `settle`.
        """
        self.account = settle(root, apart)
        self.left_out.update(self.account.left_out)
        return self

    def add_motor(self, part: str, moves: Collection[str]) -> None:
        """Add a motor of moves, which is a part that is left out."""
        self.actuated.update(moves)
        self.motors[part] += bool(moves)

    def hang(
        self, element: Element, name: str, outer: str, place: Place, moves: Sequence[Move] = ()
    ) -> None:
        """Hang a link on another one by a chain of moves; without any it is part of that.

        Raises:
            CaseError: a name is taken, a place is beyond all numbers, or there are too many.
        """
        if name in self.places:
            raise element.repeated_name(name, "the bodies")
        _require_few(element, MOST_LINKS, len(self.places), "bodies; take out what does not move")
        _require_few(element, MOST_MOVING, len(self.moving) + len(moves), f"joints; {_TAKE_OUT}")
        carrier = self.carriers[outer]
        if name == GROUND and (moves or carrier != GROUND):
            raise element.fault(
                f"name: found {shown(name)}, which is what does not move in a mechanism; rename the"
                " body"
            )
        _require_within(element, place.at)
        for k, move in enumerate(moves):
            if move.name in self.moves or (move.kind == "free" and move.name in self.free):
                raise move.element.repeated_name(move.name, "the joints")
            if move.kind == "free" and (len(moves) > 1 or carrier != GROUND):
                raise move.element.fault(
                    "frees a body that other joints hold, expected a body in worldbody alone;"
                    " remove one of them"
                )
            _require_within(move.element, move.point)
            inner = name if k == len(moves) - 1 else self.names.new(f"{name}.{move.name}")
            self.moving[inner] = place
            if inner != name:
                self.massless.add(inner)
            if move.kind == "free":
                self.free.update({move.name: name, name: name})
            self.moves[move.name] = replace(move, outer=carrier, inner=inner)
            carrier = inner
        self.places[name], self.carriers[name] = place, carrier

    def mark(self, element: Element, name: str, link: str, place: Place) -> None:
        """Add a site of a name to a link.

        Raises:
            CaseError: the name is taken, or the place is beyond all numbers.
        """
        if name in self.sites:
            raise element.repeated_name(name, "the sites")
        _require_within(element, place.at)
        self.sites[name] = self.carriers[link], place

    def weigh(self, link: str, mass: Mass | None) -> None:
        """Add the mass of a link, in its frame, to what carries it; None if it cannot be read."""
        carrier = self.carriers[link]
        if carrier == GROUND:
            return
        if mass is None:
            self.unweighed.add(carrier)
        else:
            seen = mass.in_frame(self.places[link].relative_to(self.moving[carrier]))
            self.masses.setdefault(carrier, []).append(seen)

    def require_moving(self, root: Element) -> None:
        """Refuse a model in which nothing moves."""
        if not self.moving:
            raise root.fault(
                "has no body with a joint, expected a mechanism; give a model that moves"
            )

    def add_tie(self, tie: Tie) -> None:
        """Add a tie; one between parts of the ground is counted.

        Raises:
            CaseError: it ties a link to itself, is a curve between sums of moves, or there are too
                many.
        """
        _require_few(tie.element, MOST_TIES, len(self.ties) + 1, f"equalities; {_TAKE_OUT}")
        if isinstance(tie, Closure) and tie.links[0] == tie.links[1]:
            if tie.links[0] == GROUND:
                self.count("equalities of what stands still")
                return
            raise tie.element.fault(
                f"joins {tie.links[0]!r} with itself, expected two bodies that move otherwise;"
                " remove it"
            )
        if isinstance(tie, Coupling) and not (tie.is_linear or tie.is_curve):
            own = tie.element.attributes.get("name") or tie.element.tag
            raise tie.element.fault(
                "polycoef: is a curve between sums of joints, expected one joint on either side, or"
                f" a line; leave it out by --without {own}"
            )
        self.ties.append(tie)

    def add_strut(self, strut: Strut) -> None:
        """Add a strut; one without a law is counted.

        Raises:
            CaseError: there are too many.
        """
        law = strut.spring
        if isinstance(law, Spring) and not (law.stiffness or law.damping):
            self.count(strut.described)
            return
        _require_few(strut.element, MOST_TIES, len(self.struts) + 1, f"springs; {_TAKE_OUT}")
        self.struts.append(strut)

    def require_axial(self, element: Element, key: str, name: str | None) -> str:
        """Return the name of a move with one coordinate.

        Raises:
            CaseError: there is none of the name.
        """
        if name is None or name not in self.joints:
            raise element.unknown_name(key, name, self.joints, "a joint")
        if self.joints[name].kind == "ball":
            raise element.fault(
                f"{key}: {name!r} is a ball joint, expected a hinge or a slide; couple one of those"
            )
        return name


_TAKE_OUT = "take out those that are not looked at"


def _require_few(element: Element, most: int, count: int, what: str) -> None:
    """Refuse more than can be read in some seconds."""
    if count > most:
        raise element.fault(f"found more than the {most} that are read, expected fewer {what}")


def _require_within(element: Element, point: Vec3) -> None:
    """Refuse a place beyond all numbers, to which the places of many links may add up."""
    if not all(math.isfinite(x) and abs(x) <= LARGEST for x in point):
        raise element.fault(
            f"is farther than {LARGEST:g} m from the origin, expected a mechanism; correct places"
        )
