"""The circumstances of a run: everything needed to repeat it and to understand its records."""

from __future__ import annotations

import hashlib
import platform
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from time import perf_counter
from typing import Any, TypeAlias

import msgspec
import numpy as np

from ..case.case import TIME, Case, Series, Truth
from ..case.notes import notes
from ..doors import offers
from ..mechanism.motions import Absolute, Motion, Slowed
from ..version import VERSION
from .compare import as_numbers
from .record import IDENTICAL, OutputSeries, Record, Results, Suspect
from .table_units import table_facts

Suspicion: TypeAlias = Callable[
    [Case, Sequence[Record], Mapping[str, Series] | None], Suspect | None
]
"""Suspicion of a case with a failed record, by all records and, as far as they are known, native's
outputs.
"""


def results(
    cases: Sequence[Case],
    records: Sequence[Record],
    *,
    started: datetime,
    tol: float,
    command: str,
    facts: Mapping[str, Any] | None = None,
    plan: Sequence[tuple[str, str, str]] = (),
    native: Mapping[str, Mapping[str, Series]] | None = None,
) -> Results:
    """Return the results of a run: its records, circumstances, references and suspicions.

    Args:
        facts: further circumstances, recorded at the start of the run. They replace those found
            here.
        plan: the planned pairs of an incomplete run.
        native: outputs of the native engine by case, as far as they are known.
    """
    known = {**circumstances(cases, started=started, tol=tol, command=command), **(facts or {})}
    known["cases"] = _with_identical(
        known["cases"],
        records,
        [case.name for case in cases if not (case.origin and case.origin.own)],
    )
    off = {record.case for record in records if record.outcome.bad}
    suspicions: list[Suspicion] = [each.load() for each in offers("suspicions").values() if off]
    suspects = {
        case.name: found
        for suspect in suspicions
        for case in cases
        if case.name in off and (found := suspect(case, records, (native or {}).get(case.name)))
    }
    return Results(
        run=known | {"engines": versions(records), **missing_pairs(plan, records)},
        records=list(records),
        references=references(cases),
        suspects=suspects,
    )


def _with_identical(
    cases: Mapping[str, Any], records: Sequence[Record], of_others: Sequence[str]
) -> dict[str, Any]:
    """Return the facts of the cases, with a note on a case if its reference is native's result."""
    own = {
        record.case
        for record in records
        if record.evidence and record.evidence.own and record.case in of_others
    }
    return {
        name: {**facts, "notes": [*dict.fromkeys((*facts["notes"], IDENTICAL))]}
        if name in own
        else facts
        for name, facts in cases.items()
    }


def circumstances(
    cases: Sequence[Case], *, started: datetime, tol: float, command: str
) -> dict[str, Any]:
    """Return the circumstances known before a run begins, as plain data for JSON."""
    return plain(
        {
            "kincheck": VERSION,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "engines": {},
            "platform": platform.platform(),
            "processor": processor(),
            "host": readable(platform.node()),
            "started": started.isoformat(timespec="seconds"),
            "tol": tol,
            "command": readable(command),
            "cases": {case.name: case_facts(case) for case in cases},
        }
    )


def versions(records: Sequence[Record]) -> dict[str, str | None]:
    """Return the version of each engine, by name; None if unknown.

    A resumed run may have several versions of an engine: all are given.
    """
    found: dict[str, list[str]] = {record.engine: [] for record in records}
    for record in records:
        # a crashed engine may not have reported its version
        if record.version is not None and record.version not in found[record.engine]:
            found[record.engine].append(record.version)
    return {engine: " and ".join(each) or None for engine, each in found.items()}


def missing_pairs(
    plan: Sequence[tuple[str, str, str]], records: Sequence[Record]
) -> dict[str, Any]:
    """Return case, engine and mode of planned pairs without a record, or an empty mapping."""
    made = {record.pair for record in records}
    pairs = [list(pair) for pair in plan if pair not in made]
    return {"missing": pairs} if pairs else {}


def references(cases: Sequence[Case]) -> dict[str, dict[str, OutputSeries]]:
    """Return the reference values of each case with a reference, by case and output."""
    return {
        case.name: {
            output.name: as_numbers(case.reference[output.name], output)
            for output in case.outputs
            if output.name in case.reference
        }
        for case in cases
        if case.reference
    }


def git_state(folder: Path) -> dict[str, Any] | None:
    """Return the commit, the branch (null if none is checked out), and whether the working tree
    differs from the commit.

    For changed files, add a digest of the difference. Return None without a repository.
    """

    def git(*arguments: str) -> str | None:
        try:
            done = subprocess.run(
                # a repository's configuration may name programs for these; a lock of its index
                # would stay if the time limit ends git
                [
                    *("git", "--no-optional-locks", "-c", "core.fsmonitor=false"),
                    *("-C", folder, *arguments),
                ],
                capture_output=True,
                text=True,
                timeout=10,
                check=False,
            )
        except (
            OSError,
            subprocess.TimeoutExpired,
        ):  # git is missing, or the drive does not respond
            return None
        return done.stdout.strip() if done.returncode == 0 else None

    commit = git("rev-parse", "HEAD")
    changed = git("status", "--porcelain", "--untracked-files=no")
    if not commit:
        return None
    edits = dict[str, str]()
    if changed:
        diff = git("diff", "--no-ext-diff", "--no-textconv", "HEAD") or ""
        edits["edits"] = hashlib.sha256(diff.encode()).hexdigest()[:12]
    return {
        "commit": commit,
        "branch": git("symbolic-ref", "--short", "HEAD"),
        "changed": None if changed is None else bool(changed),
        **edits,
    }


def conditions() -> dict[str, Any]:
    """Return the facts needed to compare later runs: state of the files, speed of the machine."""
    return {"git": git_state(Path.cwd()), "calibration_seconds": calibration()}


def calibration() -> float:
    """Return the time of a fixed piece of work, median of five [s], to compare different days.

    Time spent waiting for a processor does not count. The work takes about 20 ms: interpreter steps
    and small linear solves in turn, like the engines' loops.
    """
    matrix, column = np.eye(12) + 0.01 * np.arange(144.0).reshape(12, 12) / 144.0, np.ones(12)
    times: list[float] = []
    for _ in range(5):
        before, begin = waiting_seconds(), perf_counter()
        for _ in range(700):
            column = np.linalg.solve(matrix, column)
            column /= np.abs(column).max()
            total = 0.0
            for step in range(500):
                total += step * 0.5
        times.append(perf_counter() - begin - (waiting_seconds() - before))
    return float(np.median(times))


def case_facts(case: Case) -> dict[str, Any]:
    """Return what pages say of a case: its source, driver, motions, signs and outputs."""
    sweep = case.sweep
    swept = (
        {"name": TIME, "type": TIME}
        if sweep.driver == TIME
        else _driver(case, sweep.driver) | {"rate": sweep.rate}
    )
    own = table_facts(case)
    return {
        "source": case.source,
        "truth": truth_of(case),
        "driver": swept,
        "motions": {
            name: _driver(case, name) | {"motion": _motion(motion)}
            for name, motion in sweep.motions.items()
        },
        "signs": case.signs,
        "notes": notes(case),
        "outputs": {output.name: dict(output.facts) for output in case.outputs},
        **({"formerly": list(case.formerly)} if case.formerly else {}),
        **{key: own[key] for key in ("units", "is_table") if key in own},
    }


def _driver(case: Case, name: str) -> dict[str, Any]:
    driver = case.mechanism.driver(name)
    return {"type": driver.type, **asdict(driver), "design": case.sweep.path.design.get(name, 0.0)}


def _motion(motion: Motion) -> dict[str, Any]:
    return (
        _motion(motion.motion)
        if isinstance(motion, Absolute | Slowed)
        else {"type": getattr(motion, "type", "recorded"), **asdict(motion)}
    )


def plain(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return facts of any origin as plain data that JSON preserves.

    A value that JSON cannot represent becomes its text.
    """

    def encode_unknown(value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)  # pyright: ignore

    return msgspec.json.decode(msgspec.json.encode(dict(facts), enc_hook=encode_unknown))


def readable(text: str) -> str:
    """Return text that UTF-8 can encode: file names and messages may contain undecodable bytes."""
    return text.encode("utf-8", "replace").decode("utf-8")


def truth_of(case: Case) -> Truth:
    """Return the kind of a case's reference; consensus_only without one, as in `Record.truth`."""
    return case.truth if case.reference else Truth.CONSENSUS_ONLY


def processor() -> str:
    """Return the processor's name; platform.processor() gives none on Linux."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            return next(
                line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")
            )
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


_ACCOUNT = Path("/proc/thread-self/schedstat")


def waiting_seconds() -> float:
    """Return the seconds this thread was ready and waited for a processor; 0 except on Linux.

    Processor time does not replace wall-clock time: it misses the time in which a solve sleeps, or
    waits for a disk or a lock.
    """
    try:
        # fields: nanoseconds run, nanoseconds waited, time slices (Linux,
        # Documentation/scheduler/sched-stats.rst)
        return 1e-9 * int(_ACCOUNT.read_text("ascii").split()[1])
    except (OSError, IndexError, ValueError):
        return 0.0
