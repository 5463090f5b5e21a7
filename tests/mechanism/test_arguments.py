"""Arguments that are no numbers, or complex ones, whose imaginary part would be lost: refused by
name, by every function.
"""

import inspect
from dataclasses import dataclass, replace
from functools import partial

import kincheck
import numpy as np
import pytest
from kincheck import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    MechanismError,
    Point,
    Revolute,
    SolveError,
    Table,
    cases,
    solve,
)
from kincheck.core.mechanism.motions import Motion

from ..support.mechanisms import ORIGIN, X, Z, chain, mcpherson

VALUES = np.linspace(-0.01, 0.01, 3)
NO_NUMBERS = (None, "x", 1j, np.complex128(1.0), np.array([1.0 + 0.0j]), [1.0, 2.0])
BALL = {"joints.ball.point": np.array([[1.0, 0.5, 0.1]])}


ARGUMENTS = {
    "solve": ("stroke", VALUES),
    "solve_designs": ("stroke", VALUES, BALL),
    "assemble": ({},),
    "find_assemblies": ({},),
    "trace": ("stroke",),
}
FUNCTIONS = {name: getattr(kincheck, name) for name in ARGUMENTS if name in kincheck.__all__}
"""Those of extensions that are there, too."""
CALLS = {name: partial(each, mcpherson(), *ARGUMENTS[name]) for name, each in FUNCTIONS.items()}


@pytest.mark.parametrize("number", NO_NUMBERS, ids=repr)
@pytest.mark.parametrize(
    "name",
    [
        f"{who} {argument}"
        for who in CALLS
        for argument in ("rate", "tol", "order", "length")
        if argument in inspect.signature(CALLS[who]).parameters
    ],
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
    for who, message, *rest in (
        ("solve", "values are .*, expected numbers", "stroke", numbers),
        ("solve_designs", "values are .*, expected numbers", "stroke", numbers, BALL),
        ("solve_designs", "joints.ball.point are ", "stroke", VALUES, ball),
        ("assemble", "origin r of body .* are ", poses),
        ("find_assemblies", "origin r of body .* are ", poses),
    ):
        if who in FUNCTIONS:
            with pytest.raises(SolveError, match=f"(?s)^{who}: {message}"):
                FUNCTIONS[who](mcpherson(), *rest)


@pytest.mark.parametrize("who", [each for each in ("solve", "solve_designs") if each in CALLS])
def test_order_may_be_numpy_float(who):
    assert CALLS[who](order=np.float64(1.0)).points["wheel"].acceleration is None


def test_complex_coordinates_are_refused():
    at, off = ORIGIN, (0.0, np.complex128(1.0), 1j)
    for call in (
        partial(Body, "a", origin=off),
        partial(Point, "p", "a", off),
        partial(Revolute, "r", "ground", "a", point=at, axis=off),
        partial(Distance, "d", "ground", "a", points=(at, X), length=1j),
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
        joints=[*there.joints, Revolute("shoulder", "ground", "arm", Z, Z)],
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
    for who, argument, *given in (
        ("solve", "points", *ARGUMENTS["solve"]),
        ("solve", "bodies", *ARGUMENTS["solve"]),
        ("solve_designs", "points", *ARGUMENTS["solve_designs"]),
        ("trace", "points", *ARGUMENTS["trace"]),
        ("solve", "driver", None, VALUES),
        ("trace", "driver", None),
    ):
        named = {} if argument == "driver" else {argument: "ball"}
        if who in FUNCTIONS:
            with pytest.raises(SolveError, match=f"^{who}: {argument} is .*, expected a "):
                FUNCTIONS[who](mcpherson(), *given, **named)


def test_mechanism_member_of_wrong_kind():
    body, hinge = Body("arm"), Revolute("hinge", "ground", "arm", ORIGIN, Z)
    for bodies, joints, found in (
        ([hinge], [body], "bodies has Revolute"),
        ("arm", [hinge], "bodies is 'arm', expected a list"),
        ([body], [hinge, None], "joints has None, expected a Joint"),
        ([body], hinge, "joints is Revolute"),
    ):
        with pytest.raises(MechanismError, match=f"^mechanism 'm': {found}"):
            Mechanism("m", bodies, joints)
