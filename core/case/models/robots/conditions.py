"""Conditions of NAME.constraints.json, as `kincheck export --to urdf` writes them, as joints.

All conditions of a joint together give its freedoms: `offset` leaves slides across its direction,
and pairs of `directions` leave turns. The joint is a chain of slides and turns from the zero pose,
in which all conditions hold.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import msgspec

from ....algebra import Vec3, X, Y, Z, cross, vec
from ....errors import CaseError, remedy
from ....joints.base import triad
from ....mechanism.mechanism import Vector
from ...io.document import shown
from ..mjcf.frames import unit_vector
from .robot import Connection, Coupling, Described, Loop, Mimic, Move, Robot, Rod

# Rounding of exported numbers, relative to the size of the numbers.
OPEN = 1e-9


class End(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A point of a link, in its axes [m]."""

    link: str
    point: Vector


class Along(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A direction of a link, in its axes [-]."""

    link: str
    direction: Vector


class Condition(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A condition of a joint; the fields depend on its kind."""

    joint: str
    kind: Literal["coincident", "distance", "directions", "offset", "linear", "polynomial"]
    i: End | None = None
    j: End | None = None
    x: Along | None = None
    y: Along | None = None
    value: float = 0.0
    weights: dict[str, float] = {}
    driven: str = ""
    driving: str = ""
    coefficients: list[float] = []


class ConstraintsFile(msgspec.Struct, frozen=True):
    """The file; its other keys are for people."""

    constraints: list[Condition]


def add_constraints(file: Path, found: ConstraintsFile, robot: Robot) -> None:
    """Add the conditions of a file to a robot.

    Raises:
        CaseError: a link is unknown, or no joint has these conditions.
    """
    groups: dict[str, list[Condition]] = {}
    for each in found.constraints:
        if each.kind not in ("linear", "polynomial"):
            groups.setdefault(each.joint, []).append(each)
    for name, conditions in groups.items():
        _Group(file, name, conditions, robot).add()
    names = {*groups}
    for k, each in enumerate(found.constraints, 1):
        if each.kind not in ("linear", "polynomial"):
            continue
        name = each.joint if each.joint not in names else f"{each.joint}.{k}"
        names.add(name)
        element = Described(file, "", {}, 1, words=f"constraints: joint {each.joint!r}")
        if each.kind == "linear":
            robot.couplings.append(Coupling(name, each.weights, element))
        else:
            pair = each.driven, each.driving
            robot.mimics.append(Mimic(name, pair, each.coefficients, element))


class _Group:
    """The conditions of one joint."""

    def __init__(
        self, file: Path, name: str, conditions: Sequence[Condition], robot: Robot
    ) -> None:
        self.file, self.name, self.robot = file, name, robot
        self.element = Described(file, "", {}, 1, words=f"constraints: joint {name!r}")
        self.by_kind: Mapping[str, list[Condition]] = {
            kind: [each for each in conditions if each.kind == kind]
            for kind in ("coincident", "distance", "offset", "directions")
        }
        first = conditions[0]
        ends = (first.i, first.j) if first.i and first.j else (first.x, first.y)
        if ends[0] is None or ends[1] is None:
            raise self.fault("found no two links, expected i and j, or x and y")
        self.links = self.link(ends[0].link), self.link(ends[1].link)

    def fault(self, problem: str) -> CaseError:
        """Return the error of the group."""
        return self.element.fault(f"{problem}; export the case anew")

    def link(self, name: str) -> str:
        """Return a name of a link."""
        if name not in self.robot.links:
            raise self.fault(
                f"found {shown(name)}, expected a link; {remedy(name, self.robot.links)}"
            )
        return name

    def point(self, end: End | None) -> Vec3:
        """Return a point, global."""
        if end is None:
            raise self.fault("found a condition without i and j, expected two points")
        return self.robot.links[self.link(end.link)].point(vec(end.point))

    def axis(self, along: Along | None) -> Vec3:
        """Return a direction, global, length one."""
        if along is None:
            raise self.fault("found a condition without x, expected a direction")
        found = self.robot.links[self.link(along.link)].direction(vec(along.direction))
        if not math.hypot(*found) > 0.0:
            raise self.fault("found a direction of length zero, expected an axis")
        return unit_vector([*found])

    def require_zero(self, residual: float, scale: float) -> None:
        """Refuse a condition with a residual in the zero pose."""
        if abs(residual) > OPEN * max(1.0, scale):
            raise self.fault(
                f"is open by {residual:.3g} in the zero pose, expected a condition that holds there"
            )

    def add(self) -> None:
        """Add the joint."""
        if self.by_kind["distance"]:
            self.add_distance()
            return
        moves = [*self.slides(), *self.turns()]
        names = [self.name] if len(moves) == 1 else [f"{self.name}.{k}" for k in range(1, 7)]
        named = tuple(
            Move(move.kind, name, move.point, move.axis)
            for move, name in zip(moves, names, strict=False)
        )
        self.robot.loops.append(Loop(Connection(self.name, self.links, named, self.element)))

    def add_distance(self) -> None:
        """Add a rod; with an offset across a hinge on its first link."""
        (rod,) = self.by_kind["distance"]
        p, q = self.point(rod.i), self.point(rod.j)
        apart = q - p
        self.require_zero(math.sqrt(apart @ apart) - rod.value, rod.value)
        if not self.by_kind["offset"]:
            self.robot.rods.append(Rod(self.name, self.links, (p, q), self.element))
            return
        (across,) = self.by_kind["offset"]
        moves = (
            Move("hinge", self.name, p, self.axis(across.x)),
            Move("ball", f"{self.name}.ball", q, X),
        )
        self.robot.loops.append(Loop(Connection(self.name, self.links, moves, self.element)))

    def slides(self) -> list[Move]:
        """Return the slides left by offsets; none with a common point."""
        for each in self.by_kind["coincident"]:
            apart = self.point(each.j) - self.point(each.i)
            self.require_zero(math.sqrt(apart @ apart), 1.0)
            return []
        held: list[Vec3] = []
        for each in self.by_kind["offset"]:
            x, p, q = self.axis(each.x), self.point(each.i), self.point(each.j)
            self.require_zero(x @ (q - p) - each.value, abs(each.value))
            held.append(x)
        match held:
            case []:
                free = [X, Y, Z]
            case [x]:
                f, g, _ = triad((*x,))
                free = [f, g]
            case [x, y]:
                free = [_unit(cross(x, y))]
            case _:
                raise self.fault(f"found {len(held)} offsets, expected two at most")
        return [Move("slide", "", self.pivot, axis) for axis in free]

    def turns(self) -> list[Move]:
        """Return the turns left by pairs of directions."""
        pairs: list[tuple[Vec3, Vec3]] = []
        for each in self.by_kind["directions"]:
            x, y = self.axis(each.x), self.axis(each.y)
            self.require_zero(x @ y - each.value, 1.0)
            pairs.append((x, y))
        match pairs:
            case []:
                return [Move("ball", f"{self.name}.ball", self.pivot, X)]
            case [(x, y)]:
                return [Move("hinge", "", self.pivot, each) for each in (x, y)]
            case [(_, y), (_, z)] if abs(y @ z) > 1.0 - OPEN:
                return [Move("hinge", "", self.pivot, y)]
            case [_, _, _]:
                return []
            case _:
                raise self.fault(f"found {len(pairs)} pairs of directions of no joint")

    @property
    def pivot(self) -> Vec3:
        """The point of the second link about which it turns, global."""
        for each in (*self.by_kind["coincident"], *self.by_kind["offset"]):
            return self.point(each.j)
        return self.robot.links[self.links[1]].at


def _unit(a: Vec3) -> Vec3:
    return (1.0 / math.sqrt(a @ a)) * a
