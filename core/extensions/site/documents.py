"""The documents below a folder: runs, searches over releases, boards; only the keys of the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeAlias

import msgspec

from ...errors import KincheckError


class Change(msgspec.Struct, frozen=True, rename={"earlier": "from", "later": "to"}):
    """A change between two releases."""

    earlier: str
    later: str
    kind: str
    cases: dict[str, Any]
    right: str
    repeat: str
    field: str | None = None
    reproducer: str | None = None


class Bisection(msgspec.Struct, frozen=True, tag_field="schema", tag="kincheck-bisect/1"):
    """A search over releases."""

    engine: str
    package: str
    ends: tuple[str, str]
    changes: list[Change]
    tried: list[str]
    command: str


class Step(msgspec.Struct, frozen=True):
    """One run of a stepper."""

    error: float | None = None


class Row(msgspec.Struct, frozen=True):
    """A row of the board."""

    case: str
    engine: str
    integrator: str
    column: str
    state: str
    version: str = ""
    folder: str = ""
    message: str = ""
    runs: list[Step] = []


class Board(msgspec.Struct, frozen=True, tag_field="schema", tag="kincheck-board/1"):
    """A board."""

    rows: list[Row]


class Record(msgspec.Struct, frozen=True):
    """A pair of case and engine."""

    case: str
    engine: str
    mode: str
    outcome: str
    version: str | None = None
    message: str = ""
    us_per_step: float | None = None


class Results(msgspec.Struct, frozen=True, tag_field="schema", tag="kincheck-results/1"):
    """A run."""

    records: list[Record]


Document: TypeAlias = Bisection | Board | Results
KNOWN = b"kincheck-bisect/1", b"kincheck-board/1", b"kincheck-results/1"
HEAD = 200


def documents(folder: Path) -> list[tuple[Path, Document]]:
    """Return the documents below a folder, with their paths in it; other files are passed over.

    Raises:
        KincheckError: a document is damaged.
    """
    found: list[tuple[Path, Document]] = []
    for file in sorted(folder.rglob("*.json")):
        text = file.read_bytes()
        if not any(b'"%s"' % schema in text[:HEAD] for schema in KNOWN):
            continue
        try:
            document = msgspec.json.decode(text, type=Document)
        except msgspec.MsgspecError as error:
            raise KincheckError(f"{file}: {error}. Write the file again, or remove it.") from None
        found.append((file.relative_to(folder), document))
    return found
