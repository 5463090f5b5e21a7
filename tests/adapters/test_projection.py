"""The walk that the simulators share: what it must not accept."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import JointAngle, Revolute, Sine, SolveError
from kincheck.adapters.shared.projection import solve_by_projection
from kincheck.core.case.case import Sweep

from ..support.engine_motion import installed, mechanism_of, motion_case
from ..support.examples import examples
from ..support.mechanisms import ORIGIN, X, Z

(MISSING,) = examples(__file__, "missing")

CASE = motion_case(
    mechanism_of(
        [Revolute("pivot", "ground", "crank", ORIGIN, Z)],
        {"pin": ("crank", X)},
        [JointAngle("turn", "pivot")],
    ),
    np.linspace(0.0, 1.0, 21),
)


class Crank:
    """A crank and a second coordinate that no output sees; it is where `hidden` says, at a driver
    value.
    """

    def __init__(self, hidden):
        self.hidden, self.q, self.c = hidden, np.zeros(2), 0.0

    def reset(self):
        self.q = np.array([0.0, self.hidden(0.0)])

    def save(self):
        return self.q.copy()

    def restore(self, saved):
        self.q = saved.copy()

    def move(self, dx):
        self.q = self.q + dx

    def residual(self, c):
        return np.array([self.q[0] - c[0], self.q[1] - self.hidden(c[0])])

    def jacobian(self):
        return np.eye(2)

    def driver_columns(self):
        return np.array([[1.0], [0.0]])

    def bias(self, v):
        return np.zeros(2)

    def points(self, v, a):
        c, s = np.cos(self.q[0]), np.sin(self.q[0])
        return [
            (
                np.array([c, s, 0.0]),
                v[0] * np.array([-s, c, 0.0]),
                v[0] ** 2 * np.array([-c, -s, 0.0]),
            )
        ]


@pytest.mark.parametrize(
    ("beyond", "message"),
    [
        (1.0, ""),
        (-1.0, "jumps to another assembly; last reachable sample at turn = 0.5"),
        (np.nan, "last reachable sample at turn = 0.5"),
    ],
    ids=["steady", "jump", "nan"],
)
def test_projection_ends_at_hidden_jump(beyond, message):
    found = solve_by_projection(Crank(lambda c: 1.0 if c < 0.52 else beyond), CASE, 1e-12)
    reached = CASE.sweep.values < (0.52 if message else 2.0)
    assert found.solved.tolist() == reached.tolist()
    assert message in found.message
    assert bool(message) == bool(found.message)
    x = found.points["pin"].position[:, 0]
    assert np.abs(x - np.cos(CASE.sweep.values))[reached].max() <= 1e-15
    assert np.isnan(x[~reached]).all()


def test_undriven_freedom_is_refused():
    class Loose(Crank):
        def jacobian(self):
            return np.diag([1.0, 0.0])

    with pytest.raises(SolveError, match=r"1 of the 2 coordinates .* left free"):
        solve_by_projection(Loose(lambda c: 1.0), CASE, 1e-12)


def test_repeated_sample_out_of_reach():
    """No step between samples says how small a part of one may be."""
    case = replace(CASE, sweep=Sweep("turn", np.array([0.5, 0.5])))
    found = solve_by_projection(Crank(lambda c: 1.0), case, 1e-12)
    assert found.solved.all()
    assert (found.details["rank"], found.details["dof"], found.details["unknowns"]) == (2, 1, 2)
    jumps = solve_by_projection(Crank(lambda c: float(c > 0.25)), case, 1e-12)
    assert not jumps.solved.any()
    assert "no sample reached on this side" in jumps.message
    assert np.isnan(jumps.residual)


def test_unreachable_rates_at_first_sample():
    """The pose is reached on the way there, where the drivers move otherwise."""

    class Stuck(Crank):
        def bias(self, v):
            return np.full(2, np.nan if abs(v[0]) < 1e-9 else 0.0)

    case = replace(
        CASE,
        sweep=Sweep(
            "time", np.linspace(0.0, 1.0, 3), motions={"turn": Sine(0.5, 0.1, np.pi / 2.0)}
        ),
    )
    assert solve_by_projection(Crank(lambda c: 0.0), case, 1e-12).solved.all()
    found = solve_by_projection(Stuck(lambda c: 0.0), case, 1e-12)
    assert not found.solved.any()
    assert "its drivers cannot move there" in found.message


@pytest.mark.parametrize("defect", [1e-4, 1e-9])
@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("name", ["mujoco", "pinocchio", "exudyn"])
def test_near_parallelogram_keeps_its_branch(name, loops, defect):
    """Nearly a parallelogram: beside its change points, within parts of a step, the crossed linkage
    goes straight on.

    Between them the coupler and the rocker never are in line, and so the rocker's end stays on one
    side of the line between theirs. Of two on one crank, both fold at once, and the determinant of
    all rows keeps its sign.
    """
    engine, ground, coupler, rocker = installed(name), 3.0, 3.0, 1.0 + defect
    turns = np.linspace(0.0, 3.2, 17)
    pin = np.exp(1j * (0.7 + turns))
    apart = ground - pin
    along = 0.5 * (1.0 + (coupler**2 - rocker**2) / abs(apart) ** 2)
    truth = pin + (along - 1j * np.sqrt(coupler**2 / abs(apart) ** 2 - along**2)) * apart

    def place(z):
        return z.real, z.imag, 0.0

    joints = [Revolute("A", "ground", "crank", ORIGIN, Z)]
    for k in range(loops):
        joints += [
            Revolute(f"B {k}", "crank", f"coupler {k}", place(pin[0]), Z),
            Revolute(f"C {k}", f"coupler {k}", f"rocker {k}", place(truth[0]), Z),
            Revolute(f"D {k}", "ground", f"rocker {k}", place(ground), Z),
        ]
    points = {"P": ("coupler 0", place(truth[0]))}
    case = motion_case(mechanism_of(joints, points, [JointAngle("turn", "A")]), turns)
    found = engine.solve(engine.build(case), case, 1e-12)
    assert found.solved.all(), found.message
    P = found.points["P"].position
    np.testing.assert_allclose(P[:, 0] + 1j * P[:, 1], truth, rtol=0, atol=1e-11)


class Doubled(Crank):
    """The driver's row once more, off by a gap, and its rates by a push."""

    def __init__(self, gap, push):
        super().__init__(lambda c: 0.0)
        self.gap, self.push = gap, push

    def residual(self, c):
        first, hidden = super().residual(c)
        return np.array([first, hidden, first + self.gap])

    def jacobian(self):
        return np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])

    def driver_columns(self):
        return np.array([[1.0], [0.0], [1.0]])

    def bias(self, v):
        return np.array([0.0, 0.0, self.push])


@pytest.mark.parametrize(
    ("gap", "push", "tol", "message"),
    MISSING,
)
def test_missing_design_pose_is_explained(gap, push, tol, message):
    found = solve_by_projection(Doubled(gap, push), CASE, tol)
    assert found.solved.all() == (not message)
    assert found.message.startswith(message)
    assert bool(found.message) == bool(message)
