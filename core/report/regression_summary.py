"""The regression report as Markdown, for a pull request, a job summary or an e-mail, and as a part
of the HTML report.
"""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup

from ..errors import number_of
from ..history.findings import WHY, Kind, Regressions
from .markdown import escaped, row
from .page_parts import environment
from .regression_labels import (
    LONGEST,
    STEPS,
    headline,
    loose_says,
    pairs,
    passed_by_says,
    rows,
    step_lines,
)


def to_markdown(found: Regressions) -> str:
    """Return the changes in Markdown, the worst first; long parts are folded."""
    return "\n".join([f"## {escaped(headline(found))}", "", *_lines(found)]).rstrip() + "\n"


def to_markup(found: Regressions) -> Markup:
    """Return the changes as a part of an HTML page."""
    groups = [
        (
            kind,
            WHY[kind],
            len(pairs(found, kind)),
            rows(each for each in found.findings if each.kind is kind),
        )
        for kind in Kind
    ]
    return Markup(
        environment()
        .get_template("regressions.html")
        .render(
            headline=headline(found),
            found=found,
            groups=[group for group in groups if group[2]],
            steps=[
                (over, title, step_lines(found.steps, over=over)) for over, title in STEPS.items()
            ],
            passed_by=passed_by_says(found),
            loose=loose_says(found.loose),
            longest=LONGEST,
        )
    )


def _lines(found: Regressions) -> Iterator[str]:
    if found.changes:
        yield f"Changed: {escaped(', '.join(map(str, found.changes)))}."
    elif found.against is not None:
        yield "Neither versions nor machine nor commit changed."
    yield ""
    yield from [passed_by_says(found), ""] if found.passed_by else []
    for kind in Kind:
        group = rows(each for each in found.findings if each.kind is kind)
        if not group:
            continue
        folded = not found.fails(kind) and kind not in (Kind.FIXED, Kind.JUDGED)
        title = f"{kind.capitalize()} ({len(pairs(found, kind))}): {WHY[kind]}"
        yield from (
            [f"<details><summary>{escaped(title)}</summary>", ""]
            if folded
            else [f"**{escaped(title)}**", ""]
        )
        yield from ("| engine | case | what |", "| --- | --- | --- |")
        for each in group[:LONGEST]:
            yield row(map(escaped, (each.engine, each.where, each.what)))
        yield ""
        if len(group) > LONGEST:
            yield from (f"and {len(group) - LONGEST} more, all in the JSON.", "")
        yield from ["</details>", ""] if folded else []
    for over, title in STEPS.items():
        lines = step_lines(found.steps, over=over)
        if lines:
            yield from (
                [f"<details><summary>{title} ({len(lines)})</summary>", ""]
                if over
                else [f"**{title}**", ""]
            )
            yield from (f"- {escaped(line)}" for line in lines[:LONGEST])
            rest = len(lines) - LONGEST
            yield from [f"- and {rest} more, all in the JSON"] if rest > 0 else []
            yield from ["", "</details>", ""] if over else [""]
    if found.loose:
        lines = loose_says(found.loose)
        title = f"Tolerances that could be tightened ({number_of(len(lines), 'case')})"
        yield from (f"<details><summary>{title}</summary>", "")
        yield from (f"- {escaped(line)}" for line in lines)
        yield from ("", "</details>", "")
