"""kincheck schema: print the JSON Schema of a file format of kincheck."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from ..case.io.atomic_files import to_standard_output
from .registry import Registry, Status, add_joint_types


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


def add(commands: Any) -> None:
    """Add the command to the parser."""
    schema: argparse.ArgumentParser = commands.add_parser(
        "schema", help="print the JSON Schema of a file", description=_schema.__doc__
    )
    schema.set_defaults(do=_schema)
    schema.add_argument(
        "name",
        choices=[*SCHEMAS],
        metavar="NAME",
        help=f"one of {', '.join(SCHEMAS)}; TOML files follow the schema of their content",
    )
    add_joint_types(schema)


def _schema(options: argparse.Namespace, registry: Registry) -> int:
    """Print the JSON Schema of a file, for editors and validators, made from the types of its
    reader and writer.
    """
    found = msgspec.json.encode(SCHEMAS[options.name]())
    to_standard_output(msgspec.json.format(found, indent=2) + b"\n")
    return Status.WITHIN
