"""Recording of a run in progress, and continuation of a killed run with the same identity: a digest
of the content of cases and settings.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ..case.case import Case
from ..harness.engine import Engine
from ..harness.engine_versions import PATIENCE, versions
from ..harness.provenance import circumstances, conditions, plain, references
from ..harness.record import Record, Results
from ..harness.run import planned
from .store import HistoryError, Store


def digest(*things: Any) -> str:
    """Return the SHA-256 digest of data: dataclasses by class and fields, arrays by their bits.

    A pickle is unsuitable: it depends on which equal parts are one object. Objects of other types
    enter by their text; a text with a memory address makes every digest different.
    """
    whole = hashlib.sha256()
    for piece in _pieces(things):
        whole.update(piece)
    return whole.hexdigest()


def _pieces(thing: Any) -> Iterator[bytes]:
    if isinstance(thing, np.ndarray):
        values: Any = np.ascontiguousarray(thing)  # pyright: ignore
        yield f"array{values.shape}{values.dtype.str}".encode()
        yield values.tobytes()
    elif is_dataclass(thing) and not isinstance(thing, type):
        yield f"({type(thing).__qualname__}".encode()
        for field in fields(thing):
            yield f",{field.name}=".encode()
            yield from _pieces(getattr(thing, field.name))
        yield b")"
    elif isinstance(thing, Mapping):
        yield b"{"
        for key, value in thing.items():  # pyright: ignore
            yield from _pieces(key)
            yield from _pieces(value)
        yield b"}"
    elif isinstance(thing, Sequence) and not isinstance(thing, str | bytes):
        yield b"["
        for each in thing:  # pyright: ignore
            yield from _pieces(each)
        yield b"]"
    else:
        yield f"{type(thing).__name__}:{thing!r};".encode("utf-8", "surrogatepass")


@dataclass
class Keeping:
    """A run in a history.

    Attributes:
        run: its number.
        resumed: whether the run continues an earlier one.
        made: the records of the earlier run.
        facts: its circumstances, for `run`.
        problems: faults of the history; after the first, the run continues without a history.
    """

    store: Store
    run: int
    facts: Mapping[str, Any]
    resumed: bool = False
    made: Sequence[Record] = ()
    problems: list[str] = field(default_factory=list[str])

    def add(self, record: Record) -> None:
        """Keep a record."""
        if self.problems:
            return
        try:
            self.store.add_record(self.run, record)
        except HistoryError as error:
            self.problems.append(
                f"{error}; the records before {record.case} {record.engine} are stored as run"
                f" {self.run}"
            )

    def end(self, results: Results, *, interrupted: bool) -> None:
        """End the run, complete or interrupted."""
        if not self.problems:
            try:
                self.store.finish(self.run, results, "interrupted" if interrupted else "finished")
            except HistoryError as error:
                self.problems.append(
                    f"{error}; all records are stored, but run {self.run} has no end; --resume"
                    " gives it one"
                )
        self.store.close()


def keep(
    path: Path,
    cases: Sequence[Case],
    engines: Sequence[Engine],
    *,
    tol: float,
    command: str,
    settings: Mapping[str, Any],
    resume: bool,
    unread: Sequence[str] = (),
    sources: Mapping[str, str] | None = None,
) -> Keeping:
    """Begin a run in a history, or continue the last one with the same cases, engines, tolerance,
    limits, versions, machine and files.

    Args:
        settings: further circumstances.
        resume: continue an unfinished run; begin a new one if there is none.
        unread: names of requested cases that cannot be read.
        sources: digests of the modules of joint types and engines of users, by name: other code
            makes another run.

    Raises:
        HistoryError: the file cannot be read or written.
    """
    started = datetime.now(UTC)
    facts = circumstances(cases, started=started, tol=tol, command=command) | plain(
        {**settings, **conditions()}
    )
    plan = planned(cases, engines, unread)
    # the place of the work and the number of workers change no record
    limits = [settings.get(name) for name in ("timeout", "memory_gb")]
    git: Mapping[str, Any] = facts["git"] or {}
    state = [facts[name] for name in ("kincheck", "python", "numpy")] + [
        git.get(name) for name in ("commit", "changed", "edits")
    ]
    code = [*state, *(sources or {}).items()]
    found = versions(engines, min(settings.get("timeout", PATIENCE), PATIENCE))
    versioned = [
        (each.name, each.mode, version) for each, version in zip(engines, found, strict=True)
    ]
    machine = [*(facts[name] for name in ("host", "processor")), *versioned]
    identity = digest(cases, plan, tol, limits, code, machine)
    store = Store(path)
    try:
        if resume:
            with store.sparing():
                earlier = store.resume_run(identity)
                if earlier is not None:
                    return Keeping(
                        store,
                        earlier.id,
                        earlier.circumstances,
                        resumed=True,
                        made=store.records(earlier.id),
                    )
        run = store.begin_run(identity, plan, facts, references(cases))
    except BaseException:
        store.close()
        raise
    return Keeping(store, run, facts)
