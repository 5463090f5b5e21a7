"""Ground rows: the paper's count keeps fixed bodies; eliminating them changes nothing."""

import numpy as np
import pytest
from kincheck.core.kinematics.formulation.cartesian import Cartesian
from kincheck.core.kinematics.formulation.constraints import Constraint, constraints, frames
from kincheck.core.kinematics.one_design import solve
from kincheck.core.kinematics.structure.redundancy import independent_rows
from kincheck.core.mechanism.mechanism import GROUND
from kincheck.core.primitives import Drive, Ground, Twist

from ..support.mechanisms import mcpherson
from .test_freedom import jacobian

# Ground rows: the paper's count keeps fixed bodies; eliminating them changes nothing


def with_ground_rows(mechanism, drives):
    held = [
        Constraint(body.name, Ground(), GROUND, body.name)
        for body in mechanism.bodies
        if body.fixed
    ]
    return Cartesian(
        [*held, *constraints(mechanism, frames(mechanism), drives)],
        [body.name for body in mechanism.bodies],
    )


def test_ground_rows_keep_rank():
    """Formulation section 10: 30 columns, 29 rows and the driver, rank 29 without it."""
    formulation = with_ground_rows(mcpherson(), {})
    J = jacobian(formulation, formulation.configuration(formulation.design))
    assert J.shape == (30, 30)
    singular = np.linalg.svd(J[:29], compute_uv=False)
    assert singular[-1] > 1e-3
    assert len(independent_rows(J[:29], 0)) == 29


def test_ground_rows_keep_solution():
    """Newton's iteration on all 30 unknowns, dense and by numpy, against the sweep of 18."""
    stroke, mechanism = 0.05, mcpherson()
    unit = frames(mechanism).unit
    formulation = with_ground_rows(mechanism, {"stroke": Drive(stroke / unit, 1.0 / unit)})
    at = formulation.configuration(formulation.design)
    for _ in range(8):
        step = np.linalg.solve(jacobian(formulation, at), -np.array(formulation.phi(at)))
        at = formulation.configuration(formulation.retract(at, list(step)))
    assert np.abs(formulation.phi(at)).max() < 1e-15
    v = np.linalg.solve(jacobian(formulation, at), formulation.nu(at))
    a = np.linalg.solve(jacobian(formulation, at), formulation.gamma(at, list(v)))
    arm = frames(mechanism).arm("knuckle", mechanism.point("wheel").position)
    pose, motion = at.poses["knuckle"], formulation.twists(at, list(v))["knuckle"]
    rest = formulation.accelerations(at, list(v), list(a))["knuckle"]
    S = pose.turn(arm)
    expected = (
        np.add([*(unit * (pose.u + pose.swing(arm)))], mechanism.point("wheel").position),
        [*(unit * motion.of(S))],
        [*(unit * (Twist(rest.v_t, rest.w_t).of(S) + motion.centripetal(S)))],
    )
    wheel = solve(mechanism, "stroke", [stroke]).points["wheel"]
    for found, wanted in zip(
        (wheel.position[0], wheel.velocity[0], wheel.acceleration[0]), expected, strict=True
    ):
        assert found == pytest.approx(wanted, rel=1e-14, abs=1e-14)
    for fixed in ("chassis", "rack"):
        assert np.abs([*at.poses[fixed].u]).max() < 1e-15
