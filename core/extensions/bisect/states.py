"""The state of each release: installed, run and kept, so a stopped search goes on later."""

from __future__ import annotations

import json
import math
import pickle
import sys
import tempfile
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from time import monotonic

import msgspec

from ...case.io.atomic_files import write_all
from ...case.io.escape import file_name
from ...errors import number_of, refuse
from ...harness.record import to_json
from ...history.runs import digest
from ...version import VERSION
from .inside import Done, Task
from .releases import Environments, NotInstallableError, run
from .signature import READER, Answer, Signature, answer_of, answer_of_reader

INSIDE = f"{__package__}.inside"
STARTUP = 120.0
"""Longest start of a run without its cases, on a busy machine [s]."""


@dataclass
class States:
    """The states of releases, each found once.

    Attributes:
        found: state by release; None if it cannot be installed.
        reasons: why not, by release.
        seconds: time of each run [s].
    """

    releases: list[str]
    task: Task
    environments: Environments
    found: dict[str, Signature | None] = field(default_factory=dict[str, Signature | None])
    reasons: dict[str, str] = field(default_factory=dict[str, str])
    seconds: list[float] = field(default_factory=list[float])

    def __call__(self, place: int) -> Signature | None:
        """Return the state of the release at a place of the row."""
        release = self.releases[place]
        if release not in self.found:
            self.found[release] = self._state(release)
        return self.found[release]

    def _state(self, release: str) -> Signature | None:
        begin, environments = monotonic(), self.environments
        name = f"{environments.package} {release}"
        try:
            python = environments.python(release)
            kept = self._kept(release)
            if before := kept.is_file():
                done = msgspec.json.decode(kept.read_bytes(), type=Done)
            else:
                done = self._run(python)
                if done.shadow and not environments.whole:
                    environments.whole = True
                    environments.python(release, again=True)
                    done = self._run(python)
                if done.shadow:
                    raise NotInstallableError(f"{done.shadow} would be loaded in its place")
                if self._lasting(done, release):
                    refuse(write_all([(kept, to_json(done))]))
                self.seconds.append(monotonic() - begin)
        except NotInstallableError as error:
            self.reasons[release] = str(error)
            tell(f"{name}: cannot be installed: {error}")
            return None
        found = {each.case: answer_of(each) for each in done.records}
        if done.problem:
            lost = Answer("error", done.problem, runs=False)
            found = {plain.name: lost for plain, _ in self.task.cases}
        found |= self._reader(python)
        tell(f"{name}: {counts(found)}{', kept from before' if before else self._left()}")
        return found

    def _run(self, python: str) -> Done:
        with tempfile.TemporaryDirectory() as folder:
            task, out = Path(folder) / "task", Path(folder) / "out.json"
            task.write_bytes(pickle.dumps(self.task))
            patience = STARTUP + 2.0 * self.task.timeout * (1 + len(self.task.cases))
            status, said = run([python, "-P", "-m", INSIDE, str(task), str(out)], patience)
            if out.is_file():
                return msgspec.json.decode(out.read_bytes(), type=Done)
        if "Timeout (" in said:
            said = f"its import takes more than {self.task.timeout:g} s"
        last = said.strip().splitlines()[-1:]
        return Done(problem=f"its process ended with status {status}: {' '.join(last)[:300]}")

    def _reader(self, python: str) -> Signature:
        """Return the numbers of the simulator's own reader, if the engine has a probe."""
        probe = probe_of(self.task.engine)
        if probe is None:
            return {}
        status, said = run([python, "-P", str(probe), "--read"], self.task.timeout)
        if status or not said.strip():
            last = " ".join(said.strip().splitlines()[-1:])[:300]
            return {READER: Answer("error", last, runs=False)}
        return {READER: answer_of_reader(json.loads(said.splitlines()[-1]))}

    def _kept(self, release: str) -> Path:
        """Return the file of a release's answers to this task, in this state of kincheck."""
        sources = sorted(
            (str(each), each.stat().st_size, each.stat().st_mtime_ns)
            for package in ("kincheck.core", "kincheck.adapters")
            for each in Path(str(files(package))).rglob("*.py")
        )
        environment = self.environments.path_of(release)
        key = digest(
            VERSION, replace(self.task, native=((), ()), timeout=0.0), environment.name, sources
        )
        return environment / f".{key[:32]}.json"

    def _lasting(self, done: Done, release: str) -> bool:
        """Return whether a run repeats: its engine is of the release or of kincheck, and nothing
        took too long.
        """
        homes = self.environments.path_of(release), Path(str(files("kincheck.adapters")))
        ours = any(Path(done.file).is_relative_to(home) for home in homes)
        return ours and all(each.outcome.value != "timeout" for each in done.records)

    def _left(self) -> str:
        done = len(self.found) + 1
        wanted = min(len(self.releases), 2 + math.ceil(math.log2(len(self.releases))))
        most = max(0, wanted - done)
        left = most * sum(self.seconds) / len(self.seconds)
        more = number_of(most, "more release")
        told = f" in {self.seconds[-1]:.0f} s"
        return f"{told}; {more} for one change, about {left:.0f} s" if most else told


def probe_of(engine: str) -> Path | None:
    """Return the script for an engine's own numbers without kincheck; None without one."""
    path = Path(__file__).parent / "probes" / f"{file_name(engine.partition('-')[0])}.py"
    return path if path.is_file() else None


def counts(found: Signature) -> str:
    """Return the number of cases with each outcome."""
    outcomes = [each.outcome for each in found.values()]
    return ", ".join(f"{outcomes.count(each)} {each}" for each in dict.fromkeys(outcomes))


def tell(text: str) -> None:
    """Print a line of progress."""
    print(text, file=sys.stderr, flush=True)


def require_runs(found: Signature, release: str) -> str:
    """Return why a release runs none of the cases; empty if it runs one."""
    if any(each.runs for name, each in found.items() if name != READER):
        return ""
    first = next(iter(found.values()))
    return f"{release}: {first.outcome}: {first.message}"
