"""The option --bench of kincheck run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...cli.engine_source import EngineSource
from ...options import destination, options


@options
class BenchOfRun(EngineSource):
    """Work-precision data beside the results."""

    bench: Path | None = destination(
        "show the work-precision data of this bench.json in the report", Path
    )

    @staticmethod
    def contradictions(options: Any) -> list[str]:
        """Return why the data have no place."""
        if options.out is not None:
            return []
        return ["--bench adds to the report. Give --out DIR."]

    @staticmethod
    def efforts(options: Any) -> Any:
        """Return the efforts of a file of kincheck bench."""
        from .bench.engines import efforts_in

        return efforts_in(options.bench)
