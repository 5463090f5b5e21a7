"""The spanning tree against a search through all joints at every step."""

import random

import pytest
from kincheck.core import (
    Body,
    Cylindrical,
    Distance,
    Gear,
    JointAngle,
    Mechanism,
    Revolute,
    Spherical,
)
from kincheck.core.joints import Fixed
from kincheck.core.mechanism.tree import spanning_tree

Z = (0.0, 0.0, 1.0)


def searched(mechanism):
    """Parent, child and joint of every branch: at each step the first of the best joints that lead
    out of the tree.
    """
    named = {driver.joint for driver in mechanism.drivers} | {
        name for each in mechanism.couplers for name in each.joints
    }
    placed = {"ground"} | {body.name for body in mechanism.bodies if body.fixed}
    waiting = [body.name for body in mechanism.moving]
    found = []
    while waiting:
        reaching = [
            joint
            for joint in mechanism.joints
            if joint.rows >= 3 and (joint.i in placed) != (joint.j in placed)
        ]
        best = max(reaching, key=lambda joint: (joint.name in named, joint.rows), default=None)
        parent, child = (
            ("ground", waiting[0])
            if best is None
            else best.bodies
            if best.i in placed
            else best.bodies[::-1]
        )
        placed.add(child)
        waiting.remove(child)
        found.append(("ground" if mechanism.is_fixed(parent) else parent, child, best))
    return found


def scrambled(seed):
    """Bodies, some fixed, with joints of all ranks between any two; parts may hang together loosely
    or not at all.
    """
    pick = random.Random(seed)
    bodies = [Body(f"b{k}", fixed=pick.random() < 0.15) for k in range(pick.randint(1, 14))]
    still = {"ground", *(body.name for body in bodies if body.fixed)}
    point = (0.1, 0.2, 0.3)
    joints = []
    for k in range(pick.randint(0, 25)):
        i, j = pick.choices(["ground", *(body.name for body in bodies)], k=2)
        if i != j and not {i, j} <= still:
            kinds = [
                (Revolute, point, Z),
                (Spherical, point),
                (Distance, (point, Z)),
                (Cylindrical, point, Z),
                (Fixed,),
            ]
            kind, *geometry = pick.choice(kinds)
            joints.append(kind(f"j{k}", i, j, *geometry))
    turning = [joint.name for joint in joints if isinstance(joint, Revolute | Cylindrical)]
    pick.shuffle(turning)
    drivers = [JointAngle("turn", name) for name in turning[:1]]
    couplers = [Gear("gear", tuple(turning[1:3]), 2.0)] if len(turning) > 2 else []
    return Mechanism("scrambled", bodies, joints, (), drivers, couplers)


@pytest.mark.parametrize("seed", range(60))
def test_the_tree_is_that_of_a_full_search(seed):
    mechanism = scrambled(seed)
    tree = spanning_tree(mechanism)
    assert [(branch.parent, branch.child, branch.joint) for branch in tree.branches] == searched(
        mechanism
    )
    used = {branch.joint.name for branch in tree.branches if branch.joint is not None}
    assert [joint.name for joint in tree.cut] == [
        joint.name for joint in mechanism.joints if joint.name not in used
    ]
