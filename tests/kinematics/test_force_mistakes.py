"""Planted mistakes in forces: equilibrium and the balance of power find each."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.algebra import ZERO
from kincheck.core.kinematics.forces import equations
from kincheck.core.kinematics.forces import equations as demand
from kincheck.core.mechanism.loads import SpringDamper
from kincheck.core.primitives import GROUND_POSE, Pose, Twist
from kincheck.core.program import elimination

from ..oracles import newton_euler
from ..support.loads import loaded, pushes, solved, traced


def worst(mechanism, case, solve):
    """The largest wrench missing to the equilibrium of a body, as a part of the largest force.

    And the power that is missing, as a part of the largest power.
    """
    found = solve(mechanism, case)
    largest = max(np.abs(each.force).max() for each in found.forces.joints.values())
    k = len(case.sweep.values) // 3
    pushed = pushes(mechanism, found, k)
    for spring in mechanism.forces:
        ends = [
            newton_euler.carried(mechanism.body(name), found.bodies[name], k, point)
            for name, point in zip(spring.bodies, spring.points, strict=True)
        ]
        d = ends[1] - ends[0]
        length = np.linalg.norm(d)
        pull = spring.stiffness * (length - spring.free_length) * d / length
        for name, end, sign in zip(spring.bodies, ends, (1.0, -1.0), strict=True):
            pushed.setdefault(name, []).append((sign * pull, end, np.zeros(3)))
    left = newton_euler.left_over(mechanism, found, k, pushed)
    off = max(np.abs(part).max() for pair in left.values() for part in pair)
    return off / largest, np.abs(found.forces.power).max() / found.forces.largest_power.max()


def turned(change):
    """The inertia's part, with other poses."""
    return lambda right: (
        lambda body, at: right(body, replace(at, poses={k: change(v) for k, v in at.poses.items()}))
    )


MISTAKES = {
    "sign of gravity": (
        "equations.inertial",
        lambda right: lambda body, at, gravity: right(body, at, -gravity),
    ),
    "no gyroscopic term": (
        "demand.spin_change",
        lambda right: (
            lambda body, at: at.poses[body.name].turn(
                demand.inertia_of(body) @ demand.spin_of(body, at)[1]
            )
        ),
    ),
    "inertia that does not turn": ("demand.spin_change", turned(lambda pose: GROUND_POSE)),
    "inertia turned backwards": (
        "demand.spin_change",
        turned(lambda pose: Pose.of(pose.u, pose.q.conjugate())),
    ),
    "centre of mass at the origin": (
        "equations.inertial",
        lambda right: lambda body, at, g: right(replace(body, center_of_mass=body.origin), at, g),
    ),
    "moment about the wrong point": (
        "equations.ForceEquations._arm",
        lambda right: lambda self, joint, body: 0.0 * right(self, joint, body),
    ),
    "reaction on the wrong body": (
        "equations.ForceEquations.reaction",
        lambda right: lambda self, *rest: tuple(-each for each in right(self, *rest)),
    ),
    "sign of the effort": (
        "equations.ForceEquations.effort",
        lambda right: lambda self, *rest: -right(self, *rest),
    ),
    "no centripetal acceleration": (
        "equations.inertial",
        lambda right: (
            lambda body, at, g: right(
                body, replace(at, twists={k: Twist(v.v, ZERO) for k, v in at.twists.items()}), g
            )
        ),
    ),
    "spring that pushes": (
        "demand.spring",
        lambda right: (
            lambda each, at: replace(
                right(each, at), wrenches={k: -v for k, v in right(each, at).wrenches.items()}
            )
        ),
    ),
    "spring on one body": (
        "demand.spring",
        lambda right: (
            lambda each, at: replace(
                right(each, at), wrenches={each.j: right(each, at).wrenches[each.j]}
            )
        ),
    ),
    "elimination not transposed": (
        "elimination.Elimination.solve_transposed",
        lambda right: lambda self, c: self.solve(c),
    ),
}


def with_spring():
    case = cases.load("mcpherson_strut")
    mechanism = loaded(case.mechanism)
    ends = ((1.0, 0.5, 0.0), (0.99, 0.56, 0.5))
    spring = SpringDamper("spring", "lca", "strut", ends, 3e3, free_length=0.3)
    return case, replace(mechanism, forces=[spring])


@pytest.mark.parametrize("solve", [solved, traced])
def test_force_balance_without_mistake(solve):
    case, mechanism = with_spring()
    assert max(worst(mechanism, case, solve)) <= 1e-11


@pytest.mark.by_day(3)
@pytest.mark.parametrize("solve", [solved, traced])
@pytest.mark.parametrize("mistake", MISTAKES)
def test_force_balance_finds_planted_mistake(mistake, solve, monkeypatch):
    place, change = MISTAKES[mistake]
    module, *path = place.split(".")
    if module == "elimination" and solve is solved:
        return  # singular values do without
    owner = {"equations": equations, "demand": demand, "elimination": elimination}[module]
    for name in path[:-1]:
        owner = getattr(owner, name)
    monkeypatch.setattr(owner, path[-1], change(getattr(owner, path[-1])))
    case, mechanism = with_spring()
    assert max(worst(mechanism, case, solve)) > 1e-6
