"""Texts of a regression report, the same in every format: headline, findings in groups, and changed
versions.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

from markupsafe import Markup
from rich.text import Text

from ..case.io.escape import visible
from ..doors import offers
from ..errors import shortened
from ..harness.labels import (
    folded,
    motion_unit,
    number,
    product,
    shown_change,
    unread_count,
)
from ..history.findings import WHY, Accepted, Finding, Kind, Loose, Regressions, Step
from . import terminal
from .sections import environment
from .table import escape_markdown, row

LONGEST = 12
"""Largest number of rows shown in a group; a broken engine has one for every case. The JSON has
all.
"""

NAMED = 4
"""Largest number of cases named in a row."""


COUNTED: Mapping[Kind, str] = {
    Kind.LOST: "with something lost",
    Kind.GONE: "with values gone",
    Kind.MOVED: "with other values",
    Kind.FREEDOM: "with another dof",
    Kind.UNIT: "with another unit",
    Kind.DRIFTED: "less accurate",
    Kind.RESIDUAL: "with a larger residual",
}
"""Words after the number of pairs with a finding, if they differ from the name of the kind."""


TITLES: Mapping[Kind, str] = {Kind.MOVED: "other values"}
"""Title of a group of findings, if it differs from the name of the kind."""


def heading(found: Regressions, kind: Kind) -> tuple[str, str]:
    """Return the title of a group of findings, and why it matters, as far as the versions tell."""
    why = WHY[kind]
    if kind is Kind.MOVED:
        since = dict.fromkeys(
            str(change)
            for each in found.findings
            if each.kind is kind
            for change in each.changes or found.changes
            if change.what == each.engine
        )
        why = f"the values differ since {', '.join(since)}" if since else why
    return TITLES.get(kind, kind), why


@dataclass(frozen=True)
class Row:
    """One finding, or several with the same text.

    Attributes:
        engine: the engine, or the engines.
        more: number of further findings of the kind for the pair.
    """

    engine: str
    cases: Sequence[str]
    message: str
    since: int | None
    more: int = 0

    @property
    def where(self) -> str:
        """The cases; of many, the first ones."""
        return shortened(self.cases, NAMED)

    @property
    def about(self) -> str:
        """The number of further findings of the pair, and the first run; empty without any."""
        since = f" · since run {self.since}" if self.since is not None else ""
        return (f" · and {self.more} more like it" if self.more else "") + since

    @property
    def what(self) -> str:
        """The message, folded, and what is known about it."""
        return folded(self.message) + self.about


def headline(found: Regressions) -> str:
    """Return the report in one sentence."""
    if found.against is None:
        judged = found.pairs - len(found.unjudged) - found.unable
        failing = (
            f"{len(found.failing)} of {judged} not right"
            if found.failing
            else f"all {judged} right"
        )
        # without a run to compare with there are no other regressions
        never = _count_pairs(found, Kind.LOST)
        rest = [f"{len(found.unjudged)} not judged"] if found.unjudged else []
        rest += [f"{found.unable} unavailable or unsupported"] if found.unable else []
        rest += [f"{never} not run"] if never else []
        absent = _count_pairs(found, Kind.ABSENT)
        rest += [f"{absent} {Kind.ABSENT}"] if absent else []
        rest += [unread_count(len(found.unread))] if found.unread else []
        return (
            f"{found.run.name}: {', '.join([failing, *rest])}; nothing to compare with:"
            f" {found.reason}"
        )
    words = {**COUNTED, Kind.FAILURE: "new failure" + "s" * (len(pairs(found, Kind.FAILURE)) > 1)}
    counts = [
        f"{count} {words.get(kind, kind)}"
        for kind in Kind
        if found.fails(kind) and (count := _count_pairs(found, kind))
    ]
    counts += [unread_count(len(found.unread))] if found.unread else []
    said = ", ".join(counts) or "nothing regressed"
    fixed = len(pairs(found, Kind.FIXED))
    known = len(found.failing) - len(pairs(found, Kind.FAILURE))
    again = len(pairs(found, Kind.JUDGED))
    rest = [f"{fixed} fixed"] if fixed else []
    rest += [f"{again} judged again"] if again else []
    rest += [f"{len(found.unjudged)} not judged"] if found.unjudged else []
    absent = 0 if found.missing_is_failure else _count_pairs(found, Kind.ABSENT)
    rest += [f"{absent} {Kind.ABSENT}"] if absent else []
    rest += [f"{known} not right before either"] if known > 0 else []
    rest += [", ".join(map(str, versions(found)))] if versions(found) else []
    return "; ".join([f"{found.run.name} against {found.against.name}: {said}", *rest])


def versions(found: Regressions) -> list[str]:
    """Return the changed versions, without changes of the machine and the settings."""
    return [
        str(change)
        for change in found.changes
        if change.what not in ("host", "processor", "platform", "commit", "tol")
    ]


def pairs(found: Regressions, kind: Kind) -> set[tuple[str, str, str]]:
    """Return the pairs with findings of a kind."""
    return {each.pair for each in found.findings if each.kind is kind}


def _count_pairs(found: Regressions, kind: Kind) -> int:
    """Return the number of pairs with findings of a kind; an unreadable case is one fault."""
    return sum(case not in found.unread for case, _, _ in pairs(found, kind))


def rows(findings: Iterable[Finding]) -> list[Row]:
    """Return the rows of one kind: each pair once, with its worst ratio; cases, then engines, with
    the same text are merged.
    """
    by_pair: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        by_pair.setdefault(finding.pair, []).append(finding)
    alike: dict[tuple[str, str, int | None, int], list[str]] = {}
    for (case, engine, mode), each in by_pair.items():
        first = max(each, key=lambda finding: finding.ratio or 0.0)
        alike.setdefault(
            (product(engine, mode), first.message, first.since, len(each) - 1), []
        ).append(case)
    engines: dict[tuple[tuple[str, ...], str, int | None, int], list[str]] = {}
    for (engine, message, since, more), cases in alike.items():
        engines.setdefault((tuple(cases), message, since, more), []).append(engine)
    return [Row(", ".join(names), *said) for said, names in engines.items()]


def passed_by_says(found: Regressions) -> str:
    """Return the later runs that are not judged, as a sentence; empty without any."""
    if not found.passed_by:
        return ""
    runs = "run" if len(found.passed_by) == 1 else "runs"
    named = shortened([*map(str, found.passed_by)], NAMED)
    return f"Not judged: {runs} {named}, of another selection; kincheck report RUN judges one."


def step_lines(steps: Iterable[Step], *, over: bool) -> list[str]:
    """Return the steps that stand, or those that came and went; cases with the same text share a
    line.
    """
    alike: dict[tuple[str, str], list[str]] = {}
    for step in steps:
        if (step.repaired is not None) is over:
            key = product(step.engine, step.mode), step_says(step)
            alike.setdefault(key, []).append(step.case)
    return [
        f"{engine} on {shortened(cases, NAMED)}: {says}" for (engine, says), cases in alike.items()
    ]


def accepted_says(each: Accepted) -> str:
    """Return an acceptance as a sentence."""
    return (
        f"{each.case} in {product(each.engine, each.mode)} is accepted in run {each.run} by"
        f" {each.who}, {each.made[:10]} ({', '.join(each.what)}): {each.reason}"
    )


def searches(found: Regressions) -> list[str]:
    """Return the command for each engine with another version and other results, if there is such a
    command: it finds the release.
    """
    lines: list[str] = []
    for change in found.changes if "bisect" in offers("commands") else ():
        cases = [each.case for each in found.findings if each.engine == change.what]
        if cases and change.before and change.now:
            names = " ".join([*dict.fromkeys(cases)][:NAMED])
            ends = f"--from {change.before} --to {change.now}"
            lines.append(f"{change}: kincheck bisect {change.what} {names} {ends}")
    return lines


@dataclass(frozen=True)
class Group:
    """A part of the report below a title: findings, or lines.

    Attributes:
        why: the findings matter.
        wrong: whether they fail the run.
        folded: whether a page shows the title alone.
    """

    title: str
    count: int
    folded: bool
    why: str = ""
    wrong: bool = False
    rows: Sequence[Row] = ()
    lines: Sequence[str] = ()

    @property
    def more(self) -> str:
        """The number of rows or lines that are not shown; empty without any."""
        rest = len(self.rows or self.lines) - LONGEST
        return f"and {rest} more, all in the JSON" if rest > 0 else ""

    @property
    def head(self) -> str:
        """Title, count and why."""
        return f"{self.title} ({self.count})" + (f": {self.why}" if self.why else "")


def groups(found: Regressions) -> list[Group]:
    """Return the parts of the report, findings first, the worst first."""
    made: list[Group] = []
    for kind in Kind:
        if each := rows(each for each in found.findings if each.kind is kind):
            wrong = found.fails(kind)
            folded = not wrong and kind not in (Kind.FIXED, Kind.JUDGED)
            title, why = heading(found, kind)
            made.append(Group(title, len(pairs(found, kind)), folded, why, wrong, each))
    steps = (step_lines(found.steps, over=over) for over in (False, True))
    for title, lines, folded in zip(
        LISTS,
        (searches(found), *steps, loose_says(found.loose)),
        (False, False, True, True),
        strict=True,
    ):
        if lines:
            made.append(Group(title, len(lines), folded, lines=lines))
    return made


LISTS = (
    "to find the release",
    "steps in the history that still stand",
    "steps that came and went",
    "tolerances that could be tightened",
)
"""Titles of the lists behind the findings."""


def said(found: Regressions) -> list[str]:
    """Return the sentences above the groups."""
    changes: list[str] = []
    if found.changes:
        changes = [f"Changed: {', '.join(map(str, found.changes))}."]
    elif found.against is not None:
        changes = ["Neither versions nor machine nor commit changed."]
    passed_by = [text] if (text := passed_by_says(found)) else []
    return [*changes, *passed_by, *map(accepted_says, found.accepted)]


def step_says(step: Step) -> str:
    """Return the text of a step, with its first run and the changes in that run."""
    name = f"{step.output} {step.quantity} error" if step.output else step.quantity
    if step.before is None or step.now is None:
        what = "bad" if step.worse else "good again"
    elif step.quantity == "time":
        what = f"{number(1e3 * step.before)} → {number(1e3 * step.now)} ms a sweep"
    else:
        unit, facts = motion_unit(step.unit, step.quantity), {"units": step.units}
        what = shown_change(step.before, step.now, unit, facts if step.units else {})
    changed = ", ".join(map(str, step.changes)) or "no version, machine or commit changed there"
    repaired = f", repaired in run {step.repaired}" if step.repaired is not None else ""
    since = f"since run {step.first} ({step.started[:16].replace('T', ' ')}){repaired}"
    return f"{name}: {what} {since}; after run {step.last}: {changed}"


def loose_says(loose: Sequence[Loose]) -> list[str]:
    """Return the tolerances to tighten, one line per case: its output with the least reduction."""
    by_case: dict[str, list[Loose]] = {}
    for each in loose:
        by_case.setdefault(each.case, []).append(each)
    lines: list[str] = []
    for case, each in by_case.items():
        least = min(each, key=lambda one: one.factor or math.inf)
        many = f"{len(each)} outputs" if len(each) > 1 else least.output
        reason = f"; its reason: {least.why}" if least.why else ""
        factor = (
            f"{number(least.factor)} times or more"
            if least.factor
            else "by any factor, since all errors are zero"
        )
        lines.append(f"{case}: {many}, {factor}, by {least.runs} runs{reason}")
    return lines


def to_markdown(found: Regressions) -> str:
    """Return the changes in Markdown, the worst first; long parts are folded."""
    lines = [f"## {escape_markdown(headline(found))}"]
    for each in said(found):
        lines += ["", escape_markdown(each)]
    for group in groups(found):
        title = escape_markdown(group.head[0].upper() + group.head[1:])
        head = f"<details><summary>{title}</summary>" if group.folded else f"**{title}**"
        lines += ["", head, ""]
        if group.rows:
            lines += ["| engine | case | what |", "| --- | --- | --- |"]
        for each in group.rows[:LONGEST]:
            lines.append(row(map(escape_markdown, (each.engine, each.where, each.what))))
        lines += (f"- {escape_markdown(line)}" for line in group.lines[:LONGEST])
        lines += ["", f"{group.more}."] if group.more else []
        lines += ["", "</details>"] if group.folded else []
    return "\n".join(lines) + "\n"


def to_markup(found: Regressions) -> Markup:
    """Return the changes as a part of an HTML page."""
    return Markup(
        environment()
        .get_template("regressions.html")
        .render(headline=headline(found), said=said(found), groups=groups(found), longest=LONGEST)
    )


def print_regressions(found: Regressions, file: TextIO) -> None:
    """Print the changes, the worst first."""
    console = terminal.console(file)

    def say(line: str, style: str = "") -> None:
        console.print(Text(visible(line), style=style), soft_wrap=True)

    say(headline(found), "bold")
    for line in said(found):
        say(line)
    for group in groups(found):
        say("")
        say(group.head, "bold red" if group.wrong else "bold")
        table = terminal.columns("engine", "case", "what")
        for each in group.rows[:LONGEST]:
            table.add_row(*(Text(visible(cell)) for cell in (each.engine, each.where, each.what)))
        if group.rows:
            console.print(terminal.indent_table(table))
        for line in (*group.lines[:LONGEST], *filter(None, [group.more])):
            say(f"  {line}")
