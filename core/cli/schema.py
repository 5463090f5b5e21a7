"""kincheck schema: print the JSON Schema of a file format of kincheck."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import msgspec

from ..case.io.atomic_files import to_standard_output
from ..options import (
    argument,
    joint_types,
    options,
)
from .parser import Command
from .registry import Registry, Status


def _case() -> dict[str, Any]:
    from ..case.io.catalogue import case_schema

    return case_schema()


def _variation() -> dict[str, Any]:
    from ..studies.variation.variation_schema import variation_schema

    return variation_schema()


def _results() -> dict[str, Any]:
    from ..harness.record import Results

    return msgspec.json.schema(Results)


def _regression() -> dict[str, Any]:
    from ..history.findings import Regressions

    return msgspec.json.schema(Regressions)


def _live() -> dict[str, Any]:
    from ..live.protocol import live_schema

    return live_schema()


def _board() -> dict[str, Any]:
    from ..studies.board.results import Board

    return msgspec.json.schema(Board)


SCHEMAS: Mapping[str, Callable[[], dict[str, Any]]] = {
    "case": _case,
    "variation": _variation,
    "results": _results,
    "regression": _regression,
    "live": _live,
    "board": _board,
}


@options
class PrintSchema(Command):
    """Print the JSON Schema of a file, for editors and validators, made from the types of its
    reader and writer.
    """

    about: ClassVar[str] = "print the JSON Schema of a file"
    name: str = argument(
        f"one of {', '.join(SCHEMAS)}; TOML files follow the schema of their content",
        "NAME",
        choices=[*SCHEMAS],
    )
    joint_type: tuple[str, ...] = joint_types()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        found = msgspec.json.encode(SCHEMAS[self.name]())
        to_standard_output(msgspec.json.format(found, indent=2) + b"\n")
        return Status.WITHIN
