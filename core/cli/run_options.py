"""Options of kincheck run, and defaults shared with other commands."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..case.io.reader_options import CurveOptions
from ..errors import KincheckError
from .parser import add_options, values_of

if TYPE_CHECKING:
    from ..case.case import Case

# Largest accepted constraint residual [m or -]: a thousand times the round-off of coordinates of
# one metre, and a thousandth of the outputs' 1e-9 m. A mechanism may amplify it a hundredfold
# unnoticed.
TOL = 1e-12

MODES = ("projection", "simulate")
MODE = "mode of the engines; default: projection, or simulate if an engine has only this"

HISTORY = "KINCHECK_HISTORY"
"""Environment variable: the history file if --history is not given."""


def add_curve_options(command: argparse.ArgumentParser) -> None:
    """Add the options for a measured curve, see --reference."""
    add_options(command, CurveOptions)


def curve_options(options: argparse.Namespace) -> CurveOptions:
    """Return the options of a measured curve."""
    return values_of(CurveOptions, options)


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
            f"{curves[0]}: found {len(cases)} cases and {len(files)} references, expected a"
            " measured curve and its case alone. Run them one by one."
        )
    if not curves:
        return judged_by(cases, proved, unused), []
    case, notes = with_curve(cases[0], curves[0], curve)
    return [case], notes
