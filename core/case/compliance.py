"""The rig of a compliance study as a case file has it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Load(StrEnum):
    """A load of a wheel; see `studies.compliance.rig`."""

    LONGITUDINAL = "longitudinal"
    LATERAL = "lateral"
    BRAKING = "braking"
    ALIGNING = "aligning"


@dataclass(frozen=True)
class Resting:
    """The table [equilibrium].

    Attributes:
        held: drivers with values; all others are free.
    """

    held: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rig:
    """The table [compliance]; None follows from the other tables.

    Attributes:
        wheel: the wheel's carrier.
        contact: point of the wheel's contact with the road.
        held: drivers with values; all others are free.
        loads: loads whose slopes are wanted.
        tire_stiffness: vertical [N/m], for the ride rate.
    """

    wheel: str | None = None
    contact: str | None = None
    held: tuple[str, ...] | None = None
    loads: tuple[Load, ...] = tuple(Load)
    tire_stiffness: float | None = None
