"""Rows of the board as plain data: what each stepper does on each case."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from datetime import date, datetime
from pathlib import Path
from typing import Any, Literal, TypeAlias

import msgspec
from msgspec.structs import replace

from ...errors import KincheckError
from ...harness.provenance import processor
from ...version import VERSION

SCHEMA = "kincheck-board/1"
# An engine repeats its digits. Another processor's rounding moves errors down at round-off, and
# those of float32 by some percent.
RELATIVE, ROUNDING = 0.1, 1e-11  # [-], [m]

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
        reaction: largest error of the given joint forces, in determined directions [N].
        cost: wall time for a simulated second [s/s].
        message: why there are no numbers, or empty.
    """

    step: float | None = None
    steps: int | None = None
    accuracy: float | None = None
    error: float | None = None
    gap: float | None = None
    energy: float | None = None
    reaction: float | None = None
    cost: float | None = None
    message: str = ""


class Past(msgspec.Struct, frozen=True, kw_only=True):
    """Figures of a row on earlier boards.

    Attributes:
        since, until: dates of the first board with it, and of the first without.
        error: of the shortest step [m]; None without one.
    """

    since: str
    until: str
    version: str
    settings: dict[str, Any]
    state: State
    error: float | None


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """A stepper with one column of settings on one case.

    Attributes:
        column: "default" for the engine's settings, or "best" for the best known ones.
        group: of the integrator.
        design_order: order of the method for smooth motions; None if steps are controlled.
        by, on: who gave the settings, and when; empty for defaults.
        loop: runs the loop over the steps: the engine or Python.
        ties: form of the closed loops.
        order: by least squares over the runs above the floor; None with fewer than two.
        floor: error that smaller steps do not lower [m]; None if none is reached.
        folder: of the reproducer, below the board; empty without one.
        since: date of the first board of a history with this version, settings, state and error.
        past: its earlier figures, the oldest first.
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
    on: str = ""
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
    since: str = ""
    past: list[Past] = []

    @property
    def name(self) -> str:
        """Engine, integrator and column."""
        return f"{self.engine} {self.integrator}, {self.column}"

    @property
    def key(self) -> str:
        """Case and name."""
        return f"{self.case}: {self.name}"

    def with_history(self, earlier: Mapping[str, Row]) -> Row:
        """Return the row with its history, which continues an earlier row with the same steps."""
        before, today = earlier.get(self.key), date.today().isoformat()
        if before is None or not self.compares_with(before):
            return replace(self, since=today)
        same = (before.version, before.settings, before.state) == (
            self.version,
            self.settings,
            self.state,
        )
        if same and not _changed(before.error, self.error):
            return replace(self, since=before.since, past=before.past)
        old = Past(
            since=before.since,
            until=today,
            version=before.version,
            settings=before.settings,
            state=before.state,
            error=before.error,
        )
        return replace(self, since=today, past=[*before.past, old])

    def compares_with(self, before: Row) -> bool:
        """Return whether both are of the same steps; a row without runs compares with any."""
        ends = [[(run.step, run.accuracy) for run in row.runs[-1:]] for row in (self, before)]
        return ends[0] == ends[1] or [] in ends

    def worse_than(self, before: Row) -> bool:
        """Return whether the error has grown at the same steps, or there is none any more. An
        engine that is not installed is not worse.
        """
        if not self.compares_with(before):
            return False
        if self.error is None or before.error is None:
            return before.error is not None and self.state != "unavailable"
        return self.error > before.error and _changed(before.error, self.error)

    @property
    def error(self) -> float | None:
        """Error of the shortest step [m]."""
        return self.measured[-1].error if self.measured else None

    @property
    def measured(self) -> list[Run]:
        """The runs with numbers."""
        return [run for run in self.runs if run.error is not None]


def _changed(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is not other
    return abs(other - one) > max(RELATIVE * one, ROUNDING)


class TruthFacts(msgspec.Struct, frozen=True, kw_only=True):
    """The truth of a case; see `kincheck free`.

    Attributes:
        duration: reached [s].
        error: change of a point when all steps are halved [m].
        energy: change of the energy less the work of loads [J].
        points: number of compared points.
        forces: whether the force in any joint is determined, but for one direction at most.
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
    forces: bool = True
    seconds: float
    message: str = ""


class Board(msgspec.Struct, frozen=True, kw_only=True):
    """All rows of a board, and the circumstances in which they were measured."""

    schema: str = SCHEMA
    kincheck: str
    started: str
    processor: str
    platform: str
    truths: list[TruthFacts] = []
    rows: list[Row] = []

    @classmethod
    def begun(cls, started: datetime) -> Board:
        """Return the board of this machine, without rows."""
        return cls(
            kincheck=VERSION,
            started=started.isoformat(timespec="seconds"),
            processor=processor(),
            platform=platform.platform(),
        )


def earlier_rows(file: Path) -> dict[str, Row]:
    """Return the rows of an earlier board by their keys; none without a file.

    Raises:
        KincheckError: the file is no board.
    """
    file = file / "board.json" if file.is_dir() else file
    if not file.is_file():
        return {}
    try:
        found = msgspec.json.decode(file.read_bytes(), type=Board)
    except msgspec.DecodeError as error:
        raise KincheckError(f"{file}: is no board ({error}); give another folder") from None
    return {row.key: row for row in found.rows}
