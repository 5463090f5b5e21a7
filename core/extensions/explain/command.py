"""The command kincheck explain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...cli.registry import Registry, Status
from ...cli.shared_options import TOL, OfCase
from ...errors import refuse
from ...options import (
    json_file,
    option,
    options,
    positive,
    verbosity,
    whole,
)

if TYPE_CHECKING:
    from .diagnose import Diagnosis


@options
class Explain(OfCase):
    """Diagnose a case: degrees of freedom, redundant and contradictory rows by name, conditioning
    along the sweep, resulting tolerances, sensitivity of the outputs to hardpoints, and the
    programs of the native engine.

    Exit status: 0 it can be solved, 1 it contradicts itself or is not determined, 2 the tool could
    not do its work.
    """

    about = "diagnose a case: freedom, conditioning, tolerances"
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

    def answer(self, registry: Registry) -> Diagnosis:
        """Diagnose a case: degrees of freedom, redundant rows, conditioning, and sensitivities of
        outputs [SI].

        Raises:
            KincheckError: there is no such case, or its file is invalid.
        """
        from .diagnose import diagnose

        case = registry.case_of(self, driven=False)
        return diagnose(case, samples=self.samples, tol=self.tol)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...report.terminal import with_json
        from .text import print_diagnosis

        refuse(self.unwritable())
        found = self.answer(registry)
        how = {"quiet": self.quiet, "verbose": self.verbose}
        with with_json(found, self.json) as console:
            print_diagnosis(found, console, **how)
        return Status.DEVIATES if found.findings else Status.WITHIN
