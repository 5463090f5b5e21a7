"""Findings of the checks of a joint type or an engine, as data and as a table."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from io import StringIO
from typing import NamedTuple, TextIO

import numpy as np

from ...harness.record import Deviations
from ...trajectory import Array


class Verdict(StrEnum):
    """The outcome of a check. A check without a run is a row with its reason."""

    PASS = "pass"
    FAIL = "fail"
    SKIP = "skip"


class Limit(NamedTuple):
    """The largest accepted figure of a check, and its reason."""

    value: float
    why: str


# Sums of some thirty products of numbers of size one, each rounded at 1e-16.
ROUND_OFF = Limit(1e-13, "round-off of sums of numbers of size one")
# ROUND_OFF over the smallest singular value of accepted poses (a twentieth of the value at design),
# and the same factor once more.
AMPLIFIED = Limit(1e-10, "round-off over the smallest singular value, x100")


@dataclass(frozen=True)
class Finding:
    """One check.

    Attributes:
        figure: the worst number found, and `limit` the largest accepted one; None if nothing is
            measured or limited.
        why: the reason of the limit.
        specimen, pose: numbers of the specimen and pose with the worst figure; the
            seed reproduces them.
        row: the equation with the worst figure, as "Dot11 row 2".
        message: text beside the figure; of a failure, the remedy.
    """

    check: str
    verdict: Verdict
    figure: float | None = None
    limit: float | None = None
    why: str = ""
    specimen: int | None = None
    pose: int | None = None
    row: str = ""
    message: str = ""

    @property
    def place(self) -> str:
        """Where the worst figure is, in words."""
        parts = [f"specimen {self.specimen}" if self.specimen is not None else ""]
        parts += [f"pose {self.pose}" if self.pose is not None else "", self.row]
        return ", ".join(part for part in parts if part)


def worst(*findings: Finding) -> Finding:
    """Return the worst of several findings of one check."""
    order = (Verdict.SKIP, Verdict.PASS, Verdict.FAIL)
    return max(findings, key=lambda each: (order.index(each.verdict), each.figure or 0.0))


def skip(check: str, why: str) -> Finding:
    """Return the finding of a check without a run."""
    return Finding(check, Verdict.SKIP, message=why)


def fault_finding(check: str, fault: str, message: str = "") -> Finding:
    """Return the finding of a check without figures, by its fault; empty if there is none.

    Args:
        message: text without a fault.
    """
    return Finding(check, Verdict.FAIL if fault else Verdict.PASS, message=fault or message)


REMEDIES = {
    "design": (
        "phi must vanish at the design position: check the constants that primitives() makes of"
        " the geometry"
    ),
    "rank": "take out the dependent row, or repair it",
    "freedoms": "name each freedom that is left, or add the missing row",
    "rows": "what is named is no combination of the others' rows: differentiate phi again",
    "nu": "rows . v must be nu where phi stays zero; a joint has nu = 0",
    "gamma": (
        "rows . a must be gamma where phi stays zero: differentiate rows . v = nu once more,"
        " and move all but rows . a to the right"
    ),
    "newton": (
        "the rows have the right space but not the size or sign of the derivative, so a step is"
        " too long or too short"
    ),
    "branch tests": "a test must be positive on the branch of the design position: turn its sign",
    "round-off": "a difference of large numbers is formed: start from what changed",
    "axis lengths": "a direction may have any length: use unit() or triad()",
    "exchange": (
        "the joint is another one with its bodies exchanged: set symmetric = False, or repair it"
    ),
    "rigid motion": (
        "it must not matter where the two bodies are together: check which body each arm and"
        " axis belongs to"
    ),
    "size": (
        "a length that is not declared so is not scaled: declare it by position(), positions()"
        " or length()"
    ),
    "place": "take arms from the bodies' origins: i.arm(P), j.arm(P), never P itself",
    "mixed style": "mixed() must say the same as primitives(): define both",
    "driver": (
        "measured() is to drive the joint's own coordinate: phi = 0 at the drive's c, nu of its"
        " c_t, gamma of its c_tt; its rows are a force along the axis through the joint's"
        " point, or a couple about the axis; its branch tests are positive at c, and not a turn"
        " further"
    ),
    "power": "drivers, masses and springs do not balance: a joint has nu = 0",
    "no work": "the reaction works on the joint's freedoms: see rows and nu",
    "acts and reacts": (
        "what one body gets is not the opposite of what the other gets: see rows; a driver's"
        " force acts along the axis through the point: see measured()"
    ),
    "determinism": "keeps a state from one case to the next, or uses random numbers",
}
"""Texts for checks that fail, by the last part of their names."""
REMEDIES["residual elsewhere"] = REMEDIES["rigid motion"]
REMEDIES["in this process"] = REMEDIES["determinism"]


def judge_figures(
    check: str,
    figures: Array,
    limit: Limit,
    names: Sequence[str] = ("",),
    message: str = "",
    remedy: str = "",
) -> Finding:
    """Return the finding of figures by row and pose, shape (len(names), poses); NaN fails.

    Args:
        message: text of the finding, whatever the verdict.
        remedy: text added to a failure; by default that of the check in `REMEDIES`.
    """
    figures = np.where(np.isnan(figures), math.inf, np.atleast_2d(figures))
    row, pose = np.unravel_index(int(figures.argmax()), figures.shape)
    worst = float(figures[row, pose])
    good = worst <= limit.value
    remedy = remedy or REMEDIES.get(check.rpartition(": ")[2], "")
    return Finding(
        check,
        Verdict.PASS if good else Verdict.FAIL,
        worst,
        *limit,
        pose=int(pose) if worst else None,
        row=names[int(row)] if worst else "",
        message="; ".join(each for each in (message, "" if good else remedy) if each),
    )


AGREEMENT = 1.0
"""Largest accepted error over the tolerance of its output."""


def agreement(
    check: str, verdict: Verdict, errors: Mapping[str, Deviations], why: str, message: str
) -> Finding:
    """Return the finding of a comparison of outputs.

    Args:
        errors: deviations by output.
        why: reason of the limit.
    """
    shares = [
        (off.ratio, f"{output} {quantity}", off)
        for output, each in errors.items()
        for quantity, off in each.items()
    ]
    if not shares:
        return Finding(check, verdict, message=message)
    worst, row, off = max(shares, key=lambda each: each[:2])
    return Finding(check, verdict, worst, AGREEMENT, why, None, off.worst_step, row, message)


@dataclass(frozen=True)
class Report:
    """The checks of a joint type or an engine.

    Attributes:
        subject: name of the class or engine.
        specimens: the examined joints, as text.
        seed: seed of all random numbers; None if there are none.
    """

    subject: str
    specimens: tuple[str, ...]
    seed: int | None
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether no check failed."""
        return not self.failures

    @property
    def failures(self) -> tuple[str, ...]:
        """Names of the failed checks."""
        return tuple(each.check for each in self.findings if each.verdict is Verdict.FAIL)

    def __getitem__(self, check: str) -> Finding:
        return next(each for each in self.findings if each.check == check)

    def __str__(self) -> str:
        text = StringIO()
        self.print(text)
        return text.getvalue()

    def print(self, file: TextIO, *, quiet: bool = False) -> None:
        """Print one line per check, then the messages, the specimens and a count; if quiet, the
        failures and the count alone.
        """
        from rich.text import Text

        from ...report import terminal

        console = terminal.console(file)
        table = terminal.columns("check", "verdict", ">worst", ">limit", "at", "limit because")
        colours = {Verdict.PASS: "green", Verdict.FAIL: "bold red", Verdict.SKIP: "yellow"}
        shown = [each for each in self.findings if not quiet or each.verdict is Verdict.FAIL]
        for each in shown:
            numbers = ("–" if x is None else f"{x:.3g}" for x in (each.figure, each.limit))
            table.add_row(
                each.check,
                Text(each.verdict, colours[each.verdict]),
                *numbers,
                each.place,
                each.why,
            )
        if shown:
            console.print(table)
        for each in shown:
            if each.message:
                console.print(Text(f"{each.check}: {each.message}"), soft_wrap=True)
        for k, specimen in enumerate(() if quiet else self.specimens):
            console.print(Text(f"specimen {k}: {specimen}"), soft_wrap=True)
        counts = Counter(each.verdict for each in self.findings)
        summary = ", ".join(
            f"{counts[verdict]} {verdict}" for verdict in Verdict if counts[verdict]
        )
        seed = "" if self.seed is None else f" (seed {self.seed})"
        console.print(Text(f"{self.subject}: {summary}{seed}"))
