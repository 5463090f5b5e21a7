"""What all fuzzers share: what counts as a crash, where inputs are written, and how they are
changed.
"""

import os
import random
import tempfile
from collections.abc import Callable
from pathlib import Path

from kincheck.core.case.case import Case
from kincheck.core.case.io.case_file import case_text
from kincheck.core.errors import CaseError, KincheckError

from ..support.written_again import written_again

_MEMORY = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
_TEMPORARY = tempfile.TemporaryDirectory(
    prefix="kincheck-fuzz-", dir=_MEMORY, ignore_cleanup_errors=True
)
FOLDER = Path(_TEMPORARY.name)
"""Where inputs are written to be read: files that never reach a disk, where there are such."""
# An excerpt of what was found (60 characters), a list of what is known, and a path; nobody reads
# more.
LONGEST_MESSAGE = 4000


def written(name: str, data: bytes) -> Path:
    """The input as a file."""
    file = FOLDER / name
    file.write_bytes(data)
    return file


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
        assert "; " in message, f"no remedy: {message!r}"
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
