"""The table [compliance] of case files: keys of `Rig`."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ...mechanism.body import STIFFNESS
from ...mechanism.mechanism import Mechanism
from ..compliance import Load, Resting, Rig
from ..units import FileUnits
from .document import Section
from .schema import Text

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


def read_resting(section: Section, mechanism: Mechanism) -> Resting:
    """Return the table [equilibrium].

    Raises:
        CaseError: unknown keys or names.
    """
    keys, known = section.typed(RestingKeys), mechanism.drivers
    for name in keys.held:
        if name not in (names := [driver.name for driver in known]):
            raise section.at("held").unknown(name, names, "a driver")
    return Resting(keys.held)


def read_rig(section: Section, mechanism: Mechanism, units: FileUnits) -> Rig:
    """Return the rig of a file, in SI.

    Raises:
        CaseError: unknown keys or names.
    """
    keys = section.typed(RigKeys)
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
                raise section.at(key).unknown(name, names, what[key])
    stiffness = keys.tire_stiffness and units.power(STIFFNESS, keys.tire_stiffness)
    return Rig(keys.wheel, keys.contact, keys.held, keys.loads, stiffness)
