"""Joints that hold less where rows are redundant but for the digits of a file.

Four hinges that a file makes parallel to 1e-6 leave a planar loop no freedom, because three of its
rows agree to these digits only. A joint that closes the loop then gets fewer rows: two bodies with
a common point and axis share a line, or a plane. The result is a mechanism like any other, the same
for every engine. It knows the rows left out: they leave reactions undetermined, as redundant rows.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ... import primitives as p
from ...algebra import ZERO, Vec3, X, Y, Z, cross, vec
from ...errors import SolveError
from ...joints import (
    Attachment,
    AxialJoint,
    Inline,
    InPlane,
    Joint,
    OrientationLock,
    ParallelAxes,
    PerpendicularAxes,
    Spherical,
)
from ...joints.base import triad
from ...kinematics.formulation.cartesian import COLUMNS, Cartesian
from ...kinematics.formulation.constraints import Frames, frames, unit_near
from ...kinematics.formulation.state_vectors import jacobian
from ...kinematics.structure.redundancy import RANK_TOLERANCE, without
from ...mechanism.loads import TorsionSpringDamper
from ...mechanism.mechanism import Mechanism, Reduced, Vector
from ...mechanism.motions import JointDriver
from ...mechanism.tree import spanning_tree
from ...trajectory import Array

# Seconds of singular values for each rows x columns x lesser of both, on one slow core; and the
# longest time to spend on them unasked [s].
DENSE_WORK, LONGEST = 3e-9, 600.0
# Gaps of several joints add up, and arms lengthen them.
ADDED_UP = 10.0
# A vanishing sum of rows, of size one, is ended where its larger part is: by a direction of the
# point if its part of orientations is smaller than this. Of 48 loops of hinges in eight families, a
# seventh of it leaves 8 whose motion along 0.6 rad is another one, or locks; this leaves none.
TURNS = 0.7


@dataclass(frozen=True)
class Reduction:
    """A mechanism without redundant rows.

    Attributes:
        mechanism: its `reduced` joints are those with rows left out.
        unit: the mechanism's size [m].
    """

    mechanism: Mechanism
    unit: float


@dataclass(frozen=True, eq=False)
class _Held:
    """Directions of a joint's conditions: held along (places) and held about (turns).

    Both are orthonormal, of shape (directions, 3), global at design.

    Attributes:
        axes: on the first and the second body, at right angles, if their condition is the only one
            of turns: its direction moves with both bodies.
        axis: common axis of both bodies, if there are two conditions of turns.
    """

    places: Array
    turns: Array
    axes: tuple[Vector, Vector] | None
    axis: Vec3 | None

    def rows(self, joint: Joint, frame: Frames, formulation: Cartesian) -> Array:
        """Return the rows of both, shape (directions, unknowns)."""
        found = np.zeros((len(self.places) + len(self.turns), formulation.unknowns))
        for body, sign in zip(joint.bodies, (-1.0, 1.0), strict=True):
            if body in formulation.columns:
                k, n = formulation.columns[body], len(self.places)
                if n:
                    arm = np.array([*frame.arm(body, joint.points_on()[0])])
                    found[:n, k : k + 3] = sign * self.places
                    found[:n, k + 3 : k + COLUMNS] = sign * np.cross(arm, self.places)
                found[n:, k + 3 : k + COLUMNS] = sign * self.turns
        return found

    def part(self, sums: Array) -> tuple[_Held, _Held]:
        """Return the rest after ending vanishing sums of rows, and the part left out.

        Args:
            sums: weights of the rows in each sum, shape (sums, directions).
        """
        n = len(self.places)
        left, sizes, right = np.linalg.svd(sums[:, n:])
        turning = int((sizes > TURNS).sum())
        straight = np.linalg.qr((left[:, turning:].T @ sums[:, :n]).T)[0].T
        return (
            replace(
                self,
                places=_complement(straight) @ self.places,
                turns=right[turning:] @ self.turns,
            ),
            replace(self, places=straight @ self.places, turns=right[:turning] @ self.turns),
        )

    def joints(self, joint: Joint) -> list[Joint]:
        """Return joints with these conditions between the bodies of a joint, under its name."""
        name, turns, found = joint.name, self.turns, list[Joint]()
        ends = joint.bodies
        match len(self.places):
            case 1:
                found.append(InPlane(name, *ends, joint.points_on()[0], _vector(self.places[0])))
            case 2:
                line = _normal(self.places)
                found.append(Inline(name, *ends, joint.points_on()[0], line))
            case 3:
                found.append(Spherical(name, *ends, joint.points_on()[0]))
            case _:
                pass
        name = f"{name}: axes" if found else name
        match len(turns):
            case 1:
                found.append(PerpendicularAxes(name, *ends, self.axes or self._crossed(turns[0])))
            case 2:
                found.append(ParallelAxes(name, *ends, _normal(turns)))
            case 3:
                found.append(OrientationLock(name, *ends))
            case _:
                pass
        return found

    def _crossed(self, turn: Array) -> tuple[Vector, Vector]:
        """Return the axes of one condition, about a direction, of several conditions of turns.

        The first body has the common axis, and the second one a normal of it: any other pair is a
        condition beyond those of the joint.
        """
        f, g, h = triad(_vector(turn))
        if self.axis is not None:
            f, g = self.axis, cross(h, self.axis)
        return (*f,), (*g,)


def reduce_rows(
    mechanism: Mechanism, tolerance: float, carrying: Collection[str] = ()
) -> Reduction:
    """Return the mechanism without redundant rows, to a tolerance [m].

    Joints of closed loops lose rows; driven and coupled ones, those with torsional springs, and
    joints of other primitives than points, lines, planes and orientations, keep theirs.

    Args:
        carrying: joints with all their rows, as long as others can close the loops.
    """
    core = _without_branches(mechanism)
    frame = frames(core, unit_near(mechanism.size))
    keeping = {each.joint for each in mechanism.drivers if isinstance(each, JointDriver)}
    keeping |= {joint for coupler in mechanism.couplers for joint in coupler.joints}
    keeping |= {each.joint for each in mechanism.forces if isinstance(each, TorsionSpringDamper)}
    tree = spanning_tree(mechanism, {*carrying, *keeping})
    held = {joint.name: _held(joint) for joint in tree.cut if joint.name not in keeping}
    if not any(held.values()):  # no loop, or none whose rows can be left out
        return Reduction(mechanism, frame.unit)
    formulation = Cartesian.of(core, frame)
    matrix, named = jacobian(formulation), dict[str, list[int]]()
    for k, (owner, _) in enumerate(formulation.owners):
        named.setdefault(owner, []).append(k)
    part_of = parts_of_columns(formulation, matrix)
    columns: dict[int, list[int]] = {}
    for k, part in enumerate(part_of):
        columns.setdefault(part, []).append(k)
    whole = {part: list[int]() for part in columns}
    for name, rows in named.items():
        if held.get(name) is None:
            for k in rows:
                if (used := np.flatnonzero(matrix[k])).size:
                    whole[part_of[int(used[0])]].append(k)
    span: dict[int, Array] = {}
    enough, changed = ADDED_UP * tolerance / frame.unit, dict[str, list[Joint]]()
    reduced = list[Reduced]()
    for joint in sorted(tree.cut, key=lambda joint: joint.name not in {*carrying}):
        if (holds := held.get(joint.name)) is None:
            continue
        body = next(name for name in joint.bodies if name in formulation.columns)
        part = part_of[formulation.columns[body]]
        own = columns[part]
        if part not in span:
            _require_affordable(joint, len(whole[part]), len(own))
            span[part] = _extend_span(np.empty((0, len(own))), matrix[np.ix_(whole[part], own)])
        rows = holds.rows(joint, frame, formulation)[:, own]
        left, sizes, _ = np.linalg.svd(without(rows, span[part]), full_matrices=True)
        weak = np.concatenate([sizes <= enough, np.ones(len(rows) - len(sizes), dtype=np.bool_)])
        if weak.any():
            holds, less = holds.part(left[:, weak].T)
            kept = changed[joint.name] = holds.joints(joint)
            names = tuple(each.name for each in kept)
            left_out = tuple(each.changed(name=joint.name) for each in less.joints(joint))
            reduced.append(Reduced(joint, names, left_out))
            rows = holds.rows(joint, frame, formulation)[:, own]
        span[part] = _extend_span(span[part], rows)
    joints = [each for joint in mechanism.joints for each in changed.get(joint.name, [joint])]
    return Reduction(
        replace(mechanism, joints=joints, reduced=reduced) if changed else mechanism, frame.unit
    )


def _without_branches(mechanism: Mechanism) -> Mechanism:
    """Return the joints of loops, with the bodies coupled to them: the rows of a body at the end
    of a branch, and of the coupler of its motion, say nothing of other bodies.
    """
    joints = {joint.name: joint for joint in mechanism.joints}
    couplers = {coupler.name: coupler for coupler in mechanism.couplers}
    on: dict[str, set[str]] = {body.name: set() for body in mechanism.moving}
    of_joint: dict[str, set[str]] = {name: set() for name in joints}
    for joint in mechanism.joints:
        for body in {*joint.bodies} & on.keys():
            on[body].add(joint.name)
    for coupler in mechanism.couplers:
        for name in coupler.joints:
            of_joint[name].add(coupler.name)
    waiting = [*on]
    while waiting:
        body = waiting.pop()
        if len(on.get(body, ())) != 1:
            continue
        (name,) = on[body]
        moving = {each: couplers[each] for each in of_joint[name]}
        if len(moving) > 1 or any(x.curve and x.joints[0] != name for x in moving.values()):
            continue  # the slope of a curve may vanish
        del on[body]
        for other in joints.pop(name).bodies:
            on.get(other, set()).discard(name)
            waiting.append(other)
        for each in moving:
            for other in couplers.pop(each).joints:
                of_joint[other].discard(each)
                if other in joints:
                    waiting += joints[other].bodies
    bodies = [body for body in mechanism.bodies if body.fixed or body.name in on]
    return Mechanism(mechanism.name, bodies, [*joints.values()], couplers=[*couplers.values()])


def _held(joint: Joint) -> _Held | None:
    """Return the conditions of a joint; None if it has others than points and orientations."""
    if isinstance(joint, AxialJoint) and joint.relations:
        return None
    places, turns, here = list[Vec3](), list[Vec3](), Attachment(ZERO)
    crossed: list[tuple[Vector, Vector]] = []
    for each in joint.primitives(here, here):
        match each:
            case p.Spherical():
                places += (X, Y, Z)
            case p.Dot12():
                turns += (X, Y, Z)
            case p.Dot11(f=f, g=g) | p.Dot21(f=f, g=g):
                (turns if isinstance(each, p.Dot11) else places).extend((f, g))
            case p.Dot20(a=a):
                places.append(a)
            case p.Dot10(a=a, b=b):
                turns.append(cross(a, b))
                crossed.append(((*a,), (*b,)))
            case _:
                return None
    if places and len(joint.points_on()) != 1:
        return None
    axes = crossed[0] if len(turns) == 1 and crossed else None
    axis = cross(*turns) if len(turns) == 2 else None
    return _Held(_orthonormal(places), _orthonormal(turns), axes, axis)


def _orthonormal(vectors: Sequence[Vec3]) -> Array:
    found = np.array([[*each] for each in vectors], dtype=np.float64).reshape(-1, 3)
    return np.linalg.qr(found.T)[0].T


def _complement(vectors: Array) -> Array:
    """Return an orthonormal basis of the vectors normal to independent ones, by rows."""
    return np.linalg.svd(vectors, full_matrices=True)[2][len(vectors) :]


def _vector(a: Array) -> Vector:
    x, y, z = a.tolist()
    return x, y, z


def _normal(pair: Array) -> Vector:
    """Return the normal of two vectors, shape (2, 3)."""
    x, y, z = cross(*map(vec, pair.tolist()))
    return x, y, z


def _require_affordable(joint: Joint, rows: int, columns: int) -> None:
    """Refuse loops whose rows take longer than `LONGEST`."""
    seconds = DENSE_WORK * rows * columns * min(rows, columns)
    if seconds > LONGEST:
        raise SolveError(
            f"{joint} closes a loop among {columns // 6} bodies, whose {rows} rows, known within"
            f" digits, would be compared for some {seconds / 60.0:.0f} minutes; take out what does"
            " not take part, or give all digits"
        )


def _extend_span(span: Array, rows: Array) -> Array:
    """Return an orthonormal basis of a span and further rows."""
    _, sizes, basis = np.linalg.svd(without(rows, span), full_matrices=False)
    return np.concatenate([span, basis[sizes > RANK_TOLERANCE]])


def parts_of_columns(formulation: Cartesian, matrix: Array) -> list[int]:
    """Return the part of each column: rows tie bodies of one part alone."""
    parts = [*range(matrix.shape[1])]
    for first in formulation.columns.values():
        parts[first : first + COLUMNS] = [first] * COLUMNS
    for row in matrix:
        tied = {parts[k] for k in np.flatnonzero(row).tolist()}
        if len(tied) > 1:
            first = min(tied)
            parts = [first if part in tied else part for part in parts]
    return parts
