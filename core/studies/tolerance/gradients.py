"""Gradients of outputs by the coordinates of a variation at the nominal design.

They are central differences of solved variants. A coordinate moves by h and h/2 in both directions.
The error of the difference D(h) is f''' h^2 / 6 + f''''' h^4 / 120. Richardson's combination
(4 D(h/2) - D(h)) / 3 has an error of order h^4. The error of D(h/2) is |D(h/2) - D(h)| / 3. It
bounds the error of the result if the series converges.

With h/size = 2e-4 the relative size of the h^2 term is about (h/size)^2 / 6 = 7e-9, of the h^4
term 1e-17. Round-off of 1e-15 of the size in an output is 5e-12 of a gradient of one. So an output
may curve a hundred times as strongly as one of the mechanism's size.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...case.case import size
from ...mechanism.motions import Path
from ...trajectory import Array
from .study import Ready, Study

STEP = 2e-4
# Required accuracy: error relative to the output's largest gradient by a coordinate of the
# same unit.
ACCURATE = 1e-6
# Round-off of the gradient of an output without first-order change: this share of the output's
# size, or of the mechanism's, divided by the step. It is a thousand times a number's round-off.
ROUND_OFF = 1e-13
MOVES = np.array([1.0, -1.0, 0.5, -0.5])


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives of the rows of a study by its coordinates, at the nominal design.

    Attributes:
        along: over the samples [unit of row / unit of coordinate], shape (coordinates, rows, n);
            NaN if a neighbour of the nominal design has no value.
        design: at the design position, shape (coordinates, rows); None if the case does not
            pass through it.
        error: bound of the error over the samples and at design, from the two steps,
            shape (coordinates, rows).
        accurate: whether the error is at most `ACCURATE` of the row's largest gradient, or
            round-off, shape (coordinates, rows).
        messages: by coordinate, the reason why a neighbour has no solution.
    """

    along: Array
    design: Array | None
    error: Array
    accurate: Any
    messages: dict[int, str]


def gradients(ready: Ready) -> Gradients:
    """Return the gradients of a study."""
    study, path = ready.study, ready.study.case.sweep.path
    n, count = len(path.times), len(study.variation.coordinates)
    start = ready.designs.start
    from_design = start.stands
    if from_design:  # one sample more, at the design position
        ready = ready.along(Path(path.motions, np.append(path.times, start.time), path.design))
    steps = np.array([STEP * _size(study, k) for k in range(count)])
    found = np.empty((count, len(study.rows), n + from_design))
    apart = np.empty_like(found)
    messages = dict[int, str]()
    at_once = max(1, ready.lanes // len(MOVES))
    for first in range(0, count, at_once):
        some = np.arange(first, min(first + at_once, count))
        offsets = np.zeros((count, len(some), len(MOVES)))
        offsets[some, np.arange(len(some))] = steps[some, None] * MOVES
        values, _, _, why = ready.values(offsets.reshape(count, -1))
        plus, minus, half_plus, half_minus = np.moveaxis(
            values.reshape(*values.shape[:2], len(some), len(MOVES)), -1, 0
        )
        h = steps[some]
        whole, half = (plus - minus) / (2.0 * h), (half_plus - half_minus) / h
        found[some] = np.moveaxis((4.0 * half - whole) / 3.0, -1, 0)
        apart[some] = np.moveaxis(np.abs(half - whole) / 3.0, -1, 0)
        for lane, message in why.items():
            messages.setdefault(first + lane // len(MOVES), message)
    error = np.fmax.reduce(apart, axis=2)
    accurate = error <= np.maximum(ACCURATE * _largest(ready, found), _noise(ready, steps))
    design = found[:, :, n] if from_design else None
    return Gradients(found[:, :, :n], design, error, accurate, messages)


def _size(study: Study, coordinate: int) -> float:
    """Return a coordinate's size: the mechanism's size, one radian, or the size of the load."""
    variation = study.variation
    each = variation.coordinates[coordinate]
    if each.unit in ("m", "rad"):
        return size(study.case) if each.unit == "m" else 1.0
    (number,) = np.flatnonzero(variation.moves[:, coordinate])
    return float(abs(variation.nominal[number])) or each.scale


def _largest(ready: Ready, found: Array) -> Array:
    """Return the largest size of each row's gradients by coordinates of the same unit,
    shape (coordinates, rows).
    """
    units = [each.unit for each in ready.study.variation.coordinates]
    largest = np.fmax.reduce(np.abs(found), axis=2)
    return np.array(
        [
            np.fmax.reduce(largest[[k for k, other in enumerate(units) if other == unit]], axis=0)
            for unit in units
        ]
    )


def _noise(ready: Ready, steps: Array) -> Array:
    """Return the round-off of a zero difference, shape (coordinates, rows)."""
    sizes = [size(ready.study.case) if row.unit == "m" else 1.0 for row in ready.study.rows]
    values = np.fmax(np.fmax.reduce(np.abs(ready.nominal), axis=1), sizes)
    return ROUND_OFF * values / steps[:, None]
