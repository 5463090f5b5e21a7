"""The summary: one HTML file without scripts that prints on two A4 pages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...report.sections import Section, environment
from .drawing import svg
from .paper import Paper

LINES = 56
"""Lines of text on the second page, at the size of its print."""
CHARACTERS = 112
"""Characters of a line."""
MOST = 330
"""Characters of a sentence or a cell; the page of the report has all."""
SIZE = 400, 400
"""Size of a figure: a quarter of the first page's rest [px]."""


def summary(paper: Paper, verdict: str = "") -> str:
    """Return the summary as HTML text.

    Args:
        verdict: a sentence before that of the paper.
    """
    return (
        environment(Path(__file__).parent)
        .get_template("summary.html")
        .render(
            verdict=" ".join(filter(None, (verdict and f"{verdict}.", paper.verdict))),
            facts=paper.facts,
            four=[(svg(each.figure, size=SIZE), each.plot) for each in paper.four],
            sections=[*_fitted(paper.sections)],
        )
    )


@dataclass(frozen=True)
class _Part:
    """A section as far as it fits, and the number of what is left out."""

    section: Section
    left: int


def _fitted(sections: Sequence[Section]) -> Iterator[_Part]:
    """Yield the sections, shortened so that all fit on one page."""
    room = float(LINES)
    for k, section in enumerate(sections):
        # the other sections keep half of the room at least
        mine = room if k == len(sections) - 1 else 0.6 * room
        mine -= 3
        verdict, rows = list[str](), list[Sequence[str]]()
        for sentence in map(_short, section.verdict):
            mine -= math.ceil(len(sentence) / CHARACTERS)
            if mine >= 0:
                verdict.append(sentence)
        for row in section.rows:
            cells = [_short(cell, MOST // 4) for cell in row]
            mine -= 1.1 * _lines(cells)
            if mine >= 0:
                rows.append(cells)
        left = len(section.verdict) - len(verdict) + len(section.rows) - len(rows)
        wrong = [each for each in section.wrong if each < len(rows)]
        notes = [_short(each) for each in section.notes[:1]]
        made = replace(section, verdict=verdict, rows=rows, wrong=wrong, notes=notes, diagrams=())
        room -= 3 + sum(math.ceil(len(each) / CHARACTERS) for each in verdict)
        room -= sum(1.1 * _lines(row) for row in rows)
        yield _Part(made, left)


def _lines(cells: Sequence[str]) -> int:
    """Return about how many lines a row has; its columns take the room that they need."""
    return math.ceil(sum(map(len, cells)) / (0.9 * CHARACTERS)) or 1


def _short(text: str, most: int = MOST) -> str:
    return text if len(text) <= most else f"{text[: most - 2].rstrip()} …"
