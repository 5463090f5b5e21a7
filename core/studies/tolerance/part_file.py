"""File of a study's finished chunks. A stopped study resumes from it.

The file holds an identity, then the chunks in order. Each chunk follows its length and SHA-256;
the reader ignores a truncated chunk. The file keeps every bit of a number, so a resumed study
equals one without a stop.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Self

import msgspec
import numpy as np

from ...errors import KincheckError
from ...history.run_recorder import digest
from .chunk import Chunk
from .study import Study

MAGIC = b"kincheck-part/2\n"
HASH = hashlib.sha256().digest_size
LENGTH = 8


class Part:
    """The file of a study's finished chunks.

    Attributes:
        problems: write errors; the study goes on without the file.
    """

    def __init__(self, path: Path, facts: Mapping[str, Any], *, resume: bool) -> None:
        """Begin a new file, or continue an existing one.

        Args:
            facts: everything the chunks depend on besides the study: versions, the machine,
                modules of joint types.
            resume: use the chunks in the file.
        """
        self.path, self.problems = path, list[str]()
        self._facts, self._resume = facts, resume
        self._file: BinaryIO | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def finished(self, study: Study) -> Iterator[Chunk]:
        """Yield the study's chunks in the file; `add` then appends to them.

        Raises:
            KincheckError: the file is of another study.
        """
        head = MAGIC + digest(study, dict(self._facts)).encode() + b"\n"
        kept = len(head)
        if self._resume and self.path.is_file():
            with self.path.open("rb") as file:
                if file.read(len(head)) != head:
                    raise KincheckError(
                        f"--resume: {self.path} is the part of another study: the case, what"
                        " varies, the options, versions or the machine differ; give the same, or"
                        " leave out --resume to begin anew"
                    )
                for index in range(study.chunks):
                    chunk = _next(file)
                    if chunk is None or chunk.index != index:
                        break
                    kept = file.tell()
                    yield chunk
        else:
            self._try(lambda: self.path.write_bytes(head))
        self._try(lambda: self._append_at(kept))

    def add(self, chunk: Chunk) -> None:
        """Append a chunk."""
        file = self._file
        if file is not None:
            packed = msgspec.msgpack.encode(chunk, enc_hook=_array)
            frame = (
                len(packed).to_bytes(LENGTH, "little") + hashlib.sha256(packed).digest() + packed
            )
            self._try(lambda: file.write(frame))

    def remove(self) -> None:
        """Remove the file after the study's end."""
        self.path.unlink(missing_ok=True)

    def _append_at(self, end: int) -> None:
        os.truncate(self.path, end)
        self._file = self.path.open("ab", buffering=0)

    def _try(self, write: Any) -> None:
        try:
            if not self.problems:
                write()
        except OSError as error:
            self._file = None
            self.problems.append(
                f"{self.path}: cannot be written ({error.strerror or error}); the study cannot be"
                " taken up from there"
            )


def _next(file: BinaryIO) -> Chunk | None:
    """Return the next chunk of a file; None at its end, or if the rest is incomplete."""
    head = file.read(LENGTH + HASH)
    packed = (
        file.read(int.from_bytes(head[:LENGTH], "little")) if len(head) == LENGTH + HASH else b""
    )
    if not packed or hashlib.sha256(packed).digest() != head[LENGTH:]:
        return None
    try:
        return msgspec.msgpack.decode(packed, type=Chunk, dec_hook=_from_array)
    except (msgspec.MsgspecError, ValueError):
        return None


def _array(value: Any) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.asarray(value), allow_pickle=False)
    return buffer.getvalue()


def _from_array(kind: Any, value: bytes) -> Any:
    return np.lib.format.read_array(io.BytesIO(value), allow_pickle=False)
