"""Large mechanisms by the front door: how they are solved, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import (
    Body,
    Gear,
    JointDisplacement,
    Mechanism,
    Point,
    Revolute,
    SolveError,
    Spherical,
    Translational,
    Universal,
    solve,
    solve_designs,
)
from kincheck.core.kinematics.blocks.sparse_lanes import SparseLanes
from kincheck.core.kinematics.formulation.parameters import placed
from kincheck.core.studies.bench.size import ring

from ..support.mechanisms import Z, errors, solve_all
from .test_sparse_choice import four_bar, pin_meeting


@pytest.mark.parametrize("cranks", [12, 24])
def test_undriven_ring_names_freedom(cranks):
    with pytest.raises(SolveError, match=r"1 degree of freedom .* but 0 drivers; .*crank"):
        solve(replace(ring(cranks), drivers=()), "turn", [0.0])


def test_designs_of_large_ring():
    """What is known of sigma of many variants at once leaves all samples of such a ring in doubt.
    Designs that end early say why.
    """
    whole, turn, order = ring(21), np.array([0.1, -0.2, 0.0]), 1
    (hinge,) = (joint.point for joint in whole.joints if joint.name == "pivot0")
    hinges = np.array(hinge) + [[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]
    found = solve_designs(whole, "turn", turn, {"joints.pivot0.point": hinges}, order=order)
    assert found.solved.all()
    assert found.messages == {}
    for k, at in enumerate(hinges.tolist()):
        alone = solve(placed(whole, {"joints.pivot0.point": at}), "turn", turn, order=order)
        motion, own = found.points["tip12"], alone.points["tip12"]
        assert (errors(own, (motion.position[k], motion.velocity[k])) <= 1e-13).all()
        assert motion.acceleration is None
    # the same programs
    found = solve_designs(whole, "turn", [0.1, 3.0], {"joints.pivot0.point": [hinge]}, order=order)
    assert found.solved.tolist() == [[True, False]]
    assert "cannot be followed beyond turn = " in found.messages[0]


def test_gear_on_large_ring():
    """As one program 47 bodies take seventeen seconds to be made ready."""
    whole = ring(24)
    geared = replace(
        whole,
        bodies=[*whole.bodies, Body("wheel")],
        joints=[*whole.joints, Revolute("shaft", "ground", "wheel", (-2.0, 0.0, 0.0), Z)],
        points=[Point("rim", "wheel", (-1.0, 0.0, 0.0))],
        couplers=[Gear("gear", ("shaft", "pivot12"), ratio=-2.0)],
    )
    turn = np.linspace(-0.4, 0.4, 9)
    found = solve_all(geared, "turn", turn)
    assert "factor_entries" in found.details
    s, c, o = np.sin(-2.0 * turn), np.cos(-2.0 * turn), 0.0 * turn
    expected = np.column_stack([c - 2.0, s, o]), -2.0 * np.column_stack([-s, c, o])
    assert (errors(found.points["rim"], expected) <= [1e-14, 1e-13]).all()


@pytest.mark.parametrize(("rod", "end"), [(1.000001, 2.0), (0.99999, 1.098176)])
def test_sparse_kite_beside_corner(rod, end):
    """On the driven crank of a ring a kite on its side, on hinges: three rows more than are
    needed.
    """
    sizes, start, turn = (1.0, 1.2, rod, 1.2), -1.1, np.linspace(0.0, 1.6, 9)
    _, meet = pin_meeting(*sizes, start + turn)
    found = solve(four_bar(sizes, start, "hinges", 22), "turn", turn)
    assert "factor_entries" in found.details
    assert found.solved.sum() >= 6
    assert not found.solved[turn > end].any()
    assert np.abs(found.points["meet"].position - meet)[found.solved].max() < 1e-12
    assert found.solved.all() or "singular pose ahead" in found.message


def stretched(crank, rod, angle):
    """A crank that its slider drives towards the stretched rod, with 42 wheels on it; and where the
    slider begins.
    """
    pin = (crank * np.cos(angle), crank * np.sin(angle), 0.0)
    begin = pin[0] + np.sqrt(rod**2 - pin[1] ** 2)
    wheels = [f"w{k}" for k in range(42)]
    whole = Mechanism(
        "stretched",
        bodies=[Body(name) for name in ("crank", "rod", "slider", *wheels)],
        joints=[
            Revolute("turn", "ground", "crank", (0.0, 0.0, 0.0), Z),
            Universal("pin", "crank", "rod", pin, (Z, (pin[1], begin - pin[0], 0.0))),
            Spherical("end", "rod", "slider", (begin, 0.0, 0.0)),
            Translational("guide", "ground", "slider", (begin, 0.0, 0.0), (1.0, 0.0, 0.0)),
            *(
                Revolute(f"axle {name}", "ground", name, (0.01 * k, 0.2, 0.0), Z)
                for k, name in enumerate(wheels)
            ),
        ],
        points=[Point("pin", "crank", pin)],
        drivers=[JointDisplacement("push", "guide")],
        couplers=[
            Gear(f"mesh {name}", (f"axle {name}", f"axle w{k - 1}" if k else "turn"), -1.0)
            for k, name in enumerate(wheels)
        ],
    )
    return whole, begin


@pytest.mark.parametrize(
    ("short", "solved"), [(1e-2, True), (1e-3, True), (1e-7, False), (1e-9, False)]
)
def test_sparse_rates_beside_dead_centre(short, solved):
    """Rates were off by up to 3e-6 of their own. The crank's angle follows from the slider's place
    by a triangle.
    """
    crank, rod = 0.5, 1.5
    mechanism, begin = stretched(crank, rod, 0.3)
    (value,) = values = [(crank + rod - begin) * (1.0 - short)]
    found = solve(mechanism, "push", values)
    assert "factor_entries" in found.details
    assert found.solved.tolist() == [solved]
    if not solved:
        assert (
            "refused at 1 sample so near a singular pose that residuals leave the pose or its"
            " rates uncertain" in found.message
        )
        return
    x = begin + value
    cosine = (crank**2 - rod**2 + x**2) / (2.0 * crank * x)
    rate = -(x - crank * cosine) / (crank * x * np.sqrt(1.0 - cosine**2))
    at = crank * np.array([cosine, np.sqrt(1.0 - cosine**2), 0.0])
    np.testing.assert_allclose(found.points["pin"].position[0], at, rtol=0, atol=1e-12)
    expected = rate * np.array([-at[1], at[0], 0.0])
    np.testing.assert_allclose(
        found.points["pin"].velocity[0], expected, rtol=0, atol=1e-9 * abs(rate)
    )


def test_refused_samples_name_worst():
    mechanism, begin = stretched(0.5, 1.5, 0.3)
    nearest, near = values = (2.0 - begin) * (1.0 - np.array([1e-9, 1e-7]))
    message = solve(mechanism, "push", values).message
    assert "refused at 2 samples" in message
    assert f"(at push = {nearest:.9g})" in message
    assert f"(at push = {near:.9g})" not in message


def test_nan_error_bound_refuses_sample(monkeypatch):
    """Wherever it stands: Python's own maximum passes over what is no number."""
    mechanism, begin = stretched(0.5, 1.5, 0.3)
    values = [(2.0 - begin) * (1.0 - 1e-7)]
    for found in (np.nan, np.inf):
        bounds = lambda lanes, state, *_, found=found: np.full(state.shape[1], found)  # noqa: E731
        monkeypatch.setattr(SparseLanes, "error_bounds", bounds)
        assert not solve(mechanism, "push", values).solved.any()
    bounds = lambda lanes, state, *_: np.zeros(state.shape[1])  # noqa: E731
    monkeypatch.setattr(SparseLanes, "error_bounds", bounds)
    assert solve(mechanism, "push", values).solved.all()
