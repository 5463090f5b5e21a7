"""Slips behind recorded outputs out of tolerance: of single outputs, or a driver counted from
another zero, the other way or in another unit. They are named, and never applied.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ...case.case import TIME, Case, Quantity, Series, Sweep
from ...case.io.reference_samples import RATES
from ...case.units import LENGTHS
from ...errors import shortened
from ...harness.compare import Curve, curve_of, deviation
from ...trajectory import Array
from ...unit_text import value_text
from ..suspects.suspects import FACTORS, OTHER_SIGN, slips
from .meaning import MAP

# Places of the driver's zero that are tried, and samples of the curves to try them on: far denser
# than any wave of a mechanism's output.
_ZEROS, _DENSE = 181, 721
_TRIED = 4
# Newton from a zero within a grid step: the digits double each time.
_STEPS = 8
_NAMED = 3
_UNITS: Mapping[str, Mapping[str, float]] = {
    "rad": {"rad": 1.0, "deg": math.pi / 180.0},
    "m": {name: LENGTHS[name].size for name in ("m", "mm", "cm", "inch")},
    "s": {"s": 1.0, "ms": 1e-3},
}

Solve = Callable[[Sweep, Sequence[Quantity]], Mapping[str, Series]]
"""Returns these outputs of the native engine on a sweep."""


@dataclass(frozen=True)
class Stated:
    """How a quantity is taken from a column: sign * column + offset [SI].

    Attributes:
        unit, size: unit of the column, and its size in SI.
        si: SI unit of the quantity.
    """

    column: str
    sign: float
    offset: float
    unit: str
    size: float
    si: str


@dataclass(frozen=True, eq=False)
class _Off:
    """An output out of tolerance, the right curve, and whether it has a column."""

    output: Quantity
    values: Array
    half: Array
    true: Array
    column: bool

    @property
    def held(self) -> Curve:
        return curve_of(self.output, 0, 1.0, self.true)

    def fits(self, left: Array) -> bool:
        off = replace(self.held, values=self.true + left, half=self.half)
        found = deviation(off, Curve(self.true))
        return found is None or found.within

    def left(self, curve: Array, sign: float) -> Array:
        """Return the differences from a curve, those of whole turns taken out."""
        found: Array = self.values - sign * curve
        known: Array = found[np.isfinite(found)]
        period = self.output.period
        if not period or not known.size:
            return found
        start = float(known[0])
        return found - period * np.round((found - start) / period)


def explain_slips(
    case: Case,
    found: Mapping[str, Series],
    columns: Mapping[str, Array],
    standard: Mapping[str, Series],
    stated: Mapping[str, Stated],
    lead: str,
    sweep: Sweep,
    solve: Solve,
) -> list[str]:
    """Return sentences on the slips behind outputs out of tolerance; none if all are within.

    Args:
        columns: outputs as their columns give them, before whole turns are taken out.
        standard: the outputs as they should be, by the reference or else the native engine.
        stated: columns of time, drivers and outputs, by name.
        lead: time or the driver whose column gives the values of the sweep; empty for none.
    """
    zero = np.zeros(len(sweep.values))
    every = [
        _Off(
            output,
            found[output.name].position,
            found[output.name].uncertainty.get("position", zero),
            standard[output.name].position,
            output.name in stated,
        )
        for output in case.outputs
        if output.name in standard and found[output.name].possible
    ]
    off = [each for each in every if not each.fits(each.values - each.true)]
    held = {each.output.name: each.held for each in every}
    known = dict[str, list[tuple[str, str]]]()
    maps = dict[str, list[str]]()
    for each in off:
        name = each.output.name
        others = {key: other for key, other in held.items() if key != name}
        for values in (each.values, columns.get(name, each.values)):
            if changes := slips(each.held, Curve(values, half=each.half), others):
                words = " or ".join([*changes][:_NAMED])
                remaining = next(iter(changes.values())).max_abs
                left = value_text(f"{remaining:.2g}", each.output.unit)
                known.setdefault(words, []).append((name, left))
                maps.setdefault(words, []).extend(_stating(next(iter(changes)), name, stated))
                break
    # bodies or columns exchanged leave a sentence for each output
    most = list(known.items())[:_NAMED]
    sentences = [
        f"{shortened([name for name, _ in names], _NAMED)}: the recording {words} leaves"
        f" {names[0][1]}" + f". If it is meant, say {' '.join(maps[words])}" * bool(maps[words])
        for words, names in most
    ]
    all_known = sum(map(len, known.values())) == len(off)
    if not off or lead not in stated:
        return sentences
    change = _Change(off, stated, lead, sweep, solve, not all_known)
    turns = sweep.driver != TIME and case.mechanism.driver(sweep.driver).turns
    phrases = dict.fromkeys(change.phrases(turns=turns))
    readings = sorted(phrases, key=lambda text: (text.count(MAP), len(text)))  # the simplest first
    if not readings:
        return sentences
    return [*sentences * all_known, f"{' or '.join(readings[:_NAMED])}: say so if it is meant"]


@dataclass(frozen=True, eq=False)
class _Change:
    """A change of a driver, factor * value + zero.

    Attributes:
        free: whether outputs with a column may also have the other sign and another zero.
    """

    off: Sequence[_Off]
    stated: Mapping[str, Stated]
    lead: str
    sweep: Sweep
    solve: Solve
    free: bool

    def phrases(self, *, turns: bool) -> Iterator[str]:
        """Yield phrases on a zero, sign and unit of the driver with all outputs in tolerance.

        Args:
            turns: whether the sweep's driver is an angle.
        """
        own, x = self.stated[self.lead], self.sweep.values
        if len(x) < _TRIED or not np.ptp(x):
            return
        reach = math.pi if turns else float(np.ptp(x))
        for unit, size in {own.unit: own.size, **_UNITS.get(own.si, {})}.items():
            for sign in (1.0,) if self.lead == TIME else (1.0, -1.0):
                factor = sign * size / own.size
                zeros = [0.0]
                if size == own.size:
                    if unit != own.unit:
                        continue
                    zeros = self._zeros(factor * x, reach)
                for zero in zeros:
                    if found := self.refine_zero(unit, factor, zero, reach * max(1.0, abs(factor))):
                        yield found

    def _zeros(self, x: Array, reach: float) -> list[float]:
        """Return zeros of a driver of these values that leave less than those beside them, the best
        first.
        """
        grid = np.linspace(-reach, reach, _ZEROS)
        dense = np.linspace(float(x.min()) - reach, float(x.max()) + reach, _DENSE)
        curves = self.curves(dense)
        left = [self.left(curves, dense, x + zero) for zero in grid.tolist()]
        around = [math.inf, *left, math.inf]
        lowest = [k for k, each in enumerate(left) if math.inf > each <= min(around[k : k + 3])]
        best = sorted(lowest, key=left.__getitem__)
        return [float(grid[k]) for k in best[:_TRIED]]

    def curves(self, values: Array) -> Mapping[str, Series]:
        """Return the outputs that are off at other values of the driver."""
        outputs = [each.output for each in self.off]
        return self.solve(replace(self.sweep, values=values), outputs)

    def left(self, curves: Mapping[str, Series], dense: Array, at: Array) -> float:
        """Return the rest of all outputs at values between those of curves, in their ranges."""
        total = 0.0
        for each in self.off:
            if each.output.name not in curves:
                return math.inf
            curve = np.interp(at, dense, curves[each.output.name].position)
            total += self._better_sign(each, curve)[1] / (float(np.ptp(each.values)) or 1.0)
        return float(np.nan_to_num(total, nan=np.inf))

    def _better_sign(self, each: _Off, curve: Array) -> tuple[float, float]:
        """Return the better sign of an output for a curve, and its rest."""
        free = self.free and each.column
        sizes = {
            sign: float(np.ptp(left) if free else np.abs(left).max())
            for sign in ((1.0, -1.0) if free else (1.0,))
            for left in (each.left(curve, sign),)
        }
        sign = min(sizes, key=lambda k: float(np.nan_to_num(sizes[k], nan=np.inf)))
        return sign, sizes[sign]

    def refine_zero(self, unit: str, factor: float, first: float, reach: float) -> str:
        """Return a phrase on the best zero within reach of the first, by Newton on exact curves;
        empty if an output is still out of tolerance.
        """
        zero = first
        for _ in range(_STEPS):
            # outputs that no motion has would send it thousands of turns away
            rest = self._rests(factor, zero) if abs(zero - first) <= reach else None
            if rest is None:
                return ""
            if all(each.fits(left - offset) for each, _, offset, left, _ in rest):
                return self._phrase(unit, factor, zero)
            slopes = [slope - slope.mean() * bool(offset) for *_, offset, _, slope in rest]
            row = np.concatenate(slopes)
            right = np.concatenate([left - offset for _, _, offset, left, _ in rest])
            zero += self.sweep.rate * float(row @ right) / (float(row @ row) or 1.0)
        return ""

    def _rests(
        self, factor: float, zero: float
    ) -> list[tuple[_Off, float, float, Array, Array]] | None:
        """Return of each output its sign, its offset, its rest before the offset, and its rate;
        None if unknown.
        """
        curves = self.curves(factor * self.sweep.values + zero)
        rest = list[tuple[_Off, float, float, Array, Array]]()
        for each in self.off:
            curve = curves.get(each.output.name)
            if curve is None or curve.velocity is None or not np.isfinite(curve.position).all():
                return None
            sign, _ = self._better_sign(each, curve.position)
            left = each.left(curve.position, sign)
            offset = 0.5 * float(left.max() + left.min()) if self.free and each.column else 0.0
            rest.append((each, sign, offset, left, sign * curve.velocity))
        return rest

    def _phrase(self, unit: str, factor: float, zero: float) -> str:
        """Return the options for a change, by the shortest sufficient numbers."""
        own, sweep = self.stated[self.lead], self.sweep
        rate = sweep.rate if self.lead == TIME != sweep.driver else 1.0
        size = own.size * abs(factor)
        exact = (factor * own.offset + zero / rate) / size
        turn = 2.0 * math.pi / size
        # the angle of a driver without its whole turns, if they do not matter
        places = [math.remainder(exact, turn)] * (own.si == "rad") + [exact]
        for offset, decimals in product(dict.fromkeys(places), range(13)):
            short = round(offset, decimals)
            rest = self._rests(factor, rate * (short * size - factor * own.offset))
            if rest is None:
                continue
            maps = [_map(own, self.lead, factor * own.sign, short, unit)]
            if short and unit != own.unit:  # a unit beside an offset is that of the offset
                maps = [f"column {own.column} in {unit} and", *maps]
            fits, largest = True, (0.0, "")
            for each, sign, middle, left, _ in rest:
                total = 0.0
                if self.free and each.column:
                    column = self.stated[each.output.name]
                    # the recorded values are sign * curve + middle
                    moved = sign * (column.offset - middle) / column.size
                    total = round(moved, decimals)
                    middle = column.offset - sign * total * column.size
                    if sign < 0.0 or total != column.offset / column.size:
                        part = each.output.name, sign * column.sign, total, column.unit
                        maps.append(_map(column, *part))
                    for key in (f"{each.output.name}{ending}" for ending in RATES if ending):
                        if sign < 0.0 and (own_rate := self.stated.get(key)):
                            maps.append(_map(own_rate, key, -own_rate.sign, 0.0, own_rate.unit))
                fits = fits and each.fits(left - middle)
                largest = max(largest, (float(np.abs(left - middle).max()), each.output.unit))
            if fits:
                leaves = value_text(f"{largest[0]:.2g}", largest[1])
                return f"read with {' '.join(maps)} the recording leaves {leaves}"
        return ""


def _stating(words: str, name: str, stated: Mapping[str, Stated]) -> list[str]:
    """Return the option that states a slip of an output with a column of its own; none for a slip
    that no option states, such as samples that are one late.
    """
    if (own := stated.get(name)) is None:
        return []
    sign, offset = own.sign, own.offset / own.size
    if words.startswith(OTHER_SIGN):
        sign, offset = -sign, -offset
        words = words.removeprefix(OTHER_SIGN).removeprefix(" and ")
        if not words:
            return [_map(own, name, sign, offset, own.unit)]
        if not words.startswith("times "):
            return []
    first, number, *_ = f"{words} -".split()
    if first in ("plus", "minus") and " and " not in words:
        added = float(number) / own.size * (1.0 if first == "plus" else -1.0)
        return [_map(own, name, sign, offset + added, own.unit)]
    size = own.size * FACTORS.get(words.removeprefix("times "), math.nan)
    units = [unit for unit, each in _UNITS.get(own.si, {}).items() if math.isclose(each, size)]
    return [_map(own, name, sign, offset, unit) for unit in units]


def _map(stated: Stated, name: str, sign: float, offset: float, unit: str) -> str:
    number = f"{offset:+.12g}" if offset else ""
    return f'{MAP} "{name}={"-" if sign < 0.0 else ""}{stated.column}{number} [{unit}]"'
