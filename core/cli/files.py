"""Commands for files: kincheck export, import, same and templates."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from ..case.io.escape import file_name
from ..case.io.reader_options import Supplied
from ..errors import KincheckError, refuse, unknown
from ..options import (
    argument,
    destination,
    group,
    joint_types,
    json_file,
    number_with_unit,
    option,
    options,
    switch,
)
from .parser import Command
from .registry import Registry, Status, tell_left_out
from .shared_options import OfCase, driver_value, return_cases

if TYPE_CHECKING:
    from ..case.models.trees.undriven import Undriven


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
class Export(OfCase):
    """Write a case's mechanism in a simulator's format, with a consistent start.

    A second file holds the parts that the format lacks, such as the loop constraints of a URDF.
    """

    about = "write a mechanism for a simulator"
    to: str = destination(formats(), metavar="FORMAT", required=True)
    out: Path | None = destination(
        "stem of the written files; default: the case's name, in this folder", Path
    )
    at: str | None = option(
        "value of the swept driver at the start, such as 30mm or -20deg, in SI without a unit;"
        " default: the design position",
        number_with_unit,
        "VALUE",
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.io.model_writer import written

        if self.to not in registry.writers:
            raise KincheckError(unknown("format", self.to, registry.writers))
        case = registry.case_of(self, driven=False)
        keep_texts(
            written(case, registry.writer(self.to), driver_value(self.at, case)),
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
            raise KincheckError(f"{file} exists already. Give --out to overwrite a file.")
    require_writable([("--json", json), *(("--out", file) for file in files)])
    problems: list[str] = []
    for file, text in files.items():
        failed = written_file(file, text.encode())
        problems += failed
        if not failed:
            print(file, file=sys.stderr if json == "-" else sys.stdout)
    refuse(problems)


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


STATUS = {"same": Status.WITHIN, "differs": Status.DEVIATES, "not judged": Status.FAILED}
"""Exit status by verdict."""
NO_MOTION: Mapping[str, Any] = {
    "largest_m": None,
    "allowed_by_digits_m": None,
    "freedoms": [],
    "lost": [],
    "poses": 0,
}
"""Findings on files one of which cannot be read."""
CONVERTERS = ("mujoco",)
"""Simulators that save models, for the help: adapters load later."""
NO_CONVERTERS = {
    "drake": "Drake reads URDF, SDF and MJCF, and writes none of them",
    "pinocchio": "Pinocchio saves an archive of its own, which no other program reads",
}
"""Simulators that save no model, and what they do."""


@options
class Same(Command):
    """Compare mechanisms: the motion of each file must satisfy the joints and loops of the other,
    with as many freedoms. Limits, motors, masses and gravity are no motion: what is lost or changed
    of them is listed.

    Exit status: 0 the same motion, whether something is lost or not, 1 it differs, 2 not judged or
    not read.
    """

    about = "compare files: the same mechanism, what is lost, or how it differs"
    one_thread = True
    files: tuple[str, ...] = argument(
        "models and case files of any formats, or names of built-in cases; the first is"
        " compared with each of the others",
        "FILE",
        "+",
    )
    match: tuple[str, ...] = option(
        "a link of the first file and its partner in the others, if names and places do not tell",
        metavar="LINK=LINK",
        several="repeated",
    )
    converted_by: tuple[str, ...] = option(
        "compare with what a simulator makes of the first file: it loads and saves the file;"
        " drake and pinocchio save no model, and say so",
        choices=(*CONVERTERS, *NO_CONVERTERS),
        several="repeated",
    )
    without: tuple[str, ...] = option(
        "elements to leave out of all models, by tag, name or TAG/NAME; a note says so",
        metavar="NAME",
        several="repeated",
    )
    json: str | None = json_file("the verdict")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.models.trees.reader import require_used
        from ..report.terminal import with_json
        from ..studies.same import compare

        refuse(self.unwritable())
        for name in self.converted_by:
            if name in NO_CONVERTERS:
                raise KincheckError(
                    f"--converted-by {name}: {NO_CONVERTERS[name]}, so there is no file to compare."
                    f" Run the model in it: kincheck run FILE --engine native {name}"
                )
        given = dict(map(_pair, self.match))
        names: Sequence[str] = self.files
        if len(names) + len(self.converted_by) < 2:
            raise KincheckError(
                f"same: found one file, expected two or more, or --converted-by"
                f" {', '.join(CONVERTERS)}. Add one."
            )
        try:
            first, *others = (_read(name, registry, self.without) for name in names)
            used = {name for each in (first, *others) for name in each.without}
            require_used(Path(names[0]), self.without, used)
            others += [_convert(name, Path(names[0]), registry) for name in self.converted_by]
        except KincheckError as error:
            unread = {"files": [*names], "verdict": "not judged", "reason": str(error)}
            with with_json({**unread, **NO_MOTION}, self.json):
                raise
        found = [compare(first, other, given) for other in others]
        status, worst = max(((STATUS[each.verdict], each) for each in found), key=lambda x: x[0])
        pairs = {"pairs": [each.report() for each in found]} if len(found) > 1 else {}
        with with_json({**worst.report(), **pairs}, self.json) as console:
            for each in found:
                several = f"{' and '.join(each.files)}: " if len(found) > 1 else ""
                console.print(f"{several}{each.text}", soft_wrap=True)
                for note in each.notes:
                    console.print(f"  {note}", soft_wrap=True)
        return status


def _pair(text: str) -> tuple[str, str]:
    first, sign, second = text.partition("=")
    if not (first and sign and second):
        raise KincheckError(f"--match: found {text!r}, expected LINK=LINK.")
    return first, second


def _read(name: str, registry: Registry, without: Sequence[str]) -> Undriven:
    from ..case.models.trees.reader import is_model
    from ..case.models.trees.undriven import undriven_case, undriven_file

    file = Path(name)
    if file.is_file() and is_model(file):
        return undriven_file(file, without)
    return undriven_case(registry.find_case(name, driven=False), name)


def _convert(name: str, file: Path, registry: Registry) -> Undriven:
    """Return what a simulator saves of a model."""
    from ..case.models.trees.undriven import undriven_file

    assert registry.converter is not None
    text = registry.converter(name)(file)
    with TemporaryDirectory() as folder:
        out = Path(folder) / f"{file.stem} by {name}.xml"
        out.write_text(text, encoding="utf-8")
        return undriven_file(out)


@options
class PrintTemplates(Command):
    """Print a table of hardpoints to fill in: `kincheck templates mcpherson > car.csv`, then
    `kincheck run car.csv`.

    Its numbers are examples. Rows marked optional may be left out, and so may the column of
    meanings.
    """

    about = "print a sample table of hardpoints for each suspension template"
    template: tuple[str, ...] = argument("print only these; default: all", "NAME", "*")
    bushings: bool = switch(
        "print a file of bushings by role, for kincheck kc TABLE --bushings FILE"
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.models.hardpoints.templates import sample_table, samples

        if self.bushings:
            from ..case.models.hardpoints.rubber import sample_bushings

            print(*samples(self.template, sample_bushings), sep="\n\n")
        else:
            print(*samples(self.template, sample_table), sep="\n")
        return Status.WITHIN
