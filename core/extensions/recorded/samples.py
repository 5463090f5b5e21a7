"""Samples of a recording in terms of a case: numbers of time, drivers and outputs, and motions of
bodies, with what their printed digits allow.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...algebra import ZERO, Vec3, cross, quat, vec
from ...case.case import TIME, Case, Quantity
from ...case.curves import is_set
from ...case.io.document import fault, shown
from ...case.measures import coordinate_of
from ...case.quantity import point_jets, still_jets, with_markers
from ...errors import MOST_NAMED, number_of, shortened
from ...jet import Jet
from ...mechanism.body import Body
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Driver, JointDriver, PointCoordinate
from ...primitives.base import Pose as Placed
from ...primitives.base import Twist
from ...trajectory import Array, BodyMotion, PointMotion
from ..residuals.replay import count_turns
from .meaning import EVENT, MAP, Meaning, Pose, si_values, unit_of
from .readers import Column, Recording


@dataclass(frozen=True, eq=False)
class Samples:
    """A recording in terms of a case, SI.

    Attributes:
        numbers: time, and values of drivers and outputs and their rates, by name.
        motions: of recorded bodies; NaN at gaps.
        moved: by body, the motion after each recorded number is moved by half its last digit.
    """

    recording: Recording
    meaning: Meaning
    numbers: Mapping[str, Column]
    motions: Mapping[str, BodyMotion]
    moved: Mapping[str, Sequence[BodyMotion]]
    notes: Sequence[str]

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(next(iter(self.recording.columns.values())).values)

    @property
    def gaps(self) -> dict[str, int]:
        """Number of samples without a value or pose, by quantity and body; none without any."""
        values = {name: each.values for name, each in self.numbers.items()}
        values |= {name: each.r.sum(axis=1) + each.p[:, 0] for name, each in self.motions.items()}
        lost = {name: int(np.isnan(x).sum()) for name, x in values.items()}
        return {name: count for name, count in lost.items() if count}

    @property
    def time(self) -> Column | None:
        """The times, if they are recorded."""
        return self.numbers.get(TIME)


def samples_of(
    case: Case,
    recording: Recording,
    meaning: Meaning,
    *,
    digits: bool = True,
    whole: bool = False,
) -> Samples:
    """Return the samples of a recording.

    Args:
        whole: whether to keep all rows, also those without time, driver or pose.
        digits: whether to count printed digits.

    Raises:
        CaseError: columns have different lengths, a unit is wrong, rows at one time differ, or no
            sample is left.
    """
    notes = [*recording.notes]
    kept = recording
    if not whole:
        notes += _notes_on_columns(recording, meaning)
        kept = replace(recording, columns=_columns_of_samples(case, recording, meaning, notes))
    numbers = {name: si_values(kept, use) for name, use in meaning.numbers.items()}
    motions = dict[str, BodyMotion]()
    moved = dict[str, list[BodyMotion]]()
    for name, pose in meaning.bodies.items():
        body = case.mechanism.body(name)
        columns = {
            what: [si_values(kept, use) for use in uses] for what, uses in pose.groups.items()
        }
        given = {what: [each.values for each in group] for what, group in columns.items()}
        motions[name] = motion_of(body, pose, given)
        moved[name] = []
        for what, group in columns.items():
            for k, column in enumerate(group if digits else ()):
                changed = {**given, what: [*given[what]]}
                changed[what][k] = column.values + column.half
                moved[name].append(motion_of(body, pose, changed, given))
                if pose.frame is None and what in ("position", "attitude"):
                    moved[name].append(motion_of(body, pose, given, changed))
    found = Samples(kept, meaning, numbers, motions, moved, [*dict.fromkeys(notes)])
    there = _known_drivers(case, found)
    if whole or there.all() or not there.any():
        return found
    rows = np.flatnonzero(there)
    columns = {k: Column(c.head, c.values[rows], c.half[rows]) for k, c in kept.columns.items()}
    gaps = number_of(int((~there).sum()), "sample")
    notes.append(f"{recording.file}: left out {gaps} without the pose of a driver")
    rest = replace(kept, columns=columns, notes=notes)
    return samples_of(case, rest, meaning, digits=digits)


def _notes_on_columns(recording: Recording, meaning: Meaning) -> Iterator[str]:
    """Yield notes on columns of unknown names, and on those whose unit neither the file nor --map
    states.
    """
    bare = {
        recording.columns[use.column].head.name: use.si
        for use in meaning.uses
        if not (use.unit or recording.columns[use.column].head.unit or use.si == "1")
        and not ("rad" in use.si and recording.angle)
    }
    for use in meaning.uses:
        head = recording.columns[use.column].head
        unit, *_ = unit_of(recording.file, head, use)
        if head.unit and unit != head.unit:
            text = f"column {head.name} is taken in {unit}, as stated, and not in {head.unit}"
            yield f"{recording.file}: {text}"
    if meaning.unknown:
        yield (
            f"{recording.file}: columns of no known name are left out:"
            f" {shortened(meaning.unknown, MOST_NAMED)}"
        )
    if bare:
        units = " and ".join(dict.fromkeys(bare.values()))
        names = shortened([*bare], MOST_NAMED)
        yield f"{recording.file}: columns without a unit are taken in {units}: {names}"


def _known_drivers(case: Case, samples: Samples) -> NDArray[np.bool_]:
    """Return at which samples all drivers are known whose motion the poses tell."""
    there = np.ones(samples.count, dtype=np.bool_)
    for driver in case.mechanism.drivers:
        if driver.name not in samples.numbers:
            jet = driver_motion(samples, case.mechanism, driver)
            there &= True if jet is None else np.isfinite(jet.x)
    return there


def _columns_of_samples(
    case: Case, recording: Recording, meaning: Meaning, notes: list[str]
) -> Mapping[int, Column]:
    """Return the columns without samples that have no time or driver value, and with one row at
    each event.
    """
    file, columns = recording.file, recording.columns
    if len({len(each.values) for each in columns.values()}) > 1:
        lengths = ", ".join(f"{shown(c.head.name)} {len(c.values)}" for c in columns.values())
        raise fault(
            file, "", f"found columns of different lengths ({lengths}), expected one length"
        )
    driven = {TIME, *(driver.name for driver in case.mechanism.drivers)}
    leading = [use.column for name, use in meaning.numbers.items() if name in driven]
    count = len(next(iter(columns.values())).values)
    there = np.ones(count, dtype=np.bool_)
    for k in leading:
        there &= np.isfinite(columns[k].values)
    if not there.all():
        gaps = number_of(int((~there).sum()), "sample")
        notes.append(f"{file}: left out {gaps} without time or driver value")
    rows = np.flatnonzero(there)
    if TIME in meaning.numbers and len(rows):
        times = columns[meaning.numbers[TIME].column].values[rows]
        again = np.flatnonzero(np.diff(times) == 0.0)
        for k in again if not meaning.event else ():
            _require_equal(file, columns, rows[k], rows[k + 1], float(times[k]))
        if again.size:
            rows = np.delete(rows, again if meaning.event == "last" else again + 1)
            notes.append(f"{file}: merged {number_of(again.size, 'row')} at the time of another")
    if not len(rows):
        raise fault(file, "", "found no samples, expected rows of numbers. Record the motion anew")
    exact = {k for k in leading if is_set(columns[k].values, columns[k].half)}
    return {
        k: Column(c.head, c.values[rows], c.half[rows] * (k not in exact))
        for k, c in columns.items()
    }


def _require_equal(
    file: Path, columns: Mapping[int, Column], one: int, other: int, time: float
) -> None:
    """Refuse two rows at one time that differ by more than their digits."""
    for each in columns.values():
        a, b = (float(each.values[k]) for k in (one, other))
        if abs(a - b) > each.half[one] + each.half[other]:
            raise fault(
                file,
                shown(each.head.name),
                f"found {a!r} and {b!r} at one time, {time!r}, expected one value at an event. Say"
                f' which rows to take: {MAP} "{EVENT}=first" or "{EVENT}=last"',
            )


def motion_of(
    body: Body,
    pose: Pose,
    given: Mapping[str, Sequence[Array]],
    first: Mapping[str, Sequence[Array]] | None = None,
) -> BodyMotion:
    """Return the motion of a body by the recorded motion of a frame on it.

    Args:
        given: numbers in SI by position, attitude, velocity, omega, acceleration and alpha.
        first: those whose first sample is the design pose, if the frame is known by it.
    """

    r_0, p_0 = body.origin, body.euler_parameters
    if pose.frame:
        e = np.array(pose.frame[3:])
        r_0, p_0 = pose.frame[:3], tuple((e / np.linalg.norm(e)).tolist())

    def frame_pose(numbers: Mapping[str, Sequence[Array]]) -> tuple[Array, Array]:
        place = numbers["position"]
        if len(place) == 2:  # a planar pose
            place = [*place, np.full_like(place[0], r_0[2])]
        r = np.stack(place, axis=-1)
        return r, pose.reading.parameters(numbers["attitude"])

    r, p = frame_pose(given)
    if pose.frame is None:
        r_all, p_all = frame_pose(first or given)
        k = int(np.argmax(np.isfinite(r_all).all(axis=1) & np.isfinite(p_all).all(axis=1)))
        r_0, p_0 = r_all[k].tolist(), p_all[k].tolist()
    back = quat(p_0).conjugate()
    frame = Placed.of(ZERO, quat(p.T))
    arm = frame.turn(Placed.of(ZERO, back).turn(vec(body.origin) - vec(r_0)))
    q = quat(p.T) * back * quat(body.euler_parameters)
    rates: list[Array | None] = [None, None]
    if "velocity" in given:
        none = np.zeros((3, len(r)))
        # of a planar pose: along x and y, about z
        given = {
            what: [*values, *none[: 3 - len(values)]]
            if what in ("velocity", "acceleration")
            else [*none[: 3 - len(values)], *values]
            for what, values in given.items()
        }
        w, w_t = (
            frame.turn(vec([*given.get(what, none)]))
            if what in pose.turned
            else vec([*given.get(what, none)])
            for what in ("omega", "alpha")
        )
        own = Placed.of(ZERO, q.conjugate())
        a = vec(given["acceleration"]) if "acceleration" in given else None
        at_end = _at_end(arm, Twist(vec(given["velocity"]), w), a, w_t)
        turning = (_rows(own.turn(each)) for each in (w, w_t))
        rates = [
            None if x is None else np.hstack([x, y]) for x, y in zip(at_end, turning, strict=True)
        ]
    return BodyMotion(r + _rows(arm), np.stack([q.e0, *q.e], axis=-1), *rates)


def _at_end(arm: Vec3, twist: Twist, a: Vec3 | None, w_t: Vec3) -> list[Array | None]:
    """Return velocity and acceleration at the end of a turned arm, shape (n, 3) each.

    Args:
        a, w_t: acceleration of its other end, None if it is unknown, and of rotation.
    """
    if a is None:
        return [_rows(twist.of(arm)), None]
    return [_rows(twist.of(arm)), _rows(a + cross(w_t, arm) + twist.centripetal(arm))]


def _rows(a: Any) -> Array:
    return np.stack(np.broadcast_arrays(*a), axis=-1)


def point_motion(
    mechanism: Mechanism, motions: Mapping[str, BodyMotion], name: str, count: int
) -> PointMotion | None:
    """Return the motion of a point of a recorded or fixed body; None of any other."""
    point = mechanism.point(name)
    if mechanism.is_fixed(point.body):
        still = np.zeros((count, 3))
        return PointMotion(still + np.array(point.position), still, still)
    motion = motions.get(point.body)
    if motion is None:
        return None
    body, frame = mechanism.body(point.body), Placed.of(ZERO, quat(motion.p.T))
    back = Placed.of(ZERO, quat(body.euler_parameters).conjugate())
    arm = frame.turn(back.turn(vec(point.position) - vec(body.origin)))
    if motion.v is None:
        return PointMotion(motion.r + _rows(arm), None, None)
    twist = Twist(Vec3(*motion.v[:, :3].T), frame.turn(Vec3(*motion.v[:, 3:].T)))
    a = None if motion.a is None else motion.a.T
    linear, turning = (None, ZERO) if a is None else (Vec3(*a[:3]), frame.turn(Vec3(*a[3:])))
    return PointMotion(motion.r + _rows(arm), *_at_end(arm, twist, linear, turning))


def jet_of(
    mechanism: Mechanism, motions: Mapping[str, BodyMotion], measure: Quantity, count: int
) -> Jet | None:
    """Return a quantity by the motions of bodies, turns not counted, and its rates; NaN for what is
    not recorded, None without the poses of its bodies.

    Args:
        mechanism: with the markers of the quantity.
    """
    at = dict[str, Vec3]()
    for name in measure.points:
        motion = point_motion(mechanism, motions, name, count)
        if motion is None:
            return None
        at[name] = point_jets(motion)
    design = {name: still_jets(mechanism.point(name).position) for name in measure.points}
    with np.errstate(invalid="ignore"):
        return measure.of(at, design)


def driven_angles(case: Case, samples: Samples) -> dict[str, Array]:
    """Return the angles of joints from design by columns of their drivers, with all turns, by
    coordinate [rad].
    """
    mechanism = case.mechanism
    return {
        f"{driver.joint}.rotation": column.values - mechanism.design_value(driver.name)
        for driver in mechanism.drivers
        if isinstance(driver, JointDriver)
        and driver.turns
        and (column := samples.numbers.get(driver.name)) is not None
    }


def driver_motion(samples: Samples, mechanism: Mechanism, driver: Driver) -> Jet | None:
    """Return the value of a driver from design, and its rates, by the recorded poses; see `jet_of`.

    Turns are counted from sample to sample, from the one nearest to the design.
    """
    if not isinstance(driver, PointCoordinate | JointDriver):
        return None
    measure = coordinate_of(driver)
    marked = with_markers(mechanism, [measure])
    found = jet_of(marked, samples.motions, measure, samples.count)
    if found is None:
        return None
    x: Array = np.array(found.x, dtype=np.float64)
    return Jet(count_turns(x) if measure.period else x, found.v, found.a)
