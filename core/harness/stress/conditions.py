"""The conditions of a mechanism, written a second time: full products of vectors, in extended precision, nothing simplified.

Nothing here comes from the primitives, rows or programs that are under test; only what the fields of a joint mean is shared. Every
joint is a few rows, each a sum of terms of four kinds (a, b: directions fixed in body i and j; d: from a point of body i to one of
body j; all carried by the bodies)

    dot     a . b          slide   a . d          rod     (d . d - L^2) / 2 L          turn    the angle from i to j about h

less a constant: the value at design, or zero. A row is of the size of what violates it, because lengths are measured in a unit near
the mechanism's size. A turn is that of the arc tangent, taken to the whole turn that is nearest to a given angle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...drivers import JointDriver, PointCoordinate
from ...errors import KincheckError
from ...joints import Joint
from ...mechanism import Mechanism
from .extended import Real, extended, triad, unit
from .joint_conditions import JOINTS


class NotStatedError(KincheckError):
    """A joint or driver that has no conditions here."""


@dataclass(frozen=True, eq=False)
class Term:
    """One term: its bodies (0 is the ground), its vectors at design, and the row it is added to with a weight."""

    i: int
    j: int
    vectors: tuple[Real, ...]
    row: int
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class Conditions:
    """All rows of a mechanism; drivers are the last ones.

    Attributes:
        unit: of length [m].
        bodies: names of the moving bodies; body k of a term is bodies[k - 1].
        centres: reference point of each moving body, from the global origin [units], shape (bodies, 3).
        origin: what global positions are measured from before they are scaled [m]; takes out a far offset.
        dots, slides, rods, turns: the terms; see `Writer` for their vectors.
        constants: what is taken off each row.
        driven: the row of each driver, in order, and the size of one unit of its value there.
        turning: the joint of each turn.
        owners: what each row belongs to.
    """

    unit: float
    origin: Real
    bodies: tuple[str, ...]
    centres: Real
    dots: Sequence[Term]
    slides: Sequence[Term]
    rods: Sequence[Term]
    turns: Sequence[Term]
    constants: Real
    driven: Sequence[tuple[int, float]]
    turning: Sequence[str]
    owners: Sequence[str]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.constants)


def conditions(mechanism: Mechanism) -> Conditions:
    """The rows of all joints, couplers and drivers.

    Raises:
        NotStatedError: a joint or driver of a type that is not known here.
    """
    writer = Writer(mechanism)
    for joint in mechanism.joints:
        stated = JOINTS.get(joint.type)
        if stated is None:
            raise NotStatedError(f"{joint}: the stress truth has no conditions for this type; known: {', '.join(JOINTS)}")
        stated(writer, joint)
    for coupler in mechanism.couplers:
        row = writer.row(coupler.name)
        largest = max(abs(k) * (writer.unit if f == "translation" else 1.0) for f, k in _weights(coupler))
        for name, (freedom, k) in zip(coupler.joints, _weights(coupler), strict=True):
            metres = writer.unit if freedom == "translation" else 1.0
            writer.coordinate(row, mechanism.joint(name), freedom, k * metres / largest)
    driven: list[tuple[int, float]] = []
    for driver in mechanism.drivers:
        row = writer.row(driver.name)
        if isinstance(driver, PointCoordinate):
            point = mechanism.point(driver.point)
            direction = unit(extended(driver.direction))
            writer.slide(row, 0, writer.index(point.body), direction, point.position, point.position)
            driven.append((row, 1.0 / writer.unit))
        elif isinstance(driver, JointDriver):
            writer.coordinate(row, mechanism.joint(driver.joint), driver.freedom, 1.0)
            driven.append((row, 1.0 if driver.turns else 1.0 / writer.unit))
        else:
            raise NotStatedError(f"driver {driver.name!r} ({driver.type}): the stress truth cannot drive it")
    return writer.finished(driven)


def _weights(coupler: Any) -> list[tuple[str, float]]:
    return list(zip(coupler.freedoms, coupler.coefficients, strict=True))


@dataclass(eq=False)
class Writer:
    """Writes rows, term by term."""

    mechanism: Mechanism
    owners: list[str] = field(default_factory=list[str])
    constants: list[Any] = field(default_factory=list[Any])
    turning: list[str] = field(default_factory=list[str])
    terms: dict[str, list[Term]] = field(default_factory=lambda: {kind: [] for kind in ("dots", "slides", "rods", "turns")})

    def __post_init__(self) -> None:
        mechanism = self.mechanism
        on: dict[str, list[Sequence[float]]] = {body.name: [] for body in mechanism.bodies} | {"ground": []}
        for point in mechanism.points:
            on[point.body].append(point.position)
        for joint in mechanism.joints:
            points = getattr(joint, "points", None)
            here = getattr(joint, "point", None)
            for k, name in enumerate(joint.bodies):
                on[name] += [points[k]] if points is not None else [here] if here is not None else []
        every = extended([p for points in on.values() for p in points] or [[0.0, 0.0, 0.0]])
        self.origin = every[0]
        extent = float(np.ptp(every, axis=0).max())
        self.unit = 2.0 ** round(math.log2(extent)) if extent > 0.0 else 1.0
        self.names = [body.name for body in mechanism.moving]
        self.centres = [self.place(on[name][0] if on[name] else mechanism.body(name).origin) for name in self.names]

    def index(self, body: str) -> int:
        """Zero for whatever does not move."""
        return 0 if self.mechanism.is_fixed(body) else self.names.index(body) + 1

    def ends(self, joint: Joint) -> tuple[int, int]:
        """The bodies of a joint."""
        return self.index(joint.i), self.index(joint.j)

    def place(self, position: Sequence[float]) -> Real:
        return (extended(position) - self.origin) / extended(self.unit)

    def arm(self, body: int, position: Sequence[float]) -> Real:
        return self.place(position) - (self.centres[body - 1] if body else extended([0.0, 0.0, 0.0]))

    def row(self, owner: str) -> int:
        self.owners.append(owner)
        self.constants.append(extended(0.0))
        return len(self.owners) - 1

    def dot(self, row: int, i: int, j: int, a: Real, b: Real, weight: float = 1.0, *, held: bool = False) -> None:
        """a on i, b on j; held at its design value, or else zero."""
        self.terms["dots"].append(Term(i, j, (a, b), row, weight))
        if held:
            self.constants[row] = self.constants[row] + weight * (a @ b)

    def slide(self, row: int, i: int, j: int, a: Real, first: Any, second: Any, weight: float = 1.0, *, held: bool = False) -> None:
        """a on i; d from the first point, on i, to the second, on j."""
        d0 = (extended(second) - extended(first)) / extended(self.unit)
        self.terms["slides"].append(Term(i, j, (a, self.arm(i, first), self.arm(j, second), d0), row, weight))
        if held:
            self.constants[row] = self.constants[row] + weight * (a @ d0)

    def rod(self, row: int, i: int, j: int, first: Any, second: Any, length: float | None) -> None:
        """d from the first point, on i, to the second, on j, as long as at design unless a length [m] is given."""
        d0 = (extended(second) - extended(first)) / extended(self.unit)
        size = np.sqrt(d0 @ d0) if length is None else extended(length) / extended(self.unit)
        self.terms["rods"].append(Term(i, j, (self.arm(i, first), self.arm(j, second), d0, size[None]), row))

    def coordinate(self, row: int, joint: Joint, freedom: str, weight: float) -> None:
        """A coordinate of an axial joint: that of its second body relative to its first."""
        i, j = self.ends(joint)
        found: Any = joint
        f, g, h = triad(found.axis)
        if freedom == "rotation":
            self.turning.append(joint.name)
            self.terms["turns"].append(Term(i, j, (f, g, h), row, weight))
        else:
            self.slide(row, i, j, h, found.point, found.point, weight)

    def finished(self, driven: Sequence[tuple[int, float]]) -> Conditions:
        centres = np.array(self.centres, dtype=np.longdouble).reshape(-1, 3)
        return Conditions(
            self.unit,
            self.origin,
            tuple(self.names),
            centres,
            **self.terms,
            constants=np.array(self.constants, dtype=np.longdouble),
            driven=driven,
            turning=self.turning,
            owners=self.owners,
        )
