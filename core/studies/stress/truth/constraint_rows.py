"""The rows of a mechanism's conditions, and their writer, term by term; see `conditions`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....joints import Joint
from ....mechanism.mechanism import Mechanism
from .long_double import Real, extended, triad


@dataclass(frozen=True, eq=False)
class Term:
    """One term: its bodies (0 is the ground), its vectors at design, its row, and its weight in the
    row.
    """

    i: int
    j: int
    vectors: tuple[Real, ...]
    row: int
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class Conditions:
    """All rows of a mechanism; drivers are the last ones.

    Attributes:
        unit: unit of length [m].
        bodies: names of the moving bodies; body k of a term is bodies[k - 1].
        centres: reference point of each moving body, from the global origin [units], shape (bodies,
            3).
        origin: origin that is subtracted from global positions before scaling [m]; it removes a far
            offset.
        dots, slides, rods, turns: the terms by kind; see `Writer` for their vectors.
        constants: constant subtracted from each row.
        driven: the row of each driver, in order, and the scale of the driver's value in it.
        turning: the joint of each turn.
        owners: joint, coupler or driver of each row.
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


@dataclass(eq=False)
class Writer:
    """Writer of rows, term by term."""

    mechanism: Mechanism
    owners: list[str] = field(default_factory=list[str])
    constants: list[Any] = field(default_factory=list[Any])
    turning: list[str] = field(default_factory=list[str])
    terms: dict[str, list[Term]] = field(
        default_factory=lambda: {kind: [] for kind in ("dots", "slides", "rods", "turns")}
    )

    def __post_init__(self) -> None:
        mechanism = self.mechanism
        on: dict[str, list[Sequence[float]]] = {body.name: [] for body in mechanism.bodies} | {
            "ground": []
        }
        for point in mechanism.points:
            on[point.body].append(point.position)
        for joint in mechanism.joints:
            points = getattr(joint, "points", None)
            here = getattr(joint, "point", None)
            for k, name in enumerate(joint.bodies):
                on[name] += (
                    [points[k]] if points is not None else [here] if here is not None else []
                )
        every = extended([p for points in on.values() for p in points] or [[0.0, 0.0, 0.0]])
        self.origin = every[0]
        extent = float(np.ptp(every, axis=0).max())
        self.unit = 2.0 ** round(math.log2(extent)) if extent > 0.0 else 1.0
        self.names = [body.name for body in mechanism.moving]
        self.centres = [
            self.place(on[name][0] if on[name] else mechanism.body(name).origin)
            for name in self.names
        ]

    def index(self, body: str) -> int:
        """Return the number of a body in the terms; zero for a fixed body."""
        return 0 if self.mechanism.is_fixed(body) else self.names.index(body) + 1

    def ends(self, joint: Joint) -> tuple[int, int]:
        """Return the bodies of a joint by number."""
        return self.index(joint.i), self.index(joint.j)

    def place(self, position: Sequence[float]) -> Real:
        return (extended(position) - self.origin) / extended(self.unit)

    def arm(self, body: int, position: Sequence[float]) -> Real:
        return self.place(position) - (
            self.centres[body - 1] if body else extended([0.0, 0.0, 0.0])
        )

    def row(self, owner: str) -> int:
        self.owners.append(owner)
        self.constants.append(extended(0.0))
        return len(self.owners) - 1

    def dot(
        self, row: int, i: int, j: int, a: Real, b: Real, weight: float = 1.0, *, held: bool = False
    ) -> None:
        """Add a . b, with a on i and b on j; subtract its design value if held."""
        self.terms["dots"].append(Term(i, j, (a, b), row, weight))
        if held:
            self.constants[row] = self.constants[row] + weight * (a @ b)

    def slide(
        self,
        row: int,
        i: int,
        j: int,
        a: Real,
        first: Any,
        second: Any,
        weight: float = 1.0,
        *,
        held: bool = False,
    ) -> None:
        """Add a . d, with a on i and d from the first point, on i, to the second, on j.

        Subtract its design value if held.
        """
        d0 = (extended(second) - extended(first)) / extended(self.unit)
        self.terms["slides"].append(
            Term(i, j, (a, self.arm(i, first), self.arm(j, second), d0), row, weight)
        )
        if held:
            self.constants[row] = self.constants[row] + weight * (a @ d0)

    def rod(self, row: int, i: int, j: int, first: Any, second: Any, length: float | None) -> None:
        """Add a rod along d from the first point, on i, to the second, on j, with a length [m]; by
        default with the length at design.
        """
        d0 = (extended(second) - extended(first)) / extended(self.unit)
        size = np.sqrt(d0 @ d0) if length is None else extended(length) / extended(self.unit)
        self.terms["rods"].append(
            Term(i, j, (self.arm(i, first), self.arm(j, second), d0, size[None]), row)
        )

    def coordinate(self, row: int, joint: Joint, freedom: str, weight: float) -> None:
        """Add a coordinate of an axial joint, of the second body relative to the first."""
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
