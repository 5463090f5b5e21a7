"""Drive of a model: MJCF defines none, so the options --drive, --hold and --hold-rest do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....errors import remedy
from ....trajectory import Array
from ...io.document import decimal, fault, shown, unknown_name
from ...io.reader_options import Supplied
from ...io.schema import MOST_SAMPLES
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
        driven: by joint, its coordinates in the model, reference included [rad or m]; the first
            one is swept, the others follow it.
        held: hinges and slides with their coordinate in the start.
        fixed: balls, and otherwise free bodies, at their place in the start.
    """

    driven: Mapping[str, Array]
    held: tuple[str, ...]
    fixed: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Driven and held hinges and slides, the swept one first."""
        return (*self.driven, *self.held)


def read_driving(file: Path, tree: Tree, supplied: Supplied) -> Driving:
    """Read the options.

    Raises:
        CaseError: they name an unknown joint, name one twice, or give different samples.
    """
    driven: dict[str, Array] = {}
    given: dict[str, int] = {}
    for text in supplied.drive:
        joint, values, samples = _swept(file, tree, text)
        if joint in driven:
            raise fault(file, "--drive", f"found {joint!r} twice; give one range")
        driven[joint] = values
        if samples is not None:
            given[joint] = samples
    if len({*given.values()}) > 1:
        counts = ", ".join(f"{count} of {joint!r}" for joint, count in given.items())
        raise fault(
            file,
            "--drive",
            f"found {counts} samples, expected as many of each; all joints move together",
        )
    if given:
        count = next(iter(given.values()))
        driven = {name: np.linspace(each[0], each[-1], count) for name, each in driven.items()}
    held: list[str] = []
    fixed: list[str] = []
    for name in dict.fromkeys(supplied.hold):
        if name in driven:
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
            raise unknown_name(file, "--hold", name, known, "a joint or a free body")
    return Driving(driven, tuple(held), tuple(fixed))


def _swept(file: Path, tree: Tree, text: str) -> tuple[str, Array, int | None]:
    """Return the joint, its values, and how many were asked for; names may hold colons too."""
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
        return name, np.linspace(start, stop, steps), steps if len(numbers) == 3 else None
    else:
        hinges = [name for name, joint in tree.joints.items() if joint.type != "ball"]
        name = named[0][0]
        raise fault(
            file, "--drive", f"found {shown(text)}, expected {_FORM}; {remedy(name, hinges)}"
        )
    raise fault(file, "--drive", f"found {shown(text)}, expected {_FORM}; correct the numbers")
