"""The model that steppers of free motion read: plain data of a tree, its loops and its loads.

A stepper is a script without kincheck (`stepper_loop`), so that it is its own reproducer. The model
holds what its calls need: bodies with their hinges, slides and balls, parents first; ties, which
close loops in a tree; and joints with the rows to keep, for absolute coordinates. Every body's
frame is the global frame at design.

A hinge at the end of a loop is one tied point where a second on its axis adds no independent row,
as in a plane, else two. Joints keep all their rows in the tree, and at the ends of loops as many as
are independent of each other at design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from ...core.errors import UnsupportedError
from ...core.joints import (
    Cylindrical,
    Distance,
    Fixed,
    Joint,
    Revolute,
    Spherical,
    Translational,
    Universal,
)
from ...core.joints.base import triad
from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.loads import Axes, Force, SpringDamper, Torque
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ...core.trajectory import Array
from ..shared.constraints import skew
from ..shared.tree_plan import Chain, Closure, Link, ends_of, plan_tree

Plain: TypeAlias = dict[str, Any]

KEPT: Mapping[type[Joint], str] = {
    Cylindrical: "110110",
    Distance: "",
    Fixed: "111111",
    Revolute: "111110",
    Spherical: "111000",
    Translational: "110111",
    Universal: "",
}
"""Rows of a joint in its frame, z along its axis: three of translations, three of rotations. A
distance and a universal joint have other rows.
"""
TIED = (Revolute, Spherical, Distance)
"""Joints to be closed by ties of points."""

# Rows below this part of the largest depend on the others, as for `structure.redundancy`.
DEPENDENT = 1e-9


def stepper_model(mechanism: Mechanism, twists: Mapping[str, Array]) -> Plain:
    """Return the model of a mechanism as plain data, SI units.

    Args:
        twists: angular velocity and velocity of the material point at the origin by moving body, at
            the start, global axes [rad/s, m/s], shape (6,).

    Raises:
        UnsupportedError: no tree of the known joints with tied points has this motion.
    """
    mechanism = replace(mechanism, drivers=())
    _require_known(mechanism)
    carrying = [joint.name for joint in mechanism.joints if not isinstance(joint, TIED)]
    parts = [*plan_tree(mechanism, whole=TIED, first=carrying)]
    cut = [each.joint for each in parts if isinstance(each, Closure)]
    for joint in cut:
        if not isinstance(joint, TIED):
            raise UnsupportedError(f"{joint} closes a loop, and no tie of points replaces it")
    chains = {
        each.child: replace(each, parent=_carrier(mechanism, each.parent))
        for each in parts
        if isinstance(each, Chain)
    }
    for name, chain in chains.items():
        if chain.joint is None:
            raise UnsupportedError(f"body {name!r} has no joint that carries it")
    moves = {name: [link for _, link, *_ in each.each()] for name, each in chains.items()}
    jacobians, first = dict[str, Array](), 0
    total = sum(_columns(each).shape[1] for each in moves.values())
    for name, chain in chains.items():
        own = _columns(moves[name])
        found = jacobians.get(chain.parent, np.zeros((6, total))).copy()
        found[:, first : first + own.shape[1]] = own
        jacobians[name], first = found, first + own.shape[1]
    nothing = np.zeros((6, total))

    def relative(joint: Joint) -> Array:
        return jacobians.get(joint.j, nothing) - jacobians.get(joint.i, nothing)

    ties, kept, rows = list[Plain](), dict[str, list[int]](), np.zeros((0, total))
    length = _length(mechanism)
    for joint in cut:
        ties += _ties(mechanism, joint, relative(joint), length)
    for joint in mechanism.joints:
        flags = [*map(int, KEPT[type(joint)])]
        if joint in cut and any(flags):
            for k, row in enumerate(_rows(mechanism, joint, relative(joint))):
                more = np.vstack([rows, row])
                flags[k] *= int(_rank(more) > len(rows))
                rows = more if flags[k] else rows
        kept[joint.name] = flags
    return {
        "name": mechanism.name,
        "gravity": [*mechanism.gravity],
        "bodies": [
            _body(mechanism.body(name), chains[name], moves[name], twists)
            for name in _depth_first({name: each.parent for name, each in chains.items()})
        ],
        "ties": ties,
        "joints": [
            {
                "name": joint.name,
                "type": joint.type,
                "bodies": _ends(mechanism, joint),
                "points": [[*P] for P in ends_of(mechanism, joint)],
                "frame": _frame(joint).tolist(),
                "rows": kept[joint.name],
            }
            for joint in mechanism.joints
        ],
        "springs": [
            {
                "bodies": [_carrier(mechanism, name) for name in each.bodies],
                "points": [[*P] for P in each.points],
                "stiffness": each.stiffness,
                "damping": each.damping,
                "free_length": each.free_length,
            }
            for each in mechanism.forces
            if isinstance(each, SpringDamper)
        ],
        "loads": [
            {
                "body": each.body,
                "point": [*(each.point if isinstance(each, Force) else (0.0, 0.0, 0.0))],
                "force": [*each.vector] if isinstance(each, Force) else [0.0, 0.0, 0.0],
                "torque": [*each.vector] if isinstance(each, Torque) else [0.0, 0.0, 0.0],
            }
            for each in mechanism.forces
            if isinstance(each, Force | Torque) and not mechanism.is_fixed(each.body)
        ],
        "points": _points(mechanism),
    }


def _require_known(mechanism: Mechanism) -> None:
    for joint in mechanism.joints:
        if type(joint) not in KEPT:
            raise UnsupportedError(f"{joint}: steppers have no such joint")
    for coupler in mechanism.couplers:
        raise UnsupportedError(f"{coupler}: steppers have no constraint between coordinates")
    for each in mechanism.forces:
        constant = isinstance(each, Force | Torque) and each.frame is Axes.GLOBAL
        linear = isinstance(each, SpringDamper) and not each.curve
        if not (constant or linear):
            raise UnsupportedError(f"{each}: steppers have only constant loads and linear springs")
    for body in mechanism.moving:
        if body.mass == 0.0 or body.inertia is None:
            raise UnsupportedError(f"body {body.name!r} has no mass or no inertia")


def _carrier(mechanism: Mechanism, name: str) -> str:
    return GROUND if mechanism.is_fixed(name) else name


def _ends(mechanism: Mechanism, joint: Joint) -> list[str]:
    return [_carrier(mechanism, name) for name in joint.bodies]


def _columns(moves: list[Link]) -> Array:
    """Return the twists of unit rates: angular velocity over velocity at the origin, shape (6,
    coordinates).
    """
    found = list[Array]()
    for each in moves:
        axes = np.eye(3) if each.move == "ball" else np.array([each.axis])
        for axis in axes:
            turning = [axis, np.cross(np.array(each.point), axis)]
            found.append(np.concatenate([0 * axis, axis] if each.move == "slide" else turning))
    return np.array(found).T.reshape(6, -1)


def _at(P: Vector, twist: Array) -> Array:
    """Return the velocity of a point."""
    return twist[3:] - skew(np.array(P)) @ twist[:3]


def _rank(rows: Array) -> int:
    sizes = np.linalg.svd(rows, compute_uv=False)
    return int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())


def _frame(joint: Joint) -> Array:
    """Return the axes of a joint's rows as rows, shape (3, 3)."""
    axis = vars(joint).get("axis")
    return np.eye(3) if axis is None else np.array([[*each] for each in triad(axis)])


def _rows(mechanism: Mechanism, joint: Joint, twist: Array) -> Array:
    frame = _frame(joint)
    return np.vstack([frame @ _at(ends_of(mechanism, joint)[0], twist), frame @ twist[:3]])


def _length(mechanism: Mechanism) -> float:
    """Return a fourth of the mechanism's extent [m]: the distance of two points on a hinge."""
    points = np.array([P for joint in mechanism.joints for P in ends_of(mechanism, joint)])
    return 0.25 * float(np.ptp(points, axis=0).max()) or 1.0


def _ties(mechanism: Mechanism, joint: Joint, twist: Array, length: float) -> list[Plain]:
    ends, bodies = ends_of(mechanism, joint), _ends(mechanism, joint)
    made: Plain = {"joint": joint.name, "bodies": bodies}
    if isinstance(joint, Distance):
        return [{**made, "points": [[*P] for P in ends], "length": joint.rod_length}]
    points = [np.array(ends[0])]
    if isinstance(joint, Revolute):
        axis = _frame(joint)[2]
        both = [points[0] - 0.5 * length * axis, points[0] + 0.5 * length * axis]
        one, two = (np.vstack([_at((*P,), twist) for P in each]) for each in (points, both))
        points = both if _rank(two) > _rank(one) else points
    return [{**made, "points": [P.tolist()] * 2, "length": 0.0} for P in points]


def _depth_first(parents: Mapping[str, str]) -> list[str]:
    """Return the bodies so that each follows its parent or what the parent carries: Pinocchio needs
    consecutive numbers in a subtree.
    """
    found = list[str]()
    waiting = [GROUND]
    while waiting:
        name = waiting.pop()
        found.append(name)
        waiting += [child for child in reversed([*parents]) if parents[child] == name]
    return found[1:]


def _body(body: Body, chain: Chain, moves: list[Link], twists: Mapping[str, Array]) -> Plain:
    relative = twists[body.name] - twists.get(chain.parent, np.zeros(6))
    assert body.inertia is not None
    assert chain.joint is not None
    columns = _columns(moves)
    rates = np.linalg.lstsq(columns, relative)[0] if columns.size else np.zeros(0)
    return {
        "name": body.name,
        "parent": chain.parent,
        "joint": chain.joint.name,
        "second": chain.sign > 0,
        "moves": [
            {"kind": each.move, "axis": [*each.axis], "point": [*each.point]} for each in moves
        ],
        "rates": rates.tolist(),
        "twist": twists[body.name].tolist(),
        "mass": body.mass,
        "center": [*body.center],
        "inertia": inertia_matrix(body.inertia).tolist(),
    }


def _points(mechanism: Mechanism) -> list[Plain]:
    """Return the points to compare: those of the case, and those of joints on each moving body."""
    named = [(each.name, each.body, each.position) for each in mechanism.points]
    for joint in mechanism.joints:
        for body, P in zip(joint.bodies, ends_of(mechanism, joint), strict=True):
            named.append((f"{joint.name} on {body}", body, P))
    return [
        {"name": name, "body": body, "position": [*P]}
        for name, body, P in named
        if not mechanism.is_fixed(body)
    ]
