"""The report of a run: one HTML file for offline use, the worst engine and sample first."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, cast

from markupsafe import Markup
from msgspec.structs import asdict

from ..case.case import Truth
from ..errors import sentence
from ..harness.engine import STANDARD
from ..harness.labels import (
    TRUTHS,
    engine_name,
    notes,
    product,
    shorten_names,
    suspects,
    unread_count,
    validation,
)
from ..harness.record import REFERENCE, Outcome, Record, Results
from ..trajectory import QUANTITIES
from .axis import SAMPLES
from .curves import downloads
from .figures import Effort, Past
from .page_model import CaseView, Material, case_view, deviations_of, worst_of
from .sections import environment, figure_parts, pack_text

ANSWERED = (Outcome.PASS, Outcome.FAIL, Outcome.UNJUDGED)
"""Outcomes of pairs with an answer."""


def caveats(results: Results) -> list[tuple[str, str]]:
    """Return each limit of the run as a title and a sentence."""
    records = results.records
    limits: list[tuple[str, str]] = []

    def add(title: str, text: str) -> None:
        limits.append((title, text))

    def cases(holds: Callable[[Record], bool]) -> str:
        return shorten_names([*dict.fromkeys(record.case for record in records if holds(record))])

    add(
        "One description for all",
        "All engines solve the same case files. A wrong hardpoint, axis or driver in a file is"
        " wrong in all engines, and no comparison shows it.",
    )
    if names := cases(lambda record: record.truth == Truth.IN_HOUSE_ORACLE):
        add(
            f"In-house oracle: {names}",
            "This project computed the reference. Agreement with our own oracle is not validation.",
        )
    if names := cases(lambda record: record.truth == Truth.CONSENSUS_ONLY):
        add(
            f"Consensus only: {names}",
            "There is no reference. Engines that agree with the native one may be wrong together.",
        )
    for case, note in notes(results.run):
        add(f"Note on {case}", f"{sentence(note)}.")
    for outcome in Outcome:
        pairs = [_pair(record) for record in records if record.outcome is outcome]
        if pairs and outcome not in ANSWERED:
            add(
                f"{outcome.shown.capitalize()}: {len(pairs)}",
                f"There are no results for {shorten_names(pairs, '; ')}.",
            )
    for case, why in results.unread.items():
        add(f"Not read: {case}", f"{why}. There are no results for it.")
    if pairs := [
        f"{product(engine, mode)} on {case}"
        for case, engine, mode in results.missing
        if case not in results.unread
    ]:
        add(
            f"Not run: {len(pairs)}",
            f"The run ended before them. There are no results for {shorten_names(pairs, '; ')}.",
        )
    reasons: dict[str, dict[str, None]] = {}
    answered = [record for record in records if record.outcome in ANSWERED]
    for record in records:
        if None not in (record.solved, record.samples) and record.solved != record.samples:
            add(
                _pair(record),
                f"{record.solved} of {record.samples} samples were solved; the others have no"
                " results.",
            )
    for record in answered:
        for errors in record.errors.values():
            if errors.reason:
                reasons.setdefault(errors.reason, {})[_pair(record)] = None
    for reason, pairs in reasons.items():
        add(f"Not judged: {shorten_names([*pairs])}", reason)
    if len({record.mode for record in answered}) > 1:
        add(
            "Modes",
            "Projection and simulate are separate products; their times and errors form no"
            " common ranking.",
        )
    if len({record.loop for record in records if record.us_per_step is not None}) > 1:
        add(
            "Times",
            "The loops over the samples run in different places (see loop): each time includes"
            " engine and loop.",
        )
    if names := cases(
        lambda record: any(len(values) > SAMPLES for values in record.driver.values())
    ):
        add(
            f"Thinned figures: {names}",
            f"About {SAMPLES} samples of each curve are drawn, including the worst; tables"
            " and verdicts used all.",
        )
    return limits


def _pair(record: Record) -> str:
    return f"{engine_name(record)} on {record.case}"


NOT_JUDGED = (Outcome.UNJUDGED, Outcome.UNSUPPORTED, Outcome.UNAVAILABLE)
BROKEN = (Outcome.ERROR, Outcome.TIMEOUT, Outcome.CRASHED)

WITHOUT_TRENDS = (
    "No trends",
    "The history cannot be read, so this page shows no earlier runs.",
)
"""Limit of a report whose history is damaged."""
FAULTS = (
    ("is", "are", "outside tolerance"),
    ("contradicts", "contradict", "the native engine"),
    ("has", "have", "outputs without a value"),
    ("has", "have", "a residual above the tolerance"),
    ("has", "have", "forces without a balance of power, or bodies off their constraints"),
    ("lacks", "lack", "samples"),
)
"""Words of the headline for the fault of one failing record and of several."""


def write_report(
    results: Results,
    path: Path,
    *,
    history: Mapping[str, Sequence[Past]] | None = None,
    precision: Mapping[str, Sequence[Effort]] | None = None,
    changes: Markup | None = None,
    limits: Sequence[tuple[str, str]] = (),
) -> None:
    """Write the report as one HTML file with all scripts, styles and data inside.

    Args:
        results: a run. In `results.run`, "cases" may give each case's "source", "driver" (name,
            type, point and direction) and "motions" of further drivers, by case name; everything
            else is printed unchanged.
        path: the file to write, in an existing folder.
        history: results of the engines in earlier runs and this one, oldest first, by case name.
        precision: error against time at several efforts, by case name.
        changes: the first section, with changes since another run.
        limits: further limits of the report, each a title and a sentence.

    Raises:
        OSError: the file cannot be written.
    """
    path.write_text(
        render(Material(results, history or {}, precision or {}, limits), changes), encoding="utf-8"
    )


def render(given: Material, changes: Markup | None = None) -> str:
    """Return the report as HTML text."""
    records = given.results.records
    never = {(case, product(engine, mode)) for case, engine, mode in given.results.missing}
    names = dict.fromkeys(record.case for record in records)
    cases = [case_view(given, name, f"case-{index}") for index, name in enumerate(names)]
    curves = downloads(given.results, {each.anchor: each.name for each in cases if each.outputs})
    templates = environment()
    cast("dict[str, Any]", templates.filters).update(
        model=_model, worst=partial(worst_of, facts=given.results.run.get("cases", {}))
    )
    return templates.get_template("report.html").render(
        headline=headline(given.results),
        changes=changes,
        worst=max(
            (
                (case, case.worst)
                for case in cases
                if case.worst and case.name not in given.results.suspects
            ),
            key=lambda each: each[1].ratio,
            default=None,
        ),
        counts=[(outcome, count) for outcome in Outcome if (count := _count(records, outcome))],
        not_judged=_group_messages(record for record in records if record.outcome in NOT_JUDGED),
        suspects=suspects(given.results),
        problems=_group_messages(
            record
            for record in records
            if record.outcome in (Outcome.FAIL, *BROKEN) and not given.results.explains(record)
        ),
        circumstances={
            key: value
            for key, value in given.results.run.items()
            if key not in ("cases", "missing", "unread")
        },
        unread=given.results.unread,
        settings=_settings(records),
        styles=given.styles,
        cases=cases,
        references=given.results.references,
        caveats=[*given.limits, *caveats(given.results)],
        never=never,
        truths=TRUTHS,
        motions=QUANTITIES,
        answered=ANSWERED,
        validation=validation,
        severity=severity,
        searched=search_words,
        curves=curves,
        packed_curves=pack_text(json.dumps(curves)),
        **figure_parts(
            given.figures,
            drivers={case.anchor: case.axis.shown for case in cases},
            scenes={case.anchor: asdict(case.scene) for case in cases if case.scene},
        ),
    )


def headline(results: Results) -> str:
    """Return the run in one sentence."""
    records, unread = results.records, len(results.unread)
    missing = sum(case not in results.unread for case, _, _ in results.missing)
    # a failure may have no deviation at all, if no sample or no output has a value
    compared = [
        record for record in records if deviations_of([record]) or record.outcome is Outcome.FAIL
    ]
    broken = _count(records, *BROKEN)
    failed = [record for record in compared if record.outcome is Outcome.FAIL]
    faults = Counter(_fault(record, results.run.get("tol", 0.0)) for record in failed)
    counts = [
        f"{n} of {len(compared)} comparisons {one if n == 1 else more} {what}"
        for one, more, what in FAULTS
        if (n := faults[what])
    ]
    if not compared:
        sentence = "Nothing was compared"
    elif failed:
        sentence = ", ".join(counts)
    else:
        sentence = (
            f"All {len(compared)} comparisons are within tolerance"
            if len(compared) > 1
            else "The one comparison is within tolerance"
        )
    sentence += f", {broken} could not be completed" if broken else ""
    unjudged = _count(records, Outcome.UNJUDGED)
    sentence += f", {unjudged} {Outcome.UNJUDGED.shown}" if unjudged else ""
    for subject, words in (
        (REFERENCE, "suspect the reference of"),
        (STANDARD, "suspect native in"),
    ):
        names = [name for name, each in results.suspects.items() if each.subject == subject]
        sentence += f"; {words} {', '.join(names)}" if names else ""
    sentence += f"; {unread_count(unread)}" if unread else ""
    return sentence + (f"; the run ended before {missing} more" if missing else "")


def _fault(record: Record, tol: float) -> str:
    """Return the fault of a failing record, the first one of `FAULTS` that applies."""
    errors = record.errors.values()
    holds = (
        any(not each.within for each in errors),
        any(each.contradicted for each in errors),
        any(each.lost for each in errors),
        record.solved == record.samples and (record.residual_max or 0.0) > tol,
        record.solved == record.samples and bool(record.faults),
        True,
    )
    return next(what for (_, _, what), true in zip(FAULTS, holds, strict=True) if true)


def severity(case: CaseView) -> float:
    """Return the sort key of the overview: incomplete pairs first, then errors in tolerances."""
    broken = any(record.outcome in BROKEN for record in case.records)
    return 1e300 if broken else min(case.worst.ratio, 1e299) if case.worst else -1.0


def search_words(case: CaseView) -> str:
    """Return the words by which the overview finds a case."""
    words = [case.name, case.source, TRUTHS[case.truth], *(output.name for output in case.outputs)]
    words += [
        text
        for record in case.records
        for text in (record.engine, record.version or "", record.message)
    ]
    return " ".join(words).lower()


def _model(record: Record) -> dict[str, Any]:
    """Return an engine's facts on its model, without those in separate tables."""
    return {
        key: value for key, value in record.details.items() if key not in ("dof_account", "program")
    }


def _group_messages(records: Iterable[Record]) -> list[tuple[Outcome, str, str, list[str]]]:
    """Return outcome, engine and message, each with the cases that share them."""
    groups: dict[tuple[Outcome, str, str], list[str]] = {}
    for record in records:
        groups.setdefault((record.outcome, engine_name(record), record.message), []).append(
            record.case
        )
    return [(*key, cases) for key, cases in groups.items()]


def _settings(records: Sequence[Record]) -> list[tuple[str, dict[str, Any], list[str]]]:
    """Return each engine's distinct settings, with the cases that share them."""
    groups: dict[str, tuple[str, dict[str, Any], list[str]]] = {}
    for record in records:
        name = engine_name(record)
        group = groups.setdefault(f"{name} {record.settings}", (name, record.settings, []))
        group[2].append(record.case)
    return [*groups.values()]


def _count(records: Sequence[Record], *outcomes: Outcome) -> int:
    counts = Counter(record.outcome for record in records)
    return sum(counts[outcome] for outcome in outcomes)
