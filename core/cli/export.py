"""kincheck export: write a case's mechanism for a simulator."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..case.io.escape import file_name
from ..errors import KincheckError, unknown
from . import import_options
from .option_types import number
from .registry import Registry, Status

FORMATS = {
    "mjcf": "MuJoCo",
    "exudyn": "a Python script",
    "urdf": "Pinocchio",
    "sdf": "Drake",
    "osim": "Simbody, by OpenSim",
}
"""Formats of the adapters' writers, for help texts: adapters load later. A test compares both."""


def formats() -> str:
    """Return the formats as text for the help."""
    *first, last = (f"{name} ({what})" for name, what in FORMATS.items())
    return f"{', '.join(first)} or {last}"


def add(commands: Any) -> None:
    """Add the command to the parser."""
    export: argparse.ArgumentParser
    export = commands.add_parser(
        "export", help="write a mechanism for a simulator", description=_export.__doc__
    )
    export.set_defaults(do=_export)
    export.add_argument(
        "case",
        metavar="CASE",
        help="name of a built-in case, or path to a case file or to another tool's file",
    )
    export.add_argument("--to", required=True, metavar="FORMAT", help=formats())
    export.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="stem of the written files; default: the case's name, in this folder",
    )
    export.add_argument(
        "--at",
        type=number,
        metavar="VALUE",
        help=("value of the swept driver at the start, in SI units; default: the design position"),
    )
    import_options.add_options(export)


def _export(options: argparse.Namespace, registry: Registry) -> int:
    """Write a case's mechanism in a simulator's format, with a consistent start.

    A second file holds the parts that the format lacks, such as the loop constraints of a URDF.
    """
    from ..case.io.model_writer import written

    if options.to not in registry.writers:
        raise KincheckError(unknown("format", options.to, registry.writers))
    case = registry.find_case(options.case, import_options.supplied(options), driven=False)
    import_options.tell_left_out([case])
    keep_texts(written(case, registry.writer(options.to), options.at), case.name, options.out)
    return Status.WITHIN


def keep_texts(
    texts: Mapping[str, str], name: str, out: Path | None, json: str | None = None
) -> None:
    """Write texts to files that differ by suffix, and print their names.

    Args:
        json: destination of the JSON; "-" for standard output, which then holds nothing else.

    Raises:
        KincheckError: a file cannot be written, would overwrite the JSON, or exists and
            `out` is None.
    """
    from ..case.io.atomic_files import require_writable
    from ..case.io.atomic_files import written as written_file

    first = next(iter(texts))
    main: Path = out or Path(file_name(name) + first)
    files = {
        main if ending == first else main.with_suffix(ending): text
        for ending, text in texts.items()
    }
    for file in files:
        if out is None and file.exists():
            raise KincheckError(f"{file} exists already; give --out to overwrite a file")
    require_writable([("--json", json), *(("--out", file) for file in files)])
    problems: list[str] = []
    for file, text in files.items():
        failed = written_file(file, text.encode())
        problems += failed
        if not failed:
            print(file, file=sys.stderr if json == "-" else sys.stdout)
    if problems:
        raise KincheckError("\n".join(problems))
