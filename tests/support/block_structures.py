"""One mechanism solved as one program, component by component, and as one sparse system."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import Body, Inline, JointAngle, Mechanism, Point, Revolute, Spherical
from kincheck.core.kinematics import Method, NativeSolver

from .mechanisms import Z, chain


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


def with_one_program(method, mechanism, path, points=()):
    """Solve a mechanism over a path by a method and as one program, all bodies included."""
    bodies = tuple(body.name for body in mechanism.moving)
    return [
        solve_as(each, mechanism, path, points, bodies) for each in (method, Method.ONE_PROGRAM)
    ]


def assert_alike(found, expected):
    """Assert that two motions are one but for round-off."""
    assert found.solved.all(), found.message
    assert expected.solved.all()
    for name, motion in expected.bodies.items():
        # two orders of elimination: round-off of one times the condition, once more for each
        # derivative (library: below 100)
        for label, limit in (("r", 1e-14), ("p", 1e-14), ("v", 1e-13), ("a", 3e-12)):
            assert (
                np.abs(getattr(found.bodies[name], label) - getattr(motion, label)).max() <= limit
            )
    for name, motion in expected.points.items():
        assert np.abs(found.points[name].acceleration - motion.acceleration).max() <= 3e-12
    assert [found.details[name] for name in ("rank", "dof")] == [
        expected.details[name] for name in ("rank", "dof")
    ]


def chain_of_hinges(loops):
    """Return a chain of four-bars whose joints are all hinges: three redundant rows a loop."""
    made = chain(loops)
    hinges = [Revolute(each.name, *each.bodies, each.point, Z) for each in made.joints]
    return replace(made, joints=hinges)


def torus(rows, columns):
    """Return a torus of parallel unit cranks, and the pivot of one far from the driven one.

    Every plate but the first holds a ball of its crank, and by two pins the tips of the cranks to
    the right and above, around the edges. Every crank turns like the first. There are poses where
    several singular values vanish together, so the determinant keeps its sign.
    """

    size = pytest.importorskip("kincheck.core.extensions.laboratory.bench.size")
    cranks = [(i, j) for i in range(rows) for j in range(columns)]
    at = {(i, j): (size.pivot(i, rows), 1.37 * size.pivot(j, columns)) for i, j in cranks}
    tip = {k: (x + math.sin(size.LEAN), y + math.cos(size.LEAN), 0.0) for k, (x, y) in at.items()}
    joints = [Revolute(f"pivot{k}", "ground", f"crank{k}", (*at[k], 0.0), Z) for k in cranks]
    for i, j in cranks[1:]:
        k = i, j
        joints.append(Spherical(f"ball{k}", f"crank{k}", f"plate{k}", tip[k]))
        for name, to, height in (
            ("right", ((i + 1) % rows, j), 1.0),
            ("above", (i, (j + 1) % columns), 0.25),
        ):
            x, y, _ = tip[to]
            joints.append(Inline(f"{name}{k}", f"crank{to}", f"plate{k}", (x, y, height), Z))
    bodies = [Body(f"crank{k}") for k in cranks] + [Body(f"plate{k}") for k in cranks[1:]]
    far = rows // 2, columns // 2
    points = [Point("tip", f"crank{far}", tip[far])]
    drivers = [JointAngle("turn", "pivot(0, 0)")]
    return Mechanism(f"torus {rows} x {columns}", bodies, joints, points, drivers), at[far]
