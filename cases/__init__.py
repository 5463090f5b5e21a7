"""Built-in cases: NAME.toml each, with samples (NAME.csv) or a closed form (NAME.py) beside it as
the truth.

Variants of a mechanism share a truth: NAME_VARIANT.toml names the samples in its [reference], or
takes the closed form of NAME.py, there the function VARIANT where it has one, else `motion`. A
function `forces` beside `motion`, or VARIANT_forces, gives the outputs that are forces.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.case.case import Case, Origin, Output, Series, Truth
from ..core.case.io.case_file import load_case
from ..core.errors import CaseError, remedy
from .jet import Jet, Lanes, Motion

FOLDER = Path(__file__).resolve().parent  # in an editable installation, files are links


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
    case, motion = load_case(FOLDER / f"{name}.toml"), closed_form(name)
    if case.reference or motion is None:
        return case
    if not case.forces:
        return with_closed_form(case, motion)
    of_variant = "" if motion.__name__ == "motion" else f"{motion.__name__}_"
    forces = getattr(sys.modules[motion.__module__], f"{of_variant}forces")
    return with_closed_form(case, motion, forces)


def closed_form(name: str) -> Callable[..., Motion] | None:
    """Takes the drivers' changes from the design, as jets in the order of the case file, to the
    points; None if there is none.
    """
    stems = [file.stem for file in FOLDER.glob("*.py") if f"{name}_".startswith(f"{file.stem}_")]
    if not stems:
        return None
    stem = max(stems, key=len)
    module = importlib.import_module(f".{stem}", __name__)
    return getattr(module, name[len(stem) + 1 :], module.motion)


def with_closed_form(
    case: Case,
    motion: Callable[..., Motion],
    forces: Callable[..., Mapping[str, Lanes]] | None = None,
) -> Case:
    """The case with a closed form as the reference of its outputs that are coordinates or forces.

    Args:
        forces: takes the mechanism and the drivers' changes to outputs by name.
    """
    drivers = [driver.name for driver in case.mechanism.drivers]
    values, rates, seconds = case.sweep.path.drive(drivers, case.sweep.path.times)
    changes = [*map(Jet, values, rates, seconds)]
    moving = motion(*changes)
    design = motion(*(Jet(zero, zero, zero) for zero in np.zeros((len(drivers), 1))))
    coordinates = [output for output in case.outputs if isinstance(output, Output)]
    reference = {output.name: _series(output, moving, design) for output in coordinates}
    if forces is not None:
        known = forces(case.mechanism, *changes)
        reference |= {each.name: Series(known[each.name]) for each in case.outputs if each.forces}
    origin = Origin(f"{_title(motion)}; {case.source}")
    return replace(case, truth=Truth.CLOSED_FORM, reference=reference, origin=origin)


def _title(motion: Callable[..., Motion]) -> str:
    """What the module of a closed form says of it, in one line, and where it is."""
    first, *_ = (sys.modules[motion.__module__].__doc__ or "").strip().splitlines()
    return f"{' '.join(first.split()).rstrip('.')} ({motion.__module__})"


def _series(output: Output, moving: Motion, design: Motion) -> Series:
    along = _along(output, moving)
    origin = float(_along(output, design).x[0]) if output.relative else 0.0
    return Series(along.x - origin, along.v, along.a)


def _along(output: Output, motion: Motion) -> Jet:
    x, y, z = (
        component * jet
        for component, jet in zip(output.direction, motion[output.point], strict=True)
    )
    return x + y + z
