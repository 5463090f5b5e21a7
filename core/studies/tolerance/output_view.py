"""An output of a study as its page shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...harness.labels import number
from .conformance import Capability
from .results import Envelope, Gradient

DIGITS = 7
"""Digits of a drawn number: one more than the page shows when the reader points at a curve."""


@dataclass(frozen=True)
class OutputView:
    """An output as the page shows it, in display units: its figures by name, and its gradients,
    the largest effect first.
    """

    name: str
    unit: str
    scale: float
    envelope: Envelope
    figure: str
    spread: str
    tornado: str
    histogram: str
    gradients: Sequence[Gradient]
    limit: Capability | None

    def shown(self, value: float | None) -> str:
        """Return a value in display units."""
        return scaled_number(self.scale, value)

    @property
    def limits(self) -> dict[str, float]:
        """The limits in display units, by name."""
        ends = (None, None) if self.limit is None else (self.limit.low, self.limit.high)
        return {
            name: float(f"{self.scale * value:.{DIGITS}g}")
            for name, value in zip(("low limit", "high limit"), ends, strict=True)
            if value is not None
        }

    def ends(self) -> tuple[str, str, str]:
        """The least, the most, and the largest standard deviation, over all samples."""
        least, most, spread = (
            [value for value in values if value is not None]
            for values in (self.envelope.min, self.envelope.max, self.envelope.standard_deviation)
        )
        return (
            self.shown(min(least, default=None)),
            self.shown(max(most, default=None)),
            self.shown(max(spread, default=None)),
        )


def scaled_number(scale: float, value: float | None) -> str:
    """Return a number times a factor, to three digits; a dash for None."""
    return number(None if value is None else scale * value)
