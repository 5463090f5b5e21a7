"""The documents below a folder: runs, searches over releases, boards."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

import msgspec

from ...errors import KincheckError
from ...harness.record import Results
from ..bisect.results import Bisection
from ..board.results import Board

Document: TypeAlias = Bisection | Board | Results
KINDS: dict[bytes, type[Document]] = {
    b'"kincheck-bisect/1"': Bisection,
    b'"kincheck-board/1"': Board,
    b'"kincheck-results/1"': Results,
}
HEAD = 200
"""Bytes at the start of a document with its schema."""


def documents(folder: Path) -> list[tuple[Path, Document]]:
    """Return the documents below a folder, with their paths in it; other files are passed over.

    Raises:
        KincheckError: a document is damaged.
    """
    found: list[tuple[Path, Document]] = []
    # a row of the board is in board.json too
    for file in sorted({*folder.rglob("*.json")} - {*folder.rglob("row.json")}):
        text = file.read_bytes()
        for schema, kind in KINDS.items():
            if schema not in text[:HEAD]:
                continue
            try:
                found.append((file.relative_to(folder), msgspec.json.decode(text, type=kind)))
            except msgspec.MsgspecError as error:
                raise KincheckError(
                    f"{file}: {error}. Write the file again, or remove it."
                ) from None
    return found
