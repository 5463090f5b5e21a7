"""Choices of a study, as files and the command line name them."""

from __future__ import annotations

from enum import StrEnum


class Mode(StrEnum):
    """Choice of the variants."""

    MONTE_CARLO = "monte_carlo"
    GRID = "grid"
    ONE_AT_A_TIME = "one_at_a_time"


class Incomplete(StrEnum):
    """Judgement of variants that do not reach all samples, by specification limits."""

    OUTSIDE = "outside"
    IGNORE = "ignore"


class Sampling(StrEnum):
    """Choice of the points of a Monte Carlo study."""

    RANDOM = "random"
    LATIN = "latin"
    SOBOL = "sobol"
