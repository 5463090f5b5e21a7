"""Built-in cases: a file NAME.toml each, with its truth beside it.

The truth is a table of samples (NAME.csv) or a closed form (NAME.py). Variants of a mechanism share
a truth: NAME_VARIANT.toml names the samples in its [reference], or uses the closed form of NAME.py.
Its motion is then the function VARIANT of NAME.py, or else the function `motion`. The function
`forces` beside `motion`, or VARIANT_forces, returns the force outputs.

An extension may have a folder `cases`: with cases that it reads, and with its own tables of cases
here, in files of their names.
"""

from __future__ import annotations

import importlib
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from ..core.case.case import Case, Origin, Output, Series, Truth
from ..core.case.io.case_file import load_case
from ..core.case.io.document import Section, parse
from ..core.case.io.sections import sections
from ..core.case.units import ANGLES, LENGTHS, FileUnits
from ..core.doors import extensions
from ..core.errors import CaseError, remedy
from .jet import Jet, Lanes, Motion

FOLDER = Path(__file__).resolve().parent  # in an editable installation, files are links


@cache
def _files() -> Mapping[str, Sequence[Path]]:
    """Return the files of each case: the case, and tables of extensions."""
    modules = (sys.modules[each.package] for each in extensions().values())
    further = (Path(str(module.__file__)).resolve().parent / "cases" for module in modules)
    found: dict[str, list[Path]] = {}
    for folder in (FOLDER, *further):
        for path in folder.glob("*.toml"):
            found.setdefault(path.stem, []).append(path)
    return found


def names() -> tuple[str, ...]:
    """Return the names of the built-in cases, sorted."""
    return tuple(sorted(_files()))


def file(name: str) -> Path:
    """Return the file of a built-in case, without the tables that extensions add."""
    return _files()[name][0]


def load(name: str) -> Case:
    """Return a built-in case by its name, with its truth.

    Raises:
        CaseError: there is no such case.
    """
    if name not in names():
        raise CaseError(f"{name!r} is not a built-in case; {remedy(name, names())}")
    path, *further = _files()[name]
    case, motion = load_case(path), closed_form(name)
    for each in further:
        case = _with_tables(case, each)
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
    found = tomllib.loads(file(name).read_text(encoding="utf-8"))
    if "reference" in found:
        return Truth(found["truth"]), found["source"]
    return (Truth.CLOSED_FORM if _module(name) else Truth.CONSENSUS_ONLY), found["source"]


def _with_tables(case: Case, path: Path) -> Case:
    """Return a case with the tables that extensions read of a file."""
    units = FileUnits(LENGTHS[case.length_unit], ANGLES[case.angle_unit])
    root = Section(path, "", parse(path, path.read_text(encoding="utf-8")), units)
    for each in sections():
        if (table := root.at(each.key)).value is not None:
            case, _ = each.read(table, case)
    return case


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
    stems = (path.stem for path in FOLDER.glob("*.py") if f"{name}_".startswith(f"{path.stem}_"))
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
