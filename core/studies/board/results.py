"""Rows of the board as plain data: what each stepper does on each case."""

from __future__ import annotations

import platform
from datetime import datetime
from typing import Any, Literal, TypeAlias

import msgspec

from ...harness.provenance import processor
from ...version import VERSION

SCHEMA = "kincheck-board/1"

State: TypeAlias = Literal[
    "measured", "diverged", "failed", "unsupported", "unavailable", "timeout", "crashed"
]
"""What became of a row: at least one run has an error; no run stays finite; the engine raises; it
lacks a constraint; it is not installed; its process takes too long, or ends by itself.
"""


class Run(msgspec.Struct, frozen=True, kw_only=True):
    """One run of a stepper.

    Attributes:
        step: [s]; None if the engine controls its steps.
        steps: between two samples.
        accuracy: asked of an engine that controls its steps.
        error: largest distance of a point from the truth over the samples [m].
        gap: largest opening of a loop at the samples [m].
        energy: largest difference of the energy of motion, weight and springs from the truth's [J].
        cost: wall time for a simulated second [s/s].
        message: why there are no numbers, or empty.
    """

    step: float | None = None
    steps: int | None = None
    accuracy: float | None = None
    error: float | None = None
    gap: float | None = None
    energy: float | None = None
    cost: float | None = None
    message: str = ""


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """A stepper with one column of settings on one case.

    Attributes:
        column: "default" for the engine's settings, or "best" for the best known ones.
        group: of the integrator.
        design_order: order of the method for smooth motions; None if steps are controlled.
        by, date: who gave the settings, and when; empty for defaults.
        loop: where the loop over the steps runs: the engine or Python.
        ties: form of the closed loops.
        order: by least squares over the runs above the floor; None with fewer than two.
        floor: error that smaller steps do not lower [m]; None if none is reached.
        folder: of the reproducer, below the board; empty without one.
    """

    schema: str = SCHEMA
    case: str
    engine: str
    version: str = ""
    integrator: str
    group: str
    design_order: int | None = None
    column: str
    settings: dict[str, Any] = {}
    by: str = ""
    date: str = ""
    loop: str
    ties: str
    precision: str = "float64"
    device: str = "CPU"
    state: State
    message: str = ""
    runs: list[Run] = []
    order: float | None = None
    floor: float | None = None
    folder: str = ""

    @property
    def name(self) -> str:
        """Engine, integrator and column."""
        return f"{self.engine} {self.integrator}, {self.column}"

    @property
    def measured(self) -> list[Run]:
        """The runs with numbers."""
        return [run for run in self.runs if run.error is not None]


class TruthFacts(msgspec.Struct, frozen=True, kw_only=True):
    """The truth of a case; see `kincheck free`.

    Attributes:
        duration: reached [s].
        error: change of a point when all steps are halved [m].
        energy: change of the energy less the work of loads [J].
        points: number of compared points.
        seconds: wall time to make it [s].
        message: why it ends early, or empty.
    """

    case: str
    source: str
    duration: float
    samples: int
    error: float
    energy: float
    freedoms: int
    redundant: int
    method: str
    points: int
    seconds: float
    message: str = ""


class Board(msgspec.Struct, frozen=True, kw_only=True):
    """All rows of a board, and the circumstances in which they were measured."""

    schema: str = SCHEMA
    kincheck: str
    started: str
    processor: str
    platform: str
    truths: list[TruthFacts]
    rows: list[Row]

    @classmethod
    def of(cls, truths: list[TruthFacts], rows: list[Row], started: datetime) -> Board:
        """Return the board measured on this machine since a time."""
        return cls(
            kincheck=VERSION,
            started=started.isoformat(timespec="seconds"),
            processor=processor(),
            platform=platform.platform(),
            truths=truths,
            rows=rows,
        )
