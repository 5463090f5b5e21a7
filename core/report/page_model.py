"""The cases of a report for its page: text and figures of each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ..case.case import Truth
from ..errors import sentence
from ..harness.engine import RECORDED, STANDARD
from ..harness.labels import (
    against,
    displayed,
    engine_name,
    motion_unit,
    output_label,
    product,
    shown_text,
)
from ..harness.record import Deviation, Evidence, Facts, OutputSeries, Record, Results
from ..trajectory import QUANTITIES
from ..unit_text import FORCES, motion_word
from .axis import Axis, driver_axis
from .drawing import Drawing, drawing
from .figures import (
    Effort,
    Figure,
    Mark,
    Past,
    Style,
    Values,
    band_is_thin,
    error_figure,
    marks,
    output_figure,
    precision_figure,
    trend_figures,
)

ROUND_OFF = 1e-12
"""Part of a value by which an output may change that counts as constant without a tolerance."""


@dataclass(frozen=True)
class Judged:
    """One deviation with its record and output."""

    record: Record
    output: str
    motion: str
    deviation: Deviation
    facts: Facts = field(default_factory=dict[str, Any])

    @property
    def ratio(self) -> float:
        """The error in tolerances."""
        return self.deviation.ratio

    @property
    def word(self) -> str:
        """The motion, as in messages."""
        return motion_word(self.motion, self.unit)

    @property
    def unit(self) -> str:
        """The error's unit."""
        series = self.record.outputs.get(self.output)
        return motion_unit(series.unit, self.motion) if series else ""

    def text(self, value: float) -> str:
        """Return an error or a tolerance with its unit, that of the case's table if it has one."""
        return shown_text(value, self.unit, self.facts)


def deviations_of(records: Sequence[Record], facts: Facts | None = None) -> list[Judged]:
    """Return every deviation of the records.

    Args:
        facts: of their cases, by name.
    """
    return [
        Judged(r, output, motion, d, (facts or {}).get(r.case, {}))
        for r in records
        for output, e in r.errors.items()
        for motion, d in e.items()
    ]


def worst(deviations: Iterable[Judged]) -> Judged | None:
    """Return the deviation closest to its tolerance, or farthest beyond it."""
    return max(deviations, key=lambda each: each.ratio, default=None)


def worst_of(
    record: Record, motion: str | None = None, facts: Facts | None = None
) -> Judged | None:
    """Return the worst deviation of a record, in one motion or any; see `deviations_of`."""
    return worst(each for each in deviations_of([record], facts) if motion in (None, each.motion))


@dataclass(frozen=True)
class Plot:
    """A figure of the page: its key, a title for screen readers, and its caption."""

    figure: str
    title: str
    caption: str


@dataclass(frozen=True)
class OutputView:
    """One output of a case: its curves against the driver, and their differences to the standard.

    Attributes:
        constant: whether it moves by less than its tolerance, and is right.
        errors: a figure for each compared quantity.
        rates: the quantities of these figures after the first.
    """

    name: str
    label: str
    unit: str
    constant: bool
    plot: Plot
    errors: list[Plot]
    rates: list[str]


@dataclass(frozen=True)
class CaseView:
    """One case of the page.

    Attributes:
        source: the file or the origin of its numbers, and the convention of signs.
        log: how the file was read; empty if `source` has all.
        evidence: evidence on the reference; None without a reference.
        worst: the deviation closest to its tolerance, or farthest beyond it.
        account: the degrees of freedom, as counted in the paper and by rank.
        scene: the drawn mechanism; None if the results have none.
        trends: errors and time over earlier runs; empty without a history.
        marks: steps and other versions in them.
        precision: error against time at several effort settings, by mode; empty if not measured.
    """

    name: str
    anchor: str
    truth: Truth
    source: str
    log: str
    records: list[Record]
    evidence: Evidence | None
    axis: Axis
    outputs: list[OutputView]
    worst: Judged | None
    account: Facts | None
    scene: Drawing | None
    trends: list[Plot]
    marks: Sequence[Mark]
    precision: list[Plot]

    def by_engine(self, name: str) -> list[Record]:
        """Return the records of an engine."""
        return [record for record in self.records if engine_name(record) == name]


@dataclass(frozen=True)
class Material:
    """The material of a report: a run, further data by case, and further limits, each a title and a
    sentence; and its figures, so far.
    """

    results: Results
    history: Mapping[str, Sequence[Past]]
    precision: Mapping[str, Sequence[Effort]]
    limits: Sequence[tuple[str, str]] = ()
    figures: dict[str, Figure] = field(default_factory=dict[str, Figure])

    @cached_property
    def styles(self) -> dict[str, Style]:
        """The styles of the engines, those without any record last."""
        never = sorted({product(engine, mode) for _, engine, mode in self.results.missing})
        names = dict.fromkeys([*map(engine_name, self.results.records), *never])
        recorded = {engine_name(each) for each in self.results.records if each.mode == RECORDED}
        return {
            name: Style.number(index, name, measured=name in recorded)
            for index, name in enumerate(names)
        }


def case_view(given: Material, name: str, anchor: str) -> CaseView:
    """Return one case of the page; add its figures to those of the page."""
    results = given.results
    records = [record for record in results.records if record.case == name]
    facts: Facts = results.run.get("cases", {}).get(name, {})
    deviations = deviations_of(records, {name: facts})
    axis = driver_axis(facts, records, (each.deviation.worst_step for each in deviations))
    names = dict.fromkeys(output for record in records for output in record.outputs)
    outputs: list[OutputView] = []
    for index, output in enumerate(names):
        here = [each for each in deviations if each.output == output]
        outputs.append(_output(given, output, f"{anchor}-{index}", here, records, axis))
    source = facts.get("source", "")
    brief, more, _ = source.partition("; ")
    return CaseView(
        name=name,
        anchor=anchor,
        truth=Truth(records[0].truth),
        source=" · ".join(filter(None, (brief, facts.get("signs", "")))),
        log=source if more else "",
        records=records,
        evidence=next((record.evidence for record in records if record.evidence), None),
        axis=axis,
        outputs=sorted(outputs, key=lambda each: each.unit not in FORCES),
        worst=worst(deviations),
        account=next(
            (r.details["dof_account"] for r in records if r.details.get("dof_account")), None
        ),
        scene=drawing(results.scenes[name], axis, _values(records))
        if name in results.scenes
        else None,
        trends=_trends(given, name, anchor),
        marks=marks(given.history.get(name, ())),
        precision=_precision(given, name, anchor),
    )


def _values(records: Sequence[Record]) -> dict[str, Sequence[float | None]]:
    """Return the values of the first engine with outputs, the native engine if possible: the scene
    shows its poses.
    """
    solved = sorted(
        (record for record in records if record.outputs),
        key=lambda record: record.engine != STANDARD,
    )
    return {name: each.position for name, each in solved[0].outputs.items()} if solved else {}


def _output(
    given: Material,
    output: str,
    key: str,
    deviations: Sequence[Judged],
    records: Sequence[Record],
    axis: Axis,
) -> OutputView:
    styles, references = given.styles, given.results.references.get(records[0].case, {})
    curves = [(styles[engine_name(r)], r.outputs[output]) for r in records if output in r.outputs]
    label, truth = output_label(output), references.get(output)
    errors, compared = list[Plot](), list[str]()
    for motion in QUANTITIES:
        here = [each for each in deviations if each.motion == motion]
        values: Values | None = getattr(_standard(here, records, references), motion, None)
        if values is None:
            continue
        found = [
            (styles[engine_name(j.record)], getattr(j.record.outputs[output], motion), j.deviation)
            for j in here
        ]
        word = motion_word(motion, here[0].unit)
        title = f"{word} difference of {label} against {axis.name}, log axis"
        compared.append(motion)
        errors.append(Plot(f"{key}-{motion}", title, _worst_caption(here, axis)))
        unit = displayed(here[0].unit, here[0].facts)
        given.figures[f"{key}-{motion}"] = error_figure(motion, *unit, axis, found, values)
    positions = [each for each in deviations if each.motion == "position"]
    standard = _standard(positions, records, references)
    band = (standard, positions[0].deviation.tolerance) if standard else None
    points = records[0].truth == Truth.THIRD_PARTY_DATA
    given.figures[key] = output_figure(output, axis, curves, truth, band, measured=points)
    sentences = [f"{sentence(sense)}." for _, series in curves[:1] if (sense := series.sense)]
    sentences += [] if truth else ["No reference."]
    if band:
        whose = against(positions[0].deviation.against)
        sentences.append(_band_caption(*band, positions[0].text(band[1]), whose))
    plot = Plot(
        key,
        f"{label} against {axis.name}, all engines",
        " ".join([*sentences, axis.besides]).strip(),
    )
    constant = all(each.deviation.within for each in deviations) and _constant(
        [series.position for _, series in curves], band[1] if band else 0.0
    )
    unit = curves[0][1].unit
    return OutputView(output, label, unit, constant, plot, errors, compared[1:])


def _constant(curves: Sequence[Values], tolerance: float) -> bool:
    """Return whether all curves stay at one value, to the tolerance or to round-off."""
    known = [v for curve in curves for v in curve if v is not None and math.isfinite(v)]
    if not known:
        return False
    return max(known) - min(known) <= max(tolerance, ROUND_OFF * max(map(abs, known)))


def _trends(given: Material, case: str, anchor: str) -> list[Plot]:
    history = given.history.get(case, ())
    runs = len(dict.fromkeys(each.run for each in history))
    if runs < 2:  # the report's own run
        return []
    made = trend_figures(history, given.styles)
    given.figures.update({f"{anchor}-trend-{what}": figure for what, figure in made.items()})
    return [
        Plot(
            f"{anchor}-trend-{what}",
            f"{what.replace('-', ' ')} over {runs} runs, log axis",
            f"{runs} runs, oldest first.",
        )
        for what in made
    ]


def _precision(given: Material, case: str, anchor: str) -> list[Plot]:
    plots, efforts = list[Plot](), given.precision.get(case, ())
    for mode in dict.fromkeys(each.mode for each in efforts):
        key = f"{anchor}-precision-{mode}"
        own = [each for each in efforts if each.mode == mode]
        given.figures[key] = precision_figure(own, given.styles)
        caption = (
            f"Mode {mode}. Left is faster, down is more accurate; a point is one effort setting."
        )
        plots.append(Plot(key, f"{mode}: error against time per sample, both log axes", caption))
    return plots


def _standard(
    deviations: Sequence[Judged], records: Sequence[Record], references: Mapping[str, OutputSeries]
) -> OutputSeries | None:
    """Return the standard of one motion of one output: the reference, or the output of an engine
    that replaces it.
    """
    if not deviations:
        return None
    output, standard = deviations[0].output, deviations[0].deviation.against
    engines = {
        record.engine: record.outputs[output] for record in records if output in record.outputs
    }
    return engines.get(standard) or references.get(output)


def _band_caption(standard: OutputSeries, tolerance: float, held: str, whose: str) -> str:
    band = "narrower than the line" if band_is_thin(standard, tolerance) else "the grey band"
    return f"Tolerance ±{held} around the {whose}: {band}."


def _worst_caption(deviations: Sequence[Judged], axis: Axis) -> str:
    largest = max(deviations, key=lambda each: each.deviation.max_abs)
    d = largest.deviation
    who = f"{engine_name(largest.record)}, sample {d.worst_step} ({axis.at(d.worst_step)})"
    found, tolerance = map(largest.text, (d.max_abs, d.tolerance))
    return f"Worst {found}: {who}. Tolerance {tolerance}, against {against(d.against)}."
