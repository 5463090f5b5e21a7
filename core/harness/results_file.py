"""Reader of results files, kincheck-results/1. A file may be truncated, edited or forged, so the
reader checks all of it, and no later step can fail.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias

import msgspec

from ..case.case import Truth
from ..case.io.document import fault, read_text, shown
from ..case.io.lines import join
from ..mechanism.mechanism import GROUND
from ..trajectory import QUANTITIES
from .record import Outcome, OutputSeries, Record, Results, from_json
from .scene_record import Scene

LARGEST_FILE = 512_000_000
# Largest number in a file: reports convert units and subtract, and nothing overflows within this
# bound.
LARGEST = 1e300
_ADVICE = "write the file again with kincheck run --json"


class _Driver(msgspec.Struct, frozen=True):
    """The known keys of a driver; further keys are allowed."""

    name: str = ""
    type: str = ""
    point: str = ""
    direction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    relative: bool = True
    motion: dict[str, str | bool | int | float | list[float] | None] = {}


class _Units(msgspec.Struct, frozen=True):
    """The units of a table of hardpoints, or of another file that is not in SI."""

    length: Literal["m", "mm", "cm", "inch", "foot"]
    angle: Literal["rad", "deg"]


class _About(msgspec.Struct):
    """The known keys of a case; further keys are allowed."""

    source: str = ""
    signs: str = ""
    notes: list[str] = []
    driver: _Driver = _Driver()
    motions: dict[str, _Driver] = {}
    outputs: dict[str, dict[str, Any]] = {}
    units: _Units | None = None
    is_table: bool = True


_FACTS: Mapping[str, Any] = {
    "cases": dict[str, _About],
    "missing": list[tuple[str, str, str]],
    "unread": dict[str, str],
    "git": dict[str, str | bool | None] | None,
    "tol": float,
}
"""Facts of a run that are read; further ones are allowed."""


class _Details(msgspec.Struct):
    """An engine's details with a table in the report; further keys are allowed."""

    dof_account: dict[str, int | float | str | list[str] | None] | None = None
    program: dict[str, dict[str, int | float | str | None]] | None = None


Checks: TypeAlias = Iterator[tuple[str, bool, str]]
"""Keys of results, whether they are sound, and what is wrong if they are not."""


def read_results(file: Path) -> Results:
    """Return the results in a file.

    Raises:
        CaseError: the file cannot be read, holds no results, or contradicts itself: series of other
            lengths than the driver's, unknown names.
    """
    text = read_text(file, LARGEST_FILE, "give a results file written by kincheck run")
    try:
        results = from_json(text.encode())
    except (msgspec.DecodeError, RecursionError) as error:
        raise fault(file, "", f"found {error}, expected results; {_ADVICE}") from None
    for key, sound, problem in _checks(results):
        if not sound:
            raise fault(file, key, f"{problem}; {_ADVICE}")
    return results


def _checks(results: Results) -> Checks:
    for key, kind in _FACTS.items():
        if key in results.run:
            yield _check_conversion(f"run.{key}", results.run[key], kind)
    samples: dict[str, int] = {}
    for k, record in enumerate(results.records):
        yield from _record_checks(f"records[{k}]", record, samples)
    for case, outputs in results.references.items():
        for name, series in outputs.items():
            count = samples.get(case, len(series.position))
            yield from _series_checks(join(join("references", case), name), series, count)
    for case, scene in results.scenes.items():
        yield from _scene_checks(join("scenes", case), scene)


def _check_conversion(key: str, value: object, kind: Any) -> tuple[str, bool, str]:
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        return key, False, f"found {shown(value)}: {error}"
    return key, True, ""


def _record_checks(key: str, record: Record, samples: dict[str, int]) -> Checks:
    kinds = f"found {shown(record.truth)}, expected one of {', '.join(Truth)}"
    yield f"{key}.truth", record.truth in set(Truth), kinds
    yield _check_conversion(f"{key}.details", record.details, _Details)
    if record.driver:
        count = samples.setdefault(record.case, len(next(iter(record.driver.values()))))
        for name, values in record.driver.items():
            yield from _number_checks(join(f"{key}.driver", name), values, count)
    count = samples.get(record.case, 0)
    moved = record.driver or not (record.outputs or record.outcome is Outcome.FAIL)
    yield f"{key}.driver", bool(moved), "found none, expected values of drivers"
    for name, series in record.outputs.items():
        yield from _series_checks(join(f"{key}.outputs", name), series, count)
    for name, deviations in record.errors.items():
        for quantity, found in deviations.items():
            place = f"{join(f'{key}.errors', name)}.{quantity}"
            given = record.outputs.get(name)
            known = given is not None and getattr(given, quantity) is not None
            lack = f"found a deviation of a missing quantity, expected {quantity} in outputs"
            yield place, known, lack
            there = 0 <= found.worst_step < count
            yield f"{place}.worst_step", there, f"found no sample, expected one of {count}"
            yield _size_check(place, (found.max_abs, found.rms, found.tolerance))
    times = () if record.seconds is None else msgspec.structs.astuple(record.seconds)
    yield _size_check(key, (record.residual_max, record.us_per_step, *times))


def _series_checks(key: str, series: OutputSeries, count: int) -> Checks:
    for quantity in QUANTITIES:
        values: Sequence[float | None] | None = getattr(series, quantity)
        if values is not None:
            yield from _number_checks(f"{key}.{quantity}", values, count)


def _number_checks(key: str, values: Sequence[float | None], count: int) -> Checks:
    lengths = f"found {len(values)} numbers, expected {count}, the number of samples of the case"
    yield key, len(values) == count, lengths
    bounded = all(each is None or abs(each) <= LARGEST for each in values)
    yield key, bounded, f"found a number beyond {LARGEST:g}"


def _size_check(key: str, values: Iterable[float | None]) -> tuple[str, bool, str]:
    usable = all(each is None or 0.0 <= each <= LARGEST for each in values)
    wrong = f"found a negative number or one beyond {LARGEST:g}, expected errors and times"
    return key, usable, wrong


def _scene_checks(scene_key: str, scene: Scene) -> Checks:
    bodies = {body.name for body in scene.bodies}
    known, key = {GROUND, *bodies}, f"{scene_key}.bodies"
    once = len(bodies) == len(scene.bodies) and GROUND not in bodies
    yield key, once, "found a name twice, or the ground"
    for body in scene.bodies:
        yield from _row_checks(key, 3, [body.origin])
        yield from _row_checks(key, 4, [body.euler_parameters])
        yield from _row_checks(key, 3, body.r)
        yield from _row_checks(key, 4, body.p)
        counts = {len(body.r), len(body.p)}
        posed = counts <= {len(scene.frames)} or counts == {0}
        yield key, posed, "found other poses than frames"
    key = f"{scene_key}.joints"
    for joint in scene.joints:
        there = len(joint.bodies) == 2 and known.issuperset(joint.bodies)
        yield key, there, f"found {shown(joint.bodies)}, expected two bodies"
        far = [joint.far] if joint.far else []
        yield from _row_checks(key, 3, [*joint.points, *joint.axes, *far])
        directions = all(1e-100 < math.hypot(*axis) < 1e100 for axis in joint.axes)
        yield key, directions, f"found {shown(joint.axes)}, expected directions"
    key = f"{scene_key}.points"
    for point in scene.points:
        yield key, point.body in known, f"found {shown(point.body)}, expected a body"
        yield from _row_checks(key, 3, [point.position])
    key = f"{scene_key}.springs"
    for spring in scene.springs:
        there = len(spring.bodies) == len(spring.points) == 2 and known.issuperset(spring.bodies)
        yield key, there, f"found {shown(spring.bodies)}, expected two bodies"
        yield from _row_checks(key, 3, spring.points)
    key, names = f"{scene_key}.wheels", {point.name for point in scene.points}
    for wheel in scene.wheels:
        there = len(wheel.kingpin) in (0, 2) and names.issuperset(wheel.kingpin)
        yield key, there, f"found {shown(wheel.kingpin)}, expected two points"
        yield from _row_checks(key, 3, [wheel.middle] if wheel.middle else [])


def _row_checks(key: str, count: int, rows: Iterable[Sequence[float]]) -> Checks:
    for row in rows:
        sound = len(row) == count and all(abs(each) < 1e100 for each in row)
        yield key, sound, f"found {shown(row)}, expected {count} numbers"
