"""The table [compliance] of case files: the rig of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ...case.case import Case
from ...case.io.document import Section
from ...case.io.schema import Text
from ...case.io.sections import CaseSection
from ...case.io.toml_text import toml_table
from ...mechanism.body import STIFFNESS

KEY = "compliance"


class Load(StrEnum):
    """A load of a wheel; see `rig`."""

    LONGITUDINAL = "longitudinal"
    LATERAL = "lateral"
    BRAKING = "braking"
    ALIGNING = "aligning"


Names = Annotated[tuple[str, ...] | None, Meta(description="a list of names")]
Loads = Annotated[tuple[Load, ...], Meta(description=f"a list of {', '.join(Load)}")]
Stiffness = Annotated[
    Annotated[float, Meta(gt=0.0)] | None, Meta(description="a number greater than zero")
]


class Rig(msgspec.Struct, forbid_unknown_fields=True, kw_only=True, frozen=True):
    """[compliance]; None follows from the other tables.

    Attributes:
        wheel: the wheel's carrier.
        contact: point of the wheel's contact with the road.
        held: drivers with values; all others are free.
        loads: loads whose slopes are wanted.
        tire_stiffness: vertical [N/m], in a file in its units, for the ride rate.
    """

    wheel: Text | None = None
    contact: Text | None = None
    held: Names = None
    loads: Loads = tuple(Load)
    tire_stiffness: Stiffness = None


def rig_of(case: Case) -> Rig:
    """Return the rig of a case, by default without any demand."""
    return case.tables.get(KEY, Rig())


class ComplianceSection(CaseSection):
    """[compliance]."""

    key = KEY
    keys = Rig

    def read(self, section: Section, case: Case) -> tuple[Case, Rig]:
        """Return the case with its rig, in SI."""
        rig, mechanism = section.typed(Rig), case.mechanism
        known: dict[str, list[str]] = {
            "wheel": [body.name for body in mechanism.moving],
            "contact": [point.name for point in mechanism.points],
            "held": [driver.name for driver in mechanism.drivers],
        }
        what = {"wheel": "a body that moves", "contact": "a point", "held": "a driver"}
        for key, names in known.items():
            given: Any = getattr(rig, key)
            for name in [given] if isinstance(given, str) else given or ():
                section.at(key).require(name, names, what[key])
        stiffness = rig.tire_stiffness and section.units.power(STIFFNESS, rig.tire_stiffness)
        rig = msgspec.structs.replace(rig, tire_stiffness=stiffness)
        return replace(case, tables={**case.tables, KEY: rig}), rig

    def lines(self, case: Case) -> Sequence[str]:
        """Return the lines of the table."""
        if KEY not in case.tables:
            return []
        given = msgspec.structs.asdict(rig_of(case))
        return toml_table({key: x for key, x in given.items() if x is not None}, KEY)


SECTION = ComplianceSection()
