"""Recorded motions and reactions, judged by the masses and loads of the mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..case.case import Case, size
from ..harness.trajectory_check import CONSTRAINED
from ..kinematics import Needed, needed_forces
from ..mechanism.mechanism import Mechanism
from ..trajectory import Array, BodyMotion
from ..unit_text import value_text
from .meaning import REACTIONS, Accuracy
from .samples import Samples

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
    judge = _Judge(replace(mechanism, drivers=drivers), samples, whole)
    share = CONSTRAINED + accuracy.shares.get("acceleration", 0.0)
    return judge.judged(share, size(case))


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
        at: dict[str, BodyMotion] = {}
        for name, m in motions.items():
            assert m.v is not None
            assert m.a is not None
            at[name] = BodyMotion(m.r[rows], m.p[rows], m.v[rows], m.a[rows])
        return needed_forces(self.mechanism, at, self.times[rows])

    def judged(self, share: float, extent: float) -> tuple[dict[str, float], list[str]]:
        """Return the largest differences and the faults.

        Args:
            share: tolerance beside the digits, of the largest force, or of this at the mechanism's
                extent [m].
        """
        largest: dict[str, float] = {}
        faults: list[str] = []
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
                    faults.append(_sentence(what, unit, known[k], limit, int(self.there[k])))
                    break
        return largest, faults

    def _differences(self, needed: Needed, rows: Rows) -> list[tuple[str, str, Array, Array]]:
        """Return names, units, differences and their digits: free forces by body, then recorded
        reactions by joint.
        """
        found: list[tuple[str, str, Array, Array]] = []
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
        base = self._named(self.motions, what, rows)
        total = np.zeros(len(rows))
        for name, moved in self.samples.moved.items():
            for motion in moved if name in self.motions else ():
                total += np.abs(self._named({**self.motions, name: motion}, what, rows) - base)
        return np.nan_to_num(total)

    def _named(self, motions: Mapping[str, BodyMotion], what: str, rows: Rows) -> Array:
        found = self._differences(self._at(motions, rows), rows)
        return next(values for name, _, values, _ in found if name == what)


def _sentence(what: str, unit: str, value: float, allowed: float, sample: int) -> str:
    off, limit = (value_text(f"{x:.3g}", unit) for x in (value, allowed))
    if "." in what:
        return f"the recorded {what} is off by {off} at sample {sample}, tolerance {limit}"
    return (
        f"the recorded motion leaves {off} on {what} at sample {sample} for no joint or driver to"
        f" carry, tolerance {limit}: other masses or loads than those of the case"
    )
