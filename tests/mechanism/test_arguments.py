"""Arguments that are no numbers, or complex ones, whose imaginary part would be lost: refused by
name, by every function.
"""

from dataclasses import dataclass, replace
from functools import partial

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

from ..support.mechanisms import chain, mcpherson

VALUES = np.linspace(-0.01, 0.01, 3)
NO_NUMBERS = (None, "x", 1j, np.complex128(1.0), np.array([1.0 + 0.0j]), [1.0, 2.0])
BALL = {"joints.ball.point": np.array([[1.0, 0.5, 0.1]])}


CALLS = {
    "solve": partial(solve, mcpherson(), "stroke", VALUES),
    "solve_designs": partial(solve_designs, mcpherson(), "stroke", VALUES, BALL),
    "assemble": partial(assemble, mcpherson(), {}),
    "find_assemblies": partial(find_assemblies, mcpherson(), {}),
    "trace": partial(trace, mcpherson(), "stroke"),
}


@pytest.mark.parametrize("number", NO_NUMBERS, ids=repr)
@pytest.mark.parametrize(
    "name",
    ["solve rate", "solve tol", "solve order", "solve_designs rate", "assemble tol"]
    + ["find_assemblies tol", "trace tol", "trace length"],
)
def test_scalar_argument_of_wrong_kind(name, number):
    who, argument = name.split()
    with pytest.raises(SolveError, match=f"^{who}: {argument} is "):
        CALLS[who](**{argument: number})


@pytest.mark.parametrize(
    "numbers",
    [VALUES + 0j, "x", ["a"], [[1.0], [2.0, 3.0]]],
    ids=["complex", "text", "texts", "ragged"],
)
def test_array_argument_of_wrong_kind(numbers):
    ball = {"joints.ball.point": numbers}
    poses = {mcpherson().moving[0].name: (numbers, np.array([1.0, 0.0, 0.0, 0.0]))}
    for message, call, *rest in (
        ("solve: values are .*, expected numbers", solve, "stroke", numbers),
        ("solve_designs: values are .*, expected numbers", solve_designs, "stroke", numbers, BALL),
        ("solve_designs: joints.ball.point are ", solve_designs, "stroke", VALUES, ball),
        ("assemble: origin r of body .* are ", assemble, poses),
        ("find_assemblies: origin r of body .* are ", find_assemblies, poses),
    ):
        with pytest.raises(SolveError, match=f"(?s)^{message}"):
            call(mcpherson(), *rest)


@pytest.mark.parametrize("who", ["solve", "solve_designs"])
def test_order_may_be_numpy_float(who):
    assert CALLS[who](order=np.float64(1.0)).points["wheel"].acceleration is None


def test_complex_coordinates_are_refused():
    at, off = (0.0, 0.0, 0.0), (0.0, np.complex128(1.0), 1j)
    for call in (
        partial(Body, "a", origin=off),
        partial(Point, "p", "a", off),
        partial(Revolute, "r", "ground", "a", point=at, axis=off),
        partial(Distance, "d", "ground", "a", points=(at, (1.0, 0.0, 0.0)), length=1j),
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
        assert found.points["hand"].position == pytest.approx(expected, abs=1e-15)
        rate *= 4.0
        numbers[0] = 3.0


def test_name_argument_of_wrong_kind():
    for what, call in (
        ("solve: points", partial(CALLS["solve"], points="ball")),
        ("solve: bodies", partial(CALLS["solve"], bodies="lca")),
        ("solve_designs: points", partial(CALLS["solve_designs"], points="ball")),
        ("trace: points", partial(CALLS["trace"], points="ball")),
        ("solve: driver", partial(solve, mcpherson(), None, VALUES)),
        ("trace: driver", partial(trace, mcpherson(), None)),
    ):
        with pytest.raises(SolveError, match=f"^{what} is .*, expected a "):
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
