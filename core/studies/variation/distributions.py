"""Distributions of a coordinate's offset, by their quantile functions."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import numpy as np

from ...trajectory import Array


class Law(StrEnum):
    """Distribution of a coordinate."""

    NORMAL = "normal"
    TRUNCATED_NORMAL = "truncated_normal"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"
    VALUES = "values"


def quantile(law: Law, probability: Array, scale: float, half_width: float) -> Array:
    """Return the quantiles of a distribution at these probabilities, in the same shape.

    Args:
        probability: between 0 and 1, both excluded.
        scale: standard deviation of a normal distribution, before truncation [unit].
        half_width: largest offset of the other distributions [unit].
    """
    match law:
        case Law.NORMAL:
            return scale * normal_quantile(probability)
        case Law.TRUNCATED_NORMAL:
            outside = float(normal_share(np.array(-half_width / scale)))
            offsets = scale * normal_quantile(outside + probability * (1.0 - 2.0 * outside))
            return np.clip(offsets, -half_width, half_width)  # round-off at the ends
        case Law.TRIANGULAR:  # with its mode at the nominal value
            low = np.sqrt(2.0 * np.minimum(probability, 1.0 - probability)) - 1.0
            return half_width * np.where(probability < 0.5, low, -low)
        case Law.UNIFORM:
            return half_width * (2.0 * probability - 1.0)
        case Law.VALUES:
            raise ValueError("listed offsets have no distribution")


def normal_quantile(probability: Array) -> Array:
    """Return the quantiles of the standard normal distribution."""
    return _special().ndtri(probability)


def normal_share(value: Array) -> Array:
    """Return the share of the standard normal distribution below a value."""
    return _special().ndtr(value)


def _special() -> Any:
    """Return the module; few studies need its import."""
    import scipy.special  # pyright: ignore[reportMissingTypeStubs]

    return scipy.special
