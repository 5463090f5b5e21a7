"""kincheck same: whether files are the same mechanism, and what conversions lose."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from .option_types import add_json
from .registry import Registry, Status

if TYPE_CHECKING:
    from ..case.models.undriven import Undriven
    from ..studies.same import Comparison

STATUS = {"same": Status.WITHIN, "differs": Status.DEVIATES, "not judged": Status.FAILED}
"""Exit status by verdict."""
CONVERTERS = ("mujoco",)
"""Simulators that save models, for the help: adapters load later."""
NO_CONVERTERS = {
    "drake": "Drake reads URDF, SDF and MJCF, and writes none of them",
    "pinocchio": "Pinocchio saves an archive of its own, which no other program reads",
}
"""Simulators that save no model, and what they do."""


def add(commands: Any) -> None:
    """Add the command to the parser."""
    same: argparse.ArgumentParser
    same = commands.add_parser(
        "same",
        help="compare files: the same mechanism, what is lost, or how it differs",
        description=_same.__doc__,
    )
    same.set_defaults(do=_same, one_thread=True)
    same.add_argument(
        "files",
        nargs="+",
        metavar="FILE",
        help="models and case files of any formats, or names of built-in cases; the first is"
        " compared with each of the others",
    )
    same.add_argument(
        "--match",
        action="append",
        default=[],
        metavar="LINK=LINK",
        help="a link of the first file and its partner in the others, if names and places do not"
        " tell",
    )
    same.add_argument(
        "--converted-by",
        action="append",
        default=[],
        choices=(*CONVERTERS, *NO_CONVERTERS),
        help="compare with what a simulator makes of the first file: it loads and saves the file;"
        " drake and pinocchio save no model, and say so",
    )
    same.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="NAME",
        help="elements to leave out of all models, by tag, name or TAG/NAME; a note says so",
    )
    add_json(same, "the verdict")


def _same(options: argparse.Namespace, registry: Registry) -> int:
    """Compare mechanisms: the motion of each file must satisfy the joints and loops of the other,
    with as many freedoms. Limits, motors, masses and gravity are no motion: what is lost or changed
    of them is listed.

    Exit status: 0 the same motion, whether something is lost or not, 1 it differs, 2 not judged or
    not read.
    """
    from ..case.io.atomic_files import require_writable
    from ..case.models.files import require_used
    from ..report.terminal import page, with_json
    from ..studies.same import compare

    require_writable([("--json", options.json)])
    for name in options.converted_by:
        if name in NO_CONVERTERS:
            raise KincheckError(
                f"--converted-by {name}: {NO_CONVERTERS[name]}, so there is no file to compare; run"
                f" the model in it: kincheck run FILE --engine native {name}"
            )
    given = dict(map(_pair, options.match))
    names: Sequence[str] = options.files
    if len(names) + len(options.converted_by) < 2:
        raise KincheckError(
            f"same: found one file, expected two or more, or --converted-by"
            f" {', '.join(CONVERTERS)}; add one"
        )
    try:
        first, *others = (_read(name, registry, options.without) for name in names)
        used = {name for each in (first, *others) for name in each.without}
        require_used(Path(names[0]), options.without, used)
        others += [_converted(name, Path(names[0]), registry) for name in options.converted_by]
    except KincheckError as error:
        with with_json(_unread(names, str(error)), options.json):
            raise
    found = [compare(first, other, given) for other in others]
    with with_json(_report(found), options.json):
        console = page(options.json)
        for each in found:
            several = f"{' and '.join(each.files)}: " if len(found) > 1 else ""
            console.print(f"{several}{each.text}", soft_wrap=True)
            for note in each.notes:
                console.print(f"  {note}", soft_wrap=True)
    return max(STATUS[each.verdict] for each in found)


def _pair(text: str) -> tuple[str, str]:
    first, sign, second = text.partition("=")
    if not (first and sign and second):
        raise KincheckError(f"--match: found {text!r}, expected LINK=LINK; correct it")
    return first, second


def _read(name: str, registry: Registry, without: Sequence[str]) -> Undriven:
    from ..case.models.files import MODEL, kind_of
    from ..case.models.undriven import undriven_case, undriven_file

    file = Path(name)
    if file.is_file() and kind_of(file) == MODEL:
        return undriven_file(file, without)
    return undriven_case(registry.find_case(name, driven=False), name)


def _converted(name: str, file: Path, registry: Registry) -> Undriven:
    """Return what a simulator saves of a model."""
    from ..case.models.undriven import undriven_file

    assert registry.converter is not None
    text = registry.converter(name)(file)
    with TemporaryDirectory() as folder:
        out = Path(folder) / f"{file.stem} by {name}.xml"
        out.write_text(text, encoding="utf-8")
        return undriven_file(out)


def _unread(names: Sequence[str], reason: str) -> dict[str, Any]:
    """Return the report on files one of which cannot be read."""
    none: dict[str, Any] = {
        "largest_m": None,
        "allowed_by_digits_m": None,
        "freedoms": [],
        "lost": [],
        "poses": 0,
    }
    return {"files": [*names], "verdict": "not judged", "reason": reason, **none}


def _report(found: Sequence[Comparison]) -> dict[str, Any]:
    """Return the comparisons as JSON: the worst, and all of them if there are several."""
    worst = max(found, key=lambda each: STATUS[each.verdict]).report()
    if len(found) > 1:
        worst["pairs"] = [each.report() for each in found]
    return worst
