"""The McPherson strut against its 40-digit reference and against the paper's unsimplified
equations; what is asked is computed.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from kincheck.core import (
    Body,
    Distance,
    Fixed,
    Mechanism,
    Point,
    Revolute,
    Translational,
    Universal,
)
from kincheck.core.joints import Cylindrical, Screw
from kincheck.core.kinematics.formulation.constraints import Style
from kincheck.core.kinematics.one_design import solve

from ..oracles import naive
from ..support.mechanisms import four_bar, mcpherson, slider_crank, swapped

STROKES = np.linspace(-0.08, 0.08, 161)
MOVING = ("lca", "knuckle", "strut")


@cache
def reference():
    """Columns by name, shape (161,) each."""
    table = np.genfromtxt(
        Path(__file__).parents[1] / "data" / "mcpherson_reference.csv",
        delimiter=",",
        names=True,
        skip_header=2,
    )
    assert table.shape == (161,)
    return {name: table[name] for name in table.dtype.names}


@cache
def solution(style="native"):
    found = solve(mcpherson(), "stroke", STROKES, bodies=MOVING, style=style)
    assert found.solved.all()
    return found


def deviation(found, *columns):
    return np.abs(found - np.column_stack([reference()[name] for name in columns])).max()


# Against the reference


@pytest.mark.parametrize("style", [style.value for style in Style])
def test_wheel_against_reference(style):
    """Round-off of numbers near one, amplified by the condition (36) and the second derivatives (3
    1/m).
    """
    wheel = solution(style).points["wheel"]
    assert deviation(wheel.position, "x_W", "y_W", "z_W") <= 5e-16
    assert deviation(wheel.velocity[:, :2], "vx", "vy") <= 1e-14
    assert deviation(wheel.acceleration[:, :2], "ax", "ay") <= 1e-13
    assert np.abs(wheel.velocity[:, 2] - 1.0).max() <= 1e-15
    assert np.abs(wheel.acceleration[:, 2]).max() <= 1e-14


@pytest.mark.parametrize("style", [style.value for style in Style])
def test_knuckle_against_reference(style):
    """The body's own frame, in the paper's variables: its origin is the wheel centre."""
    knuckle = solution(style).bodies["knuckle"]
    assert deviation(knuckle.r, "x_W", "y_W", "z_W") <= 5e-16
    assert deviation(knuckle.p, "e0", "e1", "e2", "e3") <= 1e-15
    assert np.abs(np.linalg.norm(knuckle.p, axis=1) - 1.0).max() <= 5e-16


def test_strut_iterations_and_residual():
    found = solution()
    assert found.iterations.max() <= 4
    assert found.iterations.min() >= 1
    assert found.residual <= 1e-15
    assert found.message == ""


# Against the unsimplified equations


def universal_chain():
    """A crank that drives, through a universal joint, a shaft askew, with a plate welded on."""
    return Mechanism(
        "cardan",
        [
            Body("crank", (0.1, 0.2, 0.3), (0.5, 0.5, -0.5, 0.5)),
            Body("shaft", (0.0, 0.3, 1.5)),
            Body("plate", (0.2, 0.0, 2.0)),
        ],
        [
            Revolute("in", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Universal(
                "cross", "crank", "shaft", (0.0, 0.0, 1.0), ((1.0, 0.0, 0.0), (0.0, 0.8, -0.6))
            ),
            Revolute("out", "shaft", "ground", (0.0, 0.6, 1.8), (0.0, 0.6, 0.8)),
            Fixed("weld", "shaft", "plate"),
        ],
        [Point("tip", "plate", (0.3, 0.5, 2.0))],
        [replace(four_bar().driver("turn"), joint="in")],
    )


def jack():
    """A nut on a screw askew, and a slider that it moves by a rod."""
    return Mechanism(
        "jack",
        [
            Body("screw", (0.1, 0.0, 0.2)),
            Body("nut", (0.5, 0.1, 0.0), (0.8, 0.0, 0.6, 0.0)),
            Body("slider", (1.5, 0.4, 0.0)),
        ],
        [
            Revolute("bearing", "ground", "screw", (0.0, 0.0, 0.0), (1.0, 0.2, 0.1)),
            Screw("thread", "screw", "nut", (0.3, 0.06, 0.03), (1.0, 0.2, 0.1), 0.15),
            Cylindrical("keeper", "ground", "nut", (0.0, 0.3, 0.0), (1.0, 0.2, 0.1)),
            Distance("rod", "nut", "slider", ((0.4, 0.1, 0.1), (1.4, 0.4, 0.0))),
            Translational("guide", "ground", "slider", (1.5, 0.4, 0.0), (1.0, 0.5, 0.0)),
        ],
        [Point("end", "slider", (1.5, 0.4, 0.0))],
        [replace(four_bar().driver("turn"), joint="bearing")],
    )


SWEEPS = {
    "jack": (jack, "turn", np.linspace(-8.0, 6.0, 3)),
    "mcpherson": (mcpherson, "stroke", np.linspace(-0.08, 0.06, 3)),
    "slider_crank": (slider_crank, "turn", np.linspace(-4.0, 9.0, 3)),
    "four_bar": (four_bar, "turn", np.linspace(-4.0, 9.0, 3)),
    "universal_chain": (universal_chain, "turn", np.linspace(-4.0, 9.0, 3)),
}


# Every mechanism in every style; each mechanism and each style as given, and swapped.
WRITTEN = [
    pytest.param(
        name,
        swapped if (row + column) % 2 else None,
        style.value,
        id=f"{name}-{'swapped' if (row + column) % 2 else 'as given'}-{style}",
    )
    for row, name in enumerate(SWEEPS)
    for column, style in enumerate(Style)
]


@pytest.mark.parametrize(("name", "write", "style"), WRITTEN)
def test_paper_equations_hold(name, write, style):
    """Residuals of all joints at the solved poses, and their first two derivatives by time along r,
    p, v and a.

    omega' and its derivative enter through pdot and pddot: another frame or sign of theirs would
    show. All joints hold undriven, so every derivative is zero; redundant rows are among them.
    """
    make, driver, values = SWEEPS[name]
    mechanism = write(make()) if write else make()
    found = solve(
        mechanism,
        driver,
        values,
        rate=1.3,
        bodies=[body.name for body in mechanism.moving],
        style=style,
    )
    assert found.solved.all()
    for k in range(len(values)):
        path = naive.along(naive.sample(found, k))
        phi, phi_t, phi_tt = naive.taylor(lambda t, path=path: naive.residuals(mechanism, path(t)))
        # some roundings of coordinates of 2 m
        assert np.abs(naive.residuals(mechanism, path(0.0))).max() <= 4e-15
        assert np.abs(phi).max() <= 4e-15
        # speeds reach 4 m/s, accelerations 10 m/s^2; the circle of 0.1 s costs one and two digits
        assert np.abs(phi_t).max() <= 1e-13
        assert np.abs(phi_tt).max() <= 1e-11


def test_paper_equations_find_wrong_rates():
    """The check above has teeth: omega' in the wrong frame or with the wrong sign breaks it by
    orders of magnitude.
    """
    mechanism, found = mcpherson(), solution()
    r, p, v, a = naive.sample(found, 0)["knuckle"]
    A = naive.A(p)
    for wrong in (A @ v[3:], -v[3:]):
        bodies = naive.sample(found, 0) | {"knuckle": (r, p, np.r_[v[:3], wrong], a)}
        assert (
            np.abs(
                naive.taylor(lambda t, b=bodies: naive.residuals(mechanism, naive.along(b)(t)))[1]
            ).max()
            > 1e-2
        )
    bodies = naive.sample(found, 0) | {"knuckle": (r, p, v, np.r_[a[:3], A @ a[3:]])}
    assert (
        np.abs(naive.taylor(lambda t: naive.residuals(mechanism, naive.along(bodies)(t)))[2]).max()
        > 1e-2
    )


def test_points_follow_bodies():
    """Position, velocity and acceleration of a point by the bodies' r, p, omega' alone."""
    mechanism, found = mcpherson(), solution()
    arm = naive.arm(naive.design(mechanism)["knuckle"], mechanism.point("rod_end").position)
    for k in range(0, 161, 20):
        r, p, v, a = naive.sample(found, k)["knuckle"]
        A, w, w_t = naive.A(p), naive.tilde(v[3:]), naive.tilde(a[3:])
        rod_end = found.points["rod_end"]
        assert rod_end.position[k] == pytest.approx(r + A @ arm, abs=5e-16)
        assert rod_end.velocity[k] == pytest.approx(v[:3] + A @ w @ arm, abs=5e-15)
        assert rod_end.acceleration[k] == pytest.approx(a[:3] + A @ (w_t + w @ w) @ arm, abs=5e-14)
