"""Results as data: the record of one (case, engine) pair and of a whole run; the JSON schema kincheck-results/1."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import msgspec


class Outcome(StrEnum):
    """What became of a pair. Every pair gets exactly one."""

    PASS = "pass"
    FAIL = "fail"
    ERROR = "error"
    UNSUPPORTED = "unsupported"
    UNAVAILABLE = "unavailable"
    TIMEOUT = "timeout"
    CRASHED = "crashed"


class OutputSeries(msgspec.Struct, frozen=True, kw_only=True):
    """One output over the samples, in SI. A sample, or a whole series, that was not computed is null; `reason` says why."""

    position: list[float | None]
    velocity: list[float | None] | None
    acceleration: list[float | None] | None
    unit: str
    reason: str | None = None


class Deviation(msgspec.Struct, frozen=True, kw_only=True):
    """How far an output is from what it is compared with, over the samples both have."""

    max_abs: float
    rms: float
    worst_step: int
    tolerance: float
    against: str
    within: bool


class Deviations(msgspec.Struct, frozen=True, kw_only=True):
    """Deviations of one output; null where there is nothing to compare, and `reason` says why."""

    position: Deviation | None
    velocity: Deviation | None
    acceleration: Deviation | None
    reason: str | None = None


class Seconds(msgspec.Struct, frozen=True, kw_only=True):
    """Wall-clock seconds: making the model, the first solve, and a solve after a warm-up."""

    build: float | None = None
    first: float | None = None
    warm: float | None = None


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """The result of one (case, engine) pair. What was not computed is null, never zero; `message` says why."""

    case: str
    truth: str
    engine: str
    mode: str
    loop: str
    version: str | None
    outcome: Outcome
    message: str
    settings: dict[str, Any] = {}
    driver: dict[str, list[float]] = {}
    outputs: dict[str, OutputSeries] = {}
    errors: dict[str, Deviations] = {}
    residual_max: float | None = None
    rank: int | None = None
    dof: int | None = None
    iterations: int | None = None
    solved: int | None = None
    samples: int | None = None
    seconds: Seconds | None = None
    us_per_step: float | None = None
    details: dict[str, Any] = {}


class Results(msgspec.Struct, frozen=True, kw_only=True):
    """A run: its circumstances and one record per pair."""

    run: dict[str, Any]
    records: list[Record]
    schema: str = "kincheck-results/1"
