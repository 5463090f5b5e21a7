"""Words for the table of specification limits, on the terminal and on the page."""

from __future__ import annotations

from ...errors import number_of
from ..variation.modes import Incomplete
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
    if some := incomplete(results):
        variants = number_of(some, "variant")
        lines.append(
            f"Incomplete, and left out: {variants} without all samples."
            if results.incomplete == Incomplete.IGNORE
            else f"Incomplete, and so outside: {variants} without all samples; --incomplete ignore"
            " leaves them out."
        )
        if any(each.cpk is not None for each in results.limits):
            lines.append("Cp and Cpk are of all variants with a value at the sample.")
    return lines


def incomplete(results: SweepResults) -> int:
    """Return the number of incomplete variants."""
    return max((each.incomplete for each in results.limits), default=0)


def other_yield(results: SweepResults) -> list[tuple[str, str]]:
    """Return head and attribute of the yield that is not judged; none without incomplete variants,
    as both are equal.
    """
    if not incomplete(results):
        return []
    if results.incomplete == Incomplete.IGNORE:
        return [("yield of all", "share_of_all")]
    return [("yield of complete", "share_of_complete")]


def percent(share: float | None) -> str:
    """Return a share in percent, to a ten-thousandth; a dash for None."""
    return "–" if share is None else f"{100.0 * share:.2f} %"


def interval(each: Capability) -> str:
    """Return the confidence interval of a yield as text; a dash for None."""
    if each.interval is None:
        return "–"
    low, high = each.interval
    return f"{100.0 * low:.2f} to {100.0 * high:.2f} %"
