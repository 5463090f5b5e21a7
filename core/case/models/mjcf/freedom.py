"""Degrees of freedom of a model in its start, driven and held.

They are counted by the motions left by the equalities to the joints' coordinates, so the count
is the same whatever is held or driven.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ....errors import CaseError
from ....trajectory import Array
from ...io.document import fault
from .assembly import Assembled
from .driving import Driving
from .elements import Element
from .pose import UNKNOWNS

# Of motions of length one: less of a coordinate is round-off, or at rest within the digits.
AT_REST = 1e-6
# A joint that moves by less of them may do so by the file's digits alone, which lead the mechanism
# anywhere when it is held. It is held if no other one can be.
CLEARLY = 0.01


class Freedom:
    """The motions of a model not driven or held so far.

    Attributes:
        dof: their number at the beginning.
        taken: coordinates of driven and held joints.
    """

    def __init__(self, model: Assembled, spins: Mapping[str, Array]) -> None:
        """Begin with the motions left by the equalities, without the spins of rods.

        Args:
            spins: by ball or free joint, the axis about which its rod turns freely, shape (3,).
        """
        self._columns, self._free = model.pose.columns, model.free
        for name, axis in spins.items():
            turning = [*self._columns[name]][-3:]
            self._take(axis[None] @ self._free[:, turning].T)
        self.dof, self.taken = len(self._free), 0

    @property
    def left(self) -> int:
        """Number of motions left."""
        return len(self._free)

    def moves(self, joint: str) -> int:
        """Return how many of a joint's motions are left."""
        rows = self._free[:, [*self._columns[joint]]]
        return int((np.linalg.svd(rows, compute_uv=False) > AT_REST).sum()) if rows.size else 0

    def holds(self, joint: str, clearly: float) -> bool:
        """Return whether each of a joint's unknowns can be held: it moves by more than this."""
        rows = self._free[:, [*self._columns[joint]]]
        count = rows.shape[1]
        sizes = np.linalg.svd(rows, compute_uv=False)
        return len(rows) >= count and bool(sizes[count - 1] > clearly)

    def take(self, joint: str) -> None:
        """Drive or hold a joint."""
        self.taken += len(self._columns[joint])
        self._take(self._free[:, [*self._columns[joint]]].T)

    def _take(self, rows: Array) -> None:
        """Leave the motions on which rows over them vanish, shape (rows, motions)."""
        _, sizes, right = np.linalg.svd(rows, full_matrices=True)
        self._free = right[int((sizes > AT_REST).sum()) :] @ self._free


def taken(
    file: Path,
    root: Element,
    model: Assembled,
    driving: Driving,
    spins: Mapping[str, Array],
    *,
    hold_rest: bool,
) -> Driving:
    """Return the driving, with joints held for the rest if wanted: free bodies, then joints with an
    actuator, then others, then balls.

    Raises:
        CaseError: freedoms are left, or more are driven and held than there are.
    """
    freedom, tree = Freedom(model, spins), model.tree
    free = {body: joint.name for joint in tree.chain for body in (joint.name, joint.inner)}
    for option, names in (
        ("--drive", driving.driven),
        ("--hold", (*driving.held, *driving.fixed)),
    ):
        for name in names:
            if not freedom.moves(free.get(name, name)):
                advice = "name another" if option == "--drive" else "leave it out"
                raise fault(
                    file,
                    option,
                    f"found {name!r}, which an equality of the file locks, expected a joint that"
                    f" moves; {advice}, or start elsewhere by --start",
                )
    for name in (*driving.joints, *driving.fixed):
        freedom.take(free[name] if name in tree.free else name)
    held: list[str] = [*driving.held]
    fixed: list[str] = [*driving.fixed]
    if hold_rest and driving.driven:
        candidates = _candidates(root, model, driving)
        for clearly in (CLEARLY, AT_REST):
            for name, kind in candidates:
                if name not in (*held, *fixed) and freedom.holds(name, clearly):
                    freedom.take(name)
                    (held if kind in ("hinge", "slide") else fixed).append(name)
    if freedom.left or freedom.taken != freedom.dof or not driving.driven:
        raise _undriven(file, root, model, driving, freedom)
    return replace(driving, held=tuple(held), fixed=tuple(fixed))


def _candidates(root: Element, model: Assembled, driving: Driving) -> list[tuple[str, str]]:
    """Return the joints to hold, with their types, the first ones first."""
    actuated = {each.attributes.get("joint") for each in root.below() if each.tag in _ACTUATORS}
    order = {"free": 0, "hinge": 1, "slide": 1, "ball": 3}
    named = [*driving.joints, *driving.fixed]
    found = [
        (order[joint.type] + (order[joint.type] == 1 and joint.name not in actuated), k, joint)
        for k, joint in enumerate(model.tree.chain)
        if joint.name not in named and joint.inner not in named
    ]
    return [(joint.name, joint.type) for *_, joint in sorted(found, key=lambda each: each[:2])]


def _undriven(
    file: Path, root: Element, model: Assembled, driving: Driving, freedom: Freedom
) -> CaseError:
    """Return the error of a model whose degrees of freedom differ from the driven ones."""
    dof, count = freedom.dof, freedom.taken
    if dof == 0:
        return fault(
            file,
            "",
            "the model has no freedom in its start, expected one that moves; give another model or"
            " another start by --start",
        )
    what = f"{count} driven or held" if count else "nothing said of what drives it"
    advice: list[str] = []
    if not driving.driven:
        advice.append("--drive JOINT:START:STOP for the one that moves")
    wanted = freedom.left - (not driving.driven)
    if wanted > 0:
        bodies = " (a free body counts for 6, a ball for 3)" * bool(
            any(joint.type in ("ball", "free") for joint in model.tree.chain)
        )
        advice.append(f"--hold JOINT for {wanted} more{bodies}, or --hold-rest")
    elif count > dof:
        advice.append(f"fewer --hold, by {count - dof}")
    if count <= dof < freedom.left + count:
        advice.append(
            f"others for {freedom.left + count - dof} that depend on each other by the equalities"
        )
    found = (
        f"the model has {dof} degree{'s' * (dof != 1)} of freedom, and {what}, expected as many of"
        f" either; say {' and '.join(advice)}"
    )
    return fault(file, "", found + _listed(root, model, driving, freedom))


def _listed(root: Element, model: Assembled, driving: Driving, freedom: Freedom) -> str:
    """Return the complete list of joints to hold, by their kinds."""
    loose = [
        (name, kind)
        for name, kind in _candidates(root, model, driving)
        if freedom.moves(name) == UNKNOWNS[kind]
    ]
    bodies = {joint.name: joint.inner for joint in model.tree.chain}
    kinds = (
        (
            "joints, actuated ones first",
            [name for name, kind in loose if kind in ("hinge", "slide")],
        ),
        ("ball joints", [name for name, kind in loose if kind == "ball"]),
        ("free bodies", [bodies[name] for name, kind in loose if kind == "free"]),
    )
    partly = [
        name
        for name, kind in _candidates(root, model, driving)
        if 0 < freedom.moves(name) < UNKNOWNS[kind]
    ]
    found = "".join(f"; {what}: {', '.join(names)}" for what, names in kinds if names)
    if partly and not loose:
        found += f"; only in part free, so that they cannot be held: {', '.join(partly)}"
    return found or "; none can be held"


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
