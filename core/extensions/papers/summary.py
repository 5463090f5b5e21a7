"""The summary: one HTML file without scripts that prints on two A4 pages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from typing import TypeVar

from ...report.sections import Section, environment
from ..reports.svg import svg
from .paper import Paper

T = TypeVar("T")

ROOM = 740.0
"""Height of the second page: A4 without margins, and a line less [pt]."""
SENTENCE, ROW = (14.0, 88), (12.0, 96)
"""Height [pt] and characters of a line of a sentence, and of a row of a table."""
HEAD, EDGE = 95.0, 4.5
"""Height of a section's heading, note and head of a table, and of the edges of a row [pt]."""
VERDICT, FACTS, CAPTION, LONG, CELL = 240, 300, 150, 330, 96
"""Most characters; the report has all."""
SIZE = 400, 400
"""Size of a figure: a quarter of the first page's rest [px]."""


def summary(paper: Paper, verdict: str = "") -> str:
    """Return the summary as HTML text.

    Args:
        verdict: a sentence before that of the paper.
    """
    said = f"{verdict}. {paper.verdict}" if verdict else paper.verdict
    return (
        environment(Path(__file__).parent)
        .get_template("summary.html")
        .render(
            verdict=_short(said, VERDICT),
            facts=_short(" · ".join(filter(None, paper.facts)), FACTS),
            four=[
                (svg(each.figure, size=SIZE), _short(each.plot.caption, CAPTION))
                for each in paper.four
            ],
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
    room = ROOM
    for k, section in enumerate(sections):
        # the sections below keep their room, up to two fifths of it
        below = sum(map(_height, sections[k + 1 :]))
        mine = room - min(below, 0.4 * room) - HEAD
        verdict = _within(mine, [_short(each, LONG) for each in section.verdict], _sentence)
        mine -= sum(map(_sentence, verdict))
        cells = [[_short(cell, CELL) for cell in row] for row in section.rows]
        rows = _within(mine, cells, _row)
        room -= HEAD + sum(map(_sentence, verdict)) + sum(map(_row, rows))
        left = len(section.verdict) - len(verdict) + len(section.rows) - len(rows)
        wrong = [each for each in section.wrong if each < len(rows)]
        notes = [_short(each, LONG // 2) for each in section.notes[:1]]
        made = replace(section, verdict=verdict, rows=rows, wrong=wrong, notes=notes, diagrams=())
        yield _Part(made, left)


def _height(section: Section) -> float:
    """Return the height of a whole section [pt]."""
    return HEAD + sum(map(_sentence, section.verdict)) + sum(map(_row, section.rows))


def _within(room: float, parts: Sequence[T], height: Callable[[T], float]) -> list[T]:
    """Return the first parts that fit into a height [pt]."""
    ends = accumulate(map(height, parts))
    return [part for part, end in zip(parts, ends, strict=True) if end <= room]


def _sentence(text: str) -> float:
    """Return the height of a sentence [pt]."""
    line, characters = SENTENCE
    return line * math.ceil(len(text) / characters)


def _row(cells: Sequence[str]) -> float:
    """Return about the height of a row [pt]; its columns take the room that they need."""
    line, characters = ROW
    count = sum(len(each) + 2 for each in cells)
    return EDGE + line * (math.ceil(count / characters) + (len(cells) > 7))


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 2].rstrip()} …"
