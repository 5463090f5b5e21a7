"""kincheck export: write a case's mechanism for a simulator."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..case.io.escape import file_name
from ..case.io.reader_options import Supplied
from ..errors import KincheckError, unknown
from ..options import (
    ONE_CASE,
    argument,
    destination,
    group,
    joint_types,
    measured,
    option,
    options,
)
from . import import_options
from .parser import Command
from .registry import Registry, Status

if TYPE_CHECKING:
    from ..case.case import Case

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


@options
class Export(Command):
    """Write a case's mechanism in a simulator's format, with a consistent start.

    A second file holds the parts that the format lacks, such as the loop constraints of a URDF.
    """

    about: ClassVar[str] = "write a mechanism for a simulator"
    case: str | Path | Case = argument(ONE_CASE, "CASE")
    to: str = destination(formats(), metavar="FORMAT", required=True)
    out: Path | None = destination(
        "stem of the written files; default: the case's name, in this folder", Path
    )
    at: str | None = option(
        "value of the swept driver at the start, such as 30mm or -20deg, in SI without a unit;"
        " default: the design position",
        measured,
        "VALUE",
    )
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.io.model_writer import written

        if self.to not in registry.writers:
            raise KincheckError(unknown("format", self.to, registry.writers))
        case = registry.case_of(self, driven=False)
        keep_texts(
            written(case, registry.writer(self.to), import_options.driver_value(self.at, case)),
            case.name,
            self.out,
        )
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
