"""Arguments that are no numbers, or complex ones, whose imaginary part would be lost: refused by name, by every function."""

import numpy as np
import pytest
from kincheck.core import (
    Body,
    Distance,
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

from .mechanisms import mcpherson

VALUES = np.linspace(-0.01, 0.01, 3)
NO_NUMBERS = (None, "x", 1j, np.complex128(1.0), np.array([1.0 + 0.0j]), [1.0, 2.0])
BALL = {"joints.ball.point": np.array([[1.0, 0.5, 0.1]])}


@pytest.mark.parametrize("number", NO_NUMBERS, ids=repr)
def test_one_number(number):
    for who, argument, call in (
        ("solve", "rate", lambda: solve(mcpherson(), "stroke", VALUES, rate=number)),
        ("solve", "tol", lambda: solve(mcpherson(), "stroke", VALUES, tol=number)),
        ("solve", "order", lambda: solve(mcpherson(), "stroke", VALUES, order=number)),
        ("solve_designs", "rate", lambda: solve_designs(mcpherson(), "stroke", VALUES, BALL, rate=number)),
        ("assemble", "tol", lambda: assemble(mcpherson(), {}, tol=number)),
        ("find_assemblies", "tol", lambda: find_assemblies(mcpherson(), {}, tol=number)),
        ("trace", "tol", lambda: trace(mcpherson(), "stroke", tol=number)),
        ("trace", "length", lambda: trace(mcpherson(), "stroke", length=number)),
    ):
        with pytest.raises(SolveError, match=f"^{who}: {argument} is "):
            call()


@pytest.mark.parametrize("numbers", [VALUES + 0j, "x", ["a"], [[1.0], [2.0, 3.0]]], ids=["complex", "text", "texts", "ragged"])
def test_several_numbers(numbers):
    ball = {"joints.ball.point": numbers}
    poses = {mcpherson().moving[0].name: (numbers, np.array([1.0, 0.0, 0.0, 0.0]))}
    for message, call in (
        ("solve: values are .*, expected numbers", lambda: solve(mcpherson(), "stroke", numbers)),
        ("solve_designs: values are .*, expected numbers", lambda: solve_designs(mcpherson(), "stroke", numbers, BALL)),
        ("solve_designs: joints.ball.point are ", lambda: solve_designs(mcpherson(), "stroke", VALUES, ball)),
        ("assemble: origin r of body .* are ", lambda: assemble(mcpherson(), poses)),
        ("find_assemblies: origin r of body .* are ", lambda: find_assemblies(mcpherson(), poses)),
    ):
        with pytest.raises(SolveError, match=f"(?s)^{message}"):
            call()


def test_an_order_is_a_whole_number_of_any_kind():
    assert solve(mcpherson(), "stroke", VALUES, order=np.float64(1.0)).points["wheel"].acceleration is None
    assert solve_designs(mcpherson(), "stroke", VALUES, BALL, order=np.float64(1.0)).points["wheel"].acceleration is None


def test_descriptions_of_complex_numbers():
    for call in (
        lambda: Body("a", origin=(0.0, 0.0, 1j)),
        lambda: Point("p", "a", (0.0, np.complex128(1.0), 0.0)),
        lambda: Revolute("r", "ground", "a", point=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1j)),
        lambda: Distance("d", "ground", "a", points=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), length=1j),
    ):
        with pytest.raises(MechanismError, match="is not finite; give a "):
            call()
