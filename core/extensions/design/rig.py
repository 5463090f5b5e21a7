"""The curves of a rig as numbers with noise: of its printed digits, as its user states it, or as
its samples scatter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...case.case import PER_TRAVEL, TIME, Case, Output
from ...case.io.reader_options import CurveOptions
from ...case.units import Unit
from ...errors import KincheckError
from ...trajectory import Array
from ..measured.reference_curve import with_curve
from ..sweep.curves import DesignCurves, curves
from .goals import Goal, unit_in_table
from .rubber import NULL as ON_RUBBER
from .rubber import PERCENT, on_rubber, rubber_curves
from .search import Curves, Search

DEGREE, FEWEST = 6, 9
"""A polynomial of this degree follows what is left of a curve beside that of a near design; with
few samples, of a third of them, and not with fewer than nine."""
SCATTER = 2.0
"""Scatter this many times the noise of the digits is noise of the rig."""
# The median of absolute values of normal numbers, and the width of evenly spread rounding.
_MEDIAN, EVEN = 0.6744897501960817, 3.0**-0.5
LONG, LONGEST = 3.0, 121
"""Times the travel of rig and table, and samples, on which combinations without effect are told."""
NULL = 1e-15
"""Moves with this part of the largest effect have none, by the round-off of exact slopes."""
ROUND_OFF = 1e-9
"""Effects smaller than this part of the largest are none: real ones are a thousand times larger."""
STEP = 1e-4
"""Step of the travel for slopes by it [m or rad]: round-off and curvature change them by 1e-8."""


@dataclass(frozen=True, eq=False)
class Rig:
    """Curves of a rig as numbers.

    Attributes:
        file: of the numbers.
        case: at the samples of the rig.
        near: the case at travels a step beyond these, then a step before.
        back: the case at these travels with the other sign.
        long: the case over a long travel, on which combinations without effect are told.
        goals: of each output: its samples, and the numbers measured [SI]; a tolerance of one.
        noise: deviation of the numbers of each output [SI].
        sources: of the noise of each output, in words.
        notes: on how the file was read.
        curves: solves designs.
        move: unit in which moves are told.
        null: moves with this part of the largest effect have none, by the round-off of slopes.
    """

    file: Path
    case: Case
    near: Case
    back: Case
    long: Case
    goals: Sequence[Goal]
    noise: Sequence[Array]
    sources: Sequence[str]
    notes: Sequence[str]
    curves: Curves
    move: Unit
    null: float

    @cached_property
    def weights(self) -> Array:
        """One over the noise of all numbers."""
        return 1.0 / np.concatenate(self.noise)

    @property
    def count(self) -> int:
        """The number of numbers."""
        return len(self.weights)

    @cached_property
    def places(self) -> list[tuple[Goal, int]]:
        """Output and sample of each number."""
        return [(goal, int(k)) for goal in self.goals for k in goal.at]

    def unit_of(self, output: str) -> Unit:
        """Return the unit of an output by its name, as the table has it."""
        si = next(each.unit for each in self.case.outputs if each.name == output)
        return unit_in_table(si, self.case)

    def rows(self, goal: Goal) -> Array:
        """Return which numbers are of an output, as ones and zeros."""
        return np.array([float(each is goal) for each, _ in self.places])

    def of(self, values: Mapping[str, Array]) -> Array:
        """Return the values of the outputs, shape (n,) each, in the order of the numbers."""
        return np.concatenate([values[each.output][each.at] for each in self.goals])

    def times(self, factors: Mapping[str, float]) -> Rig:
        """Return the rig with the numbers of outputs times factors."""
        scale = [factors.get(each.output, 1.0) for each in self.goals]
        return replace(
            self,
            goals=[replace(g, middle=a * g.middle) for g, a in zip(self.goals, scale, strict=True)],
            noise=[abs(a) * each for each, a in zip(self.noise, scale, strict=True)],
        )

    def model(self, boxes: Mapping[str, float]) -> RigModel:
        """Return the numbers of designs less those measured; see `likely`."""
        return RigModel(self, Search(self.case, self.goals, boxes, curves=self.curves))


@dataclass(frozen=True, eq=False)
class RigModel:
    """Numbers of designs less those measured over their noise, by moves over their boxes."""

    rig: Rig
    search: Search

    @property
    def boxes(self) -> Mapping[str, float]:
        """Deviation of each place by the drawing."""
        return self.search.boxes

    def __call__(self, u: Array) -> tuple[Array, Array] | None:
        """Return numbers and slopes as `most_likely` asks for them."""
        found = self.search(u)
        weights = self.rig.weights
        return (found[0] * weights, found[1] * weights[:, None]) if found else None

    def values(self, u: Array) -> dict[str, Array]:
        """Return the outputs of a design at the samples, shape (n,) each.

        Raises:
            KincheckError: a sample is not reached.
        """
        remedy = "leave out the rows of the rig beyond it, or correct the table"
        return self.search.values(u, remedy)

    def by_travel(self, u: Array) -> Array | None:
        """Return the slopes of the numbers by the travel [SI]; None if a sample near is not
        reached, or there is no travel.
        """
        if self.rig.case.sweep.driver == TIME:
            return None
        found = self._curves(self.rig.near, u, [])
        ends = {name: values[0].reshape(2, -1) for name, values in found.values.items()}
        slopes = self.rig.of({name: (a - b) / (2.0 * STEP) for name, (a, b) in ends.items()})
        return slopes if np.isfinite(slopes).all() else None

    def over_travel(self, u: Array) -> tuple[Array, float]:
        """Return slopes of the outputs over a long travel as far as it is reached, each row of size
        one, and their round-off. Moves without effect over a part of the travel have none anywhere,
        and a longer part tells them better from a small effect.
        """
        found = self._curves(self.rig.long, u, self.search.names)
        kept = list[Array]()
        for each in found.slopes.values():
            rows = each[0] * self.search.box
            size = np.linalg.norm(rows, axis=1)
            known = size > ROUND_OFF * np.nanmax(size)  # at design some are zero
            kept.append(rows[known] / size[known, None])
        return np.concatenate(kept), self.rig.null

    def predicted(self, u: Array) -> Iterator[tuple[str, Array, Array]]:
        """Yield the outputs without a column: name, values, and slopes by the moves over
        their boxes.
        """
        case, names = self.rig.case, self.search.names
        others = [
            each.name
            for each in case.outputs
            if not (each.forces or type(each) is Output)
            and PER_TRAVEL not in each.name
            and each.name not in names
        ]
        if others:
            found = self.rig.curves(
                case, self.search.places, (u * self.search.box)[None], others, others
            )
            for name, values in found.values.items():
                yield name, values[0], found.slopes[name][0] * self.search.box

    def _curves(self, case: Case, u: Array, slopes: Sequence[str]) -> DesignCurves:
        search = self.search
        return self.rig.curves(case, search.places, (u * search.box)[None], search.names, slopes)


def read_rig(case: Case, file: Path, options: CurveOptions) -> Rig:
    """Return the numbers of a rig, with the noise of its digits or as it is stated.

    Raises:
        CaseError: the file cannot be read, or has no output of the case.
    """
    soft = bool(case.mechanism.bushings)
    case = on_rubber(case) if soft else case
    known = {each.name: each.why for each in case.outputs}
    found, notes = with_curve(case, file, replace(options, own_samples=True))
    goals, noise, sources = list[Goal](), list[Array](), list[str]()
    for each in found.outputs:
        series = found.reference.get(each.name)
        if series is None or each.forces:
            continue
        at = np.flatnonzero(np.isfinite(series.position))
        digits = EVEN * series.uncertainty.get("position", np.zeros(len(series.position)))[at]
        stated = each.atol if each.why != known[each.name] else 0.0
        named = each.name, each.name, unit_in_table(each.unit, case)
        goals.append(Goal(*named, at, series.position[at], 1.0))
        noise.append(np.hypot(digits, stated))
        sources.append("as stated" if stated else "printed digits")
    sweep, at = found.sweep, found.sweep.values
    every = np.concatenate([sweep.change, case.sweep.change])
    long = np.linspace(LONG * float(every.min()), LONG * float(every.max()), LONGEST)

    def over(values: Array) -> Case:
        return replace(found, sweep=replace(sweep, values=values), reference={})

    solved = rubber_curves, PERCENT, ON_RUBBER
    return Rig(
        *(file, over(at), over(np.concatenate([at + STEP, at - STEP]))),
        *(over(2.0 * sweep.design - at), over(at if soft else sweep.design + long)),
        *(goals, noise, sources, notes),
        *(solved if soft else (curves, unit_in_table("m", case), NULL)),
    )


def with_scatter(rig: Rig, drawn: Mapping[str, Array]) -> Rig:
    """Return the rig with the noise of outputs whose samples scatter far beyond their digits, as
    they scatter about a smooth difference from the curve of the drawing.

    Args:
        drawn: outputs of the drawing, shape (n,) each.

    Raises:
        KincheckError: an output has no noise at all.
    """
    noise, sources = [*rig.noise], [*rig.sources]
    for k, goal in enumerate(rig.goals):
        travel = rig.case.sweep.values[goal.at]
        count = len({*travel.tolist()})
        if sources[k] != "as stated" and count >= FEWEST:
            off, degree = goal.middle - drawn[goal.output][goal.at], min(DEGREE, count // 3)
            rest = np.abs(off - np.polynomial.Chebyshev.fit(travel, off, degree)(travel))
            # the median of few samples may be low
            lost = (len(rest) / (len(rest) - degree - 1.0)) ** 0.5 * (1.0 + len(rest) ** -0.5)
            scatter = float(np.median(rest)) / _MEDIAN * lost
            if scatter > SCATTER * float(np.median(noise[k])):
                noise[k], sources[k] = np.hypot(noise[k], scatter), "scatter of its samples"
        if not noise[k].all():
            raise KincheckError(
                f"{rig.file}: {goal.output} has all digits, so its noise is not known; state it:"
                f' --accuracy "{goal.output}=0.01 {goal.unit.name}"'
            )
    return replace(rig, noise=noise, sources=sources)
