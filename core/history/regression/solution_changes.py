"""Changes of a pair's solution between two runs besides errors and times: degrees of freedom, rank,
residual, units, and missing values.
"""

from __future__ import annotations

from collections.abc import Iterator

from ...harness.labels import number
from ...harness.record import Record
from ...trajectory import QUANTITIES
from ...unit_text import motion_word
from .compare import by_pair, same_samples, values_of
from .findings import Finding, Kind, finding_of
from .run_selection import Subject
from .thresholds import RESIDUAL, RESIDUAL_FLOOR


def differing(now: Subject, before: Subject) -> Iterator[Finding]:
    """Yield the changes of pairs solved in both runs, in the order of the records."""
    earlier = by_pair(before.results.records)
    for pair, record in by_pair(now.results.records).items():
        old = earlier.get(pair)
        if old is not None and old.solved and record.solved:
            yield from _numbers(record, old)
            yield from _residual(record, old)
            yield from _units(record, old)
            yield from _gone(record, old)


def _numbers(now: Record, before: Record) -> Iterator[Finding]:
    """Yield changes of dof and rank, and numbers that are null now."""
    for name, kind in (("dof", Kind.FREEDOM), ("rank", Kind.RANK)):
        old, new = getattr(before, name), getattr(now, name)
        if None not in (old, new) and new != old:
            yield finding_of(kind, now, f"{name} {old} → {new}", before=float(old), now=float(new))
    for name in ("dof", "rank", "residual_max"):
        if getattr(before, name) is not None and getattr(now, name) is None:
            why = now.reasons.get(name) or "no reason is given"
            yield finding_of(
                Kind.GONE,
                now,
                f"{name} has no value now, {number(getattr(before, name))} before: {why}",
            )


def _residual(now: Record, before: Record) -> Iterator[Finding]:
    old, new = before.residual_max, now.residual_max
    if old is None or new is None or new < RESIDUAL * max(old, RESIDUAL_FLOOR):
        return
    ratio = new / old if old else None
    times = f" (×{number(ratio)})" if ratio else ""
    message = f"largest residual {number(old)} → {number(new)}{times}"
    yield finding_of(Kind.RESIDUAL, now, message, before=old, now=new, ratio=ratio, limit=RESIDUAL)


def _units(now: Record, before: Record) -> Iterator[Finding]:
    """Yield outputs with a changed unit or positive sense."""
    for output, old in before.outputs.items():
        new = now.outputs.get(output)
        for what in ("unit", "sense"):
            a, b = getattr(old, what), getattr(new, what, None)
            if new is not None and a != b:
                yield finding_of(
                    Kind.UNIT, now, f"{output}: {what} {a or 'none'} → {b or 'none'}", output=output
                )


def _gone(now: Record, before: Record) -> Iterator[Finding]:
    """Yield motions of outputs with null in place of earlier numbers, unless another finding
    reports it.
    """
    if not same_samples(now, before):
        return
    unsolved = _unsolved(now) if (now.solved or 0) < (before.solved or 0) else set[int]()
    for output, old in before.outputs.items():
        new = now.outputs.get(output)
        for motion in QUANTITIES:
            judged = getattr(before.errors.get(output), motion, None)
            if judged is not None and getattr(now.errors.get(output), motion, None) is None:
                continue  # no longer compared, which another finding reports
            there, here = values_of(old, motion), values_of(new, motion)
            had = [k for k, value in enumerate(there) if value is not None]
            lost = [k for k in had if (k >= len(here) or here[k] is None) and k not in unsolved]
            if lost:
                at = [
                    f"{name} = {number(values[lost[0]])}"
                    for name, values in now.driver.items()
                    if lost[0] < len(values)
                ]
                first = at[0] if at else f"sample {lost[0]}"
                why = (
                    "the case has no such output now"
                    if new is None
                    else new.reason or "no reason is given"
                )
                word = motion_word(motion, old.unit)
                message = (
                    f"{output} {word} has no value at {len(lost)} of {len(had)} samples that had"
                    f" one, first at {first}: {why}"
                )
                yield finding_of(Kind.GONE, now, message, output=output, motion=motion)


def _unsolved(record: Record) -> set[int]:
    """Return the samples at which no output has a position; another finding reports unsolved
    samples.
    """
    count = max((len(output.position) for output in record.outputs.values()), default=0)
    series = [output.position for output in record.outputs.values()]
    return {k for k in range(count) if all(k >= len(each) or each[k] is None for each in series)}
