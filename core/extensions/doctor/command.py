"""kincheck doctor: list installed and missing parts with remedies, and solve one case."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...cli.shared_options import TOL
from ...errors import refuse
from ...options import (
    json_file,
    options,
    verbosity,
)

if TYPE_CHECKING:
    from rich.console import Console

    from .installation import Examination

SAMPLE = "mcpherson_strut"
"""Case of the self-check: the paper's strut, whose reference has 17 digits."""


@options
class Doctor(Command):
    """List installed and missing parts with remedies, and solve a case with the native engine.

    Exit status: 0 the tool can do its work, 2 something essential is missing or broken.
    """

    about = "list installed and missing parts, and test the installation"
    json: str | None = json_file("the findings")
    quiet: bool = verbosity("print only the verdict and the essential missing parts")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...harness.engine import STANDARD
        from ...report.terminal import with_json
        from .installation import examine

        refuse(self.unwritable())
        found = examine(registry.case(SAMPLE), registry.engine(STANDARD), TOL, registry.engines)
        with with_json(found, self.json) as console:
            (_print_verdict if self.quiet else _print)(found, console)
        return Status.WITHIN if found.able else Status.FAILED


def _print(found: Examination, console: Console) -> None:
    from rich.text import Text

    from ...report.terminal import columns

    machine, check = found.machine, found.check
    console.print(
        f"kincheck {found.kincheck}, Python {machine.python}, {machine.platform}", soft_wrap=True
    )
    console.print(f"{machine.processor}, {machine.processors} processors", soft_wrap=True)
    table = columns("part", "version", "for", "state")
    for part in found.parts:
        state = "ok" if not part.problem else "broken" if part.version else "not installed"
        style = "green" if not part.problem else "bold red" if part.essential else "yellow"
        purpose = part.purpose + " (essential)" * part.essential
        table.add_row(part.name, part.version or "–", purpose, Text(state, style))
    console.print(table)
    for part in found.parts:
        if part.problem and not part.essential:
            console.print(f"{part.name}: {part.problem}: {part.remedy}", soft_wrap=True)
    width = f", {machine.vector_width} doubles at a time" if machine.vector_width else ""
    console.print(f"programs run by {machine.executor}{width}", soft_wrap=True)
    state = machine.cache_problem or f"writable, {1e-6 * machine.cache_bytes:.3g} MB now"
    console.print(
        f"compiled code is kept in {machine.cache}: {state}",
        soft_wrap=True,
        style="yellow" if machine.cache_problem else None,
    )
    measured = (
        ""
        if check.error is None
        else f", largest error {check.error:.1e} of {check.tolerance:.0e} allowed"
    )
    time = (
        ""
        if check.us_per_step is None
        else f", {check.us_per_step:.3g} us per sample, loop: {check.loop}"
    )
    message = f": {check.message}" if check.message else ""
    console.print(
        f"self-check {check.case}: {check.outcome}{measured}{time}{message}", soft_wrap=True
    )
    _print_verdict(found, console)


def _print_verdict(found: Examination, console: Console) -> None:
    for part in found.parts:
        if part.essential and part.problem:
            console.print(f"{part.name}: {part.problem}: {part.remedy}", soft_wrap=True)
    verdict = "can do its work" if found.able else "cannot do its work: see above"
    console.print(f"kincheck {verdict}", style="bold" if found.able else "bold red")
