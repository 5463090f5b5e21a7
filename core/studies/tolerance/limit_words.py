"""Words for the table of specification limits, on the terminal and on the page."""

from __future__ import annotations

from .conformance import Capability
from .results import SweepResults


def limit_notes(results: SweepResults) -> list[str]:
    """Return the assumptions of the table of limits, a line each."""
    lines = ["A variant counts as inside if it is inside the limits at every sample."]
    if any(each.cpk is not None for each in results.limits):
        lines.append(
            "Cp and Cpk assume a normal distribution; the last column does not. Each index is the"
            " smallest over the samples."
        )
    if any(each.interval for each in results.limits) and results.sampling != "random":
        lines.append(
            f"The confidence interval assumes independent variants; for {results.sampling}"
            " sampling it is usually too wide."
        )
    if unknown := max((each.unknown for each in results.limits), default=0):
        lines.append(
            f"{unknown} variants with missing samples are neither inside nor outside, and do not"
            " count in the yield."
        )
    return lines


def percent(share: float | None) -> str:
    """Return a share in percent, to a ten-thousandth; a dash for None."""
    return "–" if share is None else f"{100.0 * share:.2f} %"


def interval(each: Capability) -> str:
    """Return the confidence interval of a yield as text; a dash for None."""
    if each.interval is None:
        return "–"
    low, high = each.interval
    return f"{100.0 * low:.2f} to {100.0 * high:.2f} %"
