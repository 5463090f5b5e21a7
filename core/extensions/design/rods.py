"""Rods of other lengths, and shims at the ends of rods and arms.

A rod keeps its length here, instead of following its points. Then the car comes together elsewhere
at design: the wheel keeps its height, and turns. The curves are those of the assembled car. An arm
with nothing but a ball joint holds the knuckle as two rods along its sides do.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...algebra import vec
from ...case.case import Case, Hardpoint
from ...errors import KincheckError
from ...joints import Distance, Revolute, Spherical, Translational
from ...mechanism.mechanism import GROUND
from ..hardpoints.suspension import Side

LENGTH, SHIM = ": length", ": shim"
"""What follows the name of a rod, or of a row, in a place."""
_SIDE = re.compile(rf"({'|'.join(Side)})_")


def rods_of(case: Case) -> dict[str, str]:
    """Return the name of each rod by its joint; those of both sides of an axle have one name."""
    rods = [each.name for each in case.mechanism.joints if isinstance(each, Distance)]
    return {joint: _SIDE.sub("", joint, count=1) for joint in rods}


def with_sides(case: Case) -> Case:
    """Return the case with two rods in place of each arm with nothing but a ball joint."""
    mechanism = case.mechanism
    if mechanism.bushings or mechanism.forces:
        return case
    for pivot in mechanism.joints:
        if not isinstance(pivot, Revolute) or pivot.i != GROUND:
            continue
        arm, rest = pivot.j, [each for each in mechanism.joints if each is not pivot]
        held = [each for each in rest if arm in each.bodies]
        laden = len(held) != 1 or any(each.body == arm for each in mechanism.points)
        if laden or not isinstance(ball := held[0], Spherical) or ball.i != arm:
            continue
        feet = vec(pivot.point), vec(pivot.point) + vec(pivot.axis)
        rods = [
            Distance(f"{arm}_side_{k}", GROUND, ball.j, ((foot.x, foot.y, foot.z), ball.point))
            for k, foot in enumerate(feet, 1)
        ]
        joints = [*(each for each in rest if each is not ball), *rods]
        bodies = [each for each in mechanism.bodies if each.name != arm]
        mechanism = replace(mechanism, bodies=bodies, joints=joints)
        hardpoints = list[Hardpoint]()
        for row in case.hardpoints:
            moves = dict(row.moves)
            foot, along, outer = (
                moves.pop(place, np.zeros((3, 3)))
                for place in (
                    *(f"joints.{pivot.name}.{part}" for part in ("point", "axis")),
                    f"joints.{ball.name}.point",
                )
            )
            for rod, by_row in zip(rods, (foot, foot + along), strict=True):
                moves |= {
                    f"joints.{rod.name}.points.{end}": each
                    for end, each in enumerate((by_row, outer))
                    if each.any()
                }
            hardpoints.append(replace(row, moves=moves))
        case = replace(case, mechanism=mechanism, hardpoints=tuple(hardpoints))
    return case


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
    case = with_sides(case)
    rods, ends = rods_of(case), ends_of(case)
    longer = {each.removesuffix(LENGTH) for each in places if each.endswith(LENGTH)}
    kept = {joint for joint, name in rods.items() if name in longer}
    for each in places:
        kept |= ends[each.partition(SHIM)[0]] if SHIM in each else set[str]()
    for each in places:
        row, _, axis = each.rpartition(" ")
        if held := kept & ends.get(row, set()):
            name = rods[min(held)]
            raise KincheckError(
                f"move {each}: {name} keeps its length by another move, so its end moves by a shim"
                f" alone; say {row}{SHIM} {axis}, or leave one out"
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
