"""Loops of a URDF in a YAML file beside it, as example-parallel-robots has them.

closed_loop: [[frame, frame], ...]     links of the URDF that coincide
type: ["6d", "3d", ...]                all, or only the points
name_mot: [joint, ...]                 joints with a motor
joint_name: [joint, ...]               joints of another type than the URDF can say
joint_type: [SPHERICAL, UJOINT_XY, FIXED, ...]
"""

from __future__ import annotations

import re
from pathlib import Path

import msgspec

from ....algebra import X
from ...io.document import fault, parse_yaml, shown, unknown_name
from .robot import Connection, Described, Loop, Move, Robot

_UNIVERSAL = re.compile(r"UJOINT_([XYZ])([XYZ])")
_TYPES = {"SPHERICAL": "spherical", "FIXED": "fixed"}


class PairedFile(msgspec.Struct, frozen=True):
    """The file; its other keys are for control programs."""

    closed_loop: list[tuple[str, str]] = []
    type: list[str] = []
    name_mot: list[str] = []
    joint_name: list[str] = []
    joint_type: list[str] = []


def read_pairs(file: Path, text: str) -> PairedFile:
    """Return the content of a file.

    Raises:
        CaseError: PyYAML is missing, or the text is no such file.
    """
    try:
        found = msgspec.convert(parse_yaml(file, text), PairedFile)
    except msgspec.ValidationError as error:
        raise fault(
            file,
            "",
            f"{error}, expected closed_loop, type, name_mot, joint_name and joint_type of"
            " example-parallel-robots; correct it, or rename a file of another kind",
        ) from None
    for key, values, other, others in (
        ("type", found.type, "closed_loop", found.closed_loop),
        ("joint_type", found.joint_type, "joint_name", found.joint_name),
    ):
        if len(values) != len(others):
            raise fault(
                file,
                key,
                f"found {len(values)}, expected {len(others)}, one for each {other}; complete it",
            )
    for kind in found.joint_type:
        if kind not in _TYPES and not _UNIVERSAL.fullmatch(kind):
            known = (*_TYPES, "UJOINT_XY")
            raise unknown_name(
                file, "joint_type", kind, known, f"{', '.join(known)}, or other axes"
            )
    for kind in found.type:
        if kind.lower() not in ("3d", "6d"):
            raise fault(file, "type", f"found {shown(kind)}, expected 3d or 6d; correct it")
    return found


def types_of(pairs: PairedFile) -> dict[str, str]:
    """Return the types of joints, by name; the letters of the axes for a universal joint."""
    return {
        name: _TYPES.get(kind, kind.removeprefix("UJOINT_"))
        for name, kind in zip(pairs.joint_name, pairs.joint_type, strict=True)
    }


def add_pairs(file: Path, pairs: PairedFile, robot: Robot) -> None:
    """Add the loops to a robot.

    Raises:
        CaseError: a name is not a link, or not a joint.
    """
    # as in Pinocchio, a joint has a frame too: that of its link
    frames = {joint.name: joint.links[1] for joint in robot.joints} | {
        name: name for name in robot.links
    }
    for names, kind in zip(pairs.closed_loop, pairs.type, strict=True):
        for name in names:
            if name not in frames:
                raise unknown_name(file, "closed_loop", name, frames, "a link or joint")
        first, second = (frames[name] for name in names)
        places = robot.links[first], robot.links[second]
        title = f"{names[0]} = {names[1]}"
        moves = (Move("ball", title, places[0].at, X),) if kind.lower() == "3d" else ()
        element = Described(file, "", {}, 1, words=f"closed_loop: {title}")
        robot.loops.append(Loop(Connection(title, (first, second), moves, element), places))
    coordinates = {move.name for joint in robot.joints for move in joint.moves}
    robot.actuated += [name for name in pairs.name_mot if name in coordinates]
