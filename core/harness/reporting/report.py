"""The report of a run: one HTML file that opens offline, the worst engine and its worst sample first."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from jinja2 import Environment, StrictUndefined

from ..case import Truth
from ..record import Deviation, Outcome, OutputSeries, Record, Results
from .caveats import COMPARED, caveats
from .figures import (
    Axis,
    Figure,
    Style,
    Values,
    band_is_thin,
    driver_axis,
    engine_name,
    error_figure,
    motion_unit,
    output_figure,
    output_label,
)

MOTIONS = ("position", "velocity", "acceleration")
TRUTHS = {
    Truth.CLOSED_FORM: "closed form",
    Truth.THIRD_PARTY_DATA: "third-party data",
    Truth.IN_HOUSE_ORACLE: "in-house oracle",
    Truth.CONSENSUS_ONLY: "consensus only",
}
NOT_RUN = (Outcome.UNSUPPORTED, Outcome.UNAVAILABLE)
BROKEN = (Outcome.ERROR, Outcome.TIMEOUT, Outcome.CRASHED)


@dataclass(frozen=True)
class Judged:
    """One deviation and what it belongs to."""

    record: Record
    output: str
    motion: str
    deviation: Deviation

    @property
    def ratio(self) -> float:
        """The error in tolerances."""
        d = self.deviation
        return d.max_abs / d.tolerance if d.tolerance > 0 else float("inf") if d.max_abs > 0 else 0.0

    @property
    def unit(self) -> str:
        """The error's unit."""
        series = self.record.outputs.get(self.output)
        return motion_unit(series.unit, self.motion) if series else ""


@dataclass(frozen=True)
class ErrorView:
    """An error figure of an output: which motion, the key of the figure, and what is said under it."""

    motion: str
    figure: str
    caption: str


@dataclass(frozen=True)
class OutputView:
    """One output of a case: the keys of its figures and what is said under them."""

    name: str
    label: str
    figure: str
    caption: str
    errors: list[ErrorView]


@dataclass(frozen=True)
class CaseView:
    """One case of the page.

    Attributes:
        worst: the deviation closest to its tolerance, or beyond it most.
        account: the degrees of freedom, counted as in the paper and by rank.
    """

    name: str
    anchor: str
    truth: Truth
    source: str
    records: list[Record]
    axis: Axis
    outputs: list[OutputView]
    worst: Judged | None
    account: Mapping[str, Any] | None


def write_report(results: Results, path: Path) -> None:
    """Write the report as one HTML file with all scripts, styles and data inside.

    Args:
        results: a run. Of `results.run`, "cases" may give each case's "source", "driver" (its name, type, point and direction)
            and "motions" of further drivers by case name; everything else is printed as it is.
        path: the file to write, in a folder that exists.

    Raises:
        OSError: the file cannot be written.
    """
    path.write_text(render(results), encoding="utf-8")


def render(results: Results) -> str:
    """The report as HTML text."""
    # Loaded here, for runs that write no report; the package has no types.
    plotly: Any = importlib.import_module("plotly.offline")
    records = results.records
    names = dict.fromkeys(engine_name(record) for record in records)
    styles = {name: Style.number(index, name) for index, name in enumerate(names)}
    figures: dict[str, Figure] = {}
    case_names = dict.fromkeys(record.case for record in records)
    cases = [_case(results, name, f"case-{index}", styles, figures) for index, name in enumerate(case_names)]
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    cast("dict[str, Any]", environment.filters).update(
        number=number, label=output_label, engine=engine_name, against=_against, model=_model, known=_known
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    template = environment.from_string(Path(__file__).with_name("report.html").read_text("utf-8"))
    return template.render(
        headline=headline(records),
        worst=max(((case, case.worst) for case in cases if case.worst), key=lambda each: each[1].ratio, default=None),
        counts=[(outcome, count) for outcome in Outcome if (count := _count(records, outcome))],
        unjudged=sum(record.outcome in COMPARED and not _judged(record) for record in records),
        problems=_grouped(record for record in records if record.outcome in (Outcome.FAIL, *BROKEN)),
        not_run=_grouped(record for record in records if record.outcome in NOT_RUN),
        circumstances={key: value for key, value in results.run.items() if key != "cases"},
        settings=_settings(records),
        styles=styles,
        cases=cases,
        references=results.references,
        caveats=caveats(results),
        truths=TRUTHS,
        motions=MOTIONS,
        compared=COMPARED,
        worst_position=worst_position,
        validation=validation,
        data={"drivers": {case.anchor: case.axis.shown for case in cases}, "figures": figures},
        plotlyjs=plotly.get_plotlyjs(),
    )


def headline(records: Sequence[Record]) -> str:
    """The run in one sentence."""
    judged = [record for record in records if _judged(record)]
    compared, failed, broken = len(judged), _count(judged, Outcome.FAIL), _count(records, *BROKEN)
    if not compared:
        said = "Nothing was compared"
    elif failed:
        said = f"{failed} of {compared} comparisons {'is' if failed == 1 else 'are'} outside tolerance"
    else:
        said = f"All {compared} comparisons are within tolerance" if compared > 1 else "The one comparison is within tolerance"
    return said + (f", {broken} could not be completed" if broken else "")


def _judged(record: Record) -> bool:
    """Whether there was anything to compare with."""
    return any(errors.items() for errors in record.errors.values())


def worst_position(record: Record) -> Deviation | None:
    """The largest position deviation over the outputs of a record."""
    known = [errors.position for errors in record.errors.values() if errors.position is not None]
    return max(known, key=lambda deviation: deviation.max_abs, default=None)


def validation(record: Record) -> str:
    """What may be called validated, if anything."""
    if not record.validated:
        return ""
    against = {deviation.against for errors in record.errors.values() for _, deviation in errors.items()}
    whole = against == {record.truth} and all(len(errors.items()) == len(MOTIONS) for errors in record.errors.values())
    return "validated" if whole else "validated, positions only"


def number(value: float | None) -> str:
    """A number to three digits for a table; a dash where it was not computed."""
    if value is None:
        return "–"
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    mantissa, _, exponent = f"{value:.2e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}" if exponent else mantissa


def _case(results: Results, name: str, anchor: str, styles: Mapping[str, Style], figures: dict[str, Figure]) -> CaseView:
    records = [record for record in results.records if record.case == name]
    facts: Mapping[str, Any] = results.run.get("cases", {}).get(name, {})
    judged = [Judged(r, output, motion, d) for r in records for output, e in r.errors.items() for motion, d in e.items()]
    axis = driver_axis(facts, records, (each.deviation.worst_step for each in judged))
    references = results.references.get(name, {})
    outputs: list[OutputView] = []
    for index, output in enumerate(dict.fromkeys(output for record in records for output in record.outputs)):
        curves = [(styles[engine_name(r)], r.outputs[output]) for r in records if output in r.outputs]
        key = f"{anchor}-{index}"
        errors: list[ErrorView] = []
        for motion in MOTIONS:
            here = [each for each in judged if (each.output, each.motion) == (output, motion)]
            standard = _standard(here, records, references)
            if standard is None:
                continue
            found = [(styles[engine_name(j.record)], getattr(j.record.outputs[output], motion), j.deviation) for j in here]
            errors.append(ErrorView(motion, f"{key}-{motion}", _worst_caption(here, axis)))
            figures[f"{key}-{motion}"] = error_figure(motion, here[0].unit, axis, found, standard)
        tolerance = next((j.deviation.tolerance for j in judged if (j.output, j.motion) == (output, "position")), None)
        figures[key] = output_figure(output, axis, curves, references.get(output), tolerance)
        caption = f"{_band_caption(references.get(output), tolerance)} {axis.besides}".strip()
        outputs.append(OutputView(output, output_label(output), key, caption, errors))
    return CaseView(
        name=name,
        anchor=anchor,
        truth=Truth(records[0].truth),
        source=facts.get("source", ""),
        records=records,
        axis=axis,
        outputs=outputs,
        worst=max(judged, key=lambda each: each.ratio, default=None),
        account=next((r.details["dof_account"] for r in records if r.details.get("dof_account")), None),
    )


def _standard(judged: Sequence[Judged], records: Sequence[Record], references: Mapping[str, OutputSeries]) -> Values | None:
    """The samples an output's motion was judged against: the reference's, or those of the engine named instead."""
    if not judged:
        return None
    output, motion, against = judged[0].output, judged[0].motion, judged[0].deviation.against
    engines = {record.engine: record.outputs[output] for record in records if output in record.outputs}
    series = engines.get(against) or references.get(output)
    return getattr(series, motion) if series else None


def _band_caption(truth: OutputSeries | None, tolerance: float | None) -> str:
    if truth is None or tolerance is None:
        return "No reference." if truth is None else ""
    band = "narrower than the line" if band_is_thin(truth, tolerance) else "the grey band"
    return f"Tolerance ±{number(tolerance)} {truth.unit}: {band}."


def _worst_caption(judged: Sequence[Judged], axis: Axis) -> str:
    worst = max(judged, key=lambda each: each.deviation.max_abs)
    d = worst.deviation
    who = f"{engine_name(worst.record)}, sample {d.worst_step} ({axis.at(d.worst_step)})"
    return f"Worst {number(d.max_abs)}: {who}. Tolerance {number(d.tolerance)}, against {_against(d)}."


def _against(deviation: Deviation) -> str:
    kinds = {kind.value: words for kind, words in TRUTHS.items()}
    return kinds.get(deviation.against, deviation.against)


def _model(record: Record) -> dict[str, Any]:
    """What an engine tells of the model it made, beyond what has a table of its own."""
    return {key: value for key, value in record.details.items() if key not in ("dof_account", "program")}


def _grouped(records: Iterable[Record]) -> list[tuple[Outcome, str, str, list[str]]]:
    """Outcome, engine and message, with the cases they were the same for."""
    groups: dict[tuple[Outcome, str, str], list[str]] = {}
    for record in records:
        groups.setdefault((record.outcome, engine_name(record), record.message), []).append(record.case)
    return [(*key, cases) for key, cases in groups.items()]


def _settings(records: Sequence[Record]) -> list[tuple[str, dict[str, Any], list[str]]]:
    """Each engine's distinct settings, with the cases they were the same for."""
    groups: dict[str, tuple[str, dict[str, Any], list[str]]] = {}
    for record in records:
        group = groups.setdefault(f"{engine_name(record)} {record.settings}", (engine_name(record), record.settings, []))
        group[2].append(record.case)
    return list(groups.values())


def _known(value: Any) -> Any:
    """A value of any kind from a results file, in words."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key} {_known(each)}" for key, each in cast("Mapping[str, Any]", value).items()) or "–"
    if isinstance(value, list | tuple):
        return ", ".join(str(_known(each)) for each in cast("Sequence[Any]", value)) or "–"
    if isinstance(value, float):
        return number(value)
    return "–" if value is None or value == "" else value


def _count(records: Sequence[Record], *outcomes: Outcome) -> int:
    counts = Counter(record.outcome for record in records)
    return sum(counts[outcome] for outcome in outcomes)
