"""The page of a compliance study: the numbers that engineers quote, and figures in groups, the
usual ones at once and the others folded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...case.case import PER_TRAVEL
from ...errors import number_of, sentence
from ...harness.labels import output_label
from ...report.axis import Axis
from ...report.figures import Figure, OverDriver, Style
from ...report.page_model import ROUND_OFF, Plot
from ...report.report import headline
from ...report.sections import Diagram, Report, Section, environment, figure_parts
from ...trajectory import Array
from ...unit_text import with_unit
from .rates import SIDES, Curve, without_side
from .results import COMPLIANCE, WHEEL_LOAD, ComplianceCurves, ComplianceResults
from .rig import PER
from .views import agreement, digits, shown_unit, unit_of_axis

SOFT, RIGID = Style.number(0, "with bushings"), Style.number(1, "rigid joints")
AT_ONCE = ("toe", "camber", "half_track_change", "roll_center_height", "wheel_rate", WHEEL_LOAD)
"""Figures over travel that are not folded; of an axle, those of the left wheel."""
AT_ONCE_BY_LOAD = ("toe", "camber", "half_track_change", WHEEL_LOAD)
WHEEL = ("toe", "camber", "caster", "kingpin_inclination", "steer_angle", "scrub_radius")
BY_LOADS = "Slopes by loads"
GROUPS: Mapping[str, Callable[[str], bool]] = {
    "Slopes by travel": lambda name: name.endswith(PER_TRAVEL),
    BY_LOADS: lambda name: name.endswith((*PER.values(),)) or COMPLIANCE in name,
    "Loads, rates and stiffness": lambda name: name.startswith(
        ("wheel_load", "wheel_rate", "ride_rate", "roll_stiffness", "roll_rate", "anti_roll_share")
    ),
    "Wheel and steering axis": lambda name: name in (*WHEEL, "mechanical_trail"),
    "Road, springs and points": lambda name: True,
}
"""Titles of folded figures by the names of their outputs without a side; the first one counts."""


@dataclass(frozen=True)
class Drawn:
    """A figure with its heading, of a group; the group's title is empty for one shown at once."""

    group: str
    heading: str
    plot: Plot


@dataclass(frozen=True)
class Over:
    """The part of a page over travel or over a load."""

    key: str
    title: str
    problems: Sequence[str]
    notes: Sequence[str]
    styles: Sequence[Style]
    drawn: Sequence[Drawn]

    @property
    def folds(self) -> dict[str, list[Drawn]]:
        """The folded figures by title."""
        found: dict[str, list[Drawn]] = {title: [] for title in GROUPS}
        for each in self.drawn:
            if each.group:
                found[each.group].append(each)
        return {title: each for title, each in found.items() if each}

    @property
    def at_once(self) -> list[Drawn]:
        """The other figures."""
        return [each for each in self.drawn if not each.group]


def page(results: ComplianceResults) -> str:
    """Return the page as HTML text."""
    figures = dict[str, Figure]()
    every = (results.travel, *results.loads.values())
    parts = [_over(number, curves, figures) for number, curves in enumerate(every)]
    said = set[str]()
    for k, part in enumerate(parts):
        parts[k] = replace(part, notes=[each for each in part.notes if each not in said])
        said.update(part.notes)
    rows = [
        (sentence(each.label), *_value(each.value, each.unit), each.says)
        for each in results.travel.summary()
    ]
    return (
        environment(Path(__file__).parent)
        .get_template("kc.html")
        .render(
            case=results.case,
            facts=[results.signs, "equilibria with springs, bushings and weight"],
            place=place(results.travel),
            rows=rows,
            parts=parts,
            matrix=_matrix(results.travel),
            agreement=[] if results.checked is None else agreement(results.checked),
            **figure_parts(figures),
        )
    )


def report(results: ComplianceResults) -> Report:
    """Return the numbers that engineers quote, and all figures, for another form of the page."""
    figures, every = dict[str, Figure](), (results.travel, *results.loads.values())
    rows = [
        (each.label, *_value(each.value, each.unit), each.says) for each in results.travel.summary()
    ]
    columns = ["quantity", "unit", "sign and meaning", "value"]
    title = f"Summary at {place(results.travel)}"
    sections = [Section(title, [], [], columns, 3, [(a, c, d, b) for a, b, c, d in rows])]
    for part in (_over(number, curves, figures) for number, curves in enumerate(every)):
        drawn = [Diagram(each.plot, figures[each.plot.figure], part.styles) for each in part.drawn]
        sections.append(Section(part.title, part.problems, [], [], 0, [], drawn))
    count, lost = sum(len(each.at) for each in every), len(results.failures)
    said = f"{lost} of {number_of(count, 'sample')} without equilibrium" * (lost > 0)
    said = said or f"all {number_of(count, 'sample')} have an equilibrium"
    if results.checked is not None:
        agreed = headline(results.checked)
        said += f", and {agreed[0].lower()}{agreed[1:]}"
    name = f"Kinematics and compliance of {results.case}"
    return Report("kc", name, [results.signs], sections, verdict=f"{said}.")


def place(curves: ComplianceCurves) -> str:
    """Return the sample of the summary in words."""
    unit, factor = unit_of_axis(curves)
    return f"{curves.axis} {digits(factor * float(curves.at[curves.near_design]))} {unit}"


def _value(value: float | None, unit: str) -> tuple[str, str]:
    shown, factor = shown_unit(unit)
    written = "–" if value is None else digits(factor * value, 4).replace("-", "\N{MINUS SIGN}")
    return written, "" if shown == "1" else shown


def _matrix(curves: ComplianceCurves) -> list[list[str]]:
    """Return the compliance at the sample nearest to design, without round-off; none if nothing
    gives way.
    """
    matrix = curves.compliance[curves.near_design]
    if curves.rigid_joints or not np.isfinite(matrix).all():
        return []
    zero = ROUND_OFF * np.abs(matrix).max()
    return [[f"{x:.4g}" for x in row] for row in np.where(abs(matrix) > zero, matrix, 0.0).tolist()]


def _over(number: int, curves: ComplianceCurves, figures: dict[str, Figure]) -> Over:
    """Return the part over travel or over a load, and add its figures."""
    axis, drawn, soft = _axis(curves), list[Drawn](), not curves.rigid_joints
    at_once = AT_ONCE if curves.axis == "travel" else AT_ONCE_BY_LOAD
    load = {} if WHEEL_LOAD in curves.not_computed else {WHEEL_LOAD: Curve(curves.wheel_load, "N")}
    for name, each in {**load, **curves.outputs}.items():
        group = "" if _left(name) in at_once else _group(name)
        if group == BY_LOADS and not soft:
            continue
        shown, size = shown_unit(each.unit)
        over = OverDriver(axis)
        pairs = [(SOFT, each.values)]
        if name in curves.rigid and soft:
            pairs.append((RIGID, curves.rigid[name]))
        for style, values in pairs:
            look = style.curve(axis.shown, [])
            over.add(_drawn(size * values), axis.shown, **{k: look[k] for k in LOOK})
        key = f"curve-{number}-{len(drawn)}"
        words = heading(name)
        title = with_unit(words, shown)
        short = curves.upward or len(title) <= MOST_UPRIGHT
        figures[key] = over.figure(title if short else with_unit("", shown).strip())
        plot = Plot(key, f"{name} over {curves.axis}", each.sense)
        drawn.append(Drawn(group, words, plot))
    order = {name: k for k, name in enumerate(map(heading, at_once))}
    drawn.sort(key=lambda each: order.get(each.heading, len(order)))
    notes = [*curves.notes, *curves.lost]
    styles = [SOFT, RIGID] if curves.rigid and soft else []
    title = "Over travel" if curves.axis == "travel" else f"Over a {curves.axis} load at design"
    return Over(f"section-{number}", title, curves.failures, notes, styles, drawn)


MOST_UPRIGHT = 36
"""Letters of a title that fit beside a figure."""
LOOK = ("name", "uid", "meta", "mode", "line", "marker")


def heading(name: str) -> str:
    """Return a name in words: toe by lateral force."""
    for suffix in PER.values():
        if name.endswith(suffix):
            own = output_label(name.removesuffix(suffix))
            return f"{own} by {suffix.removeprefix('.per_').replace('_', ' ')}"
    return output_label(name)


def _left(name: str) -> str:
    return name.removeprefix(f"{SIDES[0]}_")


def _group(name: str) -> str:
    own = without_side(name)
    return next(title for title, holds in GROUPS.items() if holds(own))


def _axis(curves: ComplianceCurves) -> Axis:
    """Return the axis of the figures: wheel travel upwards, loads and steering to the right."""
    unit, factor = unit_of_axis(curves)
    title = with_unit(curves.axis, unit)
    if curves.upward:
        arrows = "\N{LEFTWARDS ARROW}", "\N{RIGHTWARDS ARROW}"
        title = f"rebound {arrows[0]}  {with_unit('wheel travel', unit)}  {arrows[1]} jounce"
    values = [*map(float, curves.at)]
    kept = list(range(len(values)))
    return Axis(curves.axis, unit, factor, values, title, kept, int(curves.upward), [])


def _drawn(values: Array) -> list[float | None]:
    return [float(f"{x:.10g}") if math.isfinite(x) else None for x in values.tolist()]
