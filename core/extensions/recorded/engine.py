"""A recording as an engine: its outputs and poses within their digits, beside engines with a
solver; and a program of any language as one: the case and its samples go in as files, and a table
of outputs or poses comes out.
"""

from __future__ import annotations

import csv
import hashlib
import os
import shlex
import shutil
import signal
import string
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...case.case import TIME, Case, Quantity, Series, Sweep, Truth
from ...case.io.case_file import case_text
from ...case.io.document import fault
from ...case.io.reference_samples import RATES
from ...case.measures import ForceMeasure
from ...errors import (
    CaseError,
    KincheckError,
    SolveError,
    UnsupportedError,
    number_of,
    shortened,
)
from ...harness.compare import output_series
from ...harness.engine import RECORDED
from ...harness.native_engine import NativeEngine
from ...harness.record import ROWS
from ...harness.trajectory_check import Reported
from ...trajectory import QUANTITIES, Array, Trajectory
from .explain import Stated, explain_slips
from .judgement import judge_forces, judge_rows
from .meaning import Accuracy, Meaning, Reader, inputs_of, unit_of
from .readers import Head, read_recording
from .samples import Samples, jet_of, point_motion, samples_of
from .sweep import Resampled, at_own_samples

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
    accuracy: Accuracy = field(default_factory=Accuracy)
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
        turned = [self._whole_turns(output, outputs[output.name]) for output in case.outputs]
        judged = judge_rows(case, self.samples, self.accuracy)
        standard = {**self._native, **case.reference}
        columns = {name: each.values for name, each in self.samples.numbers.items()}
        values = self.resampled.lead, self.resampled.values, self._solve_sweep
        slips = explain_slips(case, outputs, columns, standard, self._columns, *values)
        notes = [*slips, *filter(None, turned), *self.samples.notes, *self.resampled.notes]
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
        count = self.samples.count
        if output.name in self.samples.numbers:
            columns = [self.samples.numbers.get(output.name + ending) for ending in RATES]
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
            quantity: half
            + self._driver_digits(output.name, quantity)
            + self.accuracy.of_output(output, quantity, x)
            for quantity, x, half in zip(QUANTITIES, values, halves, strict=True)
            if x is not None
        }
        return Series(position, *values[1:], uncertainty=uncertainty)

    def _whole_turns(self, output: Quantity, found: Series) -> str:
        """Return a sentence on the whole turns by which a column differs from an output; empty
        without any.
        """
        column = self.samples.numbers.get(output.name)
        if column is None or not output.period:
            return ""
        turns = np.round((column.values - found.position) / output.period)
        rows = np.flatnonzero(np.nan_to_num(turns))
        if not rows.size:
            return ""
        which = [*dict.fromkeys(f"{n:+.0f}" for n in turns[rows].tolist())]
        where = f"at {len(rows)} of {number_of(len(turns), 'sample')}, first at {rows[0]}"
        if len(rows) == len(turns):
            where = "at all samples"
        listed = shortened(which, 3, " or ")
        return f"{output.name}: the recording is off by whole turns, {listed}, {where}: left out"

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

    @property
    def _columns(self) -> dict[str, Stated]:
        found = dict[str, Stated]()
        for name, use in self.samples.meaning.numbers.items():
            column = self.samples.recording.columns[use.column]
            recording = self.samples.recording
            unit, size, offset = unit_of(recording.file, column.head, use, recording.angle)
            found[name] = Stated(column.head.name, use.sign, offset, unit, size, use.si)
        return found

    def _solve_sweep(self, sweep: Sweep, outputs: Sequence[Quantity]) -> Mapping[str, Series]:
        return native_outputs(replace(self.resampled.case, sweep=sweep, outputs=tuple(outputs)))

    @cached_property
    def _native(self) -> Mapping[str, Series]:
        """Native's outputs at the samples; none if it cannot solve the case."""
        return native_outputs(self.resampled.case)

    @cached_property
    def _variants(self) -> list[Mapping[str, Series]]:
        outputs = self.resampled.case.outputs
        return [self._solve_sweep(sweep, outputs) for sweep in self.resampled.variants]

    def _driver_digits(self, name: str, quantity: str) -> Array:
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


OPTION = "--engine-command"
FILES = ("case", "samples", "out")
REFUSES = 3
"""Exit status of a program that cannot express a case."""
_LAST = 300


@dataclass(frozen=True)
class ProgramEngine:
    """A program behind the protocol of engines; see `Engine`.

    Attributes:
        command: with {case} (TOML), {samples} and {out} (CSV) in place of files.
    """

    command: str
    mode = "simulate"
    loop = "simulator"
    untimed = True

    def __post_init__(self) -> None:
        form = f'Say {OPTION} "prog {{case}} {{samples}} {{out}}"'
        try:
            fields = {name for _, name, *_ in string.Formatter().parse(self.command) if name}
            words = shlex.split(self.command)
        except ValueError as error:
            raise KincheckError(f"{OPTION}: {self.command!r}: {error}. {form}") from None
        if not words or not fields.issubset(FILES) or "out" not in fields:
            raise KincheckError(
                f"{OPTION}: found {self.command!r}, expected a program, {{out}}, and no other"
                f" braces than {{case}} and {{samples}}. {form}"
            )
        if shutil.which(words[0]) is None:
            raise KincheckError(
                f"{OPTION}: there is no program {words[0]!r} that can be run. Correct its name, or"
                " give its path"
            )

    @property
    def name(self) -> str:
        """The stem of the program, or of its script: the last word that is a file."""
        first, *others = shlex.split(self.command)
        return Path(next((word for word in others[::-1] if Path(word).is_file()), first)).stem

    @property
    def settings(self) -> Mapping[str, str]:
        """The command."""
        return {"command": self.command}

    def version(self) -> str | None:
        """Return the digest of the program and its scripts, or None if there is none."""
        first, *others = shlex.split(self.command)
        if (found := shutil.which(first)) is None:
            return None
        files = [Path(found), *(Path(word) for word in others if Path(word).is_file())]
        return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]

    def unsupported(self, case: Case) -> str | None:
        """Return a reason if no case file can express the case; the program itself has its say
        later.
        """
        try:
            case_for_program(case)
        except CaseError as error:
            return str(error)
        return None

    def build(self, case: Case) -> None:
        """Do nothing: the program builds its own model."""

    def solve(self, model: None, case: Case, tol: float) -> Reported:
        """Run the program on a case.

        Raises:
            UnsupportedError: the program refuses the case.
            SolveError: it fails.
            CaseError: its table cannot be read.
        """
        with tempfile.TemporaryDirectory(prefix="kincheck-") as folder:
            files = {
                name: Path(folder) / f"{name}.{'toml' if name == 'case' else 'csv'}"
                for name in FILES
            }
            files["case"].write_text(case_for_program(case), encoding="utf-8")
            write_samples(case, files["samples"])
            said = self._run({name: str(file) for name, file in files.items()})
            if not files["out"].is_file():
                raise SolveError(f"{self.name} wrote no {{out}}{said}")
            try:
                return read_answer(self.name, case, files["out"])
            except CaseError as error:
                raise CaseError(str(error).replace(f"{folder}{os.sep}", "")) from None

    def _run(self, files: Mapping[str, str]) -> str:
        """Run the program. Return the end of its complaints, for a message."""
        words = [word.format(**files) for word in shlex.split(self.command)]
        # in the process group of the worker, which ends it in time
        done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, check=False)
        lines = done.stderr.decode(errors="replace").strip()[-_LAST:].splitlines()
        said = f": {lines[-1]}" if lines else ""
        if done.returncode == REFUSES:
            raise UnsupportedError(f"{self.name} refuses the case{said}")
        if done.returncode < 0:
            end = f"ended by signal {signal.Signals(-done.returncode).name}"
            raise SolveError(f"{self.name} {end}{said}")
        if done.returncode:
            raise SolveError(f"{self.name} ended with status {done.returncode}{said}")
        return said


def case_for_program(case: Case) -> str:
    """Return the case file of a case without its reference; uneven samples stand in their own file
    alone.
    """
    bare = replace(case, reference={}, origin=None, truth=Truth.CONSENSUS_ONLY)
    values = case.sweep.values
    even = replace(case.sweep, values=np.linspace(values[0], values[-1], len(values)))
    return case_text(replace(bare, sweep=even))


def write_samples(case: Case, file: Path) -> None:
    """Write time, and value, velocity and acceleration of each driver at the samples, SI."""
    mechanism, path = case.mechanism, case.sweep.path
    names = [driver.name for driver in mechanism.drivers]
    heads, columns = [TIME], [path.times]
    for name, (x, v, a) in zip(names, path.drive(names, path.times).swapaxes(0, 1), strict=True):
        heads += [f"{name}{ending}" for ending in RATES]
        columns += [x + mechanism.design_value(name), v, a]
    with file.open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(heads)
        table.writerows(zip(*(map(repr, each.tolist()) for each in columns), strict=True))


def read_answer(name: str, case: Case, file: Path) -> Reported:
    """Return the answer in a table of outputs or poses; a row without any is an unsolved sample.

    Raises:
        CaseError: the table cannot be read, or has another number of rows than samples.
    """
    meanings = list[Meaning]()

    def choose(heads: Sequence[Head]) -> list[int]:
        found = Reader(file, case, heads).read([])
        inputs = inputs_of(case)
        numbers = {key: use for key, use in found.numbers.items() if key not in inputs}
        meanings.append(Meaning(numbers, found.bodies, unknown=found.unknown))
        return sorted({use.column for use in meanings[-1].uses})

    recording = read_recording(file, choose)
    samples = samples_of(case, recording, meanings[-1], whole=True)
    count = len(case.sweep.values)
    if samples.count != count:
        raise fault(file, "", f"found {samples.count} rows, expected {count}, one a sample")
    values: Array = np.array([each.values for each in samples.recording.columns.values()])
    solved = np.atleast_1d(np.isfinite(values).any(axis=0))
    lost = number_of(int((~solved).sum()), "sample")
    message = "" if solved.all() else f"{name} gives no values at {lost}"
    engine = RecordedEngine(name, samples, at_own_samples(case))
    return engine.report(case, solved, message)
