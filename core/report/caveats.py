"""The limits of a run's evidence, from the facts of its records."""

from __future__ import annotations

from collections.abc import Callable

from ..case.case import Truth
from ..harness.labels import engine_name, named, notes, product
from ..harness.record import Outcome, Record, Results
from .axis import SAMPLES

ANSWERED = (Outcome.PASS, Outcome.FAIL, Outcome.UNJUDGED)
"""Outcomes of pairs with an answer."""


def caveats(results: Results) -> list[tuple[str, str]]:
    """Return each limit of the run as a title and a sentence."""
    records = results.records
    limits: list[tuple[str, str]] = []

    def add(title: str, text: str) -> None:
        limits.append((title, text))

    def cases(holds: Callable[[Record], bool]) -> str:
        return named([*dict.fromkeys(record.case for record in records if holds(record))])

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
        add(f"Note on {case}", f"{note[:1].upper()}{note[1:]}.")
    for outcome in Outcome:
        pairs = [_pair(record) for record in records if record.outcome is outcome]
        if pairs and outcome not in ANSWERED:
            add(
                f"{outcome.shown.capitalize()}: {len(pairs)}",
                f"There are no results for {named(pairs, '; ')}.",
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
            f"The run ended before them. There are no results for {named(pairs, '; ')}.",
        )
    for record in records:
        if (
            record.solved is not None
            and record.samples is not None
            and record.solved < record.samples
        ):
            add(
                _pair(record),
                f"{record.solved} of {record.samples} samples were solved; the others have no"
                " results.",
            )
    for reason, pairs in _uncompared(results).items():
        add(f"Not judged: {named(pairs)}", reason)
    if len({record.mode for record in records if record.outcome in ANSWERED}) > 1:
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


def _uncompared(results: Results) -> dict[str, list[str]]:
    reasons: dict[str, list[str]] = {}
    for record in results.records:
        if record.outcome not in ANSWERED:
            continue
        for reason in dict.fromkeys(
            errors.reason for errors in record.errors.values() if errors.reason
        ):
            reasons.setdefault(reason, []).append(_pair(record))
    return reasons
