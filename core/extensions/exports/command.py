"""The command kincheck export."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ...case.io.atomic_files import require_writable
from ...case.io.atomic_files import written as written_file
from ...case.io.escape import file_name
from ...cli.registry import Registry, Status
from ...cli.shared_options import OfCase, driver_value
from ...doors import Offer, offers
from ...errors import MOST_NAMED, KincheckError, refuse, shortened, unknown
from ...options import (
    destination,
    names_of_given,
    number_with_unit,
    option,
    options,
    switch,
)
from ...report.progress import complain

if TYPE_CHECKING:
    from .model_writer import Writer


def formats() -> str:
    """Return the formats and languages as text for the help."""
    found = [f"{name} ({each.where})" for name, each in offers("formats").items()]
    found += offers("codes")
    return " or ".join(filter(None, [", ".join(found[:-1]), *found[-1:]])) or "none is installed"


def writer_of(name: str) -> Writer:
    """Return the function that writes a mechanism in a format.

    Raises:
        KincheckError: there is no such format.
    """
    writers = offers("writers")
    if name not in writers:
        raise KincheckError(unknown("format", name, writers))
    return writers[name].load()


@options
class Export(OfCase):
    """Write a case's mechanism in a simulator's format, with a consistent start; or the solved case
    as code: C, JavaScript, or an FMU.

    A second file holds the parts that a format lacks, such as the loop constraints of a URDF.
    """

    about = "write a mechanism for a simulator, or a solved case as code"
    to: str = destination(formats(), metavar="FORMAT", required=True)
    out: Path | None = destination(
        "stem of the written files, of code their folder; default: the case's name, in this folder",
        Path,
    )
    vary: tuple[str, ...] = option(
        "a number that the code takes as a parameter, such as 'tierod_inner z'",
        metavar="PLACE",
        several="together",
    )
    fmi: str | None = option("version of the FMU; default 2", metavar="VERSION", choices=("2", "3"))
    forces: bool = switch("outputs of forces in the code, too")
    at: str | None = option(
        "value of the swept driver at the start, such as 30mm or -20deg, in SI without a unit;"
        " default: the design position",
        number_with_unit,
        "VALUE",
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...report.progress import complain
        from .model_writer import written

        if (code := offers("codes").get(self.to)) is not None:
            return self._write_code(code, registry)
        if found := names_of_given(self, ("vary", "forces", "fmi")):
            raise KincheckError(f"{found}: only code takes it. Leave it out, or add --to c.")
        writer = writer_of(self.to)
        case = registry.case_of(self, driven=False)
        texts = written(case, writer, driver_value(self.at, case))
        keep_texts(texts, case.name, self.out)
        complain(f"note: left out: {each}" for each in _left_out(texts))
        return Status.WITHIN

    def _write_code(self, code: Offer, registry: Registry) -> int:
        if self.at is not None:
            raise KincheckError("--at: the code starts at the design position. Leave it out.")
        if self.fmi is not None and self.to != "fmu":
            raise KincheckError("--fmi: only an FMU has a version. Add --to fmu, or leave it out.")
        case = registry.case_of(self)
        version = {"fmi": int(self.fmi)} if self.fmi else {}
        contents = code.load()(case, self.vary, forces=self.forces, **version)
        folder = self.out or Path()
        folder.mkdir(parents=True, exist_ok=True)
        files = {folder / name: content for name, content in contents.items()}
        require_writable([("--out", file) for file in files])
        problems: list[str] = []
        for file, content in files.items():
            problems += written_file(file, content)
            print(file)
        refuse(problems)
        left = [each.name for each in case.outputs if each.forces]
        if left and not self.forces:
            named = shortened(left, MOST_NAMED)
            complain([f"{case.name}: the code has no forces, which --forces adds: {named}"])
        return Status.WITHIN


def _left_out(texts: Mapping[str, str]) -> list[str]:
    """Return what the comments of written files say that their format cannot hold."""
    lines = " ".join(each.lstrip("# ") for text in texts.values() for each in text.splitlines())
    return re.findall(r"Left out: (.+?)\.(?= |$)", lines)


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
    first = next(iter(texts))
    main: Path = out or Path(file_name(name) + first)
    files = {
        main if ending == first else main.with_suffix(ending): text
        for ending, text in texts.items()
    }
    for file in files:
        if out is None and file.exists():
            raise KincheckError(f"{file} exists already. Give --out to overwrite a file.")
    require_writable([("--json", json), *(("--out", file) for file in files)])
    problems: list[str] = []
    for file, text in files.items():
        failed = written_file(file, text.encode())
        problems += failed
        if not failed:
            print(file, file=sys.stderr if json == "-" else sys.stdout)
    refuse(problems)
