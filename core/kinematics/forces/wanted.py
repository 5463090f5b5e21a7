"""The forces that are wanted of a mechanism, by name."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ...errors import SolveError, unknown
from ...mechanism.mechanism import Mechanism


@dataclass(frozen=True)
class WantedForces:
    """Names of joints whose reactions are wanted, of drivers with their efforts, and of force
    elements.
    """

    joints: tuple[str, ...]
    drivers: tuple[str, ...]
    elements: tuple[str, ...]


def wanted_forces(mechanism: Mechanism, names: Collection[str] | None) -> WantedForces:
    """Return what names of joints, drivers and force elements mean; all of them unless given.

    Raises:
        SolveError: a name is unknown.
    """
    if isinstance(names, str):
        raise SolveError(f"forces is {names!r}, expected a list of names, or True for all")
    every = (mechanism.joints, mechanism.drivers, mechanism.forces)
    known = [each.name for members in every for each in members]
    for name in names or ():
        if name not in known:
            what = unknown("joint, driver or force element", name, known)
            raise SolveError(f"forces of mechanism {mechanism.name!r}: {what}")
    given = known if names is None else names
    joints, drivers, elements = (
        tuple(each.name for each in members if each.name in given) for members in every
    )
    return WantedForces(joints, drivers, elements)
