"""Suspicion of a standard: the engines of a case agree with each other, but not with the reference,
or most of them with each other and not with native.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from typing import TypeAlias

import numpy as np

from ...case.case import TIME, Case, Series, pace
from ...case.io.sections import sections
from ...case.units import ANGLES, LENGTHS, SECOND, Unit
from ...errors import shortened
from ...harness.compare import Curve, as_array, curve_of, deviation
from ...harness.engine import RECORDED, STANDARD
from ...harness.labels import shown_text
from ...harness.record import REFERENCE, Deviation, Deviations, Explanation, Facts, Record, Suspect
from ...harness.table_units import table_facts
from ...trajectory import QUANTITIES, Array
from ...unit_text import motion_word

# Largest number of outputs explained in a sentence; further ones are counted.
MOST_EXPLAINED = 12
ADVICE = {
    REFERENCE: "suspect the reference, the output's component or a sign",
    STANDARD: f"suspect {STANDARD}",
}
"""What to suspect, by the subject of the suspicion."""
UNEXPLAINED = (
    "no sign, unit, offset, exchanged column, reversed or shifted order of samples explains it"
)


@dataclass(frozen=True, eq=False)
class _Off:
    """A quantity of an output out of tolerance against a standard."""

    output: str
    order: int
    held: Curve
    standard: Curve
    deviation: Deviation

    @property
    def rank(self) -> tuple[int, float]:
        """Sort key: positions first, then the largest deviation in tolerances."""
        return self.order, -self.deviation.ratio


def suspect(
    case: Case, records: Sequence[Record], native: Mapping[str, Series] | None = None
) -> Suspect | None:
    """Return the suspicion of the reference, or else of native; None without one.

    Args:
        native: native's outputs, to find the slip that explains it; without them none is sought.
    """
    # a recording has the digits of its file, and is no engine that agrees with others
    mine = [r for r in records if r.case == case.name and r.solved and r.mode != RECORDED]
    return _of_reference(case, mine) or _of_native(case, mine, native or {})


def _of_reference(case: Case, mine: Sequence[Record]) -> Suspect | None:
    """Return the suspicion of a reference: the engines agree within tolerance, and the reference
    does not fit.

    A single engine agrees with no other, so a slip must explain all deviations.
    """
    whole = [record for record in mine if record.solved == record.samples]
    if not case.reference or not any(
        _against(each, case) for record in mine for each in record.errors.values()
    ):
        return None
    if not whole:
        return None
    rate_scale = pace(case)
    agreement = _agreement(case, rate_scale, whole[0], mine)
    off = sorted(_off(case, rate_scale, whole[0]), key=lambda each: each.rank)
    if agreement is None or not off:
        return None
    explained = _explain(case, rate_scale, whole[0], off)
    engines = list(dict.fromkeys(record.engine for record in mine))
    if len(engines) == 1 and (explained[1] or not explained[0]):
        return None
    agreed = agreement.get((off[0].output, off[0].order), 0.0)
    within = off[0].held.text(agreed)
    who = (
        f"{engines[0]} is the only engine that solved it"
        if len(engines) == 1
        else f"all {len(engines)} engines agree within {within}"
    )
    return _suspicion(case, REFERENCE, engines, agreed, off, explained, who)


def _of_native(case: Case, mine: Sequence[Record], native: Mapping[str, Series]) -> Suspect | None:
    """Return the suspicion of native: a majority of all engines, native among them, agree with each
    other in a quantity compared with native, and are out of tolerance there.
    """
    rate_scale = pace(case)
    found: list[tuple[_Off, Sequence[Record], int, float]] = []
    for order, quantity in enumerate(QUANTITIES):
        held = {id(each): _held(case, rate_scale, each, order) for each in mine}
        for name in (output.name for output in case.outputs):
            off: dict[int, Deviation] = {}
            compared: list[Record] = []
            for record in mine:
                each: Deviation | None = getattr(record.errors[name], quantity)
                if each is not None and each.against == STANDARD:
                    compared.append(record)
                    off |= {id(record): each} if each.max_abs > each.tolerance else {}
            astray = [(record, held[id(record)][name]) for record in compared if id(record) in off]
            group, agreed = _largest_group(astray)
            voters = _simulators(compared)
            if 2 * len(_simulators(group)) > len(voters) + 1:
                first = group[0]
                values: Array | None = getattr(native.get(name), quantity, None)
                standard = Curve(np.empty(0) if values is None else values)
                worst = _Off(name, order, held[id(first)][name], standard, off[id(first)])
                found.append((worst, group, len(voters), agreed))
    if not found:
        return None
    found.sort(key=lambda each: each[0].rank)
    worst, group, voters, agreed = found[0]
    off_too = [each for each, others, *_ in found if {*map(id, group)} <= {*map(id, others)}]
    explained: tuple[list[Explanation], list[str]] = ([], [])
    if native:
        explained = _explain(case, rate_scale, group[0], off_too)
    engines = list(dict.fromkeys(record.engine for record in group))
    who = (
        f"{len(_simulators(group))} of {voters} other engines agree with each other within"
        f" {worst.held.text(agreed)} ({', '.join(engines)})"
    )
    return _suspicion(case, STANDARD, engines, agreed, off_too, explained, who)


def _largest_group(
    astray: Sequence[tuple[Record, Curve]],
) -> tuple[Sequence[Record], float]:
    """Return the most records that agree pairwise within the sum of their tolerances, and their
    largest difference.
    """
    apart: dict[tuple[int, int], float] = {}
    for (one, (_, a)), (other, (_, b)) in combinations(enumerate(astray), 2):
        off = deviation(b, a)
        if off is not None and off.within:
            apart[one, other] = off.max_abs
    best: list[int] = []
    for first in range(len(astray)):
        group = [first]
        for other in range(first + 1, len(astray)):
            if all((one, other) in apart for one in group):
                group.append(other)
        best = max(best, group, key=lambda each: len(_simulators(astray[k][0] for k in each)))
    agreed = max((apart[pair] for pair in combinations(best, 2)), default=0.0)
    return [astray[k][0] for k in best], agreed


def _simulators(records: Iterable[Record]) -> set[str]:
    """Return the simulators of records: modes and variants (NAME-VARIANT) of one count once."""
    return {record.engine.partition("-")[0] for record in records}


def _suspicion(
    case: Case,
    subject: str,
    engines: list[str],
    agreed: float,
    off: Sequence[_Off],
    explained: tuple[list[Explanation], list[str]],
    who: str,
) -> Suspect:
    """Return the suspicion of a standard with deviations, the worst one first."""
    worst, (explanations, left) = off[0], explained
    outputs: dict[str, list[str]] = {}
    for each in off:
        outputs.setdefault(each.output, []).append(QUANTITIES[each.order])
    reasons = _reasons(table_facts(case), subject, explanations, left)
    difference = _difference(case, subject, worst)
    return Suspect(
        subject=subject,
        engines=engines,
        agreement=agreed,
        outputs=outputs,
        output=worst.output,
        quantity=QUANTITIES[worst.order],
        sample=worst.deviation.worst_step,
        difference=worst.deviation.max_abs,
        tolerance=worst.deviation.tolerance,
        unit=worst.held.unit,
        explanations=explanations,
        unexplained=left,
        message="; ".join(filter(None, [who, f"{difference}: {ADVICE[subject]}", reasons])),
    )


def _difference(case: Case, subject: str, worst: _Off) -> str:
    step = worst.deviation.worst_step
    at = (
        f"sample {step} ({case.sweep.driver} ="
        f" {_unit(case).written(float(case.sweep.values[step]))})"
    )
    off, tolerance = map(worst.held.text, (worst.deviation.max_abs, worst.deviation.tolerance))
    held = f"{motion_word(QUANTITIES[worst.order], worst.held.unit)}, tolerance {tolerance}"
    return f"{_the(subject)} differs by {off} at {at} of output {worst.output} ({held})"


def _the(subject: str) -> str:
    return f"the {subject}" if subject == REFERENCE else subject


def _unit(case: Case) -> Unit:
    """Return the unit of the swept driver, in the file of the case."""
    if case.sweep.driver == TIME:
        return SECOND
    turns = case.mechanism.driver(case.sweep.driver).turns
    return ANGLES[case.angle_unit] if turns else LENGTHS[case.length_unit]


def _reasons(
    facts: Facts, subject: str, explanations: Sequence[Explanation], left: Sequence[str]
) -> str:
    reasons: list[str] = []
    for each in explanations:
        words = ", ".join(motion_word(quantity, each.unit) for quantity in each.quantities)
        fits, within = (
            shown_text(x, each.unit, facts, ".3g") for x in (each.difference, each.tolerance)
        )
        fit = f"{_the(subject)} {each.change} fits within {fits}, tolerance {within}"
        reasons.append(f"{', '.join(each.outputs)} ({words}): {fit}")
    if left:
        reasons.append(f"{shortened(left, MOST_EXPLAINED)}: {UNEXPLAINED}")
    return "; ".join(reasons)


def _against(errors: Deviations, case: Case) -> bool:
    """Return whether any quantity of an output is out of tolerance against the reference."""
    return any(not each.within and each.against == case.truth for _, each in errors.items())


def _held(case: Case, rate_scale: float, record: Record, order: int) -> dict[str, Curve]:
    """Return the values of a record by output, with their tolerances."""
    found: dict[str, Curve] = {}
    facts = table_facts(case)
    for output in case.outputs:
        values = as_array(getattr(record.outputs[output.name], QUANTITIES[order]))
        if order < output.orders and values is not None:
            curve = curve_of(output, order, rate_scale, values)
            found[output.name] = replace(curve, facts=facts)
    return found


def _agreement(
    case: Case, rate_scale: float, first: Record, records: Sequence[Record]
) -> dict[tuple[str, int], float] | None:
    """Return the largest difference between the first engine and the others, by output and order.

    None if any difference is out of tolerance.
    """
    largest: dict[tuple[str, int], float] = {}
    for order in range(len(QUANTITIES)):
        held = _held(case, rate_scale, first, order)
        for record in records:
            for name, other in _held(case, rate_scale, record, order).items():
                if name not in held:
                    continue
                off = deviation(other, Curve(held[name].values), first.engine)
                if off is None:
                    continue
                if not off.within:
                    return None
                largest[name, order] = max(off.max_abs, largest.get((name, order), 0.0))
    return largest


def _off(case: Case, rate_scale: float, record: Record) -> Iterator[_Off]:
    """Yield the quantities out of tolerance against the reference."""
    for order, quantity in enumerate(QUANTITIES):
        for name, held in _held(case, rate_scale, record, order).items():
            reference: Array | None = getattr(case.reference.get(name), quantity, None)
            if reference is None:
                continue
            known = Curve(reference, half=case.reference[name].uncertainty.get(quantity))
            found = deviation(held, known, str(case.truth))
            if found is not None and found.max_abs > found.tolerance:
                yield _Off(name, order, held, known, found)


def _explain(
    case: Case, rate_scale: float, record: Record, off: Sequence[_Off]
) -> tuple[list[Explanation], list[str]]:
    """Return the slips that explain the deviations, merged if equal, and the unexplained outputs by
    name.
    """
    every = {order: _held(case, rate_scale, record, order) for order in range(len(QUANTITIES))}
    units = {output.name: output.unit for output in case.outputs}
    found: dict[tuple[str, tuple[str, ...]], list[tuple[str, str, Deviation]]] = {}
    left: list[str] = []
    names = list(dict.fromkeys(each.output for each in off))
    for name in names[:MOST_EXPLAINED]:
        fitting: dict[_Off, dict[str, Deviation]] = {}
        for each in (each for each in off if each.output == name):
            others = {
                other: held
                for other, held in every[each.order].items()
                if other != name and units[other] == units[name]
            }
            fitting[each] = slips(
                each.held,
                each.standard,
                others,
                offsets=each.order == 0,
                definitions=_definitions(case, each, others),
            )
        common = [
            words
            for words in next(iter(fitting.values()))
            if all(words in fits for fits in fitting.values())
        ]
        unexplained: list[str] = []
        for quantities, changes in (
            [([*fitting], common)]
            if common
            else [([each], [*fits]) for each, fits in fitting.items()]
        ):
            orders = sorted(each.order for each in quantities)
            if not changes:
                unexplained += [motion_word(QUANTITIES[order], units[name]) for order in orders]
                continue
            first = min(quantities, key=lambda each: each.order)
            key = ", or ".join(changes), tuple(QUANTITIES[order] for order in orders)
            found.setdefault(key, []).append((name, first.held.unit, fitting[first][changes[0]]))
        left += [f"{name} ({', '.join(unexplained)})"] if unexplained else []
    left += names[MOST_EXPLAINED:]
    return [_explanation(*key, members) for key, members in found.items()], left


def _definitions(case: Case, off: _Off, others: Mapping[str, Curve]) -> list[NamedChange]:
    """Return the changes from other definitions of an output, by the extension of its type."""
    values = {name: curve.values for name, curve in others.items()}
    found = (each.definitions(case, off.output, values) for each in sections())
    return [] if off.order else [*chain.from_iterable(found)]


def _explanation(
    change: str, quantities: Sequence[str], members: Sequence[tuple[str, str, Deviation]]
) -> Explanation:
    _, unit, worst = max(members, key=lambda each: each[2].ratio)
    return Explanation(
        outputs=[name for name, _, _ in members],
        quantities=list(quantities),
        change=change,
        difference=worst.max_abs,
        tolerance=worst.tolerance,
        unit=unit,
    )


# Fewest samples: two samples fit too many changes.
FEWEST = 3
# Smallest size of a series' values, or of their changes, in tolerances: a smaller one also fits too
# many changes.
MEANINGFUL = 10.0
OTHER_SIGN = "with the other sign"
FACTORS: Mapping[str, float] = {
    "1000": 1e3,
    "1/1000": 1e-3,
    "100": 1e2,
    "1/100": 1e-2,
    "10": 10.0,
    "1/10": 0.1,
    "1e6": 1e6,
    "1e-6": 1e-6,
    "180/pi": 180.0 / math.pi,
    "pi/180": math.pi / 180.0,
    "25.4": 25.4,
    "1/25.4": 1.0 / 25.4,
    "0.0254": 0.0254,
    "1/0.0254": 1.0 / 0.0254,
    "0.3048": 0.3048,
    "1/0.3048": 1.0 / 0.3048,
    "2": 2.0,
    "1/2": 0.5,
}
"""Factors between units of length and of angle, percent and fractions, half and whole, by their
names in messages.
"""


NamedChange: TypeAlias = tuple[str, Callable[[Array], Array]]
"""A change in words, and its function of the reference's values."""


def slips(
    held: Curve,
    reference: Curve,
    others: Mapping[str, Curve],
    *,
    offsets: bool = True,
    definitions: Sequence[NamedChange] = (),
) -> dict[str, Deviation]:
    """Return all single changes that make the reference fit, with the remaining deviation, in
    words after "the reference"; without any, all pairs of changes.

    Args:
        held: the agreed values of the engines.
        reference: reference of the same output, out of tolerance.
        others: values of the other outputs, by name, which the reference may hold by mistake.
        offsets: whether a constant may be added; False for derivatives.
        definitions: changes from other definitions of the output to the engines' definition.
    """
    scales = [
        (OTHER_SIGN, _times(-1.0)),
        *((f"times {name}", _times(factor)) for name, factor in FACTORS.items()),
    ]
    found = (
        _find_fits(held, reference, definitions)
        | _find_fits(held, reference, scales, constant=True)
        | _find_fits(held, reference, _moves(held, reference, offsets))
        | _find_exchanged(reference, others, "")
    )
    if found:
        return found
    both = [(f"{OTHER_SIGN} and times {name}", _times(-factor)) for name, factor in FACTORS.items()]
    found = _find_fits(held, reference, both, constant=True)
    for words, change in scales:
        changed = reference.changed(change)
        found |= _find_fits(held, changed, definitions, f"{words} and ")
        found |= _find_fits(held, changed, _moves(held, changed, offsets), f"{words} and ")
    return found | _find_exchanged(reference.changed(_times(-1.0)), others, f"{OTHER_SIGN} ")


def _times(factor: float) -> Callable[[Array], Array]:
    return lambda x: factor * x


def _moves(held: Curve, reference: Curve, offsets: bool) -> list[NamedChange]:
    gap = np.full(1, np.nan)
    found: list[NamedChange] = [
        ("with its samples in reversed order", lambda x: x[::-1]),
        (
            "shifted by one sample, each taken from the next",
            lambda x: np.concatenate([x[1:], gap]),
        ),
        (
            "shifted by one sample, each taken from the one before",
            lambda x: np.concatenate([gap, x[:-1]]),
        ),
    ]
    off = held.values - reference.values
    known = np.isfinite(off)
    if offsets and known.any():
        constant = 0.5 * float(off[known].max() + off[known].min())
        size = held.text(abs(constant), ".9g")
        found.insert(0, (f"{'plus' if constant > 0 else 'minus'} {size}", lambda x: x + constant))
    return found


def _find_fits(
    held: Curve,
    reference: Curve,
    changes: Sequence[NamedChange],
    before: str = "",
    *,
    constant: bool = False,
) -> dict[str, Deviation]:
    """Return the changes after which the reference fits, with these words before.

    Args:
        constant: whether a constant series is significant, unless all its values are zero.
    """
    found: dict[str, Deviation] = {}
    for words, change in changes:
        changed = reference.changed(change)
        both = np.isfinite(held.values) & np.isfinite(changed.values)
        if both.sum() < FEWEST:
            continue
        off = deviation(held, changed)
        if off is None or not off.within:
            continue
        values = held.values[both]
        if (np.abs(values).max() if constant else np.ptp(values)) > MEANINGFUL * off.tolerance:
            found[before + words] = off
    return found


def _find_exchanged(
    reference: Curve, others: Mapping[str, Curve], before: str
) -> dict[str, Deviation]:
    """Return the other outputs that agree with the reference, if the reference varies."""
    found: dict[str, Deviation] = {}
    for name, other in others.items():
        same: list[NamedChange] = [(f"taken as that of output {name}", lambda x: x)]
        found |= _find_fits(other, reference, same, before)
    return found
