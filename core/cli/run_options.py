"""Options of kincheck run, and defaults shared with other commands."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import KincheckError
from . import execution_options, import_options, recorded_options
from .option_types import add_json, add_several, positive
from .verbosity import add_verbosity

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.io.reference_curve import CurveOptions

# Largest accepted constraint residual [m or -]: a thousand times the round-off of coordinates of
# one metre, and a thousandth of the outputs' 1e-9 m. A mechanism may amplify it a hundredfold
# unnoticed.
TOL = 1e-12

MODES = ("projection", "simulate")

HISTORY = "KINCHECK_HISTORY"
"""Environment variable: the history file if --history is not given."""


def add_options(run: argparse.ArgumentParser) -> None:
    """Add the options to the parser of the command."""
    run.add_argument(
        "case",
        nargs="*",
        metavar="CASE",
        help=(
            "built-in names, patterns such as 'mcpherson*', or case files; default: all built-in"
            " cases"
        ),
    )
    run.add_argument(
        "--joints",
        action="store_true",
        help="run a small closed loop around every joint type, and the named cases",
    )
    must = (
        "only these, by name or MODULE:CLASS; all must be installed (else status 2); default: all"
        " engines"
    )
    add_several(run, "--engine", must)
    run.add_argument(
        "--mode",
        choices=MODES,
        help="mode of the engines; default: projection, or simulate if an engine has only this",
    )
    run.add_argument(
        "--tol",
        type=positive,
        default=TOL,
        metavar="X",
        help=f"largest accepted constraint residual [m or -]; default {TOL:g}",
    )
    run.add_argument(
        "--out", type=Path, metavar="DIR", help="write results.json and report.html there"
    )
    run.add_argument(
        "--bench",
        type=Path,
        metavar="FILE",
        help="show the work-precision data of this bench.json in the report",
    )
    add_json(run)
    add_curve_files(run, "the curves of all engines and references")
    run.add_argument(
        "--long",
        action="store_true",
        help=(
            "write curves of hardpoint tables as those of other files, a row per output and sample"
            " in SI units; default: a row per sample and a column per output in the table's units"
        ),
    )
    run.add_argument("--junit", type=Path, metavar="FILE", help="write the results as JUnit XML")
    run.add_argument(
        "--markdown",
        type=Path,
        metavar="FILE",
        help="write the table of cases and engines as Markdown",
    )
    add_several(
        run,
        "--reference",
        "judge cases by these files instead of by their own references: proved references of"
        " kincheck reference (.json), or one measured curve (.csv, .xlsx, ...)",
        metavar="FILE",
        type=Path,
    )
    run.add_argument(
        "--explain",
        action="store_true",
        help="print what the native engine computes for each case, and what it leaves out",
    )
    add_several(
        run, "--require", "engines that must be installed and support every case (else status 2)"
    )
    add_verbosity(
        run,
        quiet="print only messages and the counts of outcomes: no progress, no table",
        verbose="print the errors of every output and their tolerances",
    )
    import_options.add_options(run)
    add_curve_options(run)
    recorded_options.add_options(run)
    execution_options.add_options(run, positive)
    run.add_argument(
        "--static",
        action="store_true",
        help="efforts and reactions at rest, at every sample; [sweep] rate = 0 of all cases",
    )
    run.add_argument(
        "--reactions",
        action="store_true",
        help=(
            "every determined reaction of joints, effort of drivers and force of elements as"
            " outputs, first in table and page; what is not determined is a note"
        ),
    )
    run.add_argument(
        "--history",
        type=Path,
        metavar="FILE",
        default=os.environ.get(HISTORY) or None,
        help=(
            "store the run in this file, each record at once; default: the file named by the"
            f" environment variable {HISTORY}, if it is set"
        ),
    )
    run.add_argument(
        "--resume",
        action="store_true",
        help=(
            "resume the latest unfinished run in the history with identical cases, engines,"
            " tolerance, limits, versions and commit"
        ),
    )


def add_curve_files(command: argparse.ArgumentParser, what: str) -> None:
    """Add the options for tables of curves."""
    for kind, form in (("csv", "CSV"), ("parquet", "Parquet"), ("xlsx", "a workbook")):
        command.add_argument(f"--{kind}", type=Path, metavar="FILE", help=f"write {what} as {form}")


def add_curve_options(run: argparse.ArgumentParser) -> None:
    """Add the options for a measured curve, see --reference."""
    curve = run.add_argument_group(
        "measured curves", "Facts that the file of --reference does not state; for one case."
    )
    curve.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="COLUMN=OUTPUT",
        help=(
            'output of a column, if its name does not state it: "Toe Angle=toe [deg]"; with the'
            " opposite sign: COLUMN=-OUTPUT"
        ),
    )
    curve.add_argument(
        "--signs",
        metavar="CONVENTION",
        help="iso8855 or sae_j670, if the file has no comment '# signs: CONVENTION'",
    )
    curve.add_argument(
        "--accuracy",
        action="append",
        default=[],
        metavar="OUTPUT=NUMBER UNIT",
        help=(
            'uncertainty of the measurement, the tolerance of the output: "toe=0.02 deg"; without'
            " a unit in that of the column"
        ),
    )
    curve.add_argument(
        "--citation",
        metavar="TEXT",
        help="source of the curve; without it, agreement is not called validated",
    )
    curve.add_argument(
        "--reference-sheet", metavar="NAME", help="sheet of a workbook with several tables"
    )
    curve.add_argument(
        "--at-reference",
        action="store_true",
        help="solve at the samples of the curve, instead of interpolating it",
    )


def curve_options(options: argparse.Namespace) -> CurveOptions:
    """Return the options of a measured curve."""
    from ..case.io.reference_curve import CurveOptions

    return CurveOptions(
        (*options.map,),
        options.signs,
        (*options.accuracy,),
        options.citation,
        options.reference_sheet,
        options.at_reference,
    )


def judged(
    cases: Sequence[Case], files: Sequence[Path], curve: CurveOptions, unused: list[str] | None
) -> tuple[list[Case], list[str]]:
    """Return the cases with the references in these files, and notes on how a curve was read.

    Raises:
        KincheckError: a file cannot be used, or a curve does not belong to one case.
    """
    from ..case.io.reference import PROVED
    from ..case.io.reference_curve import with_curve
    from ..case.io.reference_file import judged_by

    curves = [file for file in files if file.suffix.lower() != PROVED]
    proved = [file for file in files if file not in curves]
    if len(curves) > 1 or (curves and (proved or len(cases) != 1)):
        raise KincheckError(
            f"{curves[0]}: found {len(files)} references and {len(cases)} cases, expected a"
            " measured curve and its case alone; run them one by one"
        )
    if not curves:
        return judged_by(cases, proved, unused), []
    case, notes = with_curve(cases[0], curves[0], curve)
    return [case], notes
