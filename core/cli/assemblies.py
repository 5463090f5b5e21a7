"""kincheck assemblies: list the assemblies of a mechanism, and start a simulator in one of them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError, unknown
from . import import_options
from .export import formats, keep_texts
from .option_types import add_json, measured, whole
from .registry import Registry, Status, given

if TYPE_CHECKING:
    from ..studies.assemblies import Survey

# Two assemblies meet where the smallest singular value is below this; regular linkages stay above
# 1e-2.
MEETING = 1e-6


def add(commands: Any) -> None:
    """Add the command to the parser."""
    listing: argparse.ArgumentParser
    listing = commands.add_parser(
        "assemblies",
        help="list assemblies of a mechanism, found from random starts",
        description=_assemblies.__doc__,
    )
    listing.set_defaults(do=_assemblies)
    listing.add_argument(
        "case",
        metavar="CASE",
        help="name of a built-in case, or path to a case file or to another tool's file",
    )
    listing.add_argument(
        "--at",
        type=measured,
        metavar="VALUE",
        help=(
            "value of the swept driver, such as 30mm or -20deg, in SI without a unit; default: the"
            " design position"
        ),
    )
    listing.add_argument(
        "--samples",
        type=whole(1),
        default=200,
        metavar="N",
        help="number of random starts; default %(default)s",
    )
    listing.add_argument(
        "--seed",
        type=whole(0),
        default=0,
        metavar="N",
        help="seed of the random starts; default %(default)s",
    )
    add_json(listing, "the assemblies with all poses")
    listing.add_argument(
        "--export",
        metavar="FORMAT",
        help=f"write the mechanism, started in one of them: {formats()}",
    )
    listing.add_argument(
        "--number",
        type=whole(1),
        metavar="K",
        help="number of the assembly to export; default 1, the first of the list",
    )
    listing.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="stem of the exported files; default: CASE.K in this folder",
    )
    import_options.add_options(listing)


def _assemblies(options: argparse.Namespace, registry: Registry) -> int:
    """List the assemblies found from random starts at a driver value, the intended assembly first.

    Exit status: 0 assemblies are found, 1 none is found, 2 the tool could not do its work.
    """
    from ..case.io.atomic_files import require_writable
    from ..report.terminal import with_json
    from ..studies.assemblies import survey, written

    if options.export is None and (found := given(options, ("number", "out"))):
        raise KincheckError(
            f"{found}: found without --export, which it belongs to; add"
            " --export FORMAT, or leave out"
        )
    require_writable([("--json", options.json), ("--out", options.out)])
    if options.export is not None and options.export not in registry.writers:
        raise KincheckError(unknown("format", options.export, registry.writers))
    case = registry.find_case(options.case, import_options.supplied(options))
    import_options.tell_left_out([case])
    found = survey(
        case,
        import_options.driver_value(options.at, case),
        samples=options.samples,
        seed=options.seed,
    )
    with with_json(found.report(), options.json):
        _print(found, options.json)
        if options.export is not None:
            number: int = options.number or 1
            texts = written(found, registry.writer(options.export), number)
            keep_texts(texts, f"{case.name}.{number}", options.out, options.json)
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
