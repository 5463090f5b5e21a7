"""kincheck import: write the case file of a model or a table of hardpoints."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..errors import KincheckError
from . import import_options
from .registry import Registry, Status


def add(commands: Any) -> None:
    """Add the command to the parser."""
    importer: argparse.ArgumentParser
    importer = commands.add_parser(
        "import",
        help="write the case file of a model or a table of hardpoints",
        description=_import.__doc__,
    )
    importer.set_defaults(do=_import)
    importer.add_argument(
        "case",
        nargs="*",
        metavar="FILE",
        help="model, table of hardpoints, or case file, as `run` reads it",
    )
    importer.add_argument("--out", type=Path, metavar="FILE", help="default: standard output")
    import_options.add_options(importer)


def _import(options: argparse.Namespace, registry: Registry) -> int:
    """Write a model or hardpoint table as a case file: `kincheck import model.xml
    --drive hinge:0:1 > case.toml`, then `kincheck run case.toml`.

    Numbers are in SI units and keep all their digits.
    """
    from ..case.io.atomic_files import require_writable, to_standard_output, write
    from ..case.io.case_file import case_text
    from ..case.io.schema import SCHEMA_FILE

    require_writable([("--out", options.out)])
    import_options.return_cases(options)
    if len(options.case) != 1:
        raise KincheckError(
            f"import: found {len(options.case)} files, expected one; name it before --hold"
        )
    (file,) = options.case
    case = registry.find_case(file, import_options.supplied(options))
    import_options.tell_left_out([case])
    text = f"#:schema {SCHEMA_FILE}\n"
    text += case_text(case, comments=[f"Written by kincheck import from {Path(file).name}."])
    if options.out:
        write("--out", options.out, text.encode())
    else:
        to_standard_output(text.encode())
    return Status.WITHIN
