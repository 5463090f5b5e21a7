"""The content of a paper: the verdict, the figures, those that matter most, and tables."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ...errors import number_of, shortened
from ...harness.labels import NAMED, against, engine_name, number, output_label, value_words
from ...harness.labels import product as product_of
from ...harness.record import Results
from ...report.figures import Figure
from ...report.page_model import CaseView, Judged, Material, case_view, deviations_of
from ...report.report import headline
from ...report.sections import Diagram, Report, Section

if TYPE_CHECKING:
    from ...cli.forms import Shown

FIRST = "toe", "camber", "half-track change", "half track change", "caster"
"""Outputs that a chassis engineer asks for first."""
FOUR = 4

_Judged = dict[tuple[str, str], Judged]
"""Deviations by case and output."""


@dataclass(frozen=True)
class Paper:
    """What a paper shows.

    Attributes:
        verdict: the conclusion in a sentence.
        facts: what was solved, and how.
        sections: tables and sentences.
        diagrams: every figure of the page, by a name for its file.
        four: those that matter most.
    """

    verdict: str
    facts: Sequence[str]
    sections: Sequence[Section]
    diagrams: Mapping[str, Diagram]
    four: Sequence[Diagram]


def paper_of(shown: Shown) -> Paper:
    """Return the paper of a run, or of tables and diagrams."""
    return _of_results(shown) if isinstance(shown, Results) else _of_report(shown)


def _of_report(report: Report) -> Paper:
    diagrams = [each for section in report.sections for each in section.diagrams]
    verdict = ": ".join(filter(None, (report.headline, report.verdict)))
    sections = [each for each in report.sections if each.rows or each.verdict]
    return Paper(verdict, report.facts, sections, _named(diagrams), _first(diagrams, []))


def _named(diagrams: Iterable[Diagram], prefix: str = "") -> dict[str, Diagram]:
    """Return diagrams by names for files, from their titles."""
    found = dict[str, Diagram]()
    for each in diagrams:
        name = re.sub(r"\W+", "_", prefix + each.plot.title.partition(",")[0])
        found[name if name not in found else f"{name}_{len(found)}"] = each
    return found


def _of_results(results: Results) -> Paper:
    given = Material(results, {}, {})
    names = dict.fromkeys(each.case for each in results.records)
    cases = [case_view(given, name, f"case-{k}") for k, name in enumerate(names)]
    called = {case.name: f"{case.name}: " if len(cases) > 1 else "" for case in cases}
    of_cases = {case.name: _diagrams(given, case, called[case.name]) for case in cases}
    diagrams = {key: each for mine in of_cases.values() for key, each in mine.items()}
    of_truth, of_engines = _worst(results)
    worst = [
        diagrams[each.plot.figure]
        for key in of_truth
        for case in cases
        for each in case.outputs
        if key == (case.name, each.name)
    ]
    sections = [
        _tolerances(results, of_truth, of_engines, several=len(cases) > 1),
        Section("Not judged", [*_not_judged(results)], [], [], 0, []),
    ]
    first = [diagrams[each.plot.figure] for case in cases for each in case.outputs]
    return Paper(
        _verdict(results, [*of_truth.values(), *of_engines.values()]),
        [*_facts(results, cases)],
        [each for each in sections if each.rows or each.verdict],
        {
            name: each
            for case, mine in of_cases.items()
            for name, each in _named(mine.values(), called[case]).items()
        },
        _first(first, worst),
    )


def _diagrams(given: Material, case: CaseView, prefix: str) -> dict[str, Diagram]:
    """Return the figures of a case with the values of its driver, by their keys."""
    found = dict[str, Diagram]()
    for output in case.outputs:
        for plot in (output.plot, *output.errors):
            figure = given.figures[plot.figure]
            traces = [
                each | {way: case.axis.shown for way in "xy" if each[way] == "driver"}
                for each in figure["data"]
            ]
            whole: Figure = {"data": traces, "layout": figure["layout"]}
            plot = replace(plot, caption=prefix + plot.caption)
            found[plot.figure] = Diagram(plot, whole, [*given.styles.values()])
    return found


def _first(diagrams: Sequence[Diagram], worst: Iterable[Diagram]) -> list[Diagram]:
    """Return the four that matter most: the worst judged, then those of `FIRST`, then others."""
    sides = "", "left ", "axle ", "right "
    starts = [f"{side}{name} " for side in sides for name in FIRST]
    titles = [each.plot.title.replace("_", " ") for each in diagrams]
    named = [
        each
        for start in starts
        for each, title in zip(diagrams, titles, strict=True)
        if title.startswith((f"{start}against", f"{start}over"))
    ]
    found = {each.plot.figure: each for each in (*worst, *named, *diagrams)}
    return [*found.values()][:FOUR]


def _worst(results: Results) -> tuple[_Judged, _Judged]:
    """Return the deviation closest to its tolerance of each case's output, the worst first: from
    the reference, and between the engines.
    """
    of_truth, of_engines = _Judged(), _Judged()
    every = deviations_of(results.records, results.run.get("cases", {}))
    for each in sorted(every, key=lambda each: -each.ratio):
        found = of_truth if each.deviation.against == each.record.truth else of_engines
        found.setdefault((each.record.case, each.output), each)
    return of_truth, of_engines


def _tolerances(
    results: Results, of_truth: _Judged, of_engines: _Judged, *, several: bool
) -> Section:
    """Return the table of what is judged by the reference, or of all if there is none. What is
    wrong between the engines is there too, the rest a sentence.
    """
    others = [each for each in of_engines.values() if of_truth and each.deviation.within]
    rows = [each for each in (*of_truth.values(), *of_engines.values()) if each not in others]
    said = f"{number_of(len(others), 'output')}: the engines agree with each other, within"
    share = _share(others[0]) if others else ""
    return Section(
        "Tolerances",
        [f"{said} {share} of the tolerances."] if others else [],
        ["The largest share of its tolerance, over all engines and samples, of each output."],
        [*["case"] * several, "output", "against", "why", "tolerance", "difference", "share"],
        3 + several,
        [_row(results, each, several=several) for each in rows],
        wrong=[k for k, each in enumerate(rows) if not each.deviation.within],
    )


def _verdict(results: Results, judged: Sequence[Judged]) -> str:
    """Return the conclusion in a sentence, with the output closest to its tolerance."""
    said = headline(results)
    if not judged:
        return f"{said}."
    worst = max(judged, key=lambda each: each.ratio)
    several = len({each.record.case for each in judged}) > 1
    where = f" of {worst.record.case}" if several else ""
    what = "closest to its tolerance" if worst.deviation.within else "farthest beyond its tolerance"
    return f"{said}; {what}: {_label(worst)}{where} ({_share(worst)})."


def _share(each: Judged) -> str:
    return f"{number(100 * each.ratio)} %"


def _label(each: Judged) -> str:
    motion = "" if each.motion == "position" else f", {each.word}"
    return f"{output_label(each.output)}{motion}"


def _row(results: Results, each: Judged, *, several: bool) -> list[str]:
    facts = results.run.get("cases", {}).get(each.record.case, {})
    why = facts.get("outputs", {}).get(each.output, {}).get("why", "")
    found = each.deviation
    return [
        *[each.record.case] * several,
        _label(each),
        against(found.against),
        why.partition(";")[0],
        each.text(found.tolerance),
        each.text(found.max_abs),
        _share(each),
    ]


def _facts(results: Results, cases: Sequence[CaseView]) -> Iterator[str]:
    """Yield what was solved, against what, by which engines, and when."""
    yield shortened([each.name for each in cases], NAMED)
    if len(cases) == 1 and (count := len(cases[0].axis.values)):
        axis = cases[0].axis
        yield f"{count} samples from {axis.at(0)} to {axis.at(count - 1)}"
    for case in cases[:1]:
        if case.evidence is not None and len(cases) == 1:
            yield f"reference: {case.evidence.citation or 'uncited'} ({case.evidence.of})"
    versions = {engine_name(each): each.version or "–" for each in results.records}
    yield ", ".join(f"{name} {version}" for name, version in versions.items())
    yield f"kincheck {value_words(results.run.get('kincheck'))}"
    yield str(results.run.get("started", ""))[:10]


def _not_judged(results: Results) -> Iterator[str]:
    """Yield each reason why something is not judged, behind what."""
    groups: dict[str, dict[str, None]] = {}

    def add(why: str, what: str) -> None:
        groups.setdefault(why.rstrip("."), {})[what] = None

    for each in results.records:
        if not each.outcome.judged:
            add(each.message, f"{engine_name(each)} on {each.case} ({each.outcome.shown})")
            continue
        for output, errors in each.errors.items():
            if errors.reason:
                add(errors.reason, output_label(output))
    for case, why in results.unread.items():
        add(why, case)
    for case, engine, mode in results.missing:
        if case not in results.unread:
            add("the run ended before", f"{product_of(engine, mode)} on {case}")
    for why, names in groups.items():
        yield f"{shortened([*names], NAMED)}: {why}."
