"""Motion of the mechanism of a case file: drivers, their motions, and the sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ...mechanism.drivers import Driver, JointAngle, JointDisplacement, JointDriver, PointCoordinate
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import ROUNDED_TIME, Absolute, Measure, Motion
from ...trajectory import Array
from ..case import TIME, Sweep
from ..units import SECOND, Unit, plain
from .class_keys import driver_keys, motion_keys, own_fields
from .document import explained, fault, join, shown, unknown_name
from .reference import read_grid
from .reference_columns import Convert
from .reference_samples import ReferenceKeys
from .schema import MOST_SAMPLES, CaseKeys, SweepKeys
from .typed_tables import class_of, typed

DRIVERS: Mapping[str, type[Driver]] = {
    cls.type: cls for cls in (PointCoordinate, JointAngle, JointDisplacement)
}

_EVEN: Mapping[str, str] = {
    "start": "a number",
    "stop": "a number",
    "steps": f"a whole number of samples, 1 to {MOST_SAMPLES}",
}
"""Keys of an even grid of samples, and their expected values."""


def read_drivers(file: Path, tables: Mapping[str, Any]) -> list[Driver]:
    """Read the drivers of [drivers]. `read_sweep` reads their motions, since they depend on the
    sweep.
    """
    if not tables:
        raise fault(
            file, "drivers", "found no driver, expected at least one that moves; add [drivers.NAME]"
        )
    if TIME in tables:
        raise fault(
            file,
            join("drivers", TIME),
            f"found the name {TIME!r}, which [sweep] has for time itself; rename the driver",
        )
    found = [_driver(file, join("drivers", name), name, value) for name, value in tables.items()]
    driven: dict[tuple[str, str], str] = {}
    for each in found:
        if (
            isinstance(each, JointDriver)
            and (other := driven.setdefault((each.joint, each.freedom), each.name)) != each.name
        ):
            problem = (
                f"found {shown(each.joint)}, whose {each.freedom} {other!r} drives already,"
                " expected another joint"
            )
            raise fault(
                file,
                join(join("drivers", each.name), "joint"),
                f"{problem}; remove one of the drivers",
            )
    return found


def _driver(file: Path, key: str, name: str, value: object) -> Driver:
    cls = class_of(file, key, "driver", value, DRIVERS)
    keys = msgspec.structs.asdict(typed(file, key, value, driver_keys(cls)))
    with explained(file, key):
        return cls(name, **{each.name: keys[each.name] for each in own_fields(cls)})


def read_sweep(
    file: Path,
    keys: CaseKeys,
    mechanism: Mechanism,
    length: Unit,
    angle: Unit,
    reference: ReferenceKeys | None = None,
) -> tuple[Sweep, Unit, bool]:
    """Read the sweep, with the motions of all other drivers.

    Returns:
        The sweep, the unit of the swept values, and whether the sweep has the samples of the
        reference.
    """
    sweep = typed(file, "sweep", keys.sweep, SweepKeys)
    moved = {
        name: value["motion"]
        for name, value in keys.drivers.items()
        if value.get("motion") is not None
    }
    _check(file, sweep, keys.sweep, keys.drivers, moved)
    motions = {
        name: _motion(file, mechanism, name, value, length, angle) for name, value in moved.items()
    }
    convert, design = SECOND, 0.0
    if sweep.driver != TIME:
        driver = mechanism.driver(sweep.driver)
        convert, design = _unit(driver, length, angle), mechanism.design_value(sweep.driver)
    grid = np.array(_samples(file, sweep, keys.sweep, convert, reference))
    found = Sweep(
        sweep.driver, grid, convert(1.0 if sweep.rate is None else sweep.rate), design, motions
    )
    for name, motion in motions.items():
        _check_motion(file, join(join("drivers", name), "motion"), motion, found.path.times)
    return found, convert, sweep.at is not None


def _samples(
    file: Path,
    sweep: SweepKeys,
    written: Mapping[str, Any],
    convert: Unit,
    reference: ReferenceKeys | None,
) -> Sequence[float]:
    """Return the samples [SI]: an even grid, or the reference's samples."""
    if sweep.at is None:
        for key, expected in _EVEN.items():
            if written.get(key) is None:
                problem = f"missing, expected {expected}; add the key {key!r}"
                raise fault(
                    file,
                    join("sweep", key),
                    f'{problem}, or at = "reference" for the samples of the reference',
                )
        assert None not in (sweep.start, sweep.stop, sweep.steps)
        _check_even(file, sweep, written)
        even = np.linspace(sweep.start or 0.0, sweep.stop or 0.0, sweep.steps or 1)
        return [convert(value) for value in even.tolist()]
    for key in _EVEN:
        if written.get(key) is not None:
            problem = f"found {shown(written[key])} beside at = {shown(sweep.at)}, expected one"
            raise fault(file, join("sweep", key), f"{problem}; remove {key} or at")
    if reference is None:
        problem = f"found {shown(sweep.at)}, but the case has no [reference] with samples"
        raise fault(file, "sweep.at", f"{problem}; add one, or give start, stop and steps")
    found = read_grid(file, reference, convert)
    if len(found) > MOST_SAMPLES:
        problem = f"found {len(found)} rows of the reference, expected {MOST_SAMPLES} at most"
        raise fault(file, "sweep.at", f"{problem}; thin them out, or give start, stop and steps")
    return found


def _check(
    file: Path,
    sweep: SweepKeys,
    written: Mapping[str, Any],
    drivers: Mapping[str, Any],
    moved: Mapping[str, Any],
) -> None:
    """Refuse a sweep in contradiction to itself or the motions."""
    if sweep.driver == TIME:
        if not moved:
            found = f"found {shown(TIME)}" if "driver" in written else "missing"
            problem = f"{found}, and no driver has a motion, expected something that moves"
            raise fault(
                file,
                "sweep.driver",
                f"{problem}; name the driver to sweep, or add [drivers.NAME.motion]",
            )
        if sweep.rate is not None:
            problem = (
                f"found {written['rate']!r} in a sweep of time, expected none, for the motions have"
                " rates of their own"
            )
            raise fault(file, "sweep.rate", f"{problem}; remove it, or name the driver to sweep")
    elif sweep.driver not in drivers:
        known = [*drivers, TIME]
        raise unknown_name(file, "sweep.driver", sweep.driver, known, "a driver")
    elif sweep.driver in moved:
        problem = "found a motion of the swept driver, expected the sweep alone to move it"
        advice = f'remove it, or sweep time: driver = "{TIME}", start and stop in seconds'
        raise fault(file, join(join("drivers", sweep.driver), "motion"), f"{problem}; {advice}")
    if sweep.rate == 0.0:
        raise fault(
            file,
            "sweep.rate",
            "found 0, expected driver units per second; give 1 to differentiate by the driver's"
            " value",
        )


def _check_even(file: Path, sweep: SweepKeys, written: Mapping[str, Any]) -> None:
    """Refuse a number of samples in contradiction to their ends."""
    if sweep.start == sweep.stop and (sweep.steps or 1) > 1:
        problem = (
            f"found the start {written['start']!r} again with {sweep.steps} steps, expected another"
            " value"
        )
        raise fault(file, "sweep.stop", f"{problem}; give steps = 1 for a single sample")
    if sweep.start != sweep.stop and sweep.steps == 1:
        found = f"found 1 with start {written['start']!r} and stop {written['stop']!r}"
        problem = f"{found}, expected 2 or more samples, both ends among them"
        raise fault(
            file, "sweep.steps", f"{problem}; give more, or stop = start for a single sample"
        )


def _motion(
    file: Path, mechanism: Mechanism, name: str, value: object, length: Unit, angle: Unit
) -> Motion:
    key, driver = join(join("drivers", name), "motion"), mechanism.driver(name)
    cls = class_of(file, key, "motion", value, Motion.registry)
    keys = typed(file, key, value, motion_keys(cls))
    converts = dict.fromkeys(
        (Measure.DRIVER, Measure.DRIVER_RATE), _unit(driver, length, angle)
    ) | {Measure.ANGLE: angle}
    given = {
        each.name: _scaled(getattr(keys, each.name), converts.get(each.metadata["measure"], float))
        for each in own_fields(cls)
    }
    with explained(file, key):
        motion = cls(**given)
    design = mechanism.design_value(name)
    return Absolute(motion, design) if design else motion


def _scaled(
    value: float | str | tuple[float, ...], convert: Convert
) -> float | str | tuple[float, ...]:
    if isinstance(value, str):
        return value
    return tuple(map(convert, value)) if isinstance(value, tuple) else convert(value)


def _check_motion(file: Path, key: str, motion: Motion, times: Array) -> None:
    """Refuse a motion unless it defines its driver's value at every sample."""
    (first, last), low, high = motion.span, float(times.min()), float(times.max())
    slack = ROUNDED_TIME * max(abs(low), abs(high))
    if low < first - slack or high > last + slack:
        found = f"found values from {plain(first)} to {plain(last)} s"
        problem = f"{found}, expected them for the whole sweep, {low:.9g} to {high:.9g} s"
        raise fault(file, key, f"{problem}; add values, or shorten the sweep")
    with np.errstate(all="ignore"):
        finite = np.isfinite(motion.at(times)).all()
    if not finite:
        raise fault(
            file,
            key,
            "found numbers that overflow within the sweep, expected finite ones; correct them",
        )


def _unit(driver: Driver, length: Unit, angle: Unit) -> Unit:
    """Return the unit of a driver's values in the file."""
    return angle if driver.turns else length
