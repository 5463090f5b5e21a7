"""What is kept on disk between processes: machine code, tables and traced programs, by all that
determines them.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from itertools import accumulate
from pathlib import Path

DIGEST = 32
"""Bytes of the checksum at the head of what is kept."""
MOST = 2**28
"""Bytes that are kept, a quarter of a gigabyte: some thousands of mechanisms, of whose programs
most take some 50 kilobytes.
"""


def folder() -> Path | None:
    """Where it is, below XDG_CACHE_HOME where that is set; None for a user without a home, for whom
    nothing is kept.
    """
    given = os.environ.get("XDG_CACHE_HOME")
    try:
        return (Path(given) if given else Path.home() / ".cache") / "kincheck"
    except RuntimeError:
        return None


def kept(content: bytes, make: Callable[[], bytes]) -> bytes:
    """What the content meant before; or made now, and kept."""
    found = find(content)
    if found is None:
        found = make()
        if entry := _entry(content):
            _write(entry, found)
    return found


def find(content: bytes) -> bytes | None:
    """What the content meant before, or None where there is nothing that is whole."""
    entry = _entry(content)
    if entry is None:
        return None
    try:
        kept = entry.read_bytes()
    except OSError:
        return None
    found = kept[DIGEST:]
    return found if _checksum(entry, found) == kept[:DIGEST] else None


def known(content: bytes) -> bool:
    """Whether there is something that the content meant before."""
    entry = _entry(content)
    return entry is not None and entry.exists()


def _entry(content: bytes) -> Path | None:
    here = folder()
    return here and here / hashlib.sha256(content).hexdigest()


def _write(entry: Path, made: bytes) -> None:
    """Keep it; a place that cannot be written only costs the next process the time to make it."""
    import tempfile  # slow to import, and what is kept already needs none

    try:
        entry.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=entry.parent) as folder:
            whole = Path(folder) / entry.name
            whole.write_bytes(_checksum(entry, made) + made)
            whole.replace(entry)  # whole or not at all, whoever else is writing it
        _shrink(entry.parent)
    except OSError:
        return


@cache
def _shrink(here: Path) -> None:
    """Leave no more than `MOST`: what was not used for longest goes. Once in a process, for it
    looks at every file.
    """
    entries = sorted(
        _entries(here), key=lambda each: max(each[1].st_atime, each[1].st_mtime), reverse=True
    )
    sizes = accumulate(status.st_size for _, status in entries)
    for (path, _), size in zip(entries, sizes, strict=True):
        if size > MOST:
            path.unlink(missing_ok=True)  # another process may be at it too


def size() -> int:
    """Bytes that are kept."""
    here = folder()
    return sum(status.st_size for _, status in _entries(here)) if here and here.exists() else 0


def _entries(here: Path) -> Iterator[tuple[Path, os.stat_result]]:
    with os.scandir(here) as found:
        for each in found:
            with suppress(FileNotFoundError):  # it has just gone
                if each.is_file():
                    yield Path(each), each.stat()


def _checksum(entry: Path, made: bytes) -> bytes:
    """Of an entry under its name: what was written for another is none."""
    return hashlib.sha256(entry.name.encode() + made).digest()
