"""More than one driver: those that are not swept hold their design value."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import JointDisplacement, Translational
from kincheck.core.kinematics.one_design import solve

from ..oracles import naive
from ..support.mechanisms import mcpherson

STROKES = np.linspace(-0.08, 0.08, 33)


def steered():
    """The strut with a rack that can slide."""
    base = mcpherson()
    rack = Translational("rack_guide", "chassis", "rack", (1.14, 0.0, 0.1455), (0.0, 1.0, 0.0))
    bodies = [replace(body, fixed=body.name == "chassis") for body in base.bodies]
    return replace(
        base,
        bodies=bodies,
        joints=[*base.joints, rack],
        drivers=[*base.drivers, JointDisplacement("steer", "rack_guide")],
    )


def test_held_driver_keeps_value():
    held = solve(steered(), "stroke", STROKES)
    fixed = solve(mcpherson(), "stroke", STROKES)
    assert np.abs(held.points["wheel"].position - fixed.points["wheel"].position).max() <= 5e-16
    assert (
        np.abs(held.points["wheel"].acceleration - fixed.points["wheel"].acceleration).max()
        <= 1e-13
    )


def test_driven_displacement():
    """Steering with the stroke held: the rack moves as driven, all joints hold, the wheel keeps its
    height.
    """
    mechanism, values = steered(), np.linspace(-0.03, 0.05, 9)
    found = solve(
        mechanism, "steer", values, rate=0.2, bodies=[body.name for body in mechanism.moving]
    )
    assert found.solved.all()
    rack = found.bodies["rack"]
    assert rack.r - (1.14, 0.0, 0.1455) == pytest.approx(
        np.outer(values, (0.0, 1.0, 0.0)), abs=1e-16
    )
    assert rack.v == pytest.approx(np.tile((0.0, 0.2, 0.0, 0.0, 0.0, 0.0), (9, 1)), abs=1e-15)
    assert np.abs(found.points["wheel"].position[:, 2] - 0.101).max() <= 2e-16
    for k in range(len(values)):
        path = naive.along(naive.sample(found, k))
        parts = naive.taylor(lambda t, path=path: naive.residuals(mechanism, path(t)))
        assert [
            np.abs(part).max() < limit
            for part, limit in zip(parts, (2e-15, 1e-13, 1e-11), strict=True)
        ] == [True] * 3


def test_drivers_in_either_order():
    """Stroke at a steered design and steering at a stroked one pass through the same pose."""
    corner = {}
    for first, second, a, b in (("stroke", "steer", 0.03, 0.02), ("steer", "stroke", 0.02, 0.03)):
        at = moved_to(steered(), first, a)
        corner[first] = solve(at, second, [b]).points["rod_end"].position[0]
    assert corner["stroke"] == pytest.approx(corner["steer"], abs=1e-14)


def moved_to(mechanism, driver, value):
    """The mechanism as designed at another driver value: points and axes taken along with their
    bodies.
    """
    found = solve(mechanism, driver, [value], bodies=[body.name for body in mechanism.moving])
    before = naive.design(mechanism)
    now = before | {name: naive.Body(each.r[0], each.p[0]) for name, each in found.bodies.items()}

    def carried(body, point):
        return tuple(now[body].r + now[body].A @ naive.arm(before[body], point))

    def turned(body, axis):
        return tuple(now[body].A @ before[body].A.T @ np.array(axis))

    joints = []
    for joint in mechanism.joints:
        changes = {}
        if hasattr(joint, "point"):
            changes["point"] = carried(joint.i, joint.point)
        if hasattr(joint, "axis"):
            changes["axis"] = turned(joint.i, joint.axis)
        if hasattr(joint, "points"):
            changes["points"] = tuple(
                carried(*each) for each in zip(joint.bodies, joint.points, strict=True)
            )
        joints.append(replace(joint, **changes))
    bodies = [
        replace(b, origin=tuple(now[b.name].r), euler_parameters=tuple(now[b.name].p))
        for b in mechanism.bodies
    ]
    points = [
        replace(point, position=carried(point.body, point.position)) for point in mechanism.points
    ]
    return replace(mechanism, bodies=bodies, joints=joints, points=points)
