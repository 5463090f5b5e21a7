"""The wanted forces of a mechanism, by name."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ...errors import SolveError, unknown
from ...mechanism.mechanism import Mechanism


@dataclass(frozen=True)
class WantedForces:
    """Names of the joints with wanted reactions, of the drivers with wanted efforts, and of the
    wanted force elements.

    Attributes:
        slopes: whether their slopes by the varied geometry are wanted.
    """

    joints: tuple[str, ...]
    drivers: tuple[str, ...]
    elements: tuple[str, ...]
    slopes: bool = False


def wanted_forces(mechanism: Mechanism, names: Collection[str] | None) -> WantedForces:
    """Return the wanted forces for names of joints, drivers and force elements; by default all.

    Raises:
        SolveError: a name is unknown.
    """
    if isinstance(names, str):
        raise SolveError(f"forces is {names!r}, expected a list of names, or True for all")
    every = (mechanism.given_joints, mechanism.drivers, mechanism.forces)
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
