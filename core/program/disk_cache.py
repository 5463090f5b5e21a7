"""Disk cache between processes: machine code, tables and traced programs, keyed by their full
content.

Entries become running code, so only this user may have written them. A folder that others can
write, or could replace, is not used; an entry of another user, or an unreadable one, is made
again.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial
from itertools import accumulate
from pathlib import Path
from typing import TypeVar

import msgspec

Found = TypeVar("Found")

DIGEST = 32
"""Bytes of the checksum at the head of an entry; it finds damage, and proves no author."""
MOST = 2**28
"""Largest size of the cache [bytes], a quarter of a gigabyte: some thousands of mechanisms, most
with programs of about 50 kilobytes.
"""
REMEDY = "make it writable by you alone, or set XDG_CACHE_HOME to another folder"
UNREADABLE = ValueError, TypeError, LookupError, OSError, msgspec.MsgspecError
"""Errors of reading bytes that are no entry."""


def folder() -> Path | None:
    """Return the folder of the cache, below XDG_CACHE_HOME if that is an absolute path; None for a
    user without a home, who gets no cache.
    """
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not given.is_absolute():  # void by the XDG base directory specification
        try:
            given = Path.home() / ".cache"
        except RuntimeError:
            return None
    return given / "kincheck" if given.is_absolute() else None


def doubt(here: Path) -> str:
    """Make the folder of the cache if it is missing; return why it must not be used, or an empty
    text.

    The user owns it and what leads to it, or root what leads to it, and nobody else can write
    there; a folder above it may have the sticky bit instead, as /tmp.

    Raises:
        OSError: it cannot be made.
    """
    for each in (*reversed(here.parents), here):
        if not each.exists():
            each.mkdir(mode=0o700, exist_ok=True)
    if os.name == "nt":  # the profile of a user is closed to others
        return ""
    if here.is_symlink() or not here.is_dir():
        return f"{here} is no folder"
    for each in _way(here):
        status, above = each.lstat(), each != here
        if not (_is_own(status) or (above and status.st_uid == 0)):
            return f"{each} belongs to another user"
        if _open_to_others(status) and not (above and status.st_mode & stat.S_ISVTX):
            return f"other users can write in {each}"
    if here.stat().st_mode & 0o077:  # as older versions made it
        here.chmod(0o700)
    return ""


def _way(path: Path) -> Iterator[Path]:
    """Yield the folders and links on the way to a path, and the path."""
    here, waiting = Path(path.anchor), [*reversed(path.parts[1:])]
    yield here
    while waiting:
        part = waiting.pop()
        there = here.parent if part == ".." else here / part
        yield there
        if there.is_symlink():
            target = there.readlink()
            here = Path(target.anchor) if target.is_absolute() else here
            waiting += reversed(target.parts[1:] if target.is_absolute() else target.parts)
        else:
            here = there


def _is_own(status: os.stat_result) -> bool:
    return os.name == "nt" or status.st_uid == os.geteuid()


def _open_to_others(status: os.stat_result) -> bool:
    """Return whether others can write a folder or a file.

    A group with the user's name and without further members is none: many systems let it write.
    """
    if os.name == "nt" or stat.S_ISLNK(status.st_mode):
        return False
    if status.st_mode & stat.S_IWOTH or not status.st_mode & stat.S_IWGRP:
        return bool(status.st_mode & stat.S_IWOTH)
    import grp
    import pwd

    try:
        user, group = pwd.getpwuid(os.geteuid()).pw_name, grp.getgrgid(status.st_gid)
    except KeyError:
        return True
    return group.gr_name != user or not {*group.gr_mem} <= {user}


@cache
def _usable(here: Path) -> bool:
    """Return whether the folder may be used; say why not, once."""
    try:
        why = doubt(here)
    except OSError:  # `kincheck doctor` reports it
        return False
    if why:
        print(f"kincheck: note: compiled code is not kept: {why}; {REMEDY}", file=sys.stderr)
    return not why


def ready() -> bool:
    """Return whether the cache may be used; print a note, once, if others could write it."""
    here = folder()
    return here is not None and _usable(here)


def load_or_make(
    content: bytes, make: Callable[[], bytes], read: Callable[[bytes], Found]
) -> Found:
    """Return what `read` makes of the cached bytes of a content; make and store them if there are
    none, or none that it can read.
    """
    found = find(content, read)
    if found is None:
        made = make()
        if entry := _entry(content):
            _write(entry, made)
        found = read(made)
    return found


def find(content: bytes, read: Callable[[bytes], Found]) -> Found | None:
    """Return what `read` makes of the cached bytes of a content, or None without an intact entry
    of this user.
    """
    entry = _entry(content)
    if entry is None:
        return None
    try:
        with open(entry, "rb", opener=_not_followed) as file:
            status, whole = os.fstat(file.fileno()), file.read()
    except OSError:
        return None
    made = whole[DIGEST:]
    if not _is_own(status) or _open_to_others(status) or _checksum(entry, made) != whole[:DIGEST]:
        return None
    try:
        return read(made)
    except UNREADABLE:
        return None


def _not_followed(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0))


def contains(content: bytes) -> bool:
    """Return whether the cache has an entry of the content."""
    entry = _entry(content)
    return entry is not None and entry.exists()


def _entry(content: bytes) -> Path | None:
    here = folder()
    return here / hashlib.sha256(content).hexdigest() if here and _usable(here) else None


def _write(entry: Path, made: bytes) -> None:
    """Store an entry; without write access the next process only has to make it again."""
    part = entry.with_name(f"{entry.name}.{os.urandom(8).hex()}")
    try:
        with open(part, "xb", opener=partial(os.open, mode=0o600)) as file:
            file.write(_checksum(entry, made) + made)
        part.replace(entry)  # atomic, also with concurrent writers
        _shrink(entry.parent)
    except OSError:
        with suppress(OSError):
            part.unlink(missing_ok=True)


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
