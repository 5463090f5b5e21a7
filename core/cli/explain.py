"""kincheck explain: find why a case cannot be solved, or how well conditioned it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..case.io.reader_options import Supplied
from ..options import (
    ONE_CASE,
    argument,
    group,
    joint_types,
    json_file,
    option,
    options,
    positive,
    verbosity,
    whole,
)
from .parser import Command
from .registry import Registry, Status
from .run_options import TOL

if TYPE_CHECKING:
    from ..case.case import Case
    from ..studies.diagnosis import Diagnosis


@options
class Explain(Command):
    """Diagnose a case: degrees of freedom, redundant and contradictory rows by name, conditioning
    along the sweep, resulting tolerances, sensitivity of the outputs to hardpoints, and the
    programs of the native engine.

    Exit status: 0 it can be solved, 1 it contradicts itself or is not determined, 2 the tool could
    not do its work.
    """

    about: ClassVar[str] = "diagnose a case: freedom, conditioning, tolerances"
    case: str | Path | Case = argument(ONE_CASE, "CASE")
    samples: int = option(
        "number of samples of the sweep to examine; default %(default)s", whole(1), "N", default=41
    )
    tol: float = option(
        f"largest residual that engines may leave [m or -]; default {TOL:g}",
        positive,
        "X",
        default=TOL,
    )
    json: str | None = json_file("the diagnosis")
    quiet: bool = verbosity("print only the verdict, the findings and the notes")
    verbose: bool = verbosity("print all samples and sensitivities, instead of a few of each", "-v")
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied, kw_only=False)

    def answer(self, registry: Registry) -> Diagnosis:
        """Diagnose a case: degrees of freedom, redundant rows, conditioning, and sensitivities of
        outputs [SI].

        Raises:
            KincheckError: there is no such case, or its file is invalid.
        """
        from ..studies.diagnosis import diagnose

        case = registry.case_of(self, driven=False)
        return diagnose(case, samples=self.samples, tol=self.tol)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.io.atomic_files import require_writable
        from ..report.terminal import page, with_json
        from ..studies.diagnosis.text import print_diagnosis

        require_writable([("--json", self.json)])
        found = self.answer(registry)
        how = {"quiet": self.quiet, "verbose": self.verbose}
        with with_json(found, self.json):
            print_diagnosis(found, page(self.json), **how)
        return Status.DEVIATES if found.findings else Status.WITHIN
