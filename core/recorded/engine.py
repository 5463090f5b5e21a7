"""A recording as an engine: its outputs and poses within their digits, beside engines
with a solver.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..case.case import Case, Quantity, Series, Sweep
from ..case.measures import ForceMeasure
from ..errors import KincheckError, number_of
from ..harness.compare import output_series
from ..harness.engine import RECORDED
from ..harness.native_engine import NativeEngine
from ..harness.record import ROWS
from ..harness.trajectory_check import Reported
from ..trajectory import QUANTITIES, Array, Trajectory
from .explain import Stated, explained
from .forces import judge_forces
from .meaning import Accuracy, unit_of
from .rows import judge_rows
from .samples import Samples, jet_of, point_motion
from .sweep import Resampled

TOL = 1e-12


@dataclass(frozen=True, eq=False)
class RecordedEngine:
    """A recording behind the protocol of engines; see `Engine`.

    Attributes:
        samples: of the recording, in terms of the case.
        resampled: the case at these samples, the only one of the engine.
    """

    name: str
    samples: Samples
    resampled: Resampled
    accuracy: Accuracy
    mode = RECORDED
    loop = "none"
    in_process = untimed = True

    @property
    def settings(self) -> Mapping[str, Any]:
        """File, columns, readings of attitudes and the stated accuracy."""
        recording, meaning = self.samples.recording, self.samples.meaning
        names = {
            name: recording.columns[use.column].head.name for name, use in meaning.numbers.items()
        }
        stated = {**self.accuracy.shares, **self.accuracy.sizes}
        return {
            "file": recording.file.name,
            "columns": names,
            "poses": {name: str(pose.reading) for name, pose in meaning.bodies.items()},
            **({"accuracy": stated} if stated else {}),
        }

    def version(self) -> str:
        """Return the program behind the file."""
        return self.samples.recording.program or "unknown program"

    def unsupported(self, case: Case) -> str | None:
        """Return a reason for every case but the one of the recording."""
        known = self.resampled.case.name
        return None if case.name == known else f"{self.name} is a recording of {known}"

    def build(self, case: Case) -> None:
        """Do nothing: the file has been read."""

    def solve(self, model: None, case: Case, tol: float) -> Reported:
        """Return the recorded outputs, judged by the rows if poses are recorded."""
        return self.report(case)

    def report(
        self, case: Case, solved: NDArray[np.bool_] | None = None, message: str = ""
    ) -> Reported:
        """Return the outputs and the verdict of the rows.

        Args:
            solved: samples with values, shape (n,); all by default.
            message: on the others.
        """
        outputs = {output.name: self._series(case, output) for output in case.outputs}
        judged = judge_rows(case, self.samples, self.accuracy)
        standard = {**self._native, **case.reference}
        columns = {name: each.values for name, each in self.samples.numbers.items()}
        values = self.resampled.lead, self.resampled.values, self._solved
        slips = explained(case, outputs, columns, standard, self._columns, *values)
        notes = [*slips, *self.samples.notes, *self.resampled.notes]
        if gaps := self.samples.gaps:
            listed = ", ".join(f"{name} at {number_of(n, 'sample')}" for name, n in gaps.items())
            notes.append(f"not judged where nothing is recorded: {listed}")
        if judged.begun:
            listed = ", ".join(f"{name} {turns:+d}" for name, turns in judged.begun.items())
            notes.append(
                f"coupled joints begin after whole turns, which poses leave open: {listed}"
            )
        if judged.not_judged:
            joints = ", ".join(f"{name} ({body})" for name, body in judged.not_judged.items())
            notes.append(f"joints not judged, without the pose of a body: {joints}")
        forces, out_of_balance = judge_forces(case, self.samples, self.accuracy)
        details: dict[str, Any] = {"notes": notes, **({"forces": forces} if forces else {})}
        if judged.largest:
            details[ROWS] = dict(judged.largest)
        gap = judged.largest.get("position", float("nan"))
        return Reported(
            self.samples.count,
            outputs,
            gap,
            faults=[*judged.faults, *out_of_balance],
            judged=bool(judged.largest or forces),
            details=details,
            solved=solved,
            message=message,
        )

    def _series(self, case: Case, output: Quantity) -> Series:
        """Return an output of its columns, or else of the recorded poses."""
        own, count = self.samples.numbers.get(output.name), self.samples.count
        if own is not None:
            columns = [
                own,
                *(self.samples.numbers.get(f"{output.name}.{q}") for q in QUANTITIES[1:]),
            ]
            values = [None if each is None else each.values for each in columns]
            halves = [np.zeros(count) if each is None else each.half for each in columns]
        else:
            values, halves = self._of_poses(case, output)
        position = values[0]
        if position is None:
            lack = "there is no column of it, and no poses of its bodies"
            return Series(np.full(count, np.nan), possible=False, reason=lack)
        if not self.resampled.rated:
            values = [position, None, None]
        if output.period and (native := self._native.get(output.name)) is not None:
            turns = (native.position - position) / output.period
            position = position + output.period * np.round(np.nan_to_num(turns))
        uncertainty = {
            quantity: half + self._driven(output.name, quantity) + self._stated(output, quantity, x)
            for quantity, x, half in zip(QUANTITIES, values, halves, strict=True)
            if x is not None
        }
        return Series(position, *values[1:], uncertainty=uncertainty)

    def _of_poses(self, case: Case, output: Quantity) -> tuple[list[Array | None], list[Array]]:
        """Return an output by the recorded poses, and the share of their digits."""
        mechanism, motions, count = case.mechanism, self.samples.motions, self.samples.count
        none: list[Array] = [np.zeros(count) for _ in QUANTITIES]
        if isinstance(output, ForceMeasure) or not motions:
            return [None, None, None], none
        points = {name: point_motion(mechanism, motions, name, count) for name in output.points}
        known = {name: each for name, each in points.items() if each is not None}
        base = jet_of(mechanism, motions, output, count)
        if base is None or len(known) < len(points):
            return [None, None, None], none
        everywhere, still = np.ones(count, dtype=np.bool_), np.zeros(count, dtype=np.int64)
        found = output_series(case, output, Trajectory(known, everywhere, still, 0.0))
        halves = none
        bodies = {mechanism.point(name).body for name in output.points}
        for name in bodies & self.samples.moved.keys():
            for moved in self.samples.moved[name]:
                other = jet_of(mechanism, {**motions, name: moved}, output, count)
                assert other is not None
                for half, a, b in zip(halves, _orders(other), _orders(base), strict=True):
                    change: Array = np.abs(a - b)
                    # a whole turn is none, and Euler parameters of both signs are one attitude
                    if output.period:
                        change = np.minimum(change, np.abs(change - output.period))
                    elif output.unit == "1":
                        change = np.minimum(change, np.abs(a + b))
                    half += np.nan_to_num(change)
        return [found.position, found.velocity, found.acceleration], halves

    def _stated(self, output: Quantity, quantity: str, values: Array) -> float:
        """Return the stated accuracy of an output."""
        largest = float(np.abs(np.nan_to_num(values)).max(initial=0.0))
        return self.accuracy.of_output(output.name, quantity, output.unit, largest)

    @property
    def _columns(self) -> dict[str, Stated]:
        found: dict[str, Stated] = {}
        for name, use in self.samples.meaning.numbers.items():
            column = self.samples.recording.columns[use.column]
            recording = self.samples.recording
            unit, size, offset = unit_of(recording.file, column.head, use, recording.angle)
            found[name] = Stated(column.head.name, use.sign, offset, unit, size, use.si)
        return found

    def _solved(self, sweep: Sweep) -> Mapping[str, Series]:
        return native_outputs(replace(self.resampled.case, sweep=sweep))

    @cached_property
    def _native(self) -> Mapping[str, Series]:
        """Native's outputs at the samples; none if it cannot solve the case."""
        return native_outputs(self.resampled.case)

    @cached_property
    def _variants(self) -> list[Mapping[str, Series]]:
        return [*map(self._solved, self.resampled.variants)]

    def _driven(self, name: str, quantity: str) -> Array:
        """Return the share of the digits of time and drivers in an output of native."""
        total = np.zeros(self.samples.count)
        base: Array | None = getattr(self._native.get(name), quantity, None)
        for each in self._variants:
            other: Array | None = getattr(each.get(name), quantity, None)
            if base is not None and other is not None:
                total = total + np.nan_to_num(np.abs(other - base))
        return total


def native_outputs(case: Case) -> dict[str, Series]:
    """Return the native engine's outputs of a case; none if it cannot be solved."""
    engine = NativeEngine()
    try:
        found = engine.solve(engine.build(case), case, TOL)
    except KincheckError:  # the native engine's own record says why
        return {}
    return {output.name: output_series(case, output, found) for output in case.outputs}


def _orders(jet: Any) -> tuple[Array, Array, Array]:
    return jet.x, jet.v, jet.a
