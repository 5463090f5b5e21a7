"""One mechanism solved as one program, component by component, and as one sparse system."""

import math

from kincheck.core import Body, Inline, JointAngle, Mechanism, Point, Revolute, Spherical
from kincheck.core.kinematics import Method, NativeSolver

LEAN = 0.3
"""Angle of the cranks at design [rad]."""


def solve_as(method, mechanism, path, points=(), bodies=(), order=2, tol=1e-12, *, compiled=True):
    """Solve a mechanism over a path by a method."""
    solver = NativeSolver(order=order, compiled=compiled, method=method)
    return solver.prepare(mechanism, path, points, bodies)(tol)


def solve_sparse(mechanism, path, points=(), bodies=(), **settings):
    """Solve a mechanism over a path as one sparse system."""
    return solve_as(Method.SPARSE, mechanism, path, points, bodies, **settings)


def solve_components(mechanism, path, points=(), bodies=(), **settings):
    """Solve a mechanism over a path component by component."""
    return solve_as(Method.BY_COMPONENTS, mechanism, path, points, bodies, **settings)


def torus(rows, columns):
    """Return a torus of parallel unit cranks, and the pivot of one far from the driven one.

    Every plate but the first holds a ball of its crank, and by two pins the tips of the cranks to
    the right and above, around the edges. Every crank turns like the first. There are poses where
    several singular values vanish together, so the determinant keeps its sign.
    """

    def folded(k, n):
        return 2.0 * k if 2 * k < n else 2.0 * (n - k) - 1.0

    cranks = [(i, j) for i in range(rows) for j in range(columns)]
    at = {(i, j): (folded(i, rows), 1.37 * folded(j, columns)) for i, j in cranks}
    tip = {k: (x + math.sin(LEAN), y + math.cos(LEAN), 0.0) for k, (x, y) in at.items()}
    up = (0.0, 0.0, 1.0)
    joints = [Revolute(f"pivot{k}", "ground", f"crank{k}", (*at[k], 0.0), up) for k in cranks]
    for i, j in cranks[1:]:
        k = i, j
        joints.append(Spherical(f"ball{k}", f"crank{k}", f"plate{k}", tip[k]))
        for name, to, height in (
            ("right", ((i + 1) % rows, j), 1.0),
            ("above", (i, (j + 1) % columns), 0.25),
        ):
            x, y, _ = tip[to]
            joints.append(Inline(f"{name}{k}", f"crank{to}", f"plate{k}", (x, y, height), up))
    bodies = [Body(f"crank{k}") for k in cranks] + [Body(f"plate{k}") for k in cranks[1:]]
    far = rows // 2, columns // 2
    points = [Point("tip", f"crank{far}", tip[far])]
    drivers = [JointAngle("turn", "pivot(0, 0)")]
    return Mechanism(f"torus {rows} x {columns}", bodies, joints, points, drivers), at[far]
