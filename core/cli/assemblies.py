"""kincheck assemblies: list the assemblies of a mechanism, and start a simulator in one of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..case.io.reader_options import Supplied
from ..errors import KincheckError, unknown
from ..options import (
    ONE_CASE,
    argument,
    destination,
    group,
    joint_types,
    json_file,
    measured,
    option,
    options,
    whole,
)
from . import import_options
from .export import formats, keep_texts
from .parser import Command
from .registry import Registry, Status, given

if TYPE_CHECKING:
    from ..case.case import Case
    from ..studies.assemblies import Survey

# Two assemblies meet where the smallest singular value is below this; regular linkages stay above
# 1e-2.
MEETING = 1e-6


@options
class ListAssemblies(Command):
    """List the assemblies found from random starts at a driver value, the intended assembly first.

    Exit status: 0 assemblies are found, 1 none is found, 2 the tool could not do its work.
    """

    about: ClassVar[str] = "list assemblies of a mechanism, found from random starts"
    case: str | Path | Case = argument(ONE_CASE, "CASE")
    at: str | None = option(
        "value of the swept driver, such as 30mm or -20deg, in SI without a unit; default: the"
        " design position",
        measured,
        "VALUE",
        default=None,
    )
    samples: int = option(
        "number of random starts; default %(default)s", whole(1), "N", default=200
    )
    seed: int = option("seed of the random starts; default %(default)s", whole(0), "N", default=0)
    json: str | None = json_file("the assemblies with all poses")
    export: str | None = destination(
        f"write the mechanism, started in one of them: {formats()}", metavar="FORMAT"
    )
    number: int | None = destination(
        "number of the assembly to export; default 1, the first of the list", whole(1), "K"
    )
    out: Path | None = destination(
        "stem of the exported files; default: CASE.K in this folder", Path
    )
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied, kw_only=False)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.io.atomic_files import require_writable
        from ..report.terminal import with_json
        from ..studies.assemblies import survey, written

        if self.export is None and (found := given(self, ("number", "out"))):
            raise KincheckError(
                f"{found}: found without --export, which it belongs to; add"
                " --export FORMAT, or leave out"
            )
        require_writable([("--json", self.json), ("--out", self.out)])
        if self.export is not None and self.export not in registry.writers:
            raise KincheckError(unknown("format", self.export, registry.writers))
        case = registry.case_of(self)
        found = survey(
            case,
            import_options.driver_value(self.at, case),
            samples=self.samples,
            seed=self.seed,
        )
        with with_json(found.report(), self.json):
            _print(found, self.json)
            if self.export is not None:
                number: int = self.number or 1
                texts = written(found, registry.writer(self.export), number)
                keep_texts(texts, f"{case.name}.{number}", self.out, self.json)
        return Status.WITHIN if found.assemblies.found else Status.DEVIATES


def _print(found: Survey, json: str | None) -> None:
    from ..report.terminal import columns, page

    console, listed = page(json), found.assemblies
    values = ", ".join(f"{name} = {value:.9g}" for name, value in found.drivers.items())
    count, starts = len(listed.found), listed.starts
    console.print(
        f"{found.case.name} at {values}: {count} assembl{'y' if count == 1 else 'ies'} from"
        f" {starts} starts (seed {found.seed})",
        soft_wrap=True,
    )
    telling = [
        name
        for name in (listed.found[0].signs if count else ())
        if len({a.signs[name] for a in listed.found}) > 1
    ]
    table = columns(
        ">#", "which", ">distance", ">starts", ">residual", ">smallest sv", "det", *telling
    )
    for index, each in enumerate(listed.found, 1):
        which = (
            "intended"
            if found.intended(each)
            else "meets another"
            if each.smallest < MEETING
            else "other"
        )
        signs = [_sign(each.orientation), *(_sign(each.signs[name]) for name in telling)]
        numbers = (
            f"{each.distance:.4g}",
            f"{each.starts}",
            f"{each.residual:.1e}",
            f"{each.smallest:.3g}",
        )
        table.add_row(f"{index}", which, *numbers, *signs)
    console.print(table)
    if found.reason:
        console.print(f"none is the intended assembly: {found.reason}", soft_wrap=True)
    console.print(
        f"distance: from {found.ranked_by}, rms over the bodies of turn [rad] and shift [mechanism"
        " sizes]; det, joints: signs of the determinant and of triple products, + as at design;"
        f" residual: of the mechanism's size. {listed.lost} starts did not close,"
        f" {listed.spurious} ended on spurious zeros.",
        soft_wrap=True,
    )
    missing = listed.missing or "There may be some"
    console.print(f"{missing}; raise --samples.", soft_wrap=True)


def _sign(value: int) -> str:
    return "-0+"[value + 1]
