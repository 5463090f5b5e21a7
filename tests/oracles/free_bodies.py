"""Free-body diagrams of a tree of driven bodies: Newton and Euler, joint by joint, one sample.

Of the code under test only the description is used: names, points, axes and masses. No row of a
joint takes part. A body is a turn and a shift of its design position; a joint puts the second body
where its coordinates say. Each body is cut free: what its motion demands, less gravity, is what its
joints and drives give it. A joint gives nothing along a free coordinate, so there the drive gives
all of it:

    turn             a couple about the axis, on the second body; the opposite on the first
    displacement     a force along the axis through the joint's point, and the opposite
    driven point     a force at the point, along the direction
    coupler          a load of each of its two coordinates, as a drive of it would give, in the
                     proportion that does no work in all

The thread of a screw is part of its joint.
"""

import math
from dataclasses import dataclass

import numpy as np
from kincheck import PointCoordinate

from .rods import rotation


@dataclass(frozen=True)
class Moving:
    """A body: the point X of the design is at u + R X. Also the rates of u and its spin."""

    R: np.ndarray
    u: np.ndarray
    v: np.ndarray
    a: np.ndarray
    w: np.ndarray
    w_t: np.ndarray

    def place(self, X):
        return self.u + self.R @ X

    def velocity(self, X):
        return self.v + np.cross(self.w, self.R @ X)

    def acceleration(self, X):
        arm = self.R @ X
        return self.a + np.cross(self.w_t, arm) + np.cross(self.w, np.cross(self.w, arm))


STILL = Moving(np.eye(3), *np.zeros((5, 3)))


def across(h):
    """Two unit vectors at right angles to h: the plane of a planar joint."""
    first = np.cross(h, np.eye(3)[np.argmin(np.abs(h))])
    first = first / np.linalg.norm(first)
    return first, np.cross(h, first)


def carried(parent, P, h, turn, shift):
    """The body that a joint at P with axis h puts on its parent.

    Turn [rad] and shift, in axes that the parent carries [m], each with two rates.
    """
    n = parent.R @ h
    (angle, rate, rate_t), (d, d_t, d_tt) = turn, (parent.R @ each for each in shift)
    R = parent.R @ rotation(angle * h)
    w = parent.w + rate * n
    w_t = parent.w_t + rate_t * n + np.cross(parent.w, rate * n)
    reach = P + shift[0]  # of the parent, where the child's point is now
    v = parent.velocity(reach) + d_t
    a = parent.acceleration(reach) + d_tt + 2.0 * np.cross(parent.w, d_t)
    arm = R @ P
    a = a - np.cross(w_t, arm) - np.cross(w, np.cross(w, arm))
    return Moving(R, parent.place(P) + d - arm, v - np.cross(w, arm), a, w, w_t)


@dataclass(frozen=True)
class Found:
    """Wrenches of joints, first body on second, about the second's point; efforts of drivers."""

    joints: dict
    drivers: dict


def forces(mechanism, coordinates, couplings=()):
    """What joints and drivers give at one instant.

    Args:
        coordinates: value, rate and acceleration by joint and freedom, of the second body relative
            to the first.
        couplings: each a mapping from joint and freedom to the load of the coordinate by one of the
            coupler's load.
    """
    tree, bodies = _outwards(mechanism), {"ground": STILL}
    for joint, parent, child, sign in tree:
        turn, shift = (sign * part for part in _moved(joint, coordinates))
        bodies[child] = carried(bodies[parent], *axis_of(joint), turn, shift)
    needs = {name: _demand(mechanism, name, bodies[name]) for name in bodies if name != "ground"}
    passed = {joint.name: _through(tree, child, needs) for joint, _, child, _ in tree}

    def spared(load):
        """What a joint need not pass on for one of a load, by joint: wrenches on its outer body."""
        if isinstance(load, PointCoordinate):
            point = mechanism.point(load.point)
            along = np.asarray(load.direction, dtype=float) / np.linalg.norm(load.direction)
            push = _at(bodies[point.body].place(np.array(point.position)), along)
            return {
                joint.name: _through(tree, child, {point.body: push}) for joint, _, child, _ in tree
            }
        found = {joint.name: np.zeros(6) for joint, *_ in tree}
        for joint, parent, child, sign in tree:
            for (name, freedom), weight in load.items():
                if name == joint.name:
                    n = sign * weight * (bodies[parent].R @ axis_of(joint)[1])
                    place = bodies[child].place(axis_of(joint)[0])
                    along = (
                        np.concatenate([np.zeros(3), n]) if freedom == "rotation" else _at(place, n)
                    )
                    found[name] = found[name] + along
        return found

    loads = [
        spared(d if isinstance(d, PointCoordinate) else {(d.joint, d.freedom): 1.0})
        for d in mechanism.drivers
    ] + [spared(each) for each in couplings]
    rows, right = [], []
    for joint, parent, child, _ in tree:
        for motion in _free(joint, bodies[parent], bodies[child]):
            rows.append([load[joint.name] @ motion for load in loads])
            right.append(passed[joint.name] @ motion)
    amounts = np.linalg.solve(np.array(rows), np.array(right))
    joints = {}
    for joint, _, _, sign in tree:
        own = passed[joint.name] - sum(
            amount * load[joint.name] for amount, load in zip(amounts, loads, strict=True)
        )
        force, moment = sign * own[:3], sign * own[3:]
        P = bodies[joint.j].place(axis_of(joint)[0])
        joints[joint.name] = np.concatenate([force, moment - np.cross(P, force)])
    return Found(joints, {d.name: x for d, x in zip(mechanism.drivers, amounts, strict=False)})


def _outwards(mechanism):
    """Joints from the ground outwards: joint, parent, child, and the sign of child against
    parent.
    """
    left, reached, found = [*mechanism.joints], {"ground"}, []
    while left:
        joint = next(each for each in left if reached & {each.i, each.j})
        left.remove(joint)
        parent, child = (joint.i, joint.j) if joint.i in reached else (joint.j, joint.i)
        reached.add(child)
        found.append((joint, parent, child, 1.0 if child == joint.j else -1.0))
    return found


def _moved(joint, coordinates):
    """Turn, shape (3,), and shift, shape (3, 3), of a joint by its coordinates."""
    h = axis_of(joint)[1]
    turn, shift = np.zeros(3), np.zeros((3, 3))
    ways = dict(zip(("translation x", "translation y"), across(h), strict=True))
    for (name, freedom), moved in coordinates.items():
        if name == joint.name and freedom == "rotation":
            turn = np.array(moved)
        elif name == joint.name:
            shift = shift + np.outer(moved, ways.get(freedom, h))
    return turn, shift


def axis_of(joint):
    axis = np.asarray(joint.axis, dtype=float)
    return np.asarray(joint.point, dtype=float), axis / np.linalg.norm(axis)


def _at(place, force):
    """Force, and moment about the global origin."""
    return np.concatenate([force, np.cross(place, force)])


def _demand(mechanism, name, body):
    of = mechanism.body(name)
    center = np.array(of.center_of_mass)
    force = of.mass * (body.acceleration(center) - np.array(mechanism.gravity))
    xx, yy, zz, xy, yz, xz = of.inertia
    inertia = body.R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ body.R.T
    change = inertia @ body.w_t + np.cross(body.w, inertia @ body.w)
    wrench = _at(body.place(center), force)
    wrench[3:] += change
    return wrench


def _through(tree, child, wrenches):
    """What a body and all that it carries need, in sum."""
    total = np.zeros(6) + wrenches.get(child, 0.0)
    for _, parent, other, _ in tree:
        if parent == child:
            total = total + _through(tree, other, wrenches)
    return total


def _free(joint, parent, child):
    """Each free motion of the outer body: its product with a wrench about the global origin is the
    wrench's power.
    """
    P, h = axis_of(joint)
    n, place = parent.R @ h, child.place(P)
    turning, sliding = np.concatenate([np.cross(place, n), n]), np.concatenate([n, np.zeros(3)])
    if joint.type == "screw":
        return [turning + joint.lead / (2.0 * math.pi) * sliding]
    if joint.type == "planar":
        return [turning, *(np.concatenate([parent.R @ e, np.zeros(3)]) for e in across(h))]
    every = {"rotation": turning, "translation": sliding}
    return [every[freedom] for freedom in joint.freedoms]
