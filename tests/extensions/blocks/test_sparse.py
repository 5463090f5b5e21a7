"""Large mechanisms as one sparse system: the motions that one program gives, rings of any size, and
refusals with names.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    JointAngle,
    Mechanism,
    Ramp,
    Revolute,
    Sine,
    SolveError,
    Translational,
    solve,
)
from kincheck.core.extensions.blocks.components import components, describe_components
from kincheck.core.extensions.blocks.numbers_of import structure
from kincheck.core.extensions.blocks.sparse_lanes import SparseLanes
from kincheck.core.extensions.blocks.sparse_lu import Pattern
from kincheck.core.extensions.laboratory.bench.size import LEAN, pivot, ring
from kincheck.core.kinematics import Method
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.motion_solver import ONE_PROGRAM
from kincheck.core.mechanism.motions import Path
from scipy.sparse import linalg

from ...support.block_structures import assert_alike, solve_as, solve_sparse, with_one_program
from ...support.loaded_slider_crank import loaded
from ...support.mechanisms import ORIGIN, Z, crank_tip, errors, four_bar, gears, mcpherson


def turning(*values, rate=1.0):
    return Path({"turn": Ramp(rate)}, np.array(values))


def test_sparse_couplers():
    held = Translational("held", "ground", "nut", (1.0, 0.1, 0.5), Z)
    m = gears()
    mechanism = replace(m, joints=[*m.joints, held], drivers=m.drivers[:1])
    path = turning(*np.linspace(-3.0, 3.0, 25))
    found, expected = with_one_program(Method.SPARSE, mechanism, path, ("tooth", "top"))
    assert_alike(found, expected)
    # the pinion makes half the turns, the nut a lead for each
    assert np.ptp(found.points["top"].position[:, 2]) == pytest.approx(
        6.0 / 2.0 * 0.02 / (2.0 * np.pi), rel=1e-12
    )


def test_sparse_start_beyond_travel():
    steep = Path({"stroke": Sine(0.5, 0.01, 1.0)}, np.zeros(1))
    assert solve_sparse(mcpherson(), steep).message.startswith(
        "on the way to the first sample: cannot be followed beyond"
    )


CRANK = Mechanism(
    "crank",
    [Body("b")],
    [Revolute("axle", "ground", "b", ORIGIN, Z)],
    (),
    [JointAngle("turn", "axle")],
)


def test_sparse_step_is_limited():
    path = turning(6.0 * np.pi + 0.3)
    found = solve_sparse(CRANK, path, (), ["b"])  # an odd number of turns changes the sign
    assert found.bodies["b"].p[0] == pytest.approx(
        [-np.cos(0.15), 0.0, 0.0, -np.sin(0.15)], abs=1e-14
    )
    lanes = SparseLanes(CRANK, Request(("turn",), ()))
    lanes.solve_near(lanes.design, 1e-12)
    lanes.set_prediction_start(0.0, path)
    here = lanes.anchor(0.0)
    lanes.restore(
        replace(
            here,
            pose=(
                replace(here.pose[0], slopes=np.full_like(here.pose[0].sigmas, 1e-3)),
                here.pose[1],
            ),
        )
    )
    for time, accepted in ((0.9, True), (1.1, False)):
        assert (lanes.attempt(np.array([time]), path)[0] > 0.0) == accepted
    assert "too long to be believed" in str(lanes.failure(1e-12))


@pytest.mark.parametrize("cranks", [9, 120])
def test_ring_of_any_size(cranks):
    """Of a ring of 17 bodies as one program, whose samples are beyond doubt, and of a large one as
    a sparse system.
    """
    turn = np.linspace(-0.8, 0.8, 17)
    found = solve(ring(cranks), "turn", turn)
    assert found.solved.all(), found.message
    assert found.residual <= 1e-15
    assert ("factor_entries" in found.details) == (2 * cranks - 1 > ONE_PROGRAM)
    # an angle is known to the sum of the round-offs on the way to it; each derivative multiplies it
    # again
    limits = cranks * np.array([1e-15, 1e-14, 1e-13])
    for k in range(cranks):
        expected = crank_tip(pivot(k, cranks), LEAN - turn)
        assert (errors(found.points[f"tip{k}"], expected) <= limits).all()


def test_ring_factors_grow_linearly():
    sizes = [len(part) for part in components(ring(20), frames(ring(20)))]
    assert sorted(sizes) == [1, 38]  # the driven crank, and all others
    small, large = (
        SparseLanes(ring(n), Request(("turn",), ())).details["factor_entries"] for n in (40, 160)
    )
    assert large < 4.4 * small


def test_ring_samples_are_factored_together(monkeypatch):
    calls, splu = [], linalg.splu
    monkeypatch.setattr(
        linalg, "splu", lambda *matrix, **how: (calls.append(1), splu(*matrix, **how))[1]
    )
    path = turning(*np.linspace(-0.8, 0.8, 64))
    together = solve_sparse(ring(9), path, ("tip4",))
    few = len(calls)
    alone = solve_sparse(ring(9), path, ("tip4",), compiled=False)
    # at the design position rows are chosen and an order is made; after that no pose is alone
    assert few < 16
    assert len(calls) - few > 64
    motion, expected = together.points["tip4"], alone.points["tip4"]
    assert np.abs(motion.position - expected.position).max() <= 1e-14
    assert np.abs(motion.acceleration - expected.acceleration).max() <= 3e-12


def test_factors_of_outgrown_order():
    """Two rows change places: by the order of the first matrix, multipliers of the others grow."""
    rows, columns = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    first = np.array([1.0, 0.5, 0.25, 1.0])
    entries = np.tile(first[:, None], 8)
    entries[0, 3:], entries[3, 7] = 1e-9, 0.0
    entries[2, 7] = 0.0
    pattern, lanes = Pattern(rows, columns, 2, np.arange(4), first), np.arange(8)
    b = np.arange(16.0).reshape(2, 8)
    for _ in range(20):  # the order of the others takes its place
        factors = pattern.factor_lanes(entries, lanes)
        assert factors.regular(lanes).tolist() == [0, 1, 2, 3, 4, 5, 6]
        found, signs = factors.solve(b), factors.signs(8)
        for k in range(7):
            matrix = entries[:, k].reshape(2, 2)
            assert found[:, k] == pytest.approx(np.linalg.solve(matrix, b[:, k]), rel=1e-14)
            assert signs[k] * signs[0] == np.sign(np.linalg.det(matrix))
        assert np.isnan([*found[:, 7], signs[7]]).all()


# What a sparse system does not solve, and the reason it gives by name


def test_sparse_wrong_branch_is_refused():
    lanes = SparseLanes(CRANK, Request(("turn",), ()))
    lanes.solve_near(lanes.design, 1e-12)
    lanes.set_prediction_start(0.0, turning(0.0))
    # half a turn about x: the axes are parallel, but opposite
    over = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    here = lanes.anchor(0.0)
    lanes.restore(replace(here, pose=(replace(here.pose[0], state=over), here.pose[1])))
    assert not lanes.attempt(np.zeros(1), turning(0.0))[0] > 0.0
    assert "wrong branch" in str(lanes.failure(1e-12))


def test_tilted_hinge_has_one_verdict():
    mechanism = four_bar()
    joints = [
        joint.changed(axis=(0.0, 1.0, 1e-3)) if joint.name == "D" else joint
        for joint in mechanism.joints
    ]
    for method in (Method.ONE_PROGRAM, Method.SPARSE):
        with pytest.raises(SolveError, match=r"0 degrees of freedom .* but 1 driver"):
            solve_as(method, replace(mechanism, joints=joints), turning(0.5))


def test_component_programs_ignore_masses():
    """Two loops alike but for their masses are one program."""
    light = loaded()
    heavy = replace(light, bodies=[replace(each, mass=7.0) for each in light.bodies], forces=())

    def programs(mechanism):
        """The structure of each component, with its numbers."""
        parts = components(mechanism, frames(mechanism))
        every = [each.name for each in mechanism.points], [each.name for each in mechanism.moving]
        numbers: list[list[float]] = [[] for _ in parts]
        found = describe_components(mechanism, parts, *every)
        return [
            (structure(each.section, own), own) for each, own in zip(found, numbers, strict=True)
        ]

    assert programs(heavy) == programs(light)
