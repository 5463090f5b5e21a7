"""The command kincheck reference."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ...case.io.escape import file_name, visible
from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...cli.shared_options import TOL
from ...errors import refuse
from ...options import (
    CASES,
    argument,
    destination,
    joint_types,
    option,
    options,
    switch,
    verbosity,
    whole,
)

if TYPE_CHECKING:
    from ...case.io.reference_file import Reference
    from ...report.terminal import FittingTable
    from .verified_reference import NativeError
# A double has 17 digits; beyond 1000 digits only the time grows.
FEWEST, DIGITS, MOST = 17, 30, 1000
# Largest number of unproved samples in the output; the file has all of them.
NAMED = 5


@options
class ProveReferences(Command):
    """Prove that exactly one solution exists near each sample of the native engine, and enclose its
    outputs.

    Exit status: 0 all samples are proved, 1 some are not (singular poses), 2 the tool could not
    do its work.
    """

    about = "prove the samples of cases to any number of digits"
    case: tuple[str, ...] = argument(CASES, "CASE", "*")
    joint_type: tuple[str, ...] = joint_types()
    out: Path | None = destination(
        "write CASE.reference.json there, for run --reference or a case file", Path, "DIR"
    )
    digits: int = option(
        "accuracy of the outputs, 10^-N; default %(default)s",
        whole(FEWEST, MOST),
        "N",
        default=DIGITS,
    )
    decimal: bool = switch(
        "take the numbers of a case as their printed decimals, instead of as the doubles that"
        " engines get"
    )
    quiet: bool = verbosity("print one line for each case")
    verbose: bool = verbosity("print every unproved sample", "-v")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import unwritable, written
        from ...harness.record import to_json
        from ...report.terminal import indent_table, page
        from .verified_reference import prove_case

        unread: dict[str, str] = {}
        cases = registry.find_cases(self.case or [*registry.cases()], unread)
        names = [f"{file_name(case.name)}.reference.json" for case in cases]
        problems = [*unread.values(), *self.unwritable(*names)]
        if self.out is not None and not problems:  # two cases of one file
            problems += unwritable(
                (case.name, self.out / name) for case, name in zip(cases, names, strict=True)
            )
        refuse(problems)
        complete = True
        for case, name in zip(cases, names, strict=True):
            numbers = "decimal" if self.decimal else "double"
            found, errors = prove_case(case, digits=self.digits, numbers=numbers, tol=TOL)
            complete &= found.proved == len(found.samples)
            lines = _lines(found, len(found.samples) if self.verbose else NAMED)
            print(*(lines[:1] if self.quiet else lines), sep="\n", flush=True)
            if errors and not self.quiet:
                page(None).print(indent_table(_table(errors)))
            if self.out is not None:
                problems += written(self.out / name, to_json(found))
        refuse(problems)
        return Status.WITHIN if complete else Status.DEVIATES


def _lines(found: Reference, named: int) -> list[str]:
    """Return the lines of a report on proved and unproved samples."""
    count, proved = len(found.samples), [sample for sample in found.samples if sample.proved]
    each = 1e3 * found.seconds / max(1, count)
    lines = [
        f"{found.case}: {len(proved)} of {count} samples proved to 1e-{found.digits},"
        f" {found.seconds:.2g} s, {each:.2g} ms each"
    ]
    if proved:
        lines.append(
            f"  each solution is the only one within {min(s.alone or 0.0 for s in proved):.2g} of"
            " the mechanism's size"
        )
    if found.redundant:
        worst, contradicted = (
            max((s.redundant or 0.0 for s in proved), default=0.0),
            sum(s.contradicted > 0 for s in proved),
        )
        closes = (
            f"; not zero at {contradicted} samples: the geometry, as rounded, closes only without"
            " them"
            if contradicted
            else ""
        )
        lines.append(
            f"  {len(found.redundant)} redundant rows, {worst:.1e} or less at the solutions{closes}"
        )
    lines += [
        f"  {name}: no proof: {each.reason}" for name, each in found.outputs.items() if each.reason
    ]
    lines += _unproved_samples(found, named)
    lines += [
        f"  signs: {words}"
        for words in dict.fromkeys(each.signs for each in found.outputs.values())
        if words
    ]
    return lines


def _table(errors: Sequence[NativeError]) -> FittingTable:
    """Return the native engine's errors."""
    from rich.text import Text

    from ...report.terminal import columns
    from ...trajectory import QUANTITIES

    table = columns("native error", *(f">{quantity}" for quantity in QUANTITIES), "unit")
    for error in errors:
        cells = (_cell(*pair) for pair in zip(error.largest, error.ulps, strict=True))
        table.add_row(*map(Text, (visible(error.output), *cells, visible(error.unit))))
    return table


def _cell(largest: float | None, ulps: float | None) -> str:
    if largest is None:
        return "–"
    return f"{largest:.1e}" + (f" {ulps:6.1f} ulp" if ulps is not None else "")


def _unproved_samples(found: Reference, named: int) -> list[str]:
    """Return the lines about samples without a proof."""
    name, values = next(iter(found.driver.items()))
    missing = [(k, sample.reason) for k, sample in enumerate(found.samples) if not sample.proved]
    lines = [
        f"  sample {k} ({name} = {values[k]:.9g}) not proved: {reason}"
        for k, reason in missing[:named]
    ]
    return lines + (
        [f"  and {len(missing) - named} more; -v prints all, --out writes them"]
        if len(missing) > named
        else []
    )
