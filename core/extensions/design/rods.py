"""Rods of other lengths, and shims at the ends of rods.

A rod keeps its length here, instead of following its points. Then the car comes together elsewhere
at design: the wheel keeps its height, and turns. The curves are those of the assembled car.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...case.case import Case, Hardpoint
from ...errors import KincheckError
from ...joints import Distance, Translational
from ..hardpoints.suspension import Side

LENGTH, SHIM = " length", " shim"
"""What follows the name of a rod, or of a row, in a place."""
_SIDE = re.compile(rf"({'|'.join(Side)})_")


def rods_of(case: Case) -> dict[str, str]:
    """Return the name of each rod by its joint; those of both sides of an axle have one name."""
    rods = [each.name for each in case.mechanism.joints if isinstance(each, Distance)]
    return {joint: _SIDE.sub("", joint, count=1) for joint in rods}


def ends_of(case: Case) -> dict[str, set[str]]:
    """Return by row of the table the joints of the rods there, if it is on no other joint."""
    rods, found = rods_of(case), dict[str, set[str]]()
    sliders = (each for each in case.mechanism.joints if isinstance(each, Translational))
    anywhere = {f"joints.{each.name}.point" for each in sliders}  # a rack slides along any line
    for row in case.hardpoints:
        places = (each for each in row.moves.keys() - anywhere if each.startswith("joints."))
        joints = {each.split(".")[1] for each in places}
        if joints and joints <= rods.keys():
            found[row.name] = joints
    return found


def assembles(places: Sequence[str] | Mapping[str, object]) -> bool:
    """Return whether a place is a rod's length or a shim."""
    return any(each.endswith(LENGTH) or f"{SHIM} " in each for each in places)


def with_rods(case: Case, places: Sequence[str]) -> tuple[Case, list[str]]:
    """Return the case in which rods with moves keep their lengths, and its names of the places.

    Raises:
        KincheckError: a point moves in the table at the end of a rod that keeps its length.
    """
    if not assembles(places):
        return case, [*places]
    rods, ends = rods_of(case), ends_of(case)
    longer = {each.removesuffix(LENGTH) for each in places if each.endswith(LENGTH)}
    kept = {joint for joint, name in rods.items() if name in longer}
    for each in places:
        kept |= ends[each.partition(SHIM)[0]] if SHIM in each else set[str]()
    for each in places:
        if held := kept & ends.get(each.rpartition(" ")[0], set()):
            name = rods[min(held)]
            raise KincheckError(
                f"move {each}: {name} keeps its length, so a new place of its end is a shim; say"
                f" {each.replace(' ', f':{SHIM} ')}, or leave out the other moves of {name}"
            )
    joints = [
        replace(each, length=each.rod_length)
        if isinstance(each, Distance) and each.name in kept
        else each
        for each in case.mechanism.joints
    ]
    along = np.array([[1.0, 0.0, 0.0]])
    lengths = [
        Hardpoint(
            *(f"{name}{LENGTH}", (), (0.0, 0.0, 0.0), ()),
            {f"joints.{joint}.length": along for joint, own in rods.items() if own == name},
        )
        for name in sorted(longer)
    ]
    mechanism = replace(case.mechanism, joints=joints)
    case = replace(case, mechanism=mechanism, hardpoints=(*case.hardpoints, *lengths))
    names = [f"{each} x" if each.endswith(LENGTH) else each.replace(SHIM, "") for each in places]
    return case, names
