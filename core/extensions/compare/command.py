"""kincheck compare: designs of a suspension against each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...case.io.reader_options import Supplied
from ...cli.forms import contents_of_forms, with_forms
from ...cli.parser import Command
from ...cli.registry import Registry, Status, tell_left_out
from ...cli.shared_options import TOL
from ...errors import KincheckError, collect_errors, refuse
from ...options import (
    argument,
    destination,
    group,
    joint_types,
    json_file,
    option,
    options,
)

if TYPE_CHECKING:
    from ...case.case import Case
    from .designs import Designs

PAGE = ("compare.json", "compare.html")
"""File names in the folder of --out."""
_Formed: Any = with_forms()
WIDE = "write a column for each output, design and difference"


@options
class Compare(_Formed, Command):  # pyright: ignore[reportUntypedBaseClass]
    """Compare designs of a suspension: which hardpoints differ, and by how much toe, camber, roll
    centre and the other outputs do, at rebound, design, jounce and where they differ most.

    The native engine solves all designs at the samples of the first. Options for tables hold for
    all. Exit status: 0 all is solved; 1 a difference exceeds its --tolerance; 2 a design does not
    reach all samples (what it reaches is compared), or the tool could not do its work.
    """

    about = "two hardpoint tables or more: differing points, and curves over curves"
    cases: Sequence[str | Path | Case] = argument(
        "hardpoint tables or suspension cases; the others are compared with the first", "CASE", "+"
    )
    tolerance: tuple[str, ...] = option(
        'accepted difference of an output: "toe=0.1 deg", without a unit in that of the table;'
        " a larger one is status 1; may be repeated",
        metavar="OUTPUT=NUMBER UNIT",
        several="repeated",
        default=(),
    )
    out: Path | None = destination("write the page DIR/compare.html", Path, "DIR")
    json: str | None = json_file()
    csv: Path | None = destination(f"{WIDE} as CSV", Path)
    parquet: Path | None = destination(f"{WIDE} as Parquet", Path)
    xlsx: Path | None = destination(f"{WIDE} as a workbook", Path)
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied)

    def answer(self, registry: Registry) -> Designs:
        """Compare two designs of a suspension or more with the first: hardpoints and outputs.

        Raises:
            KincheckError: there are not two, one cannot be read, moves by another driver, or does
                not reach all samples.
        """
        designs, beyond, unsolved = self._compare_designs(registry)
        refuse(unsolved)
        return replace(designs, exceeded=tuple(beyond))

    def _compare_designs(self, registry: Registry) -> tuple[Designs, list[str], list[str]]:
        """Return the designs, differences beyond their tolerances, and designs unsolved in part."""
        from ...harness import run as running
        from . import designs as views

        cases = _cases(self, registry)
        found = running.run(cases, [registry.engine("native")], tol=TOL, command=self.command)
        designs = views.designs_of(found, cases)
        unsolved = [
            f"{each.case}: {each.message}"
            for each in found.records
            if not each.driver or each.solved != each.samples
        ]
        if len(designs.curves) < len(cases):
            apart = "; ".join(designs.other.values()) or "no name is the same"
            unsolved = unsolved or [
                f"{', '.join(each.name for each in cases)}: have no output in common: {apart}."
                " Compare designs with the same outputs."
            ]
            refuse(unsolved)
        if self.command:
            tell_left_out(cases)
        accepted = _tolerances_of(self.tolerance, Path(_name_of(self.cases[0])), designs)
        return designs, views.exceeded(designs, accepted), unsolved

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.table_file import WRITERS, Kind
        from ...cli.destinations import curves_of
        from ..reports.reports import deliver
        from . import designs as views

        refuse(self.unwritable(*PAGE))
        designs, beyond, unsolved = self._compare_designs(registry)
        columns = views.side_by_side(designs)
        rows = [*zip(*columns.values(), strict=True)]
        kinds = dict.fromkeys(columns, Kind.NUMBER)
        report = views.comparison(designs, beyond)
        deliver(
            report,
            views.with_comparison(designs, beyond),
            out=self.out,
            json=self.json,
            files=[
                *(
                    (file, lambda path, kind=kind: WRITERS[kind](path, kinds, [rows]))
                    for kind, file in curves_of(self).items()
                ),
                *contents_of_forms(self, report),
            ],
            problems=unsolved,
        )
        return Status.DEVIATES if beyond else Status.WITHIN


def _cases(options: Compare, registry: Registry) -> list[Case]:
    """Return the cases with different names, the first one's samples, and its driver.

    Raises:
        KincheckError: there are not two, one cannot be read, or they move by other drivers.
    """
    given: list[str | Case] = []
    for each in options.cases:
        texts = isinstance(each, str | Path)
        given += registry.matching_names(str(each)) if texts else [registry.find_case(each)]
    names = [*map(_name_of, given)]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise KincheckError(f"{twice}: found twice. Leave one out.")
    if len(names) < 2:
        count = f"{names[0]}: found one design" if names else "compare: found none"
        raise KincheckError(f"{count}, expected two or more. Name another.")
    cases: list[Case] = []
    problems: list[str] = []
    for each in given:
        with collect_errors(problems):
            cases.append(registry.find_case(each, options.supplied))
    refuse(problems)
    several = len({case.name for case in cases}) < len(cases)
    first = cases[0].sweep
    for k, (name, case) in enumerate(zip(names, cases, strict=True)):
        own = case.sweep
        if own.driver != first.driver:
            raise KincheckError(
                f"{name}: found the driver {own.driver}, expected {first.driver} as in {names[0]}."
                " Compare designs that move in the same way."
            )
        cases[k] = replace(
            case,
            name=name if several else case.name,
            reference={},
            sweep=replace(own, values=first.change + own.design),
        )
    return cases


def _name_of(case: str | Path | Case) -> str:
    return str(case) if isinstance(case, str | Path) else case.name


def _tolerances_of(texts: Sequence[str], file: Path, designs: Designs) -> dict[str, float]:
    """Return accepted differences by output, in the units of the first design."""
    from ...case.io.document import unknown_name
    from ...harness.table_units import in_table_units
    from ..measured.reference_curve import size_of

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
