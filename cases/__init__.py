"""Built-in cases: a file NAME.toml each, with its truth beside it.

The truth is a table of samples (NAME.csv) or a closed form (NAME.py). Variants of a mechanism share
a truth: NAME_VARIANT.toml names the samples in its [reference], or uses the closed form of NAME.py.
Its motion is then the function VARIANT of NAME.py, or else the function `motion`. The function
`forces` beside `motion`, or VARIANT_forces, returns the force outputs.
"""

from __future__ import annotations

import importlib
import sys
import tomllib
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
    """Return the names of the built-in cases, sorted."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.toml")))


def load(name: str) -> Case:
    """Return a built-in case by its name, with its truth.

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


def summary(name: str) -> tuple[Truth, str]:
    """Return the kind of reference and the source of a built-in case, as in `load`, without the
    motion.
    """
    with (FOLDER / f"{name}.toml").open("rb") as file:
        found = tomllib.load(file)
    if "reference" in found:
        return Truth(found["truth"]), found["source"]
    return (Truth.CLOSED_FORM if _module(name) else Truth.CONSENSUS_ONLY), found["source"]


def closed_form(name: str) -> Callable[..., Motion] | None:
    """Return the closed form of a case; None if there is none.

    It takes the drivers' changes from the design, as jets in the order of the case file, and
    returns the points.
    """
    stem = _module(name)
    if not stem:
        return None
    module = importlib.import_module(f".{stem}", __name__)
    return getattr(module, name[len(stem) + 1 :], module.motion)


def _module(name: str) -> str:
    """Return the name of the module with a case's closed form; empty if there is none."""
    stems = (file.stem for file in FOLDER.glob("*.py") if f"{name}_".startswith(f"{file.stem}_"))
    return max(stems, key=len, default="")


def with_closed_form(
    case: Case,
    motion: Callable[..., Motion],
    forces: Callable[..., Mapping[str, Lanes]] | None = None,
) -> Case:
    """Return the case with a closed form as the reference of its coordinate and force outputs.

    Args:
        forces: function from the mechanism and the drivers' changes to force outputs by name.
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
    """Return the first line of a closed form's module docstring, and the module's name."""
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
