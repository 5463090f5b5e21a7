"""The command kincheck import."""

from __future__ import annotations

from pathlib import Path

from ..case.io.reader_options import Supplied
from ..errors import KincheckError, refuse
from ..options import (
    argument,
    destination,
    group,
    joint_types,
    options,
)
from .parser import Command
from .registry import Registry, Status, tell_left_out
from .shared_options import return_cases


@options
class Import(Command):
    """Write a model or hardpoint table as a case file: `kincheck import model.xml
    --drive hinge:0:1 > case.toml`, then `kincheck run case.toml`.

    Numbers are in SI units and keep all their digits.
    """

    about = "write the case file of a model or a table of hardpoints"
    case: tuple[str, ...] = argument(
        "model, table of hardpoints, or case file, as `run` reads it", "FILE", "*"
    )
    out: Path | None = destination("default: standard output", Path)
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.io.atomic_files import to_standard_output, write
        from ..case.io.case_file import case_text
        from ..case.io.schema import SCHEMA_FILE

        refuse(self.unwritable())
        files, supplied = return_cases(self.case, self.supplied)
        if len(files) != 1:
            raise KincheckError(
                f"import: found {len(files)} files, expected one. Name it before --hold."
            )
        (file,) = files
        case = registry.find_case(file, supplied)
        tell_left_out([case])
        text = f"#:schema {SCHEMA_FILE}\n"
        text += case_text(case, comments=[f"Written by kincheck import from {Path(file).name}."])
        if self.out:
            write("--out", self.out, text.encode())
        else:
            to_standard_output(text.encode())
        return Status.WITHIN
