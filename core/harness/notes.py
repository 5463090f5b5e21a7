"""Notes on a case: what a reader of its results should know, where a file can be meant, and yet be a mistake."""

from __future__ import annotations

from .case import Case


def notes(case: Case) -> list[str]:
    """Return the notes on a case: on lengths of rods, and on the source of its reference."""
    return [*(note for joint in case.mechanism.joints for note in joint.notes), *_reference_notes(case)]


def _reference_notes(case: Case) -> list[str]:
    if not (case.reference and case.truth.validates and case.origin):
        return []
    if case.origin.own:
        return [f"judged against a reference that kincheck has made, which is no {case.truth}: no pass is called validated"]
    if not case.origin.citation:
        return [
            f"judged against an uncited reference: truth is {case.truth}, and [reference] does not say where it comes from, "
            'so that no pass is called validated; add citation = "author, title, page or address" to [reference]'
        ]
    return []
