"""Cost of the first use, stage by stage, and memory: each measurement is a new process, and the
kinds of processes take turns.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import msgspec

from ....case.case import Case
from ....harness.engine import Engine, runs_in_process
from ....harness.native_engine import NativeEngine
from .precision import level
from .rounds import Spread, spread

STAGES = (
    "import numpy",
    "import kincheck",
    "build",
    "first solve",
    "second solve",
    "ten more",
    "solve anew",
)
FIRST = STAGES[1:4]
"""The stages after the import of numpy, up to the first solution."""


def first_use(clock: Sequence[float]) -> None:
    """Build and solve the pickled case from standard input; print the seconds of all stages as a
    line of JSON.

    The last stage solves the same case again, as repeated calls of `solve` do.

    Args:
        clock: times of the start of the process, the import of numpy and the import of the solver.
    """
    case, tol = pickle.load(sys.stdin.buffer)
    begin = perf_counter()
    whole = level()
    model = whole.build(case)
    now = [begin, perf_counter()]
    for solves in (1, 1, 10):  # during ten more solves, programs are compiled
        for _ in range(solves):
            whole.solve(model, case, tol)
        now.append(perf_counter())
    anew, recent = 0.0, NativeEngine(every_body=True)
    for _ in range(2):  # so far nothing of this case is cached
        begin = perf_counter()
        recent.solve(recent.build(case), case, tol)
        anew = perf_counter() - begin
    stages = [*(b - a for each in (clock, now) for a, b in pairwise(each)), anew]
    print(json.dumps(dict(zip(STAGES, stages, strict=True))))


# Fewer rounds than for solves: a process takes a second.
MOST_ROUNDS = 5

NUMPY = "import numpy"
EMPTY, CACHED = "native, first use, empty code cache", "native, first use, code from the cache"
# For Linux, where getrusage also counts the memory of the parent process.
_TELL = """
try:
    with open("/proc/self/status") as lines:
        print(*(line.split()[1] for line in lines if line.startswith("VmHWM")))
except OSError:
    print()
"""
_IMPORT_NUMPY = f"import numpy{_TELL}"
_FIRST_USE = f"""
from time import perf_counter
clock = [perf_counter()]
import numpy
clock.append(perf_counter())
from kincheck.core import solve
clock.append(perf_counter())
from kincheck.core.extensions.laboratory.bench.processes import first_use
first_use(clock){_TELL}"""
# as the console script, but in one process, so that its memory is the total
_RUN = f"""
import sys
from kincheck.core.cli.main import main
status = main(sys.argv[1:]){_TELL}sys.exit(status)"""


class Process(msgspec.Struct, frozen=True, kw_only=True):
    """A kind of process.

    Attributes:
        seconds: time from start to end [s].
        status: exit status of the last process; 1 of a run is a deviation.
        stages: time of each stage, for the first use of the native engine [s].
        peak_mb: largest memory [MB]; null if the system does not report it.
    """

    what: str
    seconds: Spread
    status: int
    stages: dict[str, Spread]
    peak_mb: float | None

    @property
    def beyond_numpy(self) -> float | None:
        """Time from the import of numpy to the first solution [s]."""
        return sum(self.stages[name].median for name in FIRST) if self.stages else None


class _Kind(NamedTuple):
    """The command of a kind of process."""

    what: str
    code: str
    arguments: Sequence[str] = ()
    given: bytes = b""
    folder: Path | None = None
    rounds: int = 1


class _End(NamedTuple):
    """An ended process: its seconds, status and memory [MB], and the seconds of its stages."""

    seconds: float
    status: int
    peak_mb: float | None
    stages: Mapping[str, float]


def measure_processes(
    case: Case, name: str, engines: Sequence[Engine], tol: float, rounds: int
) -> list[Process]:
    """Measure processes that import numpy, that use the native engine for the first time, and that
    run `kincheck run` with each engine.

    Args:
        name: name of the case on the command line.
    """
    rounds = min(rounds, MOST_ROUNDS)
    given = pickle.dumps((case, tol))
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "kept"
        kinds = [
            _Kind(NUMPY, _IMPORT_NUMPY, rounds=rounds),
            _Kind(EMPTY, _FIRST_USE, given=given, rounds=rounds),
            _Kind(CACHED, _FIRST_USE, given=given, folder=kept, rounds=rounds),
        ]
        for engine in engines:
            mode = "" if engine.mode == "projection" else f" --mode {engine.mode}"
            options = f"--engine {engine.name}{mode}"
            arguments = ["run", name, *options.split(), "--jobs", "0"]
            turns = rounds if runs_in_process(engine) else 1
            kinds.append(_Kind(f"kincheck run {options}", _RUN, arguments, rounds=turns))
        # fills the code cache, and the file cache of the system
        _once(_Kind(CACHED, _FIRST_USE, given=given, folder=kept), kept)
        found: dict[str, list[_End]] = {kind.what: [] for kind in kinds}
        for turn in range(rounds):
            for kind in kinds:
                if turn < kind.rounds:
                    cache = kind.folder or Path(folder) / f"new {turn}"
                    found[kind.what].append(_once(kind, cache))
    return [
        Process(
            what=what,
            seconds=spread([end.seconds for end in ends]),
            status=ends[-1].status,
            stages={name: spread([end.stages[name] for end in ends]) for name in ends[0].stages},
            peak_mb=max((end.peak_mb for end in ends if end.peak_mb), default=None),
        )
        for what, ends in found.items()
    ]


def _once(kind: _Kind, cache: Path) -> _End:
    environment = {key: value for key, value in os.environ.items() if key != "KINCHECK_HISTORY"}
    if kind.given:  # `kincheck run` is timed as for a user, with the user's cache
        environment["XDG_CACHE_HOME"] = str(cache)
    begin = perf_counter()
    done = subprocess.run(
        [sys.executable, "-P", "-c", kind.code, *kind.arguments],
        input=kind.given,
        capture_output=True,
        env=environment,
        check=False,
    )
    seconds = perf_counter() - begin
    lines = done.stdout.decode("utf-8", "replace").splitlines()
    if done.returncode not in (0, 1) or not lines:
        raise RuntimeError(
            f"{kind.what}: exit status"
            f" {done.returncode}\n{done.stderr.decode('utf-8', 'replace')[-2000:]}"
        )
    peak = float(lines[-1]) / 1024.0 if lines[-1] else None
    return _End(seconds, done.returncode, peak, json.loads(lines[-2]) if kind.given else {})
