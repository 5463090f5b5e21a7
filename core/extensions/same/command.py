"""The command kincheck same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...doors import offers
from ...errors import KincheckError, refuse
from ...options import (
    argument,
    json_file,
    option,
    options,
)

if TYPE_CHECKING:
    from .undriven import Undriven
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
CONVERTERS = tuple(offers("converters"))
"""Simulators that save models."""

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
        from ...report.terminal import with_json
        from ..trees.reader import require_used
        from .verdict import compare

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
            others += [_convert(name, Path(names[0])) for name in self.converted_by]
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
    from ..trees.reader import is_model
    from .undriven import undriven_case, undriven_file

    file = Path(name)
    if file.is_file() and is_model(file):
        return undriven_file(file, without)
    return undriven_case(registry.find_case(name, driven=False), name)


def _convert(name: str, file: Path) -> Undriven:
    """Return what a simulator saves of a model."""
    from .undriven import undriven_file

    text: str = offers("converters")[name].load()(file)
    with TemporaryDirectory() as folder:
        out = Path(folder) / f"{file.stem} by {name}.xml"
        out.write_text(text, encoding="utf-8")
        return undriven_file(out)
