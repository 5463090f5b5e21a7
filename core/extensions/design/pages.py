"""What the pages of `kincheck tune` and `kincheck fit` share: curves with bands, moves in 3D."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, TextIO, cast

import msgspec
import numpy as np

from ...case.case import Case
from ...case.io.atomic_files import write
from ...case.units import Unit
from ...harness.provenance import case_facts
from ...harness.scene import scene
from ...report.axis import Axis, driver_axis
from ...report.drawing import drawing
from ...report.figures import OverDriver, Style, drawn_values
from ...report.page_model import Plot
from ...report.sections import Diagram, Report
from ...report.sections import page as page_of
from ...report.terminal import with_json
from ...trajectory import Array
from ...unit_text import with_unit
from ..reports.reports import print_report
from .goals import Goal, unit_in_table

_GREY = "rgba(128,128,128,0.3)"


class Tells(Protocol):
    """A command with files of its answer."""

    @property
    def page(self) -> Path | None: ...

    @property
    def json(self) -> str | None: ...


def tell(command: Tells, facts: Any, told: Report, drawn: Callable[[], str], written: str) -> None:
    """Print a report, and write its page and its facts where a command asks for them."""
    if command.page is not None:
        write("--page", command.page, drawn().encode())
    with with_json(facts, command.json) as console:
        print_report(told, cast(TextIO, console.file))
        if written:
            print(f"\n{written}", file=console.file)


def over_travel(
    number: int,
    what: str,
    unit: Unit,
    case: Case,
    curves: Sequence[tuple[Style, Array, str]],
    band: tuple[Array, Array, str],
) -> Diagram:
    """Return a diagram of an output over the travel.

    Args:
        number: of the diagram on its page.
        unit: of the values.
        curves: style, values [SI] and mode of each curve, shape (n,); NaN for none.
        band: its lower and its upper end, and what it is.
    """
    values = case.sweep.values.tolist()
    order: list[int] = np.argsort(case.sweep.values, kind="stable").tolist()
    axis = driver_axis(case_facts(case), [], [])
    drawn = OverDriver(replace(axis, values=values, kept=order))

    low, high, *known = (
        drawn_values(each.tolist(), order, 1.0 / unit.size)
        for each in (*band[:2], *(given for _, given, _ in curves))
    )
    drawn.add_band(low, high, fillcolor=_GREY)
    if len(drawn.traces[-1]["x"]) == 2:  # of one sample
        del drawn.traces[-1]["fill"]
        drawn.traces[-1]["line"] = {"width": 6, "color": _GREY}
    for (style, _, mode), given in zip(curves, known, strict=True):
        x, y = (given, drawn.axis.shown) if drawn.axis.up else (drawn.axis.shown, given)
        drawn.traces.append(style.curve(x, y, size=6) | {"mode": mode})
    title = with_unit(what, unit.name)
    plot = Plot(f"band-{number}", title, f"Band: {band[2]}.")
    return Diagram(plot, drawn.figure(title), [style for style, *_ in curves])


def whole(goal: Goal, values: Array, case: Case) -> Array:
    """Return values at the samples of a goal over the whole travel, NaN elsewhere."""
    found = np.full(len(case.sweep.values), np.nan)
    found[goal.at] = values
    return found


def page(report: Report, case: Case, moves: Mapping[str, float]) -> str:
    """Return a report as one HTML file, with the moves of points in the mechanism.

    Args:
        moves: by place, along the axes of the table [m].
    """
    drawn = drawing(scene(case, poses=False), Axis("travel", "", 1.0, [], "", [], 0, []))
    unit = unit_in_table("m", case)
    for each in case.hardpoints:
        way = [0.0] * 3
        for name, (k, sign) in zip("xyz", each.axes, strict=True):
            way[k] = sign * moves.get(f"{each.name} {name}", 0.0) / unit.size
        if any(way):
            drawn.arrows.append((0, [*each.position], each.name, [way]))
    drawn.unit = unit.name
    text = page_of(report, moves=msgspec.to_builtins(drawn))
    moved = Path(__file__).with_name("moves.html").read_text("utf-8")
    return text.replace("</section>", f"</section>{moved}", 1)
