"""Spanning tree of a mechanism from the ground, and the joints that it cuts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

from ..joints.base import Joint
from .mechanism import GROUND, Mechanism
from .motions import JointDriver


@dataclass(frozen=True)
class Branch:
    """A body of the tree: its joint from the parent, or none if it moves freely relative to the
    ground.
    """

    parent: str
    child: str
    joint: Joint | None


@dataclass(frozen=True)
class SpanningTree:
    """Branches, every parent before its children, and the joints left over, which close the loops.

    Fixed bodies appear only as parents, under the name "ground".
    """

    branches: tuple[Branch, ...]
    cut: tuple[Joint, ...]


def spanning_tree(mechanism: Mechanism, first: Collection[str] = ()) -> SpanningTree:
    """Return the tree with the fewest coordinates: driven and coupled joints first, then those with
    the most rows (Prim).

    A joint with a driven or coupled freedom stays in the tree, so the freedom is a coordinate.
    Joints of fewer than three rows (a distance) hold a body too loosely to carry it; a body with
    such joints only is free.

    Args:
        first: further joints, taken as driven ones are.
    """
    named = {*first} | {
        driver.joint for driver in mechanism.drivers if isinstance(driver, JointDriver)
    }
    named |= {joint for coupler in mechanism.couplers for joint in coupler.joints}
    candidates = [joint for joint in mechanism.joints if joint.rows >= 3]
    # the smallest is taken first
    ranks = [(joint.name not in named, -joint.rows, k) for k, joint in enumerate(candidates)]
    touching: dict[str, list[int]] = {}
    for k, joint in enumerate(candidates):
        for body in joint.bodies:
            touching.setdefault(body, []).append(k)
    placed = {GROUND} | {body.name for body in mechanism.bodies if body.fixed}
    # a heap of the joints with one end placed, and some with both; a search through all joints for
    # every body is quadratic
    reaching = [ranks[k] for body in placed for k in touching.get(body, ())]
    heapify(reaching)
    waiting, count = iter(mechanism.moving), len(mechanism.moving)
    branches: list[Branch] = []
    used: set[str] = set()
    while len(branches) < count:
        joint = _next(reaching, candidates, placed)
        if joint is not None:
            parent, child = joint.bodies if joint.i in placed else (joint.j, joint.i)
            used.add(joint.name)
        else:
            parent, child = GROUND, next(body.name for body in waiting if body.name not in placed)
        placed.add(child)
        for k in touching.get(child, ()):
            heappush(reaching, ranks[k])
        branches.append(Branch(GROUND if mechanism.is_fixed(parent) else parent, child, joint))
    return SpanningTree(
        tuple(branches), tuple(joint for joint in mechanism.joints if joint.name not in used)
    )


def _next(
    reaching: list[tuple[bool, int, int]], candidates: Sequence[Joint], placed: Collection[str]
) -> Joint | None:
    """Return the first joint of the heap from a placed body to an unplaced one."""
    while reaching:
        joint = candidates[heappop(reaching)[-1]]
        if joint.i not in placed or joint.j not in placed:
            return joint
    return None
