"""Start of a model: its pose qpos0, one of its keyframes, or values of joints, by --start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ....algebra import quat, vec
from ....errors import remedy, with_article
from ...io.document import decimal, fault, shown, unknown_name, usable
from .elements import Element
from .frames import HERE, Place, unit_quaternion
from .pose import Pose, Value
from .tree import ModelJoint, Tree

COORDINATES = {"hinge": 1, "slide": 1, "ball": 4, "free": 7}
KEYFRAME = "keyframe:"
QPOS0 = "its pose qpos0"
_FORM = f"{KEYFRAME}NAME or JOINT=VALUE [rad or m, as qpos]"


@dataclass(frozen=True)
class Start:
    """A pose to begin with.

    Attributes:
        given: joints whose values the user gave; they stay if the closures let them.
        text: of its source, for notes and messages.
        closed: whether it is meant to close, so that it is refused far from that.
    """

    pose: Pose
    given: tuple[str, ...] = ()
    text: str = QPOS0
    closed: bool = True


def read_start(
    file: Path,
    root: Element,
    tree: Tree,
    said: Sequence[str],
    *,
    zero: str = QPOS0,
    closed: bool = True,
) -> Start:
    """Read the start of a model.

    Args:
        zero: the model's own start, in words.
        closed: whether that is meant to close.

    Raises:
        CaseError: there is no such keyframe or joint, one is given twice, or its numbers are not
            those of the joint.
    """
    values = [*Pose.of(tree).values]
    names = [joint.name for joint in tree.chain]
    given: list[str] = []
    keyframes = [each for each in said if each.startswith(KEYFRAME)]
    if len(keyframes) > 1:
        raise fault(file, "--start", f"found {len(keyframes)} keyframes, expected one; name one")
    if keyframes:
        values = _keyframe(file, root, tree, keyframes[0].removeprefix(KEYFRAME))
    for each in said:
        if each in keyframes:
            continue
        name, sign, text = each.rpartition("=")
        if not sign:
            raise fault(file, "--start", f"found {shown(each)}, expected {_FORM}; say the value")
        if name not in names:
            raise unknown_name(file, "--start", name, names, "a joint")
        if name in given:
            raise fault(file, "--start", f"found {shown(name)} twice; give one value")
        joint = tree.chain[names.index(name)]
        values[names.index(name)] = _value(file, tree, joint, text.split(","))
        given.append(name)
    text = ", ".join(said) if said else zero
    return Start(Pose(tree, values), tuple(given), text, closed and not given)


def _keyframe(file: Path, root: Element, tree: Tree, name: str) -> list[Value]:
    keys = [each for section in root.only("keyframe") for each in section.only("key")]
    named = {each.attributes.get("name", str(k)): each for k, each in enumerate(keys)}
    if name not in named:
        raise fault(
            file,
            "--start",
            f"found {shown(KEYFRAME + name)}, expected a keyframe of the model, by name or by"
            f" number from 0; {remedy(name, named)}",
        )
    key = named[name]
    count = sum(COORDINATES[joint.type] for joint in tree.chain)
    if "qpos" not in key.attributes:
        return [*Pose.of(tree).values]
    numbers = key.attributes["qpos"].split()
    if len(numbers) != count:
        raise key.fault(
            f"qpos: found {len(numbers)} numbers, expected {count}, of the joints in order; correct"
            " the attribute"
        )
    values: list[Value] = []
    for joint in tree.chain:
        values.append(_value(file, tree, joint, numbers[: COORDINATES[joint.type]], key))
        numbers = numbers[COORDINATES[joint.type] :]
    return values


def _value(
    file: Path, tree: Tree, joint: ModelJoint, texts: Sequence[str], key: Element | None = None
) -> Value:
    """Return a joint's change since qpos0 from its coordinates."""
    expected = COORDINATES[joint.type]
    try:
        numbers = [decimal(each) for each in texts]
    except ValueError:
        numbers = [math.nan]
    if len(numbers) != expected or not all(map(usable, numbers)):
        what = f"{expected} finite number" + "s" * (expected > 1)
        problem = (
            f"found {shown(' '.join(texts))} for {joint.name!r}, {with_article(joint.type)} joint,"
            f" expected {what}; correct it"
        )
        raise key.fault(f"qpos: {problem}") if key else fault(file, "--start", problem)
    if expected == 1:
        return numbers[0] - joint.value
    if not any(numbers[-4:]):
        problem = (
            f"the quaternion of {joint.name!r} is zero, expected one of length one; correct it"
        )
        raise key.fault(f"qpos: {problem}") if key else fault(file, "--start", problem)
    turn, frame = unit_quaternion(quat(numbers[-4:])), tree.moving[joint.inner]
    if joint.type == "free":
        return Place(vec(numbers[:3]), turn).then(HERE.seen_from(frame))
    # MuJoCo has the turn in the axes of the body
    turn = frame.turn * turn * frame.turn.conjugate()
    return Place(joint.point - Place(turn=turn).direction(joint.point), turn)
