"""Slow drift: errors grow by less than a digit per night, but by more than a digit over many
nights.

Neither steps nor the comparison with the last night show it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...harness.labels import motion_unit, number
from ...trajectory import QUANTITIES
from ...unit_text import motion_word, value_text
from ..queries import History
from .change_points import above_floor, errors_of
from .findings import Finding, Kind
from .run_selection import Subject
from .segmentation import change_points
from .thresholds import DRIFT, drifted


def crept(subject: Subject, around: History, findings: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the subject's errors that are a digit above the least error since their last step, with
    the same tolerance and standard.

    Args:
        findings: the findings on the subject so far.
    """
    known = {
        (each.case, each.engine, each.mode, each.output, each.motion)
        for each in findings
        if each.kind is Kind.DRIFTED
    }
    for record in subject.results.records:
        pair = record.case, record.engine, record.mode
        entries = [entry for entry in around.pairs.get(pair, ()) if entry.run != subject.number]
        for output, motion in (
            (output, motion) for output in record.errors for motion in QUANTITIES
        ):
            now = getattr(record.errors[output], motion)
            if now is None or not now.within or (*pair, output, motion) in known:
                continue
            errors = [
                (entry, each)
                for entry, each in errors_of(entries, output, motion)
                if each.tolerance == now.tolerance
            ]
            errors = [(entry, each) for entry, each in errors if each.against == now.against]
            places = (
                change_points(np.log(above_floor(errors)), least=math.log(DRIFT), lasting=1)
                if errors
                else []
            )
            level = errors[places[-1] if places else 0 :]
            if not level:
                continue
            entry, least = min(level, key=lambda each: (each[1].max_abs, -each[0].run))
            if drifted(least.max_abs, now.max_abs, now.tolerance):
                unit = (
                    motion_unit(record.outputs[output].unit, motion)
                    if output in record.outputs
                    else ""
                )
                size = f"{number(least.max_abs)} → {value_text(number(now.max_abs), unit)}"
                yield Finding(
                    kind=Kind.DRIFTED,
                    case=record.case,
                    engine=record.engine,
                    mode=record.mode,
                    message=(
                        f"{output} {motion_word(motion, unit)} error {size}, gradually "
                        f"since run {entry.run} "
                        f"(tolerance {number(now.tolerance)})"
                    ),
                    output=output,
                    motion=motion,
                    before=least.max_abs,
                    now=now.max_abs,
                    ratio=now.max_abs / least.max_abs if least.max_abs else None,
                    limit=DRIFT,
                )
