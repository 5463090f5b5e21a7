"""Every joint type against the paper's unsimplified equations, on its manifold: row space,
right-hand sides, freedoms.

The joints are discovered; a type without an example here, or without its equations in naive.JOINTS,
fails. Rows may differ from the exact ones where a joint has others to make up for it; what must
agree is what they forbid.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from kincheck import (
    Body,
    Joint,
    JointAngle,
    Mechanism,
    MechanismError,
    Point,
    PointCoordinate,
    SolveError,
    solve,
)
from kincheck.core import joints as library
from kincheck.core.algebra import Quat, Vec3
from kincheck.core.joints import Attachment
from kincheck.core.joints.base import direction, position
from kincheck.core.primitives import Pose, Twist

from ..oracles import naive
from ..support.examples import examples
from ..support.mechanisms import ORIGIN, X, Y, Z

(EXAMPLES,) = examples(__file__, "examples")

P, Q = (0.3, -0.2, 0.5), (0.9, 0.4, 0.1)
AXIS = (1.0, 2.0, -0.5)
SQUARE = ((1.0, 1.0, 0.0), (1.0, -1.0, 3.0))
NAMES = ("joint", "first", "second")

"""Geometry by type, in the order of the fields."""


def example(name):
    return Joint.registry[name](*NAMES, *EXAMPLES[name])


TYPES = sorted(
    name for name, joint in Joint.registry.items() if joint.__module__.startswith(library.__name__)
)


def product(p, q):
    """Quaternion product of Euler parameters."""
    return np.r_[p[0] * q[0] - p[1:] @ q[1:], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]


def random_body(rng):
    p = rng.normal(size=4)
    return naive.Body(rng.normal(size=3), p / np.linalg.norm(p))


def moved(body, step):
    """The body after (dr, dpi') along the straight line in r and p; complex steps differentiate."""
    return naive.Body(body.r + step[:3], body.p + naive.p_rate(body.p, step[3:]))


def jacobian(residual, i, j):
    """Derivative of a residual (i, j) by (dr_i, dpi_i', dr_j, dpi_j'), by complex steps."""
    steps = 1e-30j * np.eye(12)
    return np.column_stack(
        [residual(moved(i, step[:6]), moved(j, step[6:])).imag / 1e-30 for step in steps]
    )


class Example:
    """A joint between two bodies that have moved together, and a little against each other as the
    joint lets them.
    """

    def __init__(self, name, seed, against=0.4):
        assert name in EXAMPLES, f"joint type {name!r} is not tested: add it to EXAMPLES here"
        assert name in naive.JOINTS, (
            f"joint type {name!r} is not tested: add its unsimplified equations to naive.JOINTS"
        )
        rng = np.random.default_rng([seed, TYPES.index(name)])
        self.joint = example(name)
        self.i0, self.j0 = random_body(rng), random_body(rng)
        common = random_body(rng)
        self.i, j = (
            naive.Body(common.r + common.A @ b.r, product(common.p, b.p))
            for b in (self.i0, self.j0)
        )
        step = against * rng.normal(size=6)
        for _ in range(20):  # off by a random step, then back to the manifold by the shortest ones
            j = moved(j, step)
            j = naive.Body(j.r, j.p / np.linalg.norm(j.p))
            step = -np.linalg.pinv(jacobian(self.residual, self.i, j)[:, 6:]) @ self.residual(
                self.i, j
            )
            if np.abs(step).max() < 1e-14:
                break
        self.j = j

    def residual(self, i, j):
        return naive.joint_residuals(self.joint, self.i0, self.j0, i, j)

    @property
    def primitives(self):
        return self.joint.primitives(*(Attachment(Vec3(*body.r)) for body in (self.i0, self.j0)))

    @property
    def poses(self):
        """The native poses: displacement and rotation since design."""
        found = []
        for before, now in ((self.i0, self.i), (self.j0, self.j)):
            e0, *e = product(now.p, before.p * [1, -1, -1, -1])
            found.append(Pose.of(Vec3(*(now.r - before.r)), Quat(e0, Vec3(*e))))
        return found

    @property
    def rows(self):
        """The native rows over the paper's unknowns."""
        blocks = [
            [*row.ri, *(self.i.A.T @ [*row.pi]), *row.rj, *(self.j.A.T @ [*row.pj])]
            for row in self.each("rows")
        ]
        return np.array(blocks)

    def each(self, method, *arguments):
        return [
            value
            for primitive in self.primitives
            for value in getattr(primitive, method)(*self.poses, *arguments)
        ]

    def gamma(self, v):
        """Native right-hand sides at the paper's velocities."""
        motions = [
            Twist(Vec3(*v[k : k + 3]), Vec3(*(b.A @ v[k + 3 : k + 6])))
            for k, b in ((0, self.i), (6, self.j))
        ]
        return np.array(self.each("gamma", *motions))


moved_together = cache(Example)
"""Examples that no test changes."""


def threaded(example):
    """The last of the naive rows of a screw couples its coordinates, which is no primitive of the
    joint.
    """
    return len(getattr(example.joint, "relations", ()))


@pytest.mark.by_day(3)
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", TYPES)
def test_joint_rows_span_paper_rows(name, seed):
    """On the manifold: native residuals vanish, the branch is the intended one, and the rows span
    the exact ones.
    """
    example = moved_together(name, seed)
    assert np.abs(example.residual(example.i, example.j)).max() < 1e-14
    assert np.abs(example.each("phi")).max() < 1e-14
    assert min(example.each("branch"), default=1.0) > 0.0
    exact = jacobian(example.residual, example.i, example.j)
    exact = exact[: len(exact) - threaded(example)]
    native = example.rows
    assert native.shape == exact.shape
    # singular values of sound joints are of the size of their arms
    assert np.linalg.svd(native, compute_uv=False).min() > 1e-2
    for one, other in ((native, exact), (exact, native)):
        assert np.abs(one - one @ np.linalg.pinv(other) @ other).max() < 1e-13
    assert example.joint.rows == len(native) + threaded(example)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", TYPES)
def test_joint_gamma_equals_paper_acceleration(name, seed):
    """Any admissible velocity, any acceleration with rows . acceleration = gamma: the exact second
    derivative vanishes.
    """
    example = moved_together(name, seed)
    rows, rng = example.rows, np.random.default_rng(seed)
    free = np.eye(12) - np.linalg.pinv(rows) @ rows
    v = free @ rng.normal(size=12)
    a = np.linalg.pinv(rows) @ example.gamma(v) + free @ rng.normal(size=12)
    path = naive.along(
        {
            "i": (example.i.r, example.i.p, v[:6], a[:6]),
            "j": (example.j.r, example.j.p, v[6:], a[6:]),
        }
    )
    phi, phi_t, phi_tt = naive.taylor(lambda t: example.residual(path(t)["i"], path(t)["j"]))
    held = len(phi) - threaded(example)
    assert np.abs(phi_t[:held]).max() < 1e-13
    assert np.abs(phi_tt[:held]).max() < 1e-11


@pytest.mark.parametrize("name", TYPES)
def test_joint_freedoms_complement_rows(name):
    joint = example(name)
    left = 6 - joint.rows
    # those of a screw are two names for one freedom; a distance joint names none, as nothing drives
    # them
    assert len(joint.freedoms) == (
        0 if name == "distance" else left + len(getattr(joint, "relations", ()))
    )


@pytest.mark.parametrize(
    "annotation", ["tuple[float, float, float]", "Vector", tuple[float, float, float]]
)
def test_joint_field_without_kind_is_refused(annotation):
    """Else it were taken for a number, and no specimen but its default tried."""
    body = {"__annotations__": {"axis": annotation}, "axis": Z, "freedoms": ("rotation",)}
    with pytest.raises(
        MechanismError, match=r"Mine: axis holds several numbers, .*; declare it as axis: ... = pos"
    ):
        type("Mine", (Joint,), body)
    kept = {
        "__annotations__": {"axis": annotation, "known": "ClassVar[tuple[str, ...]]"},
        "axis": direction(),
        "known": (),
    }
    assert issubclass(type("Mine", (Joint,), kept), Joint)


def test_joint_without_measure_is_undrivable(monkeypatch):
    monkeypatch.setattr(Joint, "registry", {**Joint.registry})  # other tests try all that are known

    @dataclass(frozen=True)
    class Unmeasured(Joint):
        """A hinge that names its freedom, and does not say how it is measured."""

        type = "unmeasured"
        freedoms = ("rotation",)
        point: tuple[float, float, float] = position()
        axis: tuple[float, float, float] = direction()

        def primitives(self, i, j):
            return library.Revolute(self.name, self.i, self.j, self.point, self.axis).primitives(
                i, j
            )

    hinge, point = (Unmeasured("h", "ground", "a", ORIGIN, Z), Point("p", "a", X))
    with pytest.raises(
        SolveError,
        match=(
            r"driver 't' \(joint_angle\): joint 'h' is unmeasured, which measures no .*AxialJoint"
        ),
    ):
        solve(Mechanism("m", [Body("a")], [hinge], [point], [JointAngle("t", "h")]), "t", [0.0])
    driven = Mechanism("m", [Body("a")], [hinge], [point], [PointCoordinate("t", "p", Y)])
    assert solve(driven, "t", [0.5]).points["p"].position[0] == pytest.approx(
        [0.75**0.5, 0.5, 0.0], abs=1e-15
    )
