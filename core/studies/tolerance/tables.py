"""The results of a study as tables: on the terminal, as CSV, and the values of all variants as
Parquet.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

import numpy as np
from rich.text import Text

from ...case.io.escape import cell
from ...case.variation.variation import Coordinate
from ...errors import KincheckError
from ...extras import library
from ...harness.labels import notes, number
from ...report import terminal
from ...report.fitting_table import FittingTable
from ...report.table import print_signs
from .page import effect, headline
from .results import SweepResults
from .study import Chunk, Study


def print_sweep(results: SweepResults, file: TextIO) -> None:
    """Print the signs of outputs, a line for each output, what could not be solved, what deviates,
    and how fast it was.
    """
    console = terminal.console(file)
    console.print(Text(headline(results), style="bold"))
    print_signs(results.run, console)
    table = FittingTable()
    for name in ("output", "unit"):
        table.add_column(name)
    for name in ("least", "variant", "most", "variant", "largest\nst. dev.", "largest\n1-99 %"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("largest effect\n(gradient x scale)")
    for name, each in results.outputs.items():
        bands = zip(each.quantiles["0.01"], each.quantiles["0.99"], strict=True)
        widths = [high - low for low, high in bands if low is not None and high is not None]
        top = max((g for g in results.gradients if g.output == name), key=effect, default=None)
        table.add_row(
            Text(name),
            each.unit,
            *(
                number(min((v for v in each.min if v is not None), default=None)),
                str(each.min_variant),
            ),
            *(
                number(max((v for v in each.max if v is not None), default=None)),
                str(each.max_variant),
            ),
            number(max((v for v in each.standard_deviation if v is not None), default=None)),
            number(max(widths, default=None)),
            Text("–" if top is None else f"{top.coordinate} {number(effect(top))}"),
        )
    console.print(table)
    for line in remarks(results):
        console.print(Text(line), soft_wrap=True)


def remarks(results: SweepResults) -> list[str]:
    """What the numbers alone do not say, a line each."""
    lines = [f"note: {note}" for _, note in notes(results.run)]
    lines += [
        f"unsolved: variant {each.variant}, {each.samples} samples: {each.message}"
        for each in results.failed[:10]
    ]
    if results.unsolved > 10:
        lines.append(
            f"unsolved: {results.unsolved} in all, the first {len(results.failed)} in the results"
        )
    replay = f"--seed {results.seed} --replay"
    lines += [
        f"{each.outcome}: variant {each.variant} ({replay} {each.variant}): {each.message}"
        for each in results.deviating[:10]
    ]
    if len(results.deviating) > 10:
        lines.append(f"deviating: {len(results.deviating)} in all, listed in the results")
    rough = sum(not each.accurate for each in results.gradients)
    if rough:
        lines.append(
            f"{rough} of {len(results.gradients)} gradients are not known to 1e-6; the results say"
            " which, and how well"
        )
    lines += [
        f"no gradient by {name}: {message}" for name, message in results.gradient_messages.items()
    ]
    if results.quantiles_of < results.samples:
        lines.append(
            f"quantiles are of a random subset of {results.quantiles_of} variants, with their"
            " standard errors in the results"
        )
    if results.retried:
        lines.append(f"{results.retried} variants needed divided steps")
    speed = ", ".join(
        f"{key.replace('_', ' ')} {number(value)}" for key, value in results.measured.items()
    )
    return [*lines, speed]


def envelope_csv(results: SweepResults) -> str:
    """A line for each output and sample [SI]; empty where there is no value. A column says of how
    many variants a part is.
    """
    swept = next(iter(results.driver))
    probabilities = list(next(iter(results.outputs.values())).quantiles)
    columns = [
        "output",
        "unit",
        "sample",
        swept,
        "nominal",
        "count",
        "min",
        "max",
        "mean",
        "standard_deviation",
    ]
    errors = any(each.standard_errors for each in results.outputs.values())
    columns += [f"quantile_{p}" for p in probabilities] + (
        [f"standard_error_{p}" for p in probabilities] if errors else []
    )
    columns += ["partial"] if results.partial else []
    rows: list[Sequence[Any]] = []
    for name, each in results.outputs.items():
        numbers = [
            each.nominal,
            each.count,
            each.min,
            each.max,
            each.mean,
            each.standard_deviation,
            *each.quantiles.values(),
        ]
        numbers += list((each.standard_errors or {}).values())
        for k, value in enumerate(results.driver[swept]):
            partial = [f"{results.partial} variants"] if results.partial else []
            rows.append([name, each.unit, k, value, *(column[k] for column in numbers), *partial])
    return _csv(columns, rows)


def gradient_csv(results: SweepResults) -> str:
    """A line for each output and coordinate [SI]."""
    columns = [
        "output",
        "coordinate",
        "unit",
        "at_design",
        "largest",
        "sample",
        "error",
        "accurate",
        "scale",
        "effect",
    ]
    return _csv(
        columns,
        (
            [*(getattr(each, name) for name in columns[:-1]), effect(each)]
            for each in results.gradients
        ),
    )


def _csv(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([cell(each) for each in row] for row in rows)
    return text.getvalue()


class ParquetStore:
    """Writes the values of all variants as they come: a row for each variant, a row group for each
    chunk.

    Columns: variant, the offset of each coordinate [SI], and each output as a list over the
    samples, NaN where there is no value. A coordinate that is named like an output, W.x say, has
    the column W.x.offset. The file's metadata under the key "kincheck" says case, seed, mode,
    units, signs and the driver's values, as JSON; where not all variants are there,
    "kincheck.partial" says how many of how many.

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
        try:
            self._writer = parquet.ParquetWriter(path, self._schema)
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
        self._writer.close()

    def write(self, chunk: Chunk) -> None:
        """Take a chunk; see `Store`."""
        assert chunk.values is not None
        assert chunk.offsets is not None
        arrow = self._arrow
        columns: list[Any] = [arrow.array(np.arange(self._first, self._first + chunk.count))]
        columns += [arrow.array(each) for each in chunk.offsets]
        for values in chunk.values:
            flat = arrow.array(np.ascontiguousarray(values.T).ravel())
            columns.append(arrow.FixedSizeListArray.from_arrays(flat, values.shape[0]))
        try:
            self._writer.write_table(arrow.table(columns, schema=self._schema))
        except OSError as error:
            raise KincheckError(
                f"--store: cannot be written ({error}); free some room, or give a file elsewhere"
            ) from error
        self._first += chunk.count


def _offset_columns(study: Study) -> dict[str, Coordinate]:
    """The coordinates by the names of their columns."""
    taken = {"variant", *(row.name for row in study.rows)}
    return {
        f"{each.name}.offset" if each.name in taken else each.name: each
        for each in study.variation.coordinates
    }
