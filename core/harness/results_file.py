"""Reader of results files, kincheck-results/1. A file may be truncated, edited or forged, so the
reader checks all of it, and no later step can fail.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import msgspec

from ..case.case import Truth
from ..case.io.document import fault, join, read_text, shown
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
    """The units of a table of hardpoints."""

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
    for key, kind in _FACTS.items():
        if key in results.run:
            _convert(file, f"run.{key}", results.run[key], kind)
    samples: dict[str, int] = {}
    for k, record in enumerate(results.records):
        _check_record(file, f"records[{k}]", record, samples)
    for case, outputs in results.references.items():
        for name, series in outputs.items():
            _check_series(
                file,
                join(join("references", case), name),
                series,
                samples.get(case, len(series.position)),
            )
    for case, scene in results.scenes.items():
        _check_scene(file, join("scenes", case), scene)
    return results


def _convert(file: Path, key: str, value: object, kind: Any) -> None:
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise fault(file, key, f"found {shown(value)}: {error}; {_ADVICE}") from None


def _check(file: Path, key: str, holds: bool, problem: str) -> None:
    if not holds:
        raise fault(file, key, f"{problem}; {_ADVICE}")


def _check_record(file: Path, key: str, record: Record, samples: dict[str, int]) -> None:
    _check(
        file,
        f"{key}.truth",
        record.truth in set(Truth),
        f"found {shown(record.truth)}, expected one of {', '.join(Truth)}",
    )
    _convert(file, f"{key}.details", record.details, _Details)
    if record.driver:
        count = samples.setdefault(record.case, len(next(iter(record.driver.values()))))
        for name, values in record.driver.items():
            _check_numbers(file, join(f"{key}.driver", name), values, count)
    count = samples.get(record.case, 0)
    moved = record.driver or not (record.outputs or record.outcome is Outcome.FAIL)
    _check(file, f"{key}.driver", bool(moved), "found none, expected values of drivers")
    for name, series in record.outputs.items():
        _check_series(file, join(f"{key}.outputs", name), series, count)
    for name, deviations in record.errors.items():
        for quantity, found in deviations.items():
            place = f"{join(f'{key}.errors', name)}.{quantity}"
            given = record.outputs.get(name)
            known = given is not None and getattr(given, quantity) is not None
            _check(
                file,
                place,
                known,
                f"found a deviation of a missing quantity, expected {quantity} in outputs",
            )
            _check(
                file,
                f"{place}.worst_step",
                0 <= found.worst_step < count,
                f"found no sample, expected one of {count}",
            )
            _check_sizes(file, place, (found.max_abs, found.rms, found.tolerance))
    numbers = [record.residual_max, record.us_per_step]
    numbers += [] if record.seconds is None else [*msgspec.structs.astuple(record.seconds)]
    _check_sizes(file, key, numbers)


def _check_series(file: Path, key: str, series: OutputSeries, count: int) -> None:
    for quantity in QUANTITIES:
        values: Sequence[float | None] | None = getattr(series, quantity)
        if values is not None:
            _check_numbers(file, f"{key}.{quantity}", values, count)


def _check_numbers(file: Path, key: str, values: Sequence[float | None], count: int) -> None:
    _check(
        file,
        key,
        len(values) == count,
        f"found {len(values)} numbers, expected {count}, the number of samples of the case",
    )
    _check(
        file,
        key,
        all(each is None or abs(each) <= LARGEST for each in values),
        f"found a number beyond {LARGEST:g}",
    )


def _check_sizes(file: Path, key: str, values: Iterable[float | None]) -> None:
    usable = all(each is None or 0.0 <= each <= LARGEST for each in values)
    _check(
        file,
        key,
        usable,
        f"found a negative number or one beyond {LARGEST:g}, expected errors and times",
    )


def _check_scene(file: Path, key: str, scene: Scene) -> None:
    bodies: Mapping[str, Any] = {body.name: body for body in scene.bodies}
    _check(
        file,
        f"{key}.bodies",
        len(bodies) == len(scene.bodies) and GROUND not in bodies,
        "found a name twice, or the ground",
    )
    for body in scene.bodies:
        rows = [
            (3, body.origin),
            (4, body.euler_parameters),
            *((3, each) for each in body.r),
            *((4, each) for each in body.p),
        ]
        _check_rows(file, f"{key}.bodies", rows)
        counts = {len(body.r), len(body.p)}
        _check(
            file,
            f"{key}.bodies",
            counts <= {len(scene.frames)} or counts == {0},
            "found other poses than frames",
        )
    known = {GROUND, *bodies}
    for joint in scene.joints:
        there = len(joint.bodies) == 2 and known.issuperset(joint.bodies)
        _check(file, f"{key}.joints", there, f"found {shown(joint.bodies)}, expected two bodies")
        places = (*joint.points, *joint.axes, *[joint.far] * bool(joint.far))
        _check_rows(file, f"{key}.joints", [(3, each) for each in places])
        directions = all(1e-100 < math.hypot(*axis) < 1e100 for axis in joint.axes)
        _check(file, f"{key}.joints", directions, f"found {shown(joint.axes)}, expected directions")
    for point in scene.points:
        _check(
            file,
            f"{key}.points",
            point.body in known,
            f"found {shown(point.body)}, expected a body",
        )
        _check_rows(file, f"{key}.points", [(3, point.position)])
    names = {point.name for point in scene.points}
    for spring in scene.springs:
        there = len(spring.bodies) == len(spring.points) == 2 and known.issuperset(spring.bodies)
        _check(file, f"{key}.springs", there, f"found {shown(spring.bodies)}, expected two bodies")
        _check_rows(file, f"{key}.springs", [(3, each) for each in spring.points])
    for wheel in scene.wheels:
        there = len(wheel.kingpin) in (0, 2) and names.issuperset(wheel.kingpin)
        _check(file, f"{key}.wheels", there, f"found {shown(wheel.kingpin)}, expected two points")
        _check_rows(file, f"{key}.wheels", [(3, each) for each in (wheel.middle,) if each])


def _check_rows(file: Path, key: str, rows: Iterable[tuple[int, Sequence[float]]]) -> None:
    for count, row in rows:
        sound = len(row) == count and all(abs(each) < 1e100 for each in row)
        _check(file, key, sound, f"found {shown(row)}, expected {count} numbers")
