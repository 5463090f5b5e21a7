"""Outputs of designs over bands, points of designs over boxes to keep out of, and their slopes."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from ...case.case import MARKER, Case
from ...case.quantity import Output
from ...case.units import LENGTHS
from ...errors import KincheckError
from ...mechanism.mechanism import Point
from ...trajectory import Array
from ..sweep.curves import DesignCurves, curves
from .goals import Goal
from .rods import with_rods

Curves: TypeAlias = Callable[..., DesignCurves]
CLEAR = '--keep-clear "NAME: X0:X1 Y0:Y1 Z0:Z1 UNIT"'
# Nearer to the middle of a box, over its size, a point is no better.
_INSIDE = 1e-3


@dataclass(frozen=True, eq=False)
class Clear:
    """A box of another part: no point of the table may be in it, over the whole travel.

    Attributes:
        middle, half: of the box along the axes of the table [m], shape (3,).
    """

    text: str
    middle: Array
    half: Array


def read_clear(texts: Sequence[str], case: Case) -> list[Clear]:
    """Return the boxes to keep clear of.

    Raises:
        KincheckError: a box has another form.
    """
    found = list[Clear]()
    for text in texts:
        *ends, unit = [*text.rpartition(": ")[2].split(), case.length_unit][:4]
        box = np.full((3, 2), np.nan)
        with suppress(ValueError):
            box = np.array([[float(x) for x in each.split(":")] for each in ends], dtype=float)
        if unit not in LENGTHS or box.shape != (3, 2) or not (box[:, 0] < box[:, 1]).all():
            raise KincheckError(
                f"--keep-clear {text!r}: expected the ends of a box along x, y and z of the table;"
                f' say {CLEAR}, such as "damper: -30:30 380:470 90:300 mm"'
            )
        low, high = LENGTHS[unit].size * box.T
        found.append(Clear(text, (low + high) / 2.0, (high - low) / 2.0))
    return found


@dataclass(eq=False)
class Search:
    """Outputs of designs over their bands, by moves over their boxes, and their slopes.

    Attributes:
        curves: solves designs.
        designs: number of designs solved.
        parts: what each number is of, by its text.
    """

    case: Case
    goals: Sequence[Goal]
    boxes: Mapping[str, float]
    clear: Sequence[Clear] = ()
    curves: Curves = curves
    designs: int = 0
    rows: Mapping[str, list[str]] = field(default_factory=dict[str, list[str]])

    def __post_init__(self) -> None:
        self.box = np.array([*self.boxes.values()])
        self.case, self.places = with_rods(self.case, [*self.boxes])
        if self.clear:
            self.case, self.rows = with_rows(self.case)
        self.names = list(dict.fromkeys(each.output for each in self.goals))

    @property
    def parts(self) -> list[str]:
        count, rows = len(self.case.sweep.values), len(self.rows)
        return [
            *(each.text for each in self.goals for _ in each.at),
            *(each.text for each in self.clear for _ in range(count * rows)),
        ]

    def __call__(self, u: Array) -> tuple[Array, Array] | None:
        """Return numbers and slopes as `least_move` asks for them."""
        self.designs += 1
        names = [*self.names, *(each for row in self.rows.values() for each in row)]
        found = self.curves(self.case, self.places, (u * self.box)[None], names, names)
        g = [(found.values[x.output][0, x.at] - x.middle) / x.tolerance for x in self.goals]
        by = [found.slopes[x.output][0, x.at] * self.box / x.tolerance for x in self.goals]
        for each in self.clear:
            for row in self.rows.values():
                at = np.array([found.values[name][0] for name in row])
                ways = np.array([found.slopes[name][0] * self.box for name in row])
                far = np.abs(at - each.middle[:, None]) / each.half[:, None]
                axis, sample = far.argmax(axis=0), [*range(at.shape[1])]
                d = np.maximum(far[axis, sample], _INSIDE)
                side = np.sign(at - each.middle[:, None])[axis, sample] / each.half[axis]
                g.append(2.0 / d - 1.0)  # 1 on the faces, less outside
                by.append((-2.0 * side / d**2)[:, None] * ways[axis, sample])
        numbers, slopes = np.concatenate(g), np.concatenate(by)
        usable = found.solved.all() and np.isfinite(numbers).all() and np.isfinite(slopes).all()
        return (numbers, slopes) if usable else None

    def values(self, u: Array, remedy: str = "give a smaller --travel") -> dict[str, Array]:
        """Return the outputs of a design, shape (n,) each.

        Raises:
            KincheckError: a sample is not reached, or a goal's output has no value there.
        """
        found = self.curves(self.case, self.places, (u * self.box)[None], self.names)
        if not found.solved.all():
            raise KincheckError(
                f"{self.case.name}: the table does not reach its whole travel"
                f" ({found.messages.get(0, 'no reason given')}); {remedy}"
            )
        for each in self.goals:
            if not np.isfinite(found.values[each.output][0, each.at]).all():
                reason = found.reasons.get(each.output, "it is not defined there")
                raise KincheckError(f"goal {each.text!r}: has no value at a sample: {reason}")
        return {name: values[0] for name, values in found.values.items()}


def with_rows(case: Case) -> tuple[Case, dict[str, list[str]]]:
    """Return the case with the points of all rows of the table, and the names of their coordinates
    along its axes by row: of an axle, those of the left wheel.
    """
    mechanism, names, points = case.mechanism, dict[str, list[str]](), list[Point]()
    outputs, hardpoints = [*case.outputs], [*case.hardpoints]
    for k, row in enumerate(case.hardpoints):
        # an axis leads to its second point, which another joint may hold
        place = min(row.moves, key=lambda each: each.endswith(".axis"), default="")
        found = re.match(r"(points|joints)\.(.+?)\.[a-z]+(?:\.(\d))?$", place)
        if found is None or not row.axes:  # a rod's length
            continue
        kind, name, end = found.groups()
        body = mechanism.point(name).body if kind == "points" else ""
        body = body or mechanism.joint(name).bodies[int(end or 0)]
        own = f"{MARKER}{row.name}"
        points.append(Point(own, body, row.position))
        turned = np.zeros((3, 3))
        for column, (axis, sign) in enumerate(row.axes):
            turned[axis, column] = sign
        moves = {**row.moves, f"points.{own}.position": turned}
        hardpoints[k] = replace(row, moves=moves)
        names[row.name] = [f"{own} {axis}" for axis in "xyz"]
        outputs += [
            Output(each, own, (way[0], way[1], way[2]), relative=False, atol=0.0, rtol=0.0, why="")
            for each, way in zip(names[row.name], turned.T.tolist(), strict=True)
        ]
    mechanism = replace(mechanism, points=[*mechanism.points, *points])
    changed = replace(
        case, mechanism=mechanism, outputs=tuple(outputs), hardpoints=tuple(hardpoints)
    )
    return changed, names
