"""Files of a study's chunks: the finished part, from which a stopped study resumes, and the Parquet
file of the values of all variants.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

import msgspec
import numpy as np

from ...case.io.atomic_files import whole
from ...errors import KincheckError
from ...extras import library
from ...history.runs import digest
from .study import Chunk, Study
from .variation import Coordinate

# The part: an identity, then the chunks in order. Each chunk follows its length and SHA-256; the
# reader ignores a truncated chunk. The file keeps every bit of a number, so a resumed study equals
# one without a stop.

MAGIC = b"kincheck-part/3\n"
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
                        " varies, the options, versions or the machine differ. Give the same, or"
                        " leave out --resume to begin anew."
                    )
                for index in range(study.chunks):
                    chunk = _next(file)
                    if chunk is None or chunk.index != index:
                        break
                    kept = file.tell()
                    yield chunk
        else:
            self._try_write(lambda: self.path.write_bytes(head))
        self._try_write(lambda: self._append_at(kept))

    def add(self, chunk: Chunk) -> None:
        """Append a chunk."""
        file = self._file
        if file is not None:
            packed = msgspec.msgpack.encode(chunk, enc_hook=_array)
            frame = (
                len(packed).to_bytes(LENGTH, "little") + hashlib.sha256(packed).digest() + packed
            )
            self._try_write(lambda: file.write(frame))

    def remove(self) -> None:
        """Remove the file after the study's end."""
        self.path.unlink(missing_ok=True)

    def _append_at(self, end: int) -> None:
        os.truncate(self.path, end)
        self._file = self.path.open("ab", buffering=0)

    def _try_write(self, write: Any) -> None:
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


class ParquetStore:
    """Writer of the values of all variants: a row for each variant, a row group for each chunk.

    Columns: variant, the offset of each coordinate [SI], and each output as a list over the
    samples, NaN if missing. If a coordinate has the name of an output, such as W.x, its column is
    W.x.offset. The file's metadata has the key "kincheck": case, seed, mode, units, signs and the
    driver's values, as JSON. In the file of a stopped sweep, the key "kincheck.partial" gives the
    numbers of stored and of all variants. An earlier file stays until the end.

    Attributes:
        problems: write errors; the study goes on without the file.

    Raises:
        KincheckError: pyarrow is not installed, or the file cannot be written.
    """

    def __init__(self, path: Path, study: Study) -> None:
        self._arrow = library("--store", "pyarrow", "parquet")
        parquet = library("--store", "pyarrow.parquet", "parquet")
        arrow, self._first, self._samples = self._arrow, 0, study.samples
        n = len(study.case.sweep.values)
        fields = [arrow.field("variant", arrow.int64())]
        offsets = _offset_columns(study)
        fields += [arrow.field(name, arrow.float64()) for name in offsets]
        fields += [arrow.field(row.name, arrow.list_(arrow.float64(), n)) for row in study.rows]
        about = {
            "case": study.case.name,
            "seed": study.seed,
            "mode": str(study.variation.mode),
            "units": (
                {row.name: row.unit for row in study.rows}
                | {name: each.unit for name, each in offsets.items()}
            ),
            "signs": study.case.signs,
            "driver": {name: values.tolist() for name, values in study.case.sweep.moved.items()},
        }
        self._schema = arrow.schema(fields, metadata={"kincheck": json.dumps(about)})
        self.path, self.problems, self._whole = path, list[str](), whole(path)
        try:
            self._writer = parquet.ParquetWriter(self._whole.__enter__(), self._schema)
        except OSError as error:
            raise KincheckError(
                f"--store {path}: cannot be written ({error.strerror or error}). Give a file"
                " elsewhere."
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._first < self._samples:
            self._writer.add_key_value_metadata(
                {"kincheck.partial": f"{self._first} of {self._samples} variants"}
            )
        with self._note_errors():
            self._writer.close()
        if error is None and self.problems:
            error = KincheckError(self.problems[0])  # leaves an earlier file as it is
        with self._note_errors():
            self._whole.__exit__(None if error is None else type(error), error, trace)

    def write(self, chunk: Chunk) -> None:
        """Write a chunk's values and offsets; chunks come in order."""
        if self.problems:
            return
        parts = zip(*chunk.stored, strict=True)
        values, offsets = (np.concatenate(each, axis=-1) for each in parts)
        arrow = self._arrow
        columns: list[Any] = [arrow.array(np.arange(self._first, self._first + chunk.count))]
        columns += [arrow.array(each) for each in offsets]
        for each in values:
            flat = arrow.array(np.ascontiguousarray(each.T).ravel())
            columns.append(arrow.FixedSizeListArray.from_arrays(flat, each.shape[0]))
        with self._note_errors():
            self._writer.write_table(arrow.table(columns, schema=self._schema))
        self._first += chunk.count

    @contextmanager
    def _note_errors(self) -> Generator[None]:
        try:
            yield
        except OSError as error:
            self.problems += [
                f"--store {self.path}: cannot be written ({error}); free some room, or give a file"
                " elsewhere"
            ] * (not self.problems)


def _offset_columns(study: Study) -> dict[str, Coordinate]:
    """Return the coordinates by column name."""
    taken = {"variant", *(row.name for row in study.rows)}
    return {
        f"{each.name}.offset" if each.name in taken else each.name: each
        for each in study.variation.coordinates
    }
