"""Disk cache between processes: machine code, tables and traced programs, keyed by their full
content.
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
"""Bytes of the checksum at the head of an entry."""
MOST = 2**28
"""Largest size of the cache [bytes], a quarter of a gigabyte: some thousands of mechanisms, most
with programs of about 50 kilobytes.
"""


def folder() -> Path | None:
    """Return the folder of the cache, below XDG_CACHE_HOME if set; None for a user without a home,
    who gets no cache.
    """
    given = os.environ.get("XDG_CACHE_HOME")
    try:
        return (Path(given) if given else Path.home() / ".cache") / "kincheck"
    except RuntimeError:
        return None


def kept(content: bytes, make: Callable[[], bytes]) -> bytes:
    """Return the cached bytes of a content; make and store them if there are none."""
    found = find(content)
    if found is None:
        found = make()
        if entry := _entry(content):
            _write(entry, found)
    return found


def find(content: bytes) -> bytes | None:
    """Return the cached bytes of a content, or None without an intact entry."""
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
    """Return whether the cache has an entry of the content."""
    entry = _entry(content)
    return entry is not None and entry.exists()


def _entry(content: bytes) -> Path | None:
    here = folder()
    return here and here / hashlib.sha256(content).hexdigest()


def _write(entry: Path, made: bytes) -> None:
    """Store an entry; without write access the next process only has to make it again."""
    import tempfile  # slow to import, and not needed for existing entries

    try:
        entry.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=entry.parent) as folder:
            whole = Path(folder) / entry.name
            whole.write_bytes(_checksum(entry, made) + made)
            whole.replace(entry)  # atomic, also with concurrent writers
        _shrink(entry.parent)
    except OSError:
        return


@cache
def _shrink(here: Path) -> None:
    """Delete the least recently used entries beyond `MOST`. Once per process, because it stats all
    files.
    """
    entries = sorted(
        _entries(here), key=lambda each: max(each[1].st_atime, each[1].st_mtime), reverse=True
    )
    sizes = accumulate(status.st_size for _, status in entries)
    for (path, _), size in zip(entries, sizes, strict=True):
        if size > MOST:
            path.unlink(missing_ok=True)  # another process may delete it too


def size() -> int:
    """Return the size of the cache [bytes]."""
    here = folder()
    return sum(status.st_size for _, status in _entries(here)) if here and here.exists() else 0


def _entries(here: Path) -> Iterator[tuple[Path, os.stat_result]]:
    with os.scandir(here) as found:
        for each in found:
            with suppress(FileNotFoundError):  # another process has just deleted it
                if each.is_file():
                    yield Path(each), each.stat()


def _checksum(entry: Path, made: bytes) -> bytes:
    """Return the checksum of an entry together with its name: entries of other contents never
    match.
    """
    return hashlib.sha256(entry.name.encode() + made).digest()
