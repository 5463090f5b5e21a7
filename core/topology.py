"""The graph of a mechanism: a spanning tree from the ground, and the joints that are cut by it."""

from __future__ import annotations

from dataclasses import dataclass

from .drivers import JointDriver
from .joints import Joint
from .mechanism import GROUND, Mechanism


@dataclass(frozen=True)
class Branch:
    """A body of the tree: reached from its parent through a joint, or free (joint None) to move relative to the ground."""

    parent: str
    child: str
    joint: Joint | None


@dataclass(frozen=True)
class SpanningTree:
    """Branches in an order where every parent comes before its children, and the joints left over, which close the loops.

    Fixed bodies appear only as parents, under the name "ground".
    """

    branches: tuple[Branch, ...]
    cut: tuple[Joint, ...]


def spanning_tree(mechanism: Mechanism) -> SpanningTree:
    """The tree whose joints leave the fewest coordinates: driven and coupled joints first, then those with the most rows (Prim).

    A joint whose axis-bound freedom is driven or coupled stays in the tree, where the freedom is a coordinate. Joints of fewer than
    three rows (a distance) tie a body too loosely to carry it; a body that hangs on such joints only is free.
    """
    named = {driver.joint for driver in mechanism.drivers if isinstance(driver, JointDriver)}
    named |= {joint for coupler in mechanism.couplers for joint in coupler.joints}
    placed = {GROUND} | {body.name for body in mechanism.bodies if body.fixed}
    waiting = {body.name: None for body in mechanism.moving}  # a dict keeps the order
    candidates = [joint for joint in mechanism.joints if joint.rows >= 3]
    branches: list[Branch] = []
    used: set[str] = set()
    while waiting:
        reaching = [joint for joint in candidates if (joint.i in placed) != (joint.j in placed)]
        if reaching:
            joint = max(reaching, key=lambda each: (each.name in named, each.rows))
            parent, child = joint.bodies if joint.i in placed else (joint.j, joint.i)
            used.add(joint.name)
        else:
            joint, parent, child = None, GROUND, next(iter(waiting))
        placed.add(child)
        del waiting[child]
        branches.append(Branch(GROUND if mechanism.is_fixed(parent) else parent, child, joint))
    return SpanningTree(tuple(branches), tuple(joint for joint in mechanism.joints if joint.name not in used))
