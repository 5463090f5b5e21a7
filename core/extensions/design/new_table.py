"""A table of hardpoints with moves of points, rods and shims: its check, and its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, radians
from pathlib import Path

import numpy as np

from ...case.case import Case
from ...cli.registry import Registry
from ...cli.shared_options import TOL, OfCase
from ...errors import KincheckError
from ...harness.record import Outcome
from ...report.sections import Section
from ..compare.designs import comparison, designs_of
from ..hardpoints.options import WheelOptions
from ..hardpoints.read import case_of_hardpoints
from ..hardpoints.reader import read_hardpoints
from ..hardpoints.saving import write_table
from ..hardpoints.table import Hardpoint, HardpointTable, unit_of
from ..hardpoints.templates import WHEEL_AXIS
from ..sweep.curves import curves
from .rods import assembles, with_rods
from .search import with_rows

CHECKS = ("mujoco", "pinocchio", "exudyn")
"""Engines that solve the answer again, the first that is installed."""
DIGITS = 12
"""Digits of written coordinates: a thousandth of the accuracy of the bands and more."""

NO_MOVE = 1e-12
"""Smaller moves are round-off of an assembly [m]."""


def _assembled(case: Case, moves: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Return the moves of all rows to where the car comes together at design, by place, and the
    angles of the wheel there, if no row states its axis.
    """
    sweep = replace(case.sweep, values=np.array([case.sweep.design]))
    marked, places = with_rods(replace(case, sweep=sweep, reference={}), [*moves])
    marked, rows = with_rows(marked)
    sides = {
        f"static_{angle}": next(
            each.name for each in case.outputs if each.name in (angle, f"left_{angle}")
        )
        for angle in ("toe", "camber")
        if not any(WHEEL_AXIS in row.roles for row in case.hardpoints)
    }
    names = [each for row in rows.values() for each in row] + [*sides.values()]
    offsets = np.vstack([np.zeros(len(moves)), [*moves.values()]])
    solved = curves(marked, places, offsets, names)
    if not solved.solved.all():
        raise KincheckError(
            f"{case.name}: with the new rods and shims the car does not come together at design"
            f" ({solved.messages.get(1, 'no reason given')}); give smaller boxes"
        )
    found = {name: each[:, 0] for name, each in solved.values.items()}
    moved = {
        f"{row} {axis}": float(np.diff(found[name])[0])
        for row, own in rows.items()
        for axis, name in zip("xyz", own, strict=True)
    }
    angles = {key: degrees(found[name][1]) for key, name in sides.items()}
    return moved, {key: radians(float(f"{x:.{DIGITS}g}")) for key, x in angles.items()}


def require_new(out: Path | None, suffix: str = ".csv") -> None:
    """Refuse an existing file, and one without the suffix.

    Raises:
        KincheckError: it is so.
    """
    if out is not None and (out.exists() or out.suffix.lower() != suffix):
        what = "the file exists and stays" if out.exists() else "the file is another kind"
        raise KincheckError(f"--out {out}: {what}; give a new name that ends in {suffix}")


def table_of(options: OfCase, registry: Registry) -> Case:
    """Return the case of a table.

    Raises:
        KincheckError: the case is no table.
    """
    case = registry.case_of(options)
    if not case.hardpoints:
        raise KincheckError(
            f"{case.name}: is no table of hardpoints; give a table, such as car.csv"
        )
    return case


@dataclass(frozen=True, eq=False)
class NewTable:
    """A table with moves of its points, put together at design.

    Attributes:
        points: in the units and axes of the table.
        moves: of its rows, by place [m].
        old, case: of the table, and with the moves, at the same samples.
    """

    table: HardpointTable
    supplied: WheelOptions
    points: Sequence[tuple[float, float, float]]
    moves: Mapping[str, float]
    old: Case
    case: Case

    @classmethod
    def of(cls, options: OfCase, old: Case, moves: Mapping[str, float]) -> NewTable:
        """Return the table of a command with moves by place [m].

        Raises:
            KincheckError: the command has a case, and no table, or the car does not come together.
        """
        if isinstance(options.case, Case):
            raise KincheckError(f"{old.name}: is a case without a file; give the table's path")
        supplied = options.supplied
        table = read_hardpoints(Path(options.case), supplied)
        size = unit_of(table, supplied.units).size
        if assembles(moves):
            moves, angles = _assembled(old, moves)
            table = replace(table, **angles)
        points = list[tuple[float, float, float]]()
        for name, each in table.points.items():
            x, y, z = (
                float(f"{value + move / size:.{DIGITS}g}")
                if abs(move := moves.get(f"{name} {axis}", 0.0)) > NO_MOVE
                else value
                for axis, value in zip("xyz", each.position, strict=True)
            )
            points.append((x, y, z))
        rows = zip(table.points.items(), points, strict=True)
        moved = {name: Hardpoint(row, each.where) for (name, each), row in rows}
        new = case_of_hardpoints(replace(table, points=moved), supplied)
        sweep = replace(new.sweep, values=old.sweep.values)
        new = replace(new, name=f"{old.name} new", sweep=sweep, reference={})
        return cls(table, supplied, points, moves, old, new)

    def check(self, registry: Registry) -> str | None:
        """Return the engine that confirms the native one; None without any.

        Raises:
            KincheckError: the engine contradicts.
        """
        from ...harness.run import run

        native, new = registry.engine("native"), self.case
        for name in CHECKS:
            if name not in registry.engines:
                continue
            engine = registry.engine(name)
            if engine.version() is None or engine.unsupported(new) is not None:
                continue
            (record,) = run([new], [engine], tol=TOL, baseline=native).records
            if record.outcome is not Outcome.PASS:
                raise KincheckError(
                    f"{new.name}: {name} does not confirm the new table ({record.outcome}:"
                    f" {record.message}); nothing is written. Run kincheck run on both."
                )
            return name
        return None

    def compare(self, registry: Registry) -> Sequence[Section]:
        """Return old against new, as `kincheck compare` prints it."""
        from ...harness.run import run

        cases = [self.old, self.case]
        results = run(cases, [registry.engine("native")], tol=TOL)
        return comparison(designs_of(results, cases), []).sections

    def write(self, out: Path) -> None:
        """Write the table to a new file.

        Raises:
            KincheckError: it cannot be written.
        """
        write_table(self.table, self.supplied, self.points, out, f"--out {out}")
