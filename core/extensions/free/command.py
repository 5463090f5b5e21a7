"""The command kincheck free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

from ...cli.registry import Registry, Status
from ...cli.shared_options import OfCase
from ...errors import KincheckError, number_of, refuse
from ...options import (
    destination,
    json_file,
    option,
    options,
    positive,
    whole,
)

if TYPE_CHECKING:
    from .free import FreeResult


@options
class MoveFreely(OfCase):
    """Integrate the motion of a case without its drivers: its masses, loads and the rates of
    [free] alone move it from the design position.

    The error is the change when all steps are halved. Exit status: 0 the whole motion is
    integrated; 1 it ends before, at a change point; 2 the tool could not do its work.
    """

    about = "move a case without drivers, by its masses and loads, to round-off"
    duration: float | None = option(
        "of the motion [s]; default: of [free]", positive, "T", default=None
    )
    samples: int | None = option(
        "number of samples, both ends included; default: of [free]",
        whole(2),
        "N",
        default=None,
    )
    rates: Mapping[str, float] | None = field(default=None)
    csv: Path | None = destination("write time and outputs as columns, SI units", Path)
    json: str | None = json_file("outputs and errors")

    def answer(self, registry: Registry) -> FreeResult:
        """Integrate the motion of a case without its drivers.

        Args `rates`: at the start, by driver or joint [m/s or rad/s]; default: those of [free].

        Raises:
            KincheckError: duration or samples are missing, or the mechanism has no free motion.
        """
        from .free import free_of
        from .section import Free, free_in, with_free

        case = registry.case_of(self, driven=False)
        given = free_in(case)
        duration = self.duration or (given and given.duration)
        samples = self.samples or (given and given.samples)
        if not duration or not samples:
            raise KincheckError(
                f"{case.name if self.case is case else self.case}: says no duration and samples of"
                " its free motion. Add [free] with duration and samples, or give --duration and"
                " --samples."
            )
        rates: Mapping[str, float] = given.rates if given else {}
        rates = rates if self.rates is None else self.rates
        if not isinstance(rates, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise KincheckError(f"rates: found {rates!r}, expected {{DRIVER or JOINT: rate}}")
        return free_of(with_free(case, Free(duration, samples, dict(rates))))

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import write
        from ...report.progress import complain
        from ...report.terminal import with_json

        refuse(self.unwritable())
        found = self.answer(registry)
        if self.csv:
            write("--csv", self.csv, found.write_csv)
        complain([*found.notes, *filter(None, [found.message])])
        with with_json(found.facts, self.json) as console:
            print(
                f"{found.case}: {len(found.times)} samples to {found.times[-1]:.9g} s,"
                f" {number_of(found.freedoms, 'degree of freedom', 'degrees of freedom')},"
                f" {number_of(found.redundant, 'redundant row')}, {found.method}",
                f"  change when all steps are halved: {found.error:.1e} m,"
                f" {found.turning_error:.1e} rad",
                f"  change of energy less work: {found.energy_error:.1e} J; largest gap:"
                f" {found.gap:.1e} of the mechanism's size",
                sep="\n",
                file=console.file,
            )
        return Status.DEVIATES if found.message else Status.WITHIN
