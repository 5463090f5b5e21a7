"""Findings of the comparison of two runs as data: the JSON schema kincheck-regression/1."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Literal

import msgspec

from ..harness.record import Facts, Record


class Kind(StrEnum):
    """The kind of a finding."""

    # regressions
    FAILURE = "new failure"
    LOST = "lost"
    UNJUDGED = "no longer judged"
    GONE = "values gone"
    MOVED = "another motion"
    FREEDOM = "freedom changed"
    UNIT = "unit changed"
    DRIFTED = "accuracy drifted"
    RESIDUAL = "residual grew"
    SLOWER = "slower"
    # other changes
    FIXED = "fixed"
    JUDGED = "judged again"
    TOLERANCE = "tolerance changed"
    REFERENCE = "reference changed"
    RANK = "rank changed"
    ADDED = "new in this run"
    ABSENT = "not in this run"

    @property
    def regression(self) -> bool:
        """Return whether a pair is worse than before."""
        kinds = [*Kind]
        return kinds.index(self) <= kinds.index(Kind.SLOWER)


WHY: Mapping[Kind, str] = {
    Kind.FAILURE: "these results are not reliable: they were before, or never have been",
    Kind.LOST: (
        "results that are no longer reached or compared are not checked: a fault there goes unseen"
    ),
    Kind.UNJUDGED: "solved, but no longer compared: a fault there goes unseen",
    Kind.GONE: "values that were numbers are null now: readers of the results lose data",
    Kind.MOVED: "the values differ: the case, its solution or its assembly has changed",
    Kind.FREEDOM: (
        "the mechanism has other degrees of freedom: it has changed, or the count is wrong"
    ),
    Kind.UNIT: "readers misread numbers in another unit or sense",
    Kind.DRIFTED: "within tolerance, but a decimal digit worse: a computation has changed",
    Kind.RESIDUAL: "the constraints are met three digits worse: the solution is less converged",
    Kind.SLOWER: "slower by more than this machine's spread from run to run",
    Kind.FIXED: "they failed in the run compared with, or in all earlier ones",
    Kind.JUDGED: "nothing was compared in the run compared with",
    Kind.TOLERANCE: "a result may pass now that failed before, or the reverse",
    Kind.REFERENCE: (
        "results are judged by other reference values than before: the reference or the case was"
        " edited"
    ),
    Kind.RANK: "the engine solves other rows than before. With equal dof, the motion is the same",
    Kind.ADDED: "nothing to compare with",
    Kind.ABSENT: "not requested, or removed from the library: nothing is known of them",
}
"""Why a kind matters."""


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """A changed version, machine or setting; a side is null if it was absent."""

    what: str
    before: Any
    now: Any

    def __str__(self) -> str:
        return f"{self.what} {_short(self.before)} → {_short(self.now)}"


def _short(value: Any) -> str:
    """Return a value as short text: a commit by its first digits."""
    text = "none" if value is None else str(value)
    return text[:10] if len(text) == 40 and text.isalnum() else text


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """One difference between the runs.

    Attributes:
        output, motion: the subject; null for a finding on the whole pair.
        before, now: errors [SI], residuals, seconds, tolerances, dof or rank, by the kind; null
            without a number.
        ratio: ratio of now to before, for a time corrected for the speed of the machine; null
            without one.
        limit: the smallest ratio that is reported.
        since: the first run with the finding, if the history has it.
        against: the run compared with, if the history has it.
        changes: other differences between the first run with the finding and the run before it.
    """

    kind: Kind
    case: str
    engine: str
    mode: str
    message: str
    output: str | None = None
    motion: str | None = None
    before: float | None = None
    now: float | None = None
    ratio: float | None = None
    limit: float | None = None
    since: int | None = None
    against: int | None = None
    changes: list[Change] = []

    @staticmethod
    def of(kind: Kind, record: Record, message: str, **about: Any) -> Finding:
        """Return a finding about the pair of a record."""
        about |= {"case": record.case, "engine": record.engine, "mode": record.mode}
        return Finding(kind=kind, message=message, **about)

    @property
    def pair(self) -> tuple[str, str, str]:
        """Case, engine and mode."""
        return self.case, self.engine, self.mode


class Step(msgspec.Struct, frozen=True, kw_only=True):
    """A change of level in the history of a pair.

    Attributes:
        quantity: position, velocity or acceleration (errors), time, or outcome.
        output: output whose error has the largest step; null for time and outcome.
        unit: unit of the output; empty for an error without a unit, for time and for outcome.
        units: of the table of hardpoints of the case, for the step's text; empty without one.
        first: number of the first run of the new level, which began at `started`.
        last: number of the last run of the previous level.
        before, now: the levels: errors [SI], seconds; null for an outcome.
        repaired: number of the first later run that is as good as before; null for a change to the
            better, and while the step stands.
        changes: other differences between these two runs.
    """

    case: str
    engine: str
    mode: str
    quantity: str
    output: str | None
    unit: str = ""
    units: dict[str, str] = {}
    first: int
    started: str
    last: int
    before: float | None
    now: float | None
    worse: bool
    repaired: int | None = None
    changes: list[Change]

    @property
    def pair(self) -> tuple[str, str, str]:
        """Case, engine and mode."""
        return self.case, self.engine, self.mode


class Loose(msgspec.Struct, frozen=True, kw_only=True):
    """A tolerance that no engine needs.

    Attributes:
        largest: the largest error in tolerances over all engines, motions and runs.
        factor: the possible reduction of the tolerance; null if all errors are exactly zero.
        why: the case's reason for its tolerance, which may justify it.
    """

    case: str
    output: str
    runs: int
    largest: float
    factor: float | None
    why: str


class Accepted(msgspec.Struct, frozen=True, kw_only=True):
    """A pair of a run that a person has accepted: the new baseline of the pair.

    Attributes:
        what: what was worse.
    """

    case: str
    engine: str
    mode: str
    run: int
    who: str
    made: str
    what: list[Kind]
    reason: str


class RunName(msgspec.Struct, frozen=True, kw_only=True):
    """The displayed name of a run, its number in the history if it has one, and the time of its
    start.
    """

    name: str
    number: int | None
    started: str
    host: str
    commit: str | None


class Regressions(msgspec.Struct, frozen=True, kw_only=True):
    """Changes between two runs.

    Attributes:
        against: the run compared with; null without one, for the reason in `reason`.
        pairs: number of records of the run.
        failing: case, engine and mode of all pairs that failed or broke, new or not.
        unjudged: case, engine and mode of all solved pairs without a comparison, new or not.
        unable: number of pairs whose engine is not there or cannot do the case.
        unread: requested cases that cannot be read; their pairs are findings, as lost.
        passed_by: numbers of later runs of something else, which are not judged.
        steps: first the standing ones, then the repaired ones (`Step.repaired`).
        time_limit: the smallest ratio of times that is reported as slower.
        missing_is_failure: whether a pair of an earlier run, missing in this one, is a regression.
        accepted: pairs accepted in this run, or in their last run before it.
    """

    schema: Literal["kincheck-regression/1"] = "kincheck-regression/1"
    run: RunName
    against: RunName | None
    reason: str
    pairs: int
    failing: list[tuple[str, str, str]]
    unjudged: list[tuple[str, str, str]] = []
    unable: int = 0
    unread: list[str] = []
    passed_by: list[int] = []
    time_limit: float
    missing_is_failure: bool = False
    findings: list[Finding]
    changes: list[Change]
    steps: list[Step]
    loose: list[Loose]
    accepted: list[Accepted] = []

    def fails(self, kind: Kind) -> bool:
        """Return whether findings of a kind are regressions in this report."""
        return kind.regression or (kind is Kind.ABSENT and self.missing_is_failure)

    @property
    def regressions(self) -> list[Finding]:
        """Return the findings of regressions."""
        return [finding for finding in self.findings if self.fails(finding.kind)]

    @property
    def regressed(self) -> bool:
        """Return whether a pair is worse than before or missing; without a run to compare with,
        whether any pair is bad.
        """
        return bool(self.regressions) or (self.against is None and bool(self.failing))


CIRCUMSTANCES = ("kincheck", "python", "numpy", "tol", "host", "processor", "platform")


def changes(now: Facts, before: Facts) -> list[Change]:
    """Return the differences in versions, machine and settings: engines first, then kincheck and
    its dependencies.
    """
    old: dict[str, Any] = before.get("engines") or {}
    new: dict[str, Any] = now.get("engines") or {}
    # an engine in only one of the runs was not requested in the other
    pairs: list[tuple[str, Any, Any]] = [
        (name, old[name], new[name]) for name in new if name in old
    ]
    pairs += [(name, before.get(name), now.get(name)) for name in CIRCUMSTANCES]
    a, b = (_files(facts) for facts in (before, now))
    pairs += [(what, a[what], b[what]) for what in a]
    return [Change(what=what, before=a, now=b) for what, a, b in pairs if a != b]


def _files(facts: Facts) -> dict[str, Any]:
    """Return the state of the files of a run; edits are given by their digest, if it is known."""
    git: dict[str, Any] = facts.get("git") or {}
    edits = git.get("edits") or ("some" if git.get("changed") else None)
    return {"commit": git.get("commit"), "uncommitted edits": edits}


def same_machine(now: Facts, before: Facts) -> bool:
    """Return whether both runs had equal processors, so that their times can be compared by the
    clock.

    Names of machines do not count: a hosted runner has another name every night.
    """
    return now.get("processor") == before.get("processor")
