"""Slips: simple mistakes in a whole series of a reference: sign, unit, offset, order of samples,
exchanged columns, another definition of the output.

A slip is reported only if its correction brings the reference within the tolerance and is
significant. The sign of a series of zeros, the offset of a constant series and any change of two
samples are insignificant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..trajectory import Array
from ..unit_text import value_text
from .compare import deviation
from .record import Deviation

# Fewest samples: two samples fit too many changes.
FEWEST = 3
# Smallest size of a series' values, or of their changes, in tolerances: a smaller one also fits too
# many changes.
MEANINGFUL = 10.0
OTHER_SIGN = "with the other sign"
FACTORS: Mapping[str, float] = {
    "1000": 1e3,
    "1/1000": 1e-3,
    "100": 1e2,
    "1/100": 1e-2,
    "10": 10.0,
    "1/10": 0.1,
    "1e6": 1e6,
    "1e-6": 1e-6,
    "180/pi": 180.0 / math.pi,
    "pi/180": math.pi / 180.0,
    "25.4": 25.4,
    "1/25.4": 1.0 / 25.4,
    "0.0254": 0.0254,
    "1/0.0254": 1.0 / 0.0254,
    "0.3048": 0.3048,
    "1/0.3048": 1.0 / 0.3048,
    "2": 2.0,
    "1/2": 0.5,
}
"""Factors between units of length and of angle, percent and fractions, half and whole, by their
names in messages.
"""


@dataclass(frozen=True, eq=False)
class Held:
    """The values of one output, and their tolerance: atol + rtol * range of the standard."""

    values: Array
    atol: float
    rtol: float
    unit: str


@dataclass(frozen=True, eq=False)
class Uncertain:
    """A reference, and the half-width of the interval around each value; None for exact ones."""

    values: Array
    half: Array | None = None

    def changed(self, change: Callable[[Array], Array]) -> Uncertain:
        """Return the reference after an affine change of its values and samples."""
        if self.half is None:
            return Uncertain(change(self.values))
        half = np.abs(change(self.half) - change(np.zeros_like(self.half)))
        return Uncertain(change(self.values), np.where(np.isfinite(half), half, 0.0))

    def off(self, held: Held, against: str = "") -> Deviation | None:
        """Return the deviation of the held values from the reference."""
        return deviation(held.values, self.values, held.atol, held.rtol, against, self.half)


@dataclass(frozen=True)
class Slip:
    """A change that makes the reference fit.

    Attributes:
        change: in words, after "the reference".
        difference: the largest remaining difference.
        tolerance: its tolerance.
    """

    change: str
    difference: float
    tolerance: float

    @property
    def ratio(self) -> float:
        """The remaining difference in tolerances."""
        return self.difference / self.tolerance if self.tolerance else 0.0


NamedChange: TypeAlias = tuple[str, Callable[[Array], Array]]
"""A change in words, and its function of the reference's values."""


def slips(
    held: Held,
    reference: Array | Uncertain,
    others: Mapping[str, Held],
    *,
    offsets: bool = True,
    definitions: Sequence[NamedChange] = (),
) -> list[Slip]:
    """Return all single changes that make the reference fit; without any, all pairs of changes.

    Args:
        held: the agreed values of the engines.
        reference: reference of the same output, out of tolerance, shape (n,).
        others: values of the other outputs, by name, which the reference may hold by mistake.
        offsets: whether a constant may be added; False for derivatives.
        definitions: changes from other definitions of the output to the engines' definition.
    """
    if not isinstance(reference, Uncertain):
        reference = Uncertain(reference)
    given = held, reference, others, offsets, definitions
    return list(_single(*given)) or list(_pairs(*given))


def _single(
    held: Held,
    reference: Uncertain,
    others: Mapping[str, Held],
    offsets: bool,
    definitions: Sequence[NamedChange],
) -> Iterator[Slip]:
    yield from _fitting(held, reference, definitions, "")
    yield from _fitting(held, reference, _scales(), "", constant=True)
    yield from _fitting(held, reference, _moves(held, reference, offsets), "")
    yield from _exchanged(reference, others, "")


def _pairs(
    held: Held,
    reference: Uncertain,
    others: Mapping[str, Held],
    offsets: bool,
    definitions: Sequence[NamedChange],
) -> Iterator[Slip]:
    both = [(f"{OTHER_SIGN} and times {name}", _times(-factor)) for name, factor in FACTORS.items()]
    yield from _fitting(held, reference, both, "", constant=True)
    for words, change in _scales():
        changed = reference.changed(change)
        yield from _fitting(held, changed, definitions, f"{words} and ")
        yield from _fitting(held, changed, _moves(held, changed, offsets), f"{words} and ")
    yield from _exchanged(reference.changed(_times(-1.0)), others, f"{OTHER_SIGN} ")


def _scales() -> list[NamedChange]:
    return [
        (OTHER_SIGN, _times(-1.0)),
        *((f"times {name}", _times(factor)) for name, factor in FACTORS.items()),
    ]


def _times(factor: float) -> Callable[[Array], Array]:
    return lambda x: factor * x


def _moves(held: Held, reference: Uncertain, offsets: bool) -> Iterator[NamedChange]:
    off = held.values - reference.values
    known = np.isfinite(off)
    if offsets and known.any():
        constant = 0.5 * float(off[known].max() + off[known].min())
        size = value_text(f"{abs(constant):.9g}", held.unit)
        yield (
            f"{'plus' if constant > 0 else 'minus'} {size}",
            lambda x: x + constant,
        )
    yield "with its samples in reversed order", lambda x: x[::-1]
    gap = np.full(1, np.nan)
    yield "shifted by one sample, each taken from the next", lambda x: np.concatenate([x[1:], gap])
    yield (
        "shifted by one sample, each taken from the one before",
        lambda x: np.concatenate([gap, x[:-1]]),
    )


def _fitting(
    held: Held,
    reference: Uncertain,
    changes: Iterator[NamedChange] | Sequence[NamedChange],
    before: str,
    *,
    constant: bool = False,
) -> Iterator[Slip]:
    """Yield the changes after which the reference fits.

    Args:
        constant: whether a constant series is significant, unless all its values are zero.
    """
    for words, change in changes:
        changed = reference.changed(change)
        both = np.isfinite(held.values) & np.isfinite(changed.values)
        if both.sum() < FEWEST:
            continue
        off = changed.off(held)
        if off is None or not off.within:
            continue
        values = held.values[both]
        if (np.abs(values).max() if constant else np.ptp(values)) > MEANINGFUL * off.tolerance:
            yield Slip(before + words, off.max_abs, off.tolerance)


def _exchanged(reference: Uncertain, others: Mapping[str, Held], before: str) -> Iterator[Slip]:
    """Yield the other outputs that agree with the reference, if the reference varies."""
    for name, other in others.items():
        yield from _fitting(
            other, reference, [(f"{before}taken as that of output {name}", lambda x: x)], ""
        )
