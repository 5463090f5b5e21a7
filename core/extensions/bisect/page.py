"""The page of a search over releases."""

from __future__ import annotations

from collections.abc import Mapping

from ...errors import number_of
from ...harness.labels import against, number
from ...report.sections import Report, Section
from ...unit_text import value_text
from .results import NEITHER, UNKNOWN, Bisection, CaseChange, Change
from .signature import IDLE, TRUTHS, Signature
from .states import counts

CHANGES = ("change", "kind", "case", "curve", "before", "after", "tolerance", "right", "field")


def report(found: Bisection, states: Mapping[str, Signature | None]) -> Report:
    """Return tables of the changes and of the tried releases."""
    tables = [each for change in found.changes for each in _rows(change)]
    links = [
        f"{change.reproducer}/README.md" if change.reproducer else ""
        for change in found.changes
        for _ in change.cases
    ]
    worse = [
        each.right in (change.earlier, NEITHER)
        for change in found.changes
        for each in change.cases.values()
    ]
    first, last = found.ends
    none = f"No change between {first} and {last}." if len(found.tried) > 1 else ""
    if not found.every and none:
        none += " Changes that were undone between the ends are found with --every."
    return Report(
        "bisect",
        f"{found.engine}: {number_of(len(found.changes), 'change')} from {found.package}"
        f" {first} to {last}",
        [
            f"kincheck {found.kincheck}",
            f"{len(found.tried)} of {found.releases} releases run",
            found.command,
        ],
        [
            Section(
                "Changes",
                [*map(says, found.changes)] or [none] * bool(none),
                ["Before and after: the largest error of the curve against the truth of its case."]
                * bool(tables),
                CHANGES,
                4,
                tables,
                links=links,
                wrong=[place for place, bad in enumerate(worse) if bad],
            ),
            Section(
                "Releases",
                [],
                [],
                ("release", "cases"),
                2,
                [
                    *((name, counts(states[name] or {})) for name in found.tried),
                    *((name, f"cannot be installed: {why}") for name, why in found.reasons.items()),
                ],
            ),
        ],
    )


def _rows(change: Change) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for case, each in change.cases.items():
        curve, errors, tolerance = "", each.outcomes, ""
        if each.curves:
            worst = each.curves[0]
            curve = worst.output
            errors = tuple(value_text(number(error), worst.unit) for error in worst.errors)
            tolerance = value_text(number(worst.tolerance), worst.unit)
        name = f"{change.earlier} → {change.later}"
        rows.append(
            (name, each.kind, case, curve, *errors, tolerance, each.right, change.field or "")
        )
    return rows


def says(change: Change) -> str:
    """Return a change in a sentence or two."""
    cases = [*change.cases.values()]
    name = f"{change.earlier} → {change.later}"
    if change.kind == "interface":
        stops = cases[0].outcomes[1] in {each.value for each in IDLE}
        release = (change.earlier, change.later)[stops]
        message = " ".join(cases[0].messages[stops].split())
        return (
            f"{name}: interface changed. {release} does not run"
            f" {number_of(len(cases), 'case')}: {message}"
        )
    curves = sum(len(each.curves) for each in cases)
    text = f"{name}: result changed, {number_of(curves, 'curve')} of "
    text += f"{number_of(len(cases), 'case')}. {_verdict(change, cases)}"
    return text + (f" The first field that differs is {change.field}." if change.field else "")


def _verdict(change: Change, cases: list[CaseChange]) -> str:
    if change.right == UNKNOWN:
        return "No truth of the cases says who is right."
    standards = {
        against(curve.against) for each in cases for curve in each.curves if curve.against in TRUTHS
    }
    by = f" by {' and '.join(sorted(standards))}" if standards else ""
    right = change.right if change.right in (change.earlier, change.later) else "Neither"
    return f"{right} is right{by}."
