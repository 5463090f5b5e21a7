"""kincheck compare: designs of a suspension against each other."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from . import import_options
from .option_types import add_json
from .registry import Registry, Status
from .run_options import TOL, add_curve_files

if TYPE_CHECKING:
    from ..case.case import Case
    from ..report.designs import Designs

PAGE = ("compare.json", "compare.html")
"""File names in the folder of --out."""


def add(commands: Any) -> None:
    """Add the command to the parser."""
    command: argparse.ArgumentParser
    command = commands.add_parser(
        "compare",
        help="two hardpoint tables or more: differing points, and curves over curves",
        description=_compare.__doc__,
    )
    command.set_defaults(do=_compare)
    command.add_argument(
        "case",
        nargs="+",
        metavar="CASE",
        help="hardpoint tables or suspension cases; the others are compared with the first",
    )
    command.add_argument(
        "--tolerance",
        action="append",
        default=[],
        metavar="OUTPUT=NUMBER UNIT",
        help=(
            'accepted difference of an output: "toe=0.1 deg", without a unit in that of the table;'
            " a larger one is status 1; may be repeated"
        ),
    )
    command.add_argument("--out", type=Path, metavar="DIR", help="write the page DIR/compare.html")
    add_json(command)
    add_curve_files(command, "a column for each output, design and difference")
    import_options.add_options(command)


def _compare(options: argparse.Namespace, registry: Registry) -> int:
    """Compare designs of a suspension: which hardpoints differ, and by how much toe, camber, roll
    centre and the other outputs do, at rebound, design, jounce and where they differ most.

    The native engine solves all designs at the samples of the first. Options for tables hold for
    all. Exit status: 0 all is solved; 1 a difference exceeds its --tolerance; 2 a design does not
    reach all samples (what it reaches is compared), or the tool could not do its work.
    """
    from ..case.io.table_file import WRITERS, Kind
    from ..harness import run as running
    from ..report import designs as views
    from ..report.progress import complain
    from ..report.sections import deliver
    from .destinations import Destinations

    to = Destinations.of(options)
    if problems := to.problems(PAGE):
        raise KincheckError("\n".join(problems))
    cases = _cases(options, registry)
    import_options.tell_left_out(cases)
    found = running.run(cases, [registry.engine("native")], tol=TOL, command=options.command)
    designs = views.designs_of(found, cases)
    unsolved = [
        f"{each.case}: {each.message}"
        for each in found.records
        if not each.driver or each.solved != each.samples
    ]
    if len(designs.curves) < len(cases):
        raise KincheckError("\n".join(unsolved))
    complain(f"note: {case.name}: {note}" for case in cases for note in case.assembly)
    beyond = views.exceeded(designs, _accepted(options.tolerance, Path(options.case[0]), designs))
    columns = views.side_by_side(designs)
    rows = [*zip(*columns.values(), strict=True)]
    kinds = dict.fromkeys(columns, Kind.NUMBER)
    deliver(
        views.comparison(designs, beyond),
        designs.results,
        out=to.out,
        json=to.json,
        files=[
            (file, lambda path, kind=kind: WRITERS[kind](path, kinds, [rows]))
            for kind, file in to.curves.items()
        ],
        problems=unsolved,
    )
    return Status.DEVIATES if beyond else Status.WITHIN


def _cases(options: argparse.Namespace, registry: Registry) -> list[Case]:
    """Return the cases with different names, the first one's samples, and its driver.

    Raises:
        KincheckError: there are not two, one cannot be read, or they move by other drivers.
    """
    names = [each for name in options.case for each in registry.matching(name)]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise KincheckError(f"{twice}: found twice, expected once; leave one out")
    if len(names) < 2:
        raise KincheckError(f"{names[0]}: found one design, expected two or more; name another")
    cases: list[Case] = []
    problems: list[str] = []
    for name in names:
        try:
            cases.append(registry.find_case(name, import_options.supplied(options)))
        except KincheckError as error:
            problems.append(str(error))
    if problems:
        raise KincheckError("\n".join(problems))
    several = len({case.name for case in cases}) < len(cases)
    first = cases[0].sweep
    for k, (name, case) in enumerate(zip(names, cases, strict=True)):
        own = case.sweep
        if own.driver != first.driver:
            raise KincheckError(
                f"{name}: found the driver {own.driver}, expected {first.driver} as in {names[0]};"
                " compare designs that move in the same way"
            )
        cases[k] = replace(
            case,
            name=name if several else case.name,
            reference={},
            sweep=replace(own, values=first.change + own.design),
        )
    return cases


def _accepted(texts: Sequence[str], file: Path, designs: Designs) -> dict[str, float]:
    """Return accepted differences by output, in the units of the first design."""
    from ..case.io.document import unknown_name
    from ..case.io.reference_curve import size_of
    from ..report.axis import in_table_units

    units = {name: each.unit for name, each in designs.results.records[0].outputs.items()}
    found: dict[str, float] = {}
    for text in texts:
        name, _, size = (part.strip() for part in text.partition("="))
        if name not in units:
            raise unknown_name(file, "--tolerance", name, units, "an output")
        _, unit = in_table_units(units[name], designs.facts)
        found[name] = (
            size_of(file, "--tolerance", name, size, units[name], lambda x, unit=unit: x * unit)
            / unit
        )
    return found
