"""Drive of a model: MJCF defines none, so the options --drive and --hold do."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....errors import CaseError, remedy
from ....trajectory import Array
from ...io.document import decimal, fault, shown
from ...io.reader_options import Supplied
from ...io.schema import MOST_SAMPLES
from .elements import Element
from .tree import Tree

SAMPLES = 41
_FORM = (
    "JOINT:START:STOP or JOINT:START:STOP:SAMPLES, in the model's coordinates [rad, m], 2 to"
    f" {MOST_SAMPLES} samples"
)


@dataclass(frozen=True)
class Driving:
    """Driven and held joints of a model.

    Attributes:
        joint: swept joint; None if not given.
        values: its coordinates in the model, reference included [rad or m].
        held: hinges and slides with the coordinate of the file.
        fixed: balls, and otherwise free bodies, in their place.
    """

    joint: str | None
    values: Array
    held: tuple[str, ...]
    fixed: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the driven hinges and slides, the swept one first."""
        return (*(() if self.joint is None else (self.joint,)), *self.held)


def read_driving(file: Path, tree: Tree, supplied: Supplied) -> Driving:
    """Read the options.

    Raises:
        CaseError: they name an unknown joint, name one twice, or sweep several joints.
    """
    if len(supplied.drive) > 1:
        raise fault(
            file,
            "--drive",
            f"found {len(supplied.drive)} joints, expected one that is swept; --hold the others",
        )
    joint, values = None, np.zeros(1)
    if supplied.drive:
        joint, values = _swept(file, tree, supplied.drive[0])
    held: list[str] = []
    fixed: list[str] = []
    for name in dict.fromkeys(supplied.hold):
        if name == joint:
            raise fault(
                file,
                "--hold",
                f"found {name!r}, which is driven, expected another joint; leave it out",
            )
        if name in tree.joints and tree.joints[name].type != "ball":
            held.append(name)
        elif name in tree.joints or name in tree.free:
            fixed.append(name)
        else:
            known = [*tree.joints, *tree.free]
            raise fault(
                file,
                "--hold",
                f"found {shown(name)}, expected a joint or a free body; {remedy(name, known)}",
            )
    return Driving(joint, values, tuple(held), tuple(fixed))


def _swept(file: Path, tree: Tree, text: str) -> tuple[str, Array]:
    """Return the joint and its values; names may hold colons too."""
    parts = text.split(":")
    named = [
        (":".join(parts[:k]), parts[k:]) for k in range(max(1, len(parts) - 3), len(parts) + 1)
    ]
    for name, numbers in named:
        if name not in tree.joints:
            continue
        if tree.joints[name].type == "ball":
            raise fault(
                file,
                "--drive",
                f"{name!r} is a ball joint, expected a hinge or a slide; drive one of those",
            )
        if len(numbers) < 2:
            raise fault(
                file,
                "--drive",
                f"found {shown(text)}, expected {_FORM}; say from where to where:"
                f" {name}:START:STOP",
            )
        try:
            start, stop, steps = (
                decimal(numbers[0]),
                decimal(numbers[1]),
                int(numbers[2]) if len(numbers) == 3 else SAMPLES,
            )
        except ValueError:
            start, stop, steps = math.nan, math.nan, 0
        if not (
            math.isfinite(start)
            and math.isfinite(stop)
            and start != stop
            and 1 < steps <= MOST_SAMPLES
        ):
            break
        return name, np.linspace(start, stop, steps)
    else:
        hinges = [name for name, joint in tree.joints.items() if joint.type != "ball"]
        name = named[0][0]
        raise fault(
            file, "--drive", f"found {shown(text)}, expected {_FORM}; {remedy(name, hinges)}"
        )
    raise fault(file, "--drive", f"found {shown(text)}, expected {_FORM}; correct the numbers")


def undriven(file: Path, root: Element, tree: Tree, driving: Driving, dof: int) -> CaseError:
    """Return the error of a model whose degrees of freedom differ from the driven ones."""
    driven, actuated = (
        len(driving.joints),
        [each.attributes.get("joint") for each in root.below() if each.tag in _ACTUATORS],
    )
    free = [
        name
        for name, joint in tree.joints.items()
        if joint.type != "ball" and name not in driving.joints
    ]
    free = [
        *(name for name in free if name in actuated),
        *(name for name in free if name not in actuated),
    ]
    bodies = [body for body in dict.fromkeys(tree.free.values()) if body not in driving.fixed]
    count = f"{dof} degree{'s' * (dof != 1)} of freedom"
    what = f"{driven} driven or held" if driven else "nothing said of what drives it"
    if dof == 0:
        return fault(
            file,
            "",
            "the model has no freedom in its pose qpos0, expected one that moves; give another"
            " model",
        )
    advice: list[str] = []
    if driving.joint is None:
        advice.append("--drive JOINT:START:STOP for the one that moves")
    if dof > driven:
        wanted = dof - driven - (driving.joint is None)
        advice += [
            f"--hold JOINT for {wanted} more" + " (a free BODY counts for 6)" * bool(bodies)
        ] * (wanted > 0)
    elif driven > dof:
        advice.append(f"fewer --hold, by {driven - dof}")
    found = f"the model has {count}, and {what}, expected as many of either; say " + " and ".join(
        advice
    )
    listed = f"; joints, actuated ones first: {', '.join(free) or 'none'}" + (
        f"; free bodies: {', '.join(bodies)}" if bodies else ""
    )
    return fault(file, "", found + listed)


_ACTUATORS = (
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "dcmotor",
)
