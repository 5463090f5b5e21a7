"""The free motion of a case: its outputs over time, with their errors, as a truth for steppers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...case.case import HELD_BUT, TIME, Case, Sweep
from ...case.io.table_file import Kind, write_csv
from ...dataset import Dataset, Variable
from ...errors import KincheckError
from ...harness.compare import output_series
from ...tabular import Tabular
from ...trajectory import Array
from .free_dynamics import free_motion
from .section import free_in

SCHEMA = "kincheck-free/1"


@dataclass(frozen=True, eq=False, repr=False)
class FreeResult(Tabular):
    """The free motion of a case, n samples, SI units.

    Attributes:
        times: of the samples [s], shape (n,).
        outputs: by name, shape (n,); NaN where rigid bodies determine none.
        units: of the outputs.
        error: largest change of a point when all steps are halved [m].
        turning_error: largest such change of the attitude of a body [rad].
        energy: kinetic energy less the work of all loads [J], shape (n,); constant but for errors.
        energy_error: its largest change [J].
        gap: largest residual of the constraints, relative to the mechanism's size.
        freedoms: degrees of freedom without drivers.
        redundant: number of redundant rows.
        method: DOP853, or Radau for stiff loads.
        message: empty, or why the motion ends early.
        notes: on outputs without values.
    """

    case: str
    times: Array
    outputs: Mapping[str, Array]
    units: Mapping[str, str]
    error: float
    turning_error: float
    energy: Array
    energy_error: float
    gap: float
    freedoms: int
    redundant: int
    method: str
    message: str
    notes: tuple[str, ...]

    def summary(self) -> str:
        """Return case, duration and error in one line."""
        ended = f"; {self.message}" if self.message else ""
        return (
            f"{self.case}: {len(self.times)} samples to {self.times[-1]:.9g} s, change when all"
            f" steps are halved {self.error:.1e} m{ended}"
        )

    def dataset(self) -> Dataset:
        """Return the outputs over time."""
        variables = {
            name: Variable("sample", values, self.units[name])
            for name, values in self.outputs.items()
        }
        coords = {TIME: Variable("sample", self.times, "s")}
        return Dataset(("sample",), coords, variables, TIME)

    def write_csv(self, path: Path) -> int:
        """Write time and outputs as columns of a CSV file; return the number of rows."""
        columns = [self.times, *self.outputs.values()]
        rows = [
            [None if np.isnan(x) else x for x in map(float, row)]
            for row in zip(*columns, strict=True)
        ]
        return write_csv(path, dict.fromkeys([TIME, *self.outputs], Kind.NUMBER), [rows])

    @property
    def facts(self) -> dict[str, Any]:
        """The result as plain data."""
        plain = dict(vars(self))
        for name in ("times", "energy"):
            plain[name] = getattr(self, name).tolist()
        plain["outputs"] = {
            name: [None if np.isnan(x) else float(x) for x in values]
            for name, values in self.outputs.items()
        }
        return {"schema": SCHEMA, **plain}


def free_of(case: Case) -> FreeResult:
    """Return the free motion of a case, as its [free] asks.

    Raises:
        KincheckError: the case has no [free], or an output of the name of the time.
        SolveError: see `kinematics.free_motion`.
    """
    free = free_in(case)
    if free is None:
        raise KincheckError(
            f"case {case.name!r} says no duration of its free motion. Add [free] with duration and"
            " samples, or give --duration and --samples."
        )
    if TIME in (output.name for output in case.outputs):
        raise KincheckError(f"case {case.name!r}: an output is named {TIME!r}. Rename it.")
    times = np.linspace(0.0, free.duration, free.samples)
    found = free_motion(case.mechanism, times, free.rates)
    drivers = {driver.name for driver in case.mechanism.drivers}
    wanted = [name for name in case.forces if name not in drivers]
    motion = found.motion
    if wanted:
        motion = replace(motion, forces=found.forces(wanted))
    along = replace(case, sweep=Sweep(TIME, found.steps))
    outputs, notes = dict[str, Array](), list[str]()
    for output in case.outputs:
        if HELD_BUT in output.facts or drivers.intersection(output.forces):
            outputs[output.name] = np.full(len(found.times), np.nan)
            notes.append(f"{output.name}: drivers determine it, and they are left out")
            continue
        series = output_series(along, output, motion)
        outputs[output.name] = series.position[found.samples]
        if series.reason:
            notes.append(f"{output.name}: {series.reason}")
    return FreeResult(
        case.name,
        found.times,
        outputs,
        {output.name: output.unit for output in case.outputs},
        found.error,
        found.turning_error,
        found.energy,
        found.energy_error,
        found.gap,
        found.freedoms,
        found.redundant,
        found.method,
        found.message,
        tuple(notes),
    )
