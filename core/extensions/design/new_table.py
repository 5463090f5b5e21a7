"""New tables of hardpoints: their points, their case, and its check by another engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...case.case import Case
from ...case.units import Unit
from ...cli.registry import Registry
from ...cli.shared_options import TOL, OfCase
from ...errors import KincheckError
from ...harness.record import Outcome, Results
from ..hardpoints.options import WheelOptions
from ..hardpoints.read import case_of_hardpoints
from ..hardpoints.reader import read_hardpoints
from ..hardpoints.saving import write_table
from ..hardpoints.table import Hardpoint, HardpointTable, unit_of

CHECKS = ("mujoco", "pinocchio", "exudyn")
"""Engines that solve the answer again, the first that is installed."""
DIGITS = 12
"""Digits of written coordinates: a thousandth of the accuracy of the bands and more."""


def require_new(out: Path | None) -> None:
    """Refuse a file that exists, or is no CSV.

    Raises:
        KincheckError: it is so.
    """
    if out is not None and (out.exists() or out.suffix.lower() != ".csv"):
        what = "the file exists and stays" if out.exists() else "is written as CSV"
        raise KincheckError(f"--out {out}: {what}; give a new name that ends in .csv")


def table_of(options: OfCase, registry: Registry) -> tuple[Case, Path]:
    """Return the case of a table, and its file.

    Raises:
        KincheckError: the case is no table.
    """
    case = registry.case_of(options)
    if isinstance(options.case, Case) or not case.hardpoints:
        raise KincheckError(
            f"{case.name}: is no table of hardpoints; give a table, such as car.csv"
        )
    return case, Path(options.case)


def write_new(
    out: Path,
    case: Case,
    file: Path,
    supplied: WheelOptions,
    moves: Mapping[str, float],
    registry: Registry,
) -> str | None:
    """Write a table with moves by place [m], and return the engine that solved it again; None
    without one.

    Raises:
        KincheckError: an engine contradicts the native one, or the file cannot be written.
    """
    table = read_hardpoints(file, supplied)
    points = moved_points(table, moves, unit_of(table, supplied.units))
    checked, _ = check(case, case_of_points(table, supplied, points, case, file), registry)
    write_table(table, supplied, points, out, f"--out {out}")
    return checked


def moved_points(
    table: HardpointTable, moves: Mapping[str, float], length: Unit
) -> list[tuple[float, float, float]]:
    """Return the points of the table with the moves, in its own units and axes."""
    found = list[tuple[float, float, float]]()
    for name, old in table.points.items():
        x, y, z = (
            float(f"{value + moves[place] / length.size:.{DIGITS}g}")
            if (place := f"{name} {axis}") in moves
            else value
            for axis, value in zip("xyz", old.position, strict=True)
        )
        found.append((x, y, z))
    return found


def case_of_points(
    table: HardpointTable,
    supplied: WheelOptions,
    points: Sequence[tuple[float, float, float]],
    case: Case,
    file: Path,
) -> Case:
    """Return the case of the new table, read as the old one, at the same samples."""
    rows = {
        name: Hardpoint(row, table.points[name].where)
        for name, row in zip(table.points, points, strict=True)
    }
    new = case_of_hardpoints(replace(table, points=rows), supplied)
    return replace(
        new,
        name=f"{file.stem} new",
        sweep=replace(new.sweep, values=case.sweep.values),
        reference={},
    )


def check(old: Case, new: Case, registry: Registry) -> tuple[str | None, Results]:
    """Return the engine that solved the new design again, and the results of the native one.

    Raises:
        KincheckError: an engine contradicts the native one.
    """
    from ...harness import run as running

    native = registry.engine("native")
    results = running.run([old, new], [native], tol=TOL)
    for name in CHECKS:
        if name not in registry.engines:
            continue
        engine = registry.engine(name)
        if engine.version() is None or engine.unsupported(new) is not None:
            continue
        (record,) = running.run([new], [engine], tol=TOL, baseline=native).records
        if record.outcome is not Outcome.PASS:
            raise KincheckError(
                f"{new.name}: {name} does not confirm the new table ({record.outcome}:"
                f" {record.message}); nothing is written. Run kincheck run on both."
            )
        return name, results
    return None, results
