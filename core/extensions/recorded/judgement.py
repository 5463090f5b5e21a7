"""Recorded poses, judged by the rows of the mechanism; and recorded motions and reactions, by its
masses and loads.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...case.case import Case, size
from ...case.units import LENGTHS
from ...errors import shortened
from ...harness.trajectory_check import CONSTRAINED
from ...kinematics import Needed, Residuals, Worst, needed_forces, replay_motions
from ...mechanism.mechanism import Mechanism
from ...trajectory import PER_TIME, QUANTITIES, Array, BodyMotion
from ...unit_text import value_text
from .meaning import REACTIONS, Accuracy, Meaning, all_readings, si_values
from .samples import Samples, driven_angles, samples_of

# A wrong reading leaves far more than a right one: the digits of those that leave less than this
# part of the stated one are counted.
_LESS = 0.1
_NAMED = 6


@dataclass(frozen=True, eq=False)
class Judged:
    """The rest that recorded poses leave of the rows.

    Attributes:
        largest: by quantity, the largest residual [m, m/s, m/s^2]; of "attitude", by how much a
            quaternion's length is off, if out of tolerance.
        faults: sentences on residuals out of tolerance.
        not_judged: joints of a body without poses, and the body.
        begun: coupled joints that begin after whole turns, and how many.
    """

    largest: Mapping[str, float] = field(default_factory=dict[str, float])
    faults: Sequence[str] = ()
    not_judged: Mapping[str, str] = field(default_factory=dict[str, str])
    begun: Mapping[str, int] = field(default_factory=dict[str, int])


def judge_rows(case: Case, samples: Samples, accuracy: Accuracy) -> Judged:
    """Judge recorded poses, and their rates, by the rows of joints and couplers."""
    if not samples.motions:
        return Judged()
    angles = driven_angles(case, samples)
    found = replay_motions(case.mechanism, samples.motions, samples.moved, angles)
    allowed = _tolerances(case, samples, accuracy)
    largest = dict[str, float]()
    faults = list[str]()
    for name, pose in samples.meaning.bodies.items():
        if not pose.reading.angles and (off := _wrong_length(samples, name, accuracy)):
            largest["attitude"] = max(off[0], largest.get("attitude", 0.0))
            faults.append(off[1])
    gaps = len(faults)
    for quantity, per_time in zip(QUANTITIES, PER_TIME, strict=True):
        worst = found.worst(quantity, allowed[quantity])
        if worst is None:
            continue
        left: Array = getattr(found, quantity)
        largest[quantity] = float(np.nanmax(np.abs(left)))
        if worst.value > worst.allowed:
            fits = (
                _fitting_readings(case, samples, allowed["position"]) if len(faults) == gaps else ""
            )
            faults.append(
                _sentence(found, quantity, worst, allowed[quantity], f"m{per_time}") + fits
            )
    turned = {name.rpartition(".")[0]: n for name, n in found.begun.items() if n}
    return Judged(largest, faults, found.not_judged, turned)


def _wrong_length(samples: Samples, name: str, accuracy: Accuracy) -> tuple[float, str] | None:
    """Return by how much the length of a body's quaternions is off one, and a sentence; None if
    within tolerance.
    """
    uses = samples.meaning.bodies[name].groups["attitude"]
    parts = [si_values(samples.recording, use) for use in uses]
    length = np.sqrt(sum(each.values**2 for each in parts))
    digits = sum(np.abs(each.values) * each.half for each in parts) / np.maximum(length, 0.5)
    off = np.abs(length - 1.0)
    allowed = CONSTRAINED + accuracy.shares.get("position", 0.0) + digits
    bad = np.flatnonzero(off > allowed)
    if not bad.size:
        return None
    k = int(bad[off[bad].argmax()])
    text = (
        f"the recorded attitude of {name} is a quaternion of length {length[k]:.9g} at sample {k},"
        f" expected 1, tolerance {allowed[k]:.3g}. {len(bad)} of {samples.count} samples are off:"
        " correct its columns"
    )
    return float(off[k]), text


def _tolerances(case: Case, samples: Samples, accuracy: Accuracy) -> dict[str, float]:
    """Return tolerances of rows beside the digits, relative to the recorded motion: by quantity
    [m, m/s, m/s^2].
    """
    extent = size(case)
    speed = rise = 0.0
    for motion in samples.motions.values():
        v, a = (np.zeros((1, 6)) if x is None else x for x in (motion.v, motion.a))
        shift, turn, push, spin = (
            float(np.nan_to_num(np.linalg.norm(x, axis=1)).max(initial=0.0))
            for x in (v[:, :3], v[:, 3:], a[:, :3], a[:, 3:])
        )
        speed = max(speed, shift + extent * turn)
        rise = max(rise, push + extent * (spin + turn**2))
    scales = dict(zip(QUANTITIES, (extent, speed, rise), strict=True))
    return {
        quantity: CONSTRAINED * scale + accuracy.of_rows(quantity, scale)
        for quantity, scale in scales.items()
    }


def _sentence(found: Residuals, quantity: str, worst: Worst, tolerance: float, unit: str) -> str:
    """Return a sentence on the worst row: how much, in which joint, of which body, and how many
    samples.
    """
    left: Array = np.abs(getattr(found, quantity))
    digits = found.allowed.get(quantity, np.zeros_like(left))
    with np.errstate(invalid="ignore"):
        outside = left > tolerance + digits
    bad = outside.any(axis=1)
    at = Counter[str]()
    for names, out in zip(found.bodies, outside[worst.sample].tolist(), strict=True):
        at.update(names if out else ())
    most = max(at[body] for body in worst.bodies)
    body = " or ".join(name for name in worst.bodies if at[name] == most)
    value, allowed = (value_text(f"{x:.3g}", unit) for x in (worst.value, worst.allowed))
    what = {"position": "poses leave a gap of", "velocity": "velocities leave"}
    text = (
        f"the recorded {what.get(quantity, 'accelerations leave')} {value} in {worst.joint} at"
        f" sample {worst.sample} ({body}), tolerance {allowed}"
    )
    count, others = int(bad.sum()), left[~bad]
    if count < len(left) and others.size:
        largest = value_text(f"{float(np.nanmax(others)):.2g}", unit)
        text += f". {len(left) - count} of {len(left)} samples leave {largest} at most"
    return text + (": suspect the recording" if count == 1 else "")


def _fitting_readings(case: Case, samples: Samples, tolerance: float) -> str:
    """Return a phrase with all other readings of the attitudes, and units of the positions, with
    which the poses satisfy the rows; empty without any.
    """
    angles = driven_angles(case, samples)
    stated = replay_motions(case.mechanism, samples.motions, angles=angles).position
    limit = _LESS * float(np.nanmax(np.abs(stated)))
    meaning = samples.meaning
    changes = dict[str, Meaning]()
    for count in {len(pose.groups["attitude"]) for pose in meaning.bodies.values()}:
        for reading in all_readings(count):
            bodies = {
                name: replace(pose, reading=reading)
                if len(pose.groups["attitude"]) == count
                else pose
                for name, pose in meaning.bodies.items()
            }
            changes[f"{reading}"] = replace(meaning, bodies=bodies)
    for unit, length in LENGTHS.items():
        changes[f"positions in {unit}, not m,"] = _scaled(meaning, length.size)
        changes[f"positions in m, not {unit},"] = _scaled(meaning, 1.0 / length.size)
    found = list[str]()
    for words, change in changes.items():
        if change == meaning:
            continue
        other = samples_of(case, samples.recording, change, digits=False)
        tried = replay_motions(case.mechanism, other.motions, angles=angles).position
        if not np.nanmax(np.abs(tried)) <= limit:
            continue
        other = samples_of(case, samples.recording, change)
        whole = replay_motions(case.mechanism, other.motions, other.moved, angles)
        worst = whole.worst("position", tolerance)
        if worst is not None and worst.value <= worst.allowed:
            found.append(words)
    if not found:
        return ""
    listed = shortened(found, _NAMED, " or ")
    return f". Read as {listed} the gap is within the printed digits: say so in --map"


def _scaled(meaning: Meaning, factor: float) -> Meaning:
    """Return the meaning with positions in another unit."""
    bodies = {
        name: replace(
            pose,
            groups={
                what: tuple(replace(use, sign=factor * use.sign) for use in uses)
                if what == "position"
                else uses
                for what, uses in pose.groups.items()
            },
        )
        for name, pose in meaning.bodies.items()
    }
    return replace(meaning, bodies=bodies)


Rows: TypeAlias = NDArray[np.intp]
# Samples with the largest forces, to which digits are applied.
_LARGEST = 4


def judge_forces(
    case: Case, samples: Samples, accuracy: Accuracy
) -> tuple[dict[str, float], list[str]]:
    """Return the largest forces out of balance [N, N m], and sentences on those out of tolerance.

    None without loads, or without accelerations of all bodies.
    """
    mechanism = case.mechanism
    motions = {b.name: samples.motions.get(b.name) for b in mechanism.moving}
    whole = {name: m for name, m in motions.items() if m is not None and m.a is not None}
    if not mechanism.has_loads or len(whole) < len(motions):
        return {}, []
    # a kinematic analysis has a motion for each freedom, whatever the model says
    unforced = () if samples.recording.kinematic else case.unforced
    drivers = [each for each in mechanism.drivers if each.name not in unforced]
    forces = _Judge(replace(mechanism, drivers=drivers), samples, whole)
    share = CONSTRAINED + accuracy.shares.get("acceleration", 0.0)
    return forces.judge(share, size(case))


class _Judge:
    """Forces of a recorded motion, at the samples without gaps."""

    def __init__(
        self, mechanism: Mechanism, samples: Samples, motions: Mapping[str, BodyMotion]
    ) -> None:
        self.mechanism, self.samples, self.motions = mechanism, samples, motions
        numbers = [x for m in motions.values() for x in (m.r, m.v, m.a) if x is not None]
        self.there = np.flatnonzero(np.isfinite(np.hstack(numbers)).all(axis=1))
        time = samples.time
        self.times = np.arange(float(samples.count)) if time is None else time.values
        self.needed = self._at(motions, self.there)

    def _at(self, motions: Mapping[str, BodyMotion], rows: Rows) -> Needed:
        at = dict[str, BodyMotion]()
        for name, m in motions.items():
            assert m.v is not None
            assert m.a is not None
            at[name] = BodyMotion(m.r[rows], m.p[rows], m.v[rows], m.a[rows])
        return needed_forces(self.mechanism, at, self.times[rows])

    def judge(self, share: float, extent: float) -> tuple[dict[str, float], list[str]]:
        """Return the largest differences and the faults.

        Args:
            share: tolerance beside the digits, of the largest force, or of this at the mechanism's
                extent [m].
        """
        largest = dict[str, float]()
        faults = list[str]()
        for what, unit, values, half in self._differences(self.needed, self.there):
            known = np.abs(np.nan_to_num(values))
            if not known.size:
                continue
            scale = self.needed.largest * (extent if unit == "N m" else 1.0)
            largest[what] = float(known.max())
            order = np.argsort(-(known - half), kind="stable")[:_LARGEST]
            bad = [int(k) for k in order if known[k] > share * scale + half[k]]
            allowed = self._digits(what, self.there[bad]) if bad else np.zeros(0)
            for k, more in zip(bad, allowed, strict=True):
                limit = share * scale + half[k] + more
                if known[k] > limit:
                    faults.append(_imbalance(what, unit, known[k], limit, int(self.there[k])))
                    break
        return largest, faults

    def _differences(self, needed: Needed, rows: Rows) -> list[tuple[str, str, Array, Array]]:
        """Return names, units, differences and their digits: free forces by body, then recorded
        reactions by joint.
        """
        found = list[tuple[str, str, Array, Array]]()
        for name, each in needed.free.items():
            worst = np.take_along_axis(each, np.abs(each).argmax(axis=1)[:, None], axis=1)[:, 0]
            found.append((name, "N", worst, np.zeros(len(rows))))
        for joint in self.mechanism.joints if needed.forces else ():
            assert needed.forces is not None
            for k, (ending, unit) in enumerate(REACTIONS.items()):
                column = self.samples.numbers.get(f"{joint.name}.{ending}")
                if column is None:
                    continue
                reaction = needed.forces.joints[joint.name]
                own = reaction.along(np.eye(3)[k % 3], moment=k > 2)
                off = column.values[rows] - own
                found.append((f"{joint.name}.{ending}", unit, off, column.half[rows]))
        return found

    def _digits(self, what: str, rows: Rows) -> Array:
        """Return by how much the digits of the recorded motion move a difference at samples."""
        base = self._difference(self.motions, what, rows)
        total = np.zeros(len(rows))
        for name, moved in self.samples.moved.items():
            for motion in moved if name in self.motions else ():
                total += np.abs(self._difference({**self.motions, name: motion}, what, rows) - base)
        return np.nan_to_num(total)

    def _difference(self, motions: Mapping[str, BodyMotion], what: str, rows: Rows) -> Array:
        found = self._differences(self._at(motions, rows), rows)
        return next(values for name, _, values, _ in found if name == what)


def _imbalance(what: str, unit: str, value: float, allowed: float, sample: int) -> str:
    off, limit = (value_text(f"{x:.3g}", unit) for x in (value, allowed))
    if "." in what:
        return f"the recorded {what} is off by {off} at sample {sample}, tolerance {limit}"
    return (
        f"the recorded motion leaves {off} on {what} at sample {sample} for no joint or driver to"
        f" carry, tolerance {limit}: other masses or loads than those of the case"
    )
