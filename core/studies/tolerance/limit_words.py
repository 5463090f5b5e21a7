"""Words for the table of specification limits, on the terminal and on the page."""

from __future__ import annotations

from .conformance import Capability
from .results import SweepResults


def limit_notes(results: SweepResults) -> list[str]:
    """Return the assumptions of the table of limits, a line each."""
    lines = ["A variant counts as inside if it is inside the limits at every sample."]
    if any(each.cpk is not None for each in results.limits):
        lines.append(
            "Cp and Cpk suppose a normal distribution, the last column does not; of each, the least"
            " over the samples counts."
        )
    if any(each.interval for each in results.limits) and results.sampling != "random":
        lines.append(
            f"The interval supposes independent variants; with {results.sampling} sampling it is"
            " mostly wider than it need be."
        )
    if unknown := max((each.unknown for each in results.limits), default=0):
        lines.append(
            f"{unknown} variants with missing samples are neither inside nor outside; the yield"
            " leaves them out."
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
