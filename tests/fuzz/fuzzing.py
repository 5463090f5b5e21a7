"""What all fuzzers share: what counts as a crash, where inputs are written, and how they are
changed.
"""

import os
import random
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kincheck.core.case.case import Case
from kincheck.core.case.io.case_file import case_text
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError, KincheckError

from ..support.written_again import written_again

_MEMORY = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
_TEMPORARY = tempfile.TemporaryDirectory(
    prefix="kincheck-fuzz-", dir=_MEMORY, ignore_cleanup_errors=True
)
FOLDER = Path(_TEMPORARY.name)
"""Where inputs are written to be read: files that never reach a disk, where there are such."""
SAID = re.compile(rb'drive(?: |=")([^ "\n]{1,40})(?: hold ([^">]{0,200}))?')
# An excerpt of what was found (60 characters), a list of what is known, and a path; nobody reads
# more.
LONGEST_MESSAGE = 4000


def written(name: str, data: bytes) -> Path:
    """The input as a file."""
    file = FOLDER / name
    file.write_bytes(data)
    return file


def said(data: bytes, **more: Any) -> Supplied:
    """The options that an input states itself: "drive NAME:START:STOP:STEPS hold NAMES"; names
    with a value or of a keyframe are a start.
    """
    drive, hold = found.groups() if (found := SAID.search(data)) else (None, None)
    names = (hold or b"").decode("latin-1").split()
    start = tuple(name for name in names if "=" in name or name.startswith("keyframe:"))
    options = {
        "drive": (drive.decode("latin-1"),) if drive else (),
        "hold": tuple(name for name in names if name not in start and name != "rest"),
        "hold_rest": "rest" in names,
        "start": start,
    }
    return Supplied(**options | more)


def reading(name: str, **more: Any) -> Callable[[bytes], None]:
    """A function that reads one input as a file of that name, with what it says itself."""

    def one(data: bytes) -> None:
        read_or_refused(lambda: load(written(name, data), said(data, **more)))

    return one


def read_or_refused(read: Callable[[], object]) -> None:
    """Let a reader take an input, or refuse it: one line that names the file, what was found, and a
    remedy. All else is a crash. A case is written, and read again as the same.
    """
    try:
        found = read()
    except KincheckError as error:
        message = str(error)
        message.encode()
        assert message.startswith(str(FOLDER)), f"names no file: {message!r}"
        assert message.isprintable(), f"not printable: {message!r}"
        assert len(message) < LONGEST_MESSAGE, f"{len(message)} characters: {message[:300]!r}"
        assert "; " in message or ". " in message, f"no remedy: {message!r}"
        return
    if isinstance(found, Case):
        try:
            case_text(found)
        except CaseError:  # samples on no even grid, names that are too long
            return
        written_again(found, FOLDER)


def changing(
    *steps: Callable[[bytes, random.Random, tuple[str, ...]], bytes], words: tuple[str, ...]
):
    """A mutator: the first of these changes that can read an input, once or several times."""

    def mutate(data: bytes, rng: random.Random) -> bytes:
        for step in steps:
            try:
                for _ in range(rng.choice((1, 1, 2, 4))):
                    data = step(data, rng, words)
            except (ValueError, RecursionError, IndexError):
                continue
            return data
        return data

    return mutate
