"""A program of any language as an engine: the case and its samples go in as files, and a table of
outputs or poses comes out.
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
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..case.case import TIME, Case, Truth
from ..case.io.case_file import case_text
from ..case.io.document import fault
from ..errors import CaseError, KincheckError, SolveError, UnsupportedError, number_of
from ..harness.trajectory_check import Reported
from ..trajectory import Array
from .engine import RecordedEngine
from .meaning import Accuracy, Meaning, Reader, inputs_of
from .readers import read_recording
from .recording import Head
from .samples import samples_of
from .sweep import as_is

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
        form = f'say {OPTION} "prog {{case}} {{samples}} {{out}}"'
        try:
            fields = {name for _, name, *_ in string.Formatter().parse(self.command) if name}
            words = shlex.split(self.command)
        except ValueError as error:
            raise KincheckError(f"{OPTION}: {self.command!r}: {error}; {form}") from None
        if not words or not fields.issubset(FILES) or "out" not in fields:
            raise KincheckError(
                f"{OPTION}: found {self.command!r}, expected a program, {{out}}, and no other"
                f" braces than {{case}} and {{samples}}; {form}"
            )
        if shutil.which(words[0]) is None:
            raise KincheckError(
                f"{OPTION}: there is no program {words[0]!r} that can be run; correct its name, or"
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
            written(case)
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
            files["case"].write_text(written(case), encoding="utf-8")
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


def written(case: Case) -> str:
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
        heads += [name, f"{name}.velocity", f"{name}.acceleration"]
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
    meanings: list[Meaning] = []

    def choose(heads: Sequence[Head]) -> list[int]:
        found = Reader(file, case, heads).read([])
        inputs = inputs_of(case)
        numbers = {key: use for key, use in found.numbers.items() if key not in inputs}
        meanings.append(Meaning(numbers, found.bodies))
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
    engine = RecordedEngine(name, samples, as_is(case), Accuracy({}, {}))
    return engine.report(case, solved, message)
