"""Built-in cases: NAME.toml each, with samples (NAME.csv) or a closed form (NAME.py) beside it as the truth."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.errors import CaseError
from ..core.harness.case import Case, Output, Series, Truth
from ..core.harness.reading.casefile import load_case
from ..core.harness.reading.document import remedy
from .jet import Jet, Motion, steady

FOLDER = Path(__file__).parent


def names() -> tuple[str, ...]:
    """The names of the built-in cases, sorted."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.toml")))


def load(name: str) -> Case:
    """The built-in case of that name, with its truth.

    Raises:
        CaseError: there is no such case.
    """
    if name not in names():
        raise CaseError(f"{name!r} is not a built-in case; {remedy(name, names())}")
    case = load_case(FOLDER / f"{name}.toml")
    return with_closed_form(case, name) if (FOLDER / f"{name}.py").exists() else case


def with_closed_form(case: Case, name: str) -> Case:
    """The case with the closed form of cases/NAME.py as the reference: `motion`, from the driver's change to the points."""
    closed_form = importlib.import_module(f".{name}", __name__)
    design: Motion = closed_form.motion(steady(np.zeros(1), 0.0))
    moving: Motion = closed_form.motion(steady(case.sweep.change, case.sweep.rate))
    reference = {output.name: _series(output, moving, design) for output in case.outputs}
    return replace(case, truth=Truth.CLOSED_FORM, reference=reference)


def _series(output: Output, moving: Motion, design: Motion) -> Series:
    along = _along(output, moving)
    origin = float(_along(output, design).x[0]) if output.relative else 0.0
    return Series(along.x - origin, along.v, along.a)


def _along(output: Output, motion: Motion) -> Jet:
    x, y, z = (component * jet for component, jet in zip(output.direction, motion[output.point], strict=True))
    return x + y + z
