"""Tolerances to tighten: in no run does an engine come near them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..queries import History
from .findings import Loose
from .thresholds import HEADROOM, LOOSE, SEEN


def loose(history: History, cases: Mapping[str, Any]) -> list[Loose]:
    """Return the outputs whose errors stayed far below their tolerances in all runs, by case.

    Args:
        cases: the facts of each case from a run's circumstances, for the reasons of its tolerances.
    """
    largest: dict[tuple[str, str], float] = {}
    runs: dict[tuple[str, str], set[int]] = {}
    for (case, _, _), entries in history.pairs.items():
        for entry in entries:
            for output, deviations in entry.errors.items():
                for _, each in deviations.items():
                    ratio = each.max_abs / each.tolerance if each.tolerance else 1.0
                    largest[case, output] = max(ratio, largest.get((case, output), 0.0))
                    runs.setdefault((case, output), set()).add(entry.run)
    return [
        Loose(
            case=case,
            output=output,
            runs=len(runs[case, output]),
            largest=ratio,
            factor=1.0 / (HEADROOM * ratio) if ratio else None,
            why=str(_facts(cases, case, output).get("why", "")),
        )
        for (case, output), ratio in sorted(largest.items())
        if ratio * LOOSE < 1.0 and len(runs[case, output]) >= SEEN
    ]


def _facts(cases: Mapping[str, Any], case: str, output: str) -> Mapping[str, Any]:
    return cases.get(case, {}).get("outputs", {}).get(output, {})
