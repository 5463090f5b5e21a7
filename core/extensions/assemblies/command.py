"""The command kincheck assemblies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...cli.registry import Registry, Status
from ...cli.shared_options import OfCase, driver_value
from ...errors import KincheckError, refuse
from ...options import (
    destination,
    json_file,
    names_of_given,
    number_with_unit,
    option,
    options,
    whole,
)
from ..exports.command import formats, keep_texts, writer_of

if TYPE_CHECKING:
    from rich.console import Console

    from .assemblies import Survey

# Two assemblies meet where the smallest singular value is below this; regular linkages stay above
# 1e-2.
MEETING = 1e-6


@options
class ListAssemblies(OfCase):
    """List the assemblies found from random starts at a driver value, the intended assembly first.

    Exit status: 0 assemblies are found, 1 none is found, 2 the tool could not do its work.
    """

    about = "list assemblies of a mechanism, found from random starts"
    at: str | None = option(
        "value of the swept driver, such as 30mm or -20deg, in SI without a unit; default: the"
        " design position",
        number_with_unit,
        "VALUE",
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

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...report.terminal import with_json
        from .assemblies import survey, written

        if self.export is None and (found := names_of_given(self, ("number", "out"))):
            raise KincheckError(
                f"{found}: only an export uses it. Add --export FORMAT, or leave it out."
            )
        refuse(self.unwritable())
        writer = None if self.export is None else writer_of(self.export)
        case = registry.case_of(self)
        found = survey(
            case,
            driver_value(self.at, case),
            samples=self.samples,
            seed=self.seed,
        )
        with with_json(found.report(), self.json) as console:
            _print(found, console)
            if writer is not None:
                number: int = self.number or 1
                texts = written(found, writer, number)
                keep_texts(texts, f"{case.name}.{number}", self.out, self.json)
        return Status.WITHIN if found.assemblies.found else Status.DEVIATES


def _print(found: Survey, console: Console) -> None:
    from ...report.terminal import columns

    listed = found.assemblies
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
