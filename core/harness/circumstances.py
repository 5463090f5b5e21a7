"""The circumstances of a run: what a reader needs to repeat it and to understand its records."""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from typing import Any

import msgspec
import numpy as np

from ..motions import Absolute, Motion
from .case import TIME, Case, Truth
from .compare import as_numbers
from .record import Record, Results


def results(cases: Sequence[Case], records: Sequence[Record], *, started: datetime, tol: float, command: str) -> Results:
    """The records, with what a reader needs to repeat the run: versions, machine, settings, cases and their references."""
    circumstances = {
        "kincheck": importlib.metadata.version("kincheck"),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "engines": {record.engine: record.version for record in records},
        "platform": platform.platform(),
        "processor": _processor(),
        "started": started.isoformat(timespec="seconds"),
        "tol": tol,
        "command": readable(command),
        "cases": {case.name: _facts(case) for case in cases},
    }
    references = {
        case.name: {
            output.name: as_numbers(case.reference[output.name], output) for output in case.outputs if output.name in case.reference
        }
        for case in cases
        if case.reference
    }
    return Results(run=plain(circumstances), records=list(records), references=references)


def _facts(case: Case) -> dict[str, Any]:
    sweep = case.sweep
    swept = {"name": TIME, "type": TIME} if sweep.driver == TIME else _driver(case, sweep.driver) | {"rate": sweep.rate}
    return {
        "source": case.source,
        "truth": truth_of(case),
        "driver": swept,
        "motions": {name: _driver(case, name) | {"motion": _motion(motion)} for name, motion in sweep.motions.items()},
        "outputs": {output.name: asdict(output) for output in case.outputs},
    }


def _driver(case: Case, name: str) -> dict[str, Any]:
    driver = case.mechanism.driver(name)
    return {"type": driver.type, **asdict(driver), "design": case.sweep.path.design.get(name, 0.0)}


def _motion(motion: Motion) -> dict[str, Any]:
    return _motion(motion.motion) if isinstance(motion, Absolute) else {"type": motion.type, **asdict(motion)}


def plain(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Facts of any origin as JSON has them: what is read equals what was written. What has no counterpart becomes its text."""

    def instead(value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)  # pyright: ignore

    return msgspec.json.decode(msgspec.json.encode(dict(facts), enc_hook=instead))


def readable(text: str) -> str:
    """Text that UTF-8 can hold: file names and foreign messages may be undecodable bytes in disguise."""
    return text.encode("utf-8", "replace").decode("utf-8")


def truth_of(case: Case) -> Truth:
    """Without a reference there is only consensus, whatever the case claims."""
    return case.truth if case.reference else Truth.CONSENSUS_ONLY


def _processor() -> str:
    """The processor's name; platform.processor() gives none on Linux."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
