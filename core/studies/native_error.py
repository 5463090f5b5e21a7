"""Errors of the native engine against proved outputs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..case.case import Case
from ..harness.compare import output_series
from ..kinematics import Proofs
from ..program.ball_executor import Ball, flint

Column = Sequence[Ball | None]
"""A quantity at the samples; None where it is not known."""


@dataclass(frozen=True)
class NativeError:
    """Largest native errors over the samples, of an output's position, velocity and acceleration.

    Attributes:
        largest: [SI]; None if there is no such derivative.
        ulps: in units in the last place of the largest value of any output of the same unit: an
            output may be zero throughout, by symmetry.
    """

    output: str
    unit: str
    largest: Sequence[float | None]
    ulps: Sequence[float | None]


def native_errors(
    case: Case, found: Proofs, values: Mapping[str, Sequence[Column]]
) -> list[NativeError]:
    """Return the native errors of every proved output."""
    outputs = [output for output in case.outputs if output.name in values]
    sizes: dict[tuple[str, int], float] = {}
    for output in outputs:
        for order, column in enumerate(values[output.name]):
            known = [
                sizes.get((output.unit, order), 0.0),
                *(upper(ball) for ball in column if ball is not None),
            ]
            sizes[output.unit, order] = max(known)
    errors: list[NativeError] = []
    for output in outputs:
        native = output_series(case, output, found.native)
        largest: list[float | None] = []
        ulps: list[float | None] = []
        for order, given in enumerate((native.position, native.velocity, native.acceleration)):
            numbers: list[float] = [] if given is None else given.tolist()
            pairs = zip(numbers, values[output.name][order], strict=given is not None)
            off = [
                upper(flint().arb(x) - ball)
                for x, ball in pairs
                if ball is not None and math.isfinite(x)
            ]
            size = sizes[output.unit, order]
            largest.append(max(off, default=None))
            ulps.append(max(off) / float(np.spacing(size)) if off and size > 0.0 else None)
        errors.append(NativeError(output.name, output.unit, largest, ulps))
    return errors


def upper(ball: Ball) -> float:
    """Return a float not below |ball|."""
    return float(np.nextafter(float(ball.abs_upper()), np.inf))
