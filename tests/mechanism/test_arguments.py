"""Arguments that are no numbers, or complex ones, whose imaginary part would be lost: refused by
name, by every function.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    MechanismError,
    Point,
    Revolute,
    SolveError,
    assemble,
    find_assemblies,
    solve,
    solve_designs,
    trace,
)
from kincheck.core.mechanism.motions import Motion, Table

from ..kinematics.test_chain import chain
from ..support.mechanisms import mcpherson

VALUES = np.linspace(-0.01, 0.01, 3)
NO_NUMBERS = (None, "x", 1j, np.complex128(1.0), np.array([1.0 + 0.0j]), [1.0, 2.0])
BALL = {"joints.ball.point": np.array([[1.0, 0.5, 0.1]])}


@pytest.mark.parametrize("number", NO_NUMBERS, ids=repr)
def test_scalar_argument_of_wrong_kind(number):
    for who, argument, call in (
        ("solve", "rate", lambda: solve(mcpherson(), "stroke", VALUES, rate=number)),
        ("solve", "tol", lambda: solve(mcpherson(), "stroke", VALUES, tol=number)),
        ("solve", "order", lambda: solve(mcpherson(), "stroke", VALUES, order=number)),
        (
            "solve_designs",
            "rate",
            lambda: solve_designs(mcpherson(), "stroke", VALUES, BALL, rate=number),
        ),
        ("assemble", "tol", lambda: assemble(mcpherson(), {}, tol=number)),
        ("find_assemblies", "tol", lambda: find_assemblies(mcpherson(), {}, tol=number)),
        ("trace", "tol", lambda: trace(mcpherson(), "stroke", tol=number)),
        ("trace", "length", lambda: trace(mcpherson(), "stroke", length=number)),
    ):
        with pytest.raises(SolveError, match=f"^{who}: {argument} is "):
            call()


@pytest.mark.parametrize(
    "numbers",
    [VALUES + 0j, "x", ["a"], [[1.0], [2.0, 3.0]]],
    ids=["complex", "text", "texts", "ragged"],
)
def test_array_argument_of_wrong_kind(numbers):
    ball = {"joints.ball.point": numbers}
    poses = {mcpherson().moving[0].name: (numbers, np.array([1.0, 0.0, 0.0, 0.0]))}
    for message, call in (
        ("solve: values are .*, expected numbers", lambda: solve(mcpherson(), "stroke", numbers)),
        (
            "solve_designs: values are .*, expected numbers",
            lambda: solve_designs(mcpherson(), "stroke", numbers, BALL),
        ),
        (
            "solve_designs: joints.ball.point are ",
            lambda: solve_designs(mcpherson(), "stroke", VALUES, ball),
        ),
        ("assemble: origin r of body .* are ", lambda: assemble(mcpherson(), poses)),
        ("find_assemblies: origin r of body .* are ", lambda: find_assemblies(mcpherson(), poses)),
    ):
        with pytest.raises(SolveError, match=f"(?s)^{message}"):
            call()


def test_order_may_be_numpy_float():
    assert (
        solve(mcpherson(), "stroke", VALUES, order=np.float64(1.0)).points["wheel"].acceleration
        is None
    )
    assert (
        solve_designs(mcpherson(), "stroke", VALUES, BALL, order=np.float64(1.0))
        .points["wheel"]
        .acceleration
        is None
    )


def test_complex_coordinates_are_refused():
    for call in (
        lambda: Body("a", origin=(0.0, 0.0, 1j)),
        lambda: Point("p", "a", (0.0, np.complex128(1.0), 0.0)),
        lambda: Revolute("r", "ground", "a", point=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1j)),
        lambda: Distance("d", "ground", "a", points=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), length=1j),
    ):
        with pytest.raises(MechanismError, match="is not finite; give a "):
            call()


def test_values_and_offset_motion_are_exclusive():
    table = {"rack": Table((0.0, 1.0), (0.001, 0.002))}
    found = solve(cases.load("mcpherson_steered").mechanism, "stroke", [], motions=table)
    assert found.solved.shape == (0,)
    assert found.message == ""


@dataclass(frozen=True)
class Held(Motion):
    """A motion that has no hash."""

    numbers: list[float]

    def at(self, t):
        return self.numbers[0] * t, np.full_like(t, self.numbers[0]), np.zeros_like(t)


def with_an_arm(loops):
    """A chain, and beside it an arm with a driver of its own."""
    there = chain(loops)
    return replace(
        there,
        bodies=[*there.bodies, Body("arm")],
        joints=[
            *there.joints,
            Revolute("shoulder", "ground", "arm", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
        ],
        points=[Point("hand", "arm", (1.0, 0.0, 1.0))],
        drivers=[*there.drivers, JointAngle("swing", "shoulder")],
    )


@pytest.mark.parametrize("loops", [1, 21], ids=["one program", "components"])
def test_mutable_arguments_are_read_each_call(loops):
    mechanism, turn, rate, numbers = (
        with_an_arm(loops),
        np.linspace(0.0, 0.4, 5),
        np.array(1.0),
        [0.5],
    )
    for _ in range(2):
        found = solve(mechanism, "turn", turn, rate=rate, motions={"swing": Held(numbers)})
        assert found.solved.all(), found.message
        swing = numbers[0] * turn / rate
        expected = np.column_stack([np.cos(swing), np.sin(swing), np.ones(5)])
        # round-off of numbers of size one
        np.testing.assert_allclose(found.points["hand"].position, expected, rtol=0.0, atol=1e-15)
        rate *= 4.0
        numbers[0] = 3.0


def test_name_argument_of_wrong_kind():
    for who, what, call in (
        ("solve", "points", lambda: solve(mcpherson(), "stroke", VALUES, points="ball")),
        ("solve", "bodies", lambda: solve(mcpherson(), "stroke", VALUES, bodies="lca")),
        (
            "solve_designs",
            "points",
            lambda: solve_designs(mcpherson(), "stroke", VALUES, BALL, points="ball"),
        ),
        ("trace", "points", lambda: trace(mcpherson(), "stroke", points="ball")),
        ("solve", "driver", lambda: solve(mcpherson(), None, VALUES)),
        ("trace", "driver", lambda: trace(mcpherson(), None)),
    ):
        with pytest.raises(SolveError, match=f"^{who}: {what} is .*, expected a "):
            call()


def test_mechanism_member_of_wrong_kind():
    body, hinge = Body("arm"), Revolute("hinge", "ground", "arm", (0, 0, 0), (0, 0, 1))
    for bodies, joints, found in (
        ([hinge], [body], "bodies has Revolute"),
        ("arm", [hinge], "bodies is 'arm', expected a list"),
        ([body], [hinge, None], "joints has None, expected a Joint"),
        ([body], hinge, "joints is Revolute"),
    ):
        with pytest.raises(MechanismError, match=f"^mechanism 'm': {found}"):
            Mechanism("m", bodies, joints)
