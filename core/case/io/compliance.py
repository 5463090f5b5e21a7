"""The table [compliance] of case files: keys of `Rig`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ...mechanism.dimension import STIFFNESS
from ...mechanism.mechanism import Mechanism
from ..compliance import Load, Resting, Rig
from ..units import RADIAN, Unit
from .document import unknown_name
from .in_si import load_in_si
from .schema import Text
from .typed_tables import typed

Names = Annotated[tuple[str, ...] | None, Meta(description="a list of names")]
Loads = Annotated[tuple[Load, ...], Meta(description=f"a list of {', '.join(Load)}")]
Stiffness = Annotated[
    Annotated[float, Meta(gt=0.0)] | None, Meta(description="a number greater than zero")
]


class RigKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[compliance]."""

    wheel: Text | None = None
    contact: Text | None = None
    held: Names = None
    loads: Loads = tuple(Load)
    tire_stiffness: Stiffness = None


class RestingKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[equilibrium]."""

    held: Annotated[tuple[str, ...], Meta(description="a list of names")] = ()


def read_resting(file: Path, value: object, mechanism: Mechanism) -> Resting:
    """Return the table [equilibrium].

    Raises:
        CaseError: unknown keys or names.
    """
    keys, known = typed(file, "equilibrium", value, RestingKeys), mechanism.drivers
    for name in keys.held:
        if name not in (names := [driver.name for driver in known]):
            raise unknown_name(file, "equilibrium.held", name, names, "a driver")
    return Resting(keys.held)


def read_rig(file: Path, value: object, mechanism: Mechanism, length: Unit) -> Rig:
    """Return the rig of a file, in SI.

    Raises:
        CaseError: unknown keys or names.
    """
    keys = typed(file, "compliance", value, RigKeys)
    known: dict[str, list[str]] = {
        "wheel": [body.name for body in mechanism.moving],
        "contact": [point.name for point in mechanism.points],
        "held": [driver.name for driver in mechanism.drivers],
    }
    what = {"wheel": "a body that moves", "contact": "a point", "held": "a driver"}
    for key, names in known.items():
        given: Any = getattr(keys, key)
        for name in [given] if isinstance(given, str) else given or ():
            if name not in names:
                raise unknown_name(file, f"compliance.{key}", name, names, what[key])
    stiffness = load_in_si(STIFFNESS, keys.tire_stiffness, length, RADIAN)
    return Rig(keys.wheel, keys.contact, keys.held, keys.loads, stiffness)
