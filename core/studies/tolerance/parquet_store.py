"""Parquet file of the values of all variants."""

from __future__ import annotations

import json
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from ...case.io.atomic_files import whole
from ...errors import KincheckError
from ...extras import library
from ..variation.variation import Coordinate
from .chunk import Chunk
from .study import Study


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
                f"--store {path}: cannot be written ({error.strerror or error}); give a file"
                " elsewhere"
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
        with self._tried():
            self._writer.close()
        if error is None and self.problems:
            error = KincheckError(self.problems[0])  # leaves an earlier file as it is
        with self._tried():
            self._whole.__exit__(None if error is None else type(error), error, trace)

    def write(self, chunk: Chunk) -> None:
        """Write a chunk; see `Store`."""
        if self.problems:
            return
        assert chunk.values is not None
        assert chunk.offsets is not None
        arrow = self._arrow
        columns: list[Any] = [arrow.array(np.arange(self._first, self._first + chunk.count))]
        columns += [arrow.array(each) for each in chunk.offsets]
        for values in chunk.values:
            flat = arrow.array(np.ascontiguousarray(values.T).ravel())
            columns.append(arrow.FixedSizeListArray.from_arrays(flat, values.shape[0]))
        with self._tried():
            self._writer.write_table(arrow.table(columns, schema=self._schema))
        self._first += chunk.count

    @contextmanager
    def _tried(self) -> Generator[None]:
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
