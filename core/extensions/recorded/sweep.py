"""The case at the samples of a recording: its drivers follow recorded columns, recorded poses, or
their own motion at the recorded times. Nothing that is compared is interpolated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...case.case import TIME, Case, Series, Sweep, Truth
from ...case.curves import match_rows
from ...case.io.document import fault, shown
from ...case.io.reference_samples import RATES
from ...case.io.schema import MOST_SAMPLES
from ...mechanism.motions import Absolute, JointDriver, Motion, Table
from ...trajectory import Array
from ..residuals.replay import TURN, begun_turns
from .meaning import MAP
from .samples import Samples, driver_motion

# Twelve digits of a driver value: a smaller error moves no output by as much as a tolerance.
SAME = 1e-12


# Solving takes some milliseconds a turn, and is done for each digit and slip.
MOST_TURNS = 10_000


@dataclass(frozen=True)
class Followed(Motion):
    """A recorded motion: its values and rates at the samples; between them a smooth curve."""

    times: tuple[float, ...]
    motion: tuple[tuple[float, float, float], ...]

    @property
    def span(self) -> tuple[float, float]:
        """First and last time."""
        return self.times[0], self.times[-1]

    @cached_property
    def _curve(self) -> Any:
        splines: Any = import_module("scipy.interpolate")  # slow to import
        return splines.BPoly.from_derivatives(self.times, self.motion)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        return self._curve(t), self._curve(t, 1), self._curve(t, 2)


@dataclass(frozen=True, eq=False)
class Drive:
    """The recorded motion of a driver, from design.

    Attributes:
        orders: value, rate and acceleration, (n,) each; the value alone if the rates are unknown.
        halves: by how much the digits move each.
        source: in words.
    """

    orders: Sequence[Array]
    halves: Sequence[Array]
    source: str


@dataclass(frozen=True, eq=False)
class Resampled:
    """A case at the samples of a recording.

    Attributes:
        rated: whether rates of outputs can be compared: those of the drivers are known.
        variants: sweeps after a recorded number of time or a driver is moved by half its last
            digit.
        lead: time or the only driver, if a column gives its values; empty for none.
        values: these values as a sweep, which tells positions alone.
    """

    case: Case
    rated: bool
    variants: Sequence[Sweep]
    notes: Sequence[str]
    lead: str
    values: Sweep


def at_own_samples(case: Case) -> Resampled:
    """Return a case at its own samples."""
    return Resampled(case, True, (), (), "", case.sweep)


def at_samples(case: Case, samples: Samples) -> Resampled:
    """Return a case at the samples of a recording.

    Raises:
        CaseError: neither time nor the swept driver is recorded, there are too many samples, or
            times do not increase.
    """
    file, sweep = samples.recording.file, case.sweep
    if samples.count > MOST_SAMPLES:
        problem = f"found {samples.count} samples, expected {MOST_SAMPLES} at most"
        raise fault(file, "", f"{problem}. Thin them out")
    time, timed = samples.time, sweep.driver == TIME
    names = [driver.name for driver in case.mechanism.drivers]
    stated = any(name in samples.numbers for name in names)
    # motions over time are followed at the recorded times; a sweep has no time of its own
    own = timed and time is not None and not stated
    followed = {} if own else _drives(case, samples)
    lead = next(iter(followed), TIME) if timed else sweep.driver
    for name, each in followed.items():
        turns = float(np.abs(np.diff(each.orders[0])).sum()) / TURN
        if case.mechanism.driver(name).turns and turns > MOST_TURNS:
            problem = f"driver {name} turns {turns:.3g} times, expected {MOST_TURNS} at most"
            raise fault(file, "", f'{problem}. Correct its unit by {MAP} "{name}=COLUMN [UNIT]"')
    notes = [f"{file}: driver {name} {each.source}" for name, each in followed.items()]
    if time is not None and lead not in followed:
        rate = 1.0 if timed else sweep.rate
        start, words = sweep.design, ""
        if not timed and float(time.values.min()) >= 0.0 and sweep.values[0] != sweep.design:
            start, words = float(sweep.values[0]), ", counted from the start of the sweep"
        found = replace(sweep, values=start + rate * time.values)
        notes.append(f"{file}: drivers at the recorded times{words}")
        moved = replace(found, values=found.values + rate * time.half)
        return _with_sweep(Resampled(case, True, [moved], notes, TIME, found), found)
    if lead not in followed:
        problem = f"found no motion of a driver, expected time, the driver {lead}, or the poses"
        raise fault(file, "", f'{problem} of its bodies. Say {MAP} "{lead}=COLUMN"')
    drive, alone = followed[lead], len(followed) == 1
    rates = alone and not timed and _at_own_rate(drive, time, sweep.rate)
    column = lead if alone and lead in samples.numbers else ""
    design = case.mechanism.design_value(lead)
    motions = {name: each for name, each in sweep.motions.items() if name != lead}
    values = Sweep(lead, design + drive.orders[0], 1.0 if timed else sweep.rate, design, motions)
    if alone and (time is None or rates or samples.count == 1):
        moved = [replace(values, values=values.values + drive.halves[0])]
        rated = not timed and (rates or time is None)
        return _with_sweep(Resampled(case, rated, moved, notes, column, values), values)
    lacking = [] if timed else [name for name in sweep.motions if name not in followed]
    if lacking:
        problem = f"found no motion of the driver {lacking[0]}, expected that of all"
        raise fault(file, "", f'{problem}. Say {MAP} "{lacking[0]}=COLUMN"')
    times = np.arange(float(samples.count)) if time is None else time.values
    if samples.count < 2 or not (np.diff(times) > 0.0).all():
        expected = "expected several, in order of time, where drivers follow the recording"
        raise fault(file, "", f"found samples whose time does not increase, {expected}. Sort them")
    rated = time is not None and all(len(each.orders) == 3 for each in followed.values())
    found = Sweep(TIME, times, motions=_motions(case, times, followed, {}))
    variants = [
        replace(found, motions=_motions(case, times, followed, {name: order}))
        for name, each in followed.items()
        for order in range(len(each.orders))
    ]
    return _with_sweep(Resampled(case, rated, variants, notes, column, values), found)


def _drives(case: Case, samples: Samples) -> dict[str, Drive]:
    """Return the recorded motions of drivers, of columns or else of poses."""
    found = dict[str, Drive]()
    begun = begun_turns(case.mechanism, samples.motions)
    for driver in case.mechanism.drivers:
        columns = [samples.numbers.get(driver.name + ending) for ending in RATES]
        known = [each for each in columns if each is not None]
        if columns[0] is not None:
            known = known if len(known) == 3 else known[:1]
            design = case.mechanism.design_value(driver.name)
            values = [known[0].values - design, *(each.values for each in known[1:])]
            source = f"is column {shown(known[0].head.name)}"
            if driver.turns and driver.name == case.sweep.driver:
                source += _turns_off(known[0].values, case.sweep.values)
            found[driver.name] = Drive(values, [c.half for c in known], source)
            continue
        jet = driver_motion(samples, case.mechanism, driver)
        if jet is None:
            continue
        orders = _orders(jet)
        if isinstance(driver, JointDriver) and driver.turns:
            orders[0] = orders[0] + TURN * begun.get(f"{driver.joint}.rotation", 0)
        halves = [np.zeros(samples.count) for _ in orders]
        for name, changed in samples.moved.items():
            for motion in changed:
                motions = {**samples.motions, name: motion}
                other = driver_motion(replace(samples, motions=motions), case.mechanism, driver)
                assert other is not None
                for half, a, b in zip(halves, _orders(other), _orders(jet), strict=False):
                    half += np.abs(a - b)
        if np.isfinite(orders[0]).all():
            found[driver.name] = Drive(orders, halves, "follows the recorded poses")
    return found


def _turns_off(values: Array, swept: Array) -> str:
    """Return words on a recorded angle that is off the sweep by whole turns; empty if it is not."""
    off = float(np.median(values) - np.median(swept))
    apart = values.min() > swept.max() or values.max() < swept.min()
    turns = round(off / TURN)
    return f", off by whole turns from the sweep, {turns:+d}" if apart and turns else ""


def _orders(jet: Any) -> list[Array]:
    """Return value and rates of a jet, as far as all are known."""
    rates = [jet.v, jet.a] if np.isfinite(jet.v + jet.a).all() else []
    return [jet.x, *rates]


def _at_own_rate(drive: Drive, time: Any, rate: float) -> bool:
    """Return whether a driver moves at the rate of the sweep, within the digits."""
    if time is None or len(time.values) < 2:
        return False
    off = drive.orders[0] - rate * time.values
    allowed = drive.halves[0] + abs(rate) * time.half + SAME * np.abs(drive.orders[0]).max()
    return bool((np.abs(off - off[0]) <= allowed + allowed[0]).all())


def _motions(
    case: Case, times: Array, followed: Mapping[str, Drive], moved: Mapping[str, int]
) -> dict[str, Motion]:
    """Return the motions of drivers.

    Args:
        moved: drivers, and which of value, rate and acceleration is moved by its digits.
    """
    found = dict[str, Motion]()
    for name, each in followed.items():
        design = case.mechanism.design_value(name)
        orders = [*each.orders]
        if name in moved:
            orders[moved[name]] = orders[moved[name]] + each.halves[moved[name]]
        orders[0] = orders[0] + design
        at = tuple(times.tolist())
        known = len(orders) == 3
        rows = tuple(zip(*(x.tolist() for x in orders), strict=True))
        motion = Followed(at, rows) if known else Table(at, tuple(orders[0].tolist()))
        found[name] = Absolute(motion, design) if design else motion
    return found


def _with_sweep(whole: Resampled, sweep: Sweep) -> Resampled:
    """Return the case with a sweep, and with its reference if that has all its samples."""
    case = whole.case
    found = replace(case, sweep=sweep)
    if case.reference:
        allowed = SAME * float(np.abs(case.sweep.values).max())
        index = match_rows(sweep.values, case.sweep.values, allowed)
        if sweep.driver != case.sweep.driver or index is None:
            note = f"{case.name}: its reference is at other samples, and is not interpolated"
            found = replace(found, reference={}, origin=None, truth=Truth.CONSENSUS_ONLY)
            return replace(whole, case=found, notes=[*whole.notes, note])
        there = np.flatnonzero(index >= 0)[np.argsort(index[index >= 0])]
        found = replace(
            found, reference={name: _at(each, there) for name, each in case.reference.items()}
        )
    return replace(whole, case=found)


def _at(series: Series, rows: NDArray[np.intp]) -> Series:
    """Return a series at some of its samples."""
    rates = (None if x is None else x[rows] for x in (series.velocity, series.acceleration))
    uncertainty = {name: each[rows] for name, each in series.uncertainty.items()}
    return Series(series.position[rows], *rates, uncertainty=uncertainty)
