"""Recorded poses, judged by the rows of the mechanism."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..case.case import Case, size
from ..errors import shortened
from ..harness.trajectory_check import CONSTRAINED
from ..kinematics import Residuals, Worst, replayed
from ..trajectory import PER_TIME, QUANTITIES, Array
from ..unit_text import value_text
from .attitudes import readings
from .meaning import Accuracy, Meaning
from .samples import Samples, driven_angles, samples_of

# A wrong reading leaves far more than a right one: the digits of those that leave less than this
# part of the stated one are counted.
_LESS = 0.1
_NAMED = 6
_FACTORS = {"mm": 1e-3, "cm": 1e-2, "inch": 0.0254, "foot": 0.3048}


@dataclass(frozen=True, eq=False)
class Judged:
    """The rest that recorded poses leave of the rows.

    Attributes:
        largest: by quantity, the largest residual [m, m/s, m/s^2].
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
    found = replayed(case.mechanism, samples.motions, samples.moved, angles)
    allowed = _tolerances(case, samples, accuracy)
    largest: dict[str, float] = {}
    faults: list[str] = []
    for quantity, per_time in zip(QUANTITIES, PER_TIME, strict=True):
        worst = found.worst(quantity, allowed[quantity])
        if worst is None:
            continue
        left: Array = getattr(found, quantity)
        largest[quantity] = float(np.nanmax(np.abs(left)))
        if worst.value > worst.allowed:
            fits = _fitting(case, samples, allowed["position"]) if not faults else ""
            faults.append(
                _sentence(found, quantity, worst, allowed[quantity], f"m{per_time}") + fits
            )
    turned = {name.rpartition(".")[0]: n for name, n in found.begun.items() if n}
    return Judged(largest, faults, found.not_judged, turned)


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
        text += f"; {len(left) - count} of {len(left)} samples leave {largest} at most"
    return text + (": suspect the recording" if count == 1 else "")


def _fitting(case: Case, samples: Samples, tolerance: float) -> str:
    """Return a phrase with all other readings of the attitudes, and units of the positions, with
    which the poses satisfy the rows; empty without any.
    """
    angles = driven_angles(case, samples)
    stated = replayed(case.mechanism, samples.motions, angles=angles).position
    limit = _LESS * float(np.nanmax(np.abs(stated)))
    meaning = samples.meaning
    changes: dict[str, Meaning] = {}
    for count in {len(pose.groups["attitude"]) for pose in meaning.bodies.values()}:
        for reading in readings(count):
            bodies = {
                name: replace(pose, reading=reading)
                if len(pose.groups["attitude"]) == count
                else pose
                for name, pose in meaning.bodies.items()
            }
            changes[f"{reading}"] = replace(meaning, bodies=bodies)
    for unit, factor in _FACTORS.items():
        changes[f"positions in {unit}, not m,"] = _scaled(meaning, factor)
        changes[f"positions in m, not {unit},"] = _scaled(meaning, 1.0 / factor)
    found: list[str] = []
    for words, change in changes.items():
        if change == meaning:
            continue
        other = samples_of(case, samples.recording, change, digits=False)
        tried = replayed(case.mechanism, other.motions, angles=angles).position
        if not np.nanmax(np.abs(tried)) <= limit:
            continue
        other = samples_of(case, samples.recording, change)
        whole = replayed(case.mechanism, other.motions, other.moved, angles)
        worst = whole.worst("position", tolerance)
        if worst is not None and worst.value <= worst.allowed:
            found.append(words)
    if not found:
        return ""
    listed = shortened(found, _NAMED, " or ")
    return f"; read as {listed} the gap is within the printed digits: say so in --map"


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
