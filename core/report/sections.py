"""Reports of tables and diagrams, on the terminal, as JSON and as a page: measurements of kincheck
itself, and comparisons of designs.
"""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, cast

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from ..case.io.escape import file_name
from ..harness.labels import against, engine_name, number, output_label, shorten_names, value_words
from ..unit_text import value_text, with_unit
from .figures import Figure, Style
from .page_model import Plot

_HERE = Path(__file__).parent
SCENE_SCRIPTS = (
    "elements.js",
    "axes.js",
    "frame.js",
    "traces.js",
    "readout.js",
    "plot.js",
    "vectors.js",
    "motion.js",
    "canvas.js",
    "solids.js",
    "centres.js",
    "scene.js",
    "pictures.js",
    "mechanism.js",
)
"""Scripts of figures and scenes, in loading order: each depends only on earlier ones."""

SCRIPTS = (*SCENE_SCRIPTS, "overview.js", "report.js")
"""Scripts of a report."""

LONG = 300
"""Characters of a message that the page shows at once; the rest is folded."""


@cache
def environment(*folders: Path) -> Environment:
    """Return the templates of these folders and of this one, with the filters of the macros.

    The process keeps them: templates take longer to compile than to render.
    """
    made = Environment(
        loader=FileSystemLoader([*folders, _HERE]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    cast("dict[str, Any]", made.filters).update(
        number=number,
        label=output_label,
        engine=engine_name,
        against=against,
        known=value_words,
        named=shorten_names,
        file_name=file_name,
        parted=split_message,
        value_text=value_text,
        with_unit=with_unit,
    )
    return made


def style_sheet() -> str:
    """Return the style sheet of all pages."""
    return (_HERE / "report.css").read_text("utf-8")


def figure_parts(
    figures: Mapping[str, Figure],
    *,
    drivers: Mapping[str, Sequence[float]] | None = None,
    scenes: Mapping[str, Any] | None = None,
) -> dict[str, str]:
    """Return style sheet, script and data of a page with figures, by their names in templates.

    Args:
        drivers: values that replace "driver" in traces, by section.
        scenes: drawings of mechanisms, by section.
    """
    data = {"drivers": drivers or {}, "figures": figures, "scenes": scenes or {}}
    return {
        "css": style_sheet(),
        "script": "\n".join(script_of(name) for name in SCRIPTS),
        "data": pack_text(json.dumps(data, allow_nan=False, separators=(",", ":"))),
    }


def script_of(name: str, folder: Path = _HERE) -> str:
    """Return a script of the pages without indentation and comment lines."""
    lines = [line.strip() for line in (folder / name).read_text("utf-8").splitlines()]
    return "\n".join(line for line in lines if line and not line.startswith("//"))


def split_message(message: str) -> tuple[str, str]:
    """Return the start of a long message, up to the end of a line or sentence, and the rest."""
    if len(message) <= LONG:
        return message, ""
    ends = [found.end() for found in re.finditer(r"\n+|[.;:] +", message) if found.end() <= LONG]
    return (message[: ends[-1]], message[ends[-1] :]) if ends else (message, "")


def pack_text(text: str) -> str:
    """Return text as base64 of its zlib stream, which has a third of the size and cannot end its
    script element.
    """
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")


@dataclass(frozen=True)
class Diagram:
    """A figure, its caption, and the styles of its curves."""

    plot: Plot
    figure: Figure
    styles: Sequence[Style]


@dataclass(frozen=True)
class Section:
    """One table of a report, with its conclusions.

    Attributes:
        verdict: the conclusions as sentences.
        notes: the method of measurement.
        columns: headings; the first `labels` of them head words, the others numbers.
        diagrams: diagrams above the table, only on the page; those with the same styles side by
            side.
        rows: cells; a row of one cell is a heading of those below it.
        links: file that belongs to each row, beside the page; empty for none.
        wrong: places of the rows in red.
    """

    title: str
    verdict: Sequence[str]
    notes: Sequence[str]
    columns: Sequence[str]
    labels: int
    rows: Sequence[Sequence[str]]
    diagrams: Sequence[Diagram] = ()
    links: Sequence[str] = ()
    wrong: Sequence[int] = ()


@dataclass(frozen=True)
class Report:
    """Results for readers.

    Attributes:
        name: also of its files.
        verdict: the conclusion in a phrase behind the headline, where the page has none.
        linked: whether the page begins with links to its sections.
    """

    name: str
    headline: str
    facts: Sequence[str]
    sections: Sequence[Section]
    linked: bool = False
    verdict: str = ""


def page(report: Report, **scenes: Any) -> str:
    """Return the report as one HTML file in the style of a run's report.

    Args:
        scenes: drawings of mechanisms, by their names in the page.
    """
    figures = {
        diagram.plot.figure: diagram.figure
        for section in report.sections
        for diagram in section.diagrams
    }
    scripted = bool(figures or scenes)
    parts = figure_parts(figures, scenes=scenes) if scripted else {"css": style_sheet()}
    return (
        environment().get_template("bench.html").render(report=report, scripted=scripted, **parts)
    )
