"""The curves of a rig as numbers with noise: of its printed digits, as its user states it, or as
its samples scatter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...case.case import Case
from ...case.io.reader_options import CurveOptions
from ...case.io.reference_curve import with_curve
from ...case.units import Unit
from ...errors import KincheckError
from ...trajectory import Array
from ..sweep.curves import curves
from .goals import Goal, unit_in_table
from .tune import Search

DEGREE, FEWEST = 6, 9
"""A polynomial of this degree follows what is left of a curve beside that of a near design; with
few samples, of a third of them, and not with fewer than nine."""
SCATTER = 2.0
"""Scatter this many times the noise of the digits is noise of the rig."""
# The median of absolute values of normal numbers, and the width of evenly spread rounding.
_MEDIAN, _EVEN = 0.6744897501960817, 3.0**-0.5
LONG, LONGEST = 3.0, 121
"""Times the travel of rig and table, and samples, on which combinations without effect are told."""
STEP = 1e-4
"""Step of the travel for slopes by it [m or rad]: round-off and curvature change them by 1e-8."""


@dataclass(frozen=True, eq=False)
class Rig:
    """What a rig measured.

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

    def unit(self, goal: Goal) -> Unit:
        """Return the unit of an output as the table has it."""
        si = next(each.unit for each in self.case.outputs if each.name == goal.output)
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
        return RigModel(self, Search(self.case, self.goals, boxes))


@dataclass(frozen=True, eq=False)
class RigModel:
    """Numbers of designs less those measured over their noise, by moves over their boxes."""

    rig: Rig
    search: Search

    def __call__(self, u: Array) -> tuple[Array, Array] | None:
        """Return numbers and slopes as `most_likely` asks for them."""
        found = self.search(u)
        weights = self.rig.weights
        return (found[0] * weights, found[1] * weights[:, None]) if found else None

    def by_travel(self, u: Array) -> Array:
        """Return the slopes of the numbers by the travel [SI]; NaN if a sample near is not
        reached.
        """
        search = self.search
        found = curves(self.rig.near, search.places, (u * search.box)[None], search.names)
        ends = {name: values[0].reshape(2, -1) for name, values in found.values.items()}
        slopes = {name: (a - b) / (2.0 * STEP) for name, (a, b) in ends.items()}
        return self.rig.of(slopes)


def read_rig(case: Case, file: Path, options: CurveOptions) -> Rig:
    """Return what a rig measured, with the noise of its digits or as it is stated.

    Raises:
        CaseError: the file cannot be read, or has no output of the case.
    """
    known = {each.name: each.why for each in case.outputs}
    found, notes = with_curve(case, file, replace(options, own_samples=True))
    goals, noise, sources = list[Goal](), list[Array](), list[str]()
    for each in found.outputs:
        series = found.reference.get(each.name)
        if series is None or each.forces:
            continue
        at = np.flatnonzero(np.isfinite(series.position))
        unit = unit_in_table(each.unit, case)
        digits = _EVEN * series.uncertainty.get("position", np.zeros(len(series.position)))[at]
        stated = each.atol if each.why != known[each.name] else 0.0
        named = each.name, each.name, (unit.name, unit.size)
        goals.append(Goal(*named, at, series.position[at], 1.0))
        noise.append(np.hypot(digits, stated))
        sources.append("as stated" if stated else "printed digits")
    at = found.sweep.values
    every = np.concatenate([found.sweep.change, case.sweep.change])
    ends = np.linspace(LONG * every.min(), LONG * every.max(), LONGEST)
    travels = [
        *(at, np.concatenate([at + STEP, at - STEP]), 2.0 * found.sweep.design - at),
        found.sweep.design + ends,
    ]
    cases = [
        replace(found, sweep=replace(found.sweep, values=values), reference={})
        for values in travels
    ]
    return Rig(file, *cases, goals, noise, sources, notes)


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
            unit = rig.unit(goal)
            raise KincheckError(
                f"{rig.file}: {goal.output} has all digits, so its noise is not known; state it:"
                f' --accuracy "{goal.output}=0.01 {unit.name}"'
            )
    return replace(rig, noise=noise, sources=sources)
