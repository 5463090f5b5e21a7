"""The built-in cases: their closed forms against the constraints solved and differentiated by
mpmath, and published values.
"""

from collections.abc import Callable, Sequence
from functools import cache

import mpmath as mp
import numpy as np
import pytest
from kincheck import cases
from kincheck.cases import four_bar, jet, rssr, spatial_slider_crank
from kincheck.core.case.case import Case, Output, Truth
from kincheck.core.errors import CaseError
from kincheck.core.joints import Distance

# Round-off of the closed forms, some dozen operations in double precision, is 1e-15 of the numbers
# they pass through.
ROUND_OFF = 1e-13


CLOSED_FORMS = {"four_bar": four_bar, "rssr": rssr, "spatial_slider_crank": spatial_slider_crank}
ANGLES = [0.3, 1.9, 3.5, 5.6]
IN_HOUSE = {"mcpherson_strut", "mcpherson_steered", "mcpherson_suspension"}


IN_HOUSE |= {
    "mcpherson_strut_loaded",
    "chrono_macpherson",
    "chrono_macpherson_cylindrical",
    "chrono_double_wishbone",
    "chrono_sedan_double_wishbone",
    "chrono_multi_link",
    "chrono_multi_link_bodies",
}


def test_case_names_and_truths():
    """Nobody publishes curves of suspensions: what the project computed for them must never read as
    validated.
    """
    found = {name: cases.load(name).truth for name in cases.names()}
    assert {name for name, truth in found.items() if truth is Truth.IN_HOUSE_ORACLE} == IN_HOUSE
    assert {truth for name, truth in found.items() if name not in IN_HOUSE} == {Truth.CLOSED_FORM}


def test_unknown_case_name_gets_suggestion():
    with pytest.raises(CaseError, match="did you mean 'four_bar'"):
        cases.load("fourbar")
    with pytest.raises(CaseError, match="not a built-in case"):
        cases.load("../cases/four_bar")


@pytest.mark.parametrize("name", cases.names())
def test_case_outputs_have_full_reference(name):
    case = cases.load(name)
    assert case.name == name
    assert list(case.reference) == [output.name for output in case.outputs]
    for output in case.outputs:
        series = case.reference[output.name]
        for values in (series.position, series.velocity, series.acceleration)[: output.orders]:
            assert values is not None
            assert values.shape == case.sweep.values.shape
            assert np.isfinite(values).all()


@pytest.mark.parametrize("name", cases.names())
def test_case_reference_at_design(name):
    case = cases.load(name)
    (design,) = np.flatnonzero(np.abs(case.sweep.change) < 1e-15)
    for output in (each for each in case.outputs if isinstance(each, Output)):
        position = (
            0.0
            if output.relative
            else np.dot(case.mechanism.point(output.point).position, output.direction)
        )
        # round-off of metres
        assert case.reference[output.name].position[design] == pytest.approx(position, abs=4e-15)


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_form_of_full_turn_closes(name):
    case = cases.load(name)
    assert case.sweep.change[[0, -1]].tolist() == pytest.approx([0.0, 2 * np.pi], abs=0)
    assert len(case.sweep.values) == 181
    for name in (each.name for each in case.outputs if isinstance(each, Output)):
        series = case.reference[name]
        assert series.velocity[-1] == pytest.approx(series.velocity[0], abs=1e-12)  # of 10 m/s
        assert np.ptp(series.position) > 0.02  # every output moves


# The same mechanisms once more, from the geometry in their case files: constraints solved by mpmath
# to 40 digits.

Points = dict[str, Sequence[mp.mpf]]


def vec(values):
    return mp.matrix([mp.mpf(value) for value in values])


def cross(a, b):
    return mp.matrix(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def dot(a, b):
    return (a.T * b)[0]


def turned(v, axis, angle):
    """Rodrigues' rotation formula."""
    n = axis / mp.norm(axis)
    return mp.cos(angle) * v + mp.sin(angle) * cross(n, v) + (1 - mp.cos(angle)) * dot(n, v) * n


def where(case, joint):
    return vec(case.mechanism.joint(joint).point)


def at(case, point):
    return vec(case.mechanism.point(point).position)


def solve_four_bar(case, angle, near):
    """Coupler pin: its distances from the crank pin and from the rocker's pivot, and its plane."""
    A, B, C, D = (
        where(case, joint) for joint in ("crank_pivot", "crank_pin", "coupler_pin", "rocker_pivot")
    )
    axis = vec(case.mechanism.joint("crank_pivot").axis)
    pin = A + turned(B - A, axis, angle)

    def closure(*x):
        X = mp.matrix(x)
        lengths = [dot(X - pin, X - pin) - dot(C - B, C - B), dot(X - D, X - D) - dot(C - D, C - D)]
        return [*lengths, dot(axis, X - D)]

    X = mp.matrix(mp.findroot(closure, near["coupler_pin"]))
    # the coupler's frame, along the coupler and across it in the plane
    frame, moved = [[side, cross(axis, side)] for side in (C - B, X - pin)]
    arm = at(case, "coupler_tip") - B
    tip = pin
    for before, now in zip(frame, moved, strict=True):
        tip += dot(arm, before) / dot(before, before) * now
    return {"coupler_pin": list(X), "coupler_tip": list(tip)}


def solve_rssr(case, angle, near):
    """Rocker's angle: the rod keeps its length."""
    rod = case.mechanism.joint("rod")
    assert isinstance(rod, Distance)
    pin = turned(vec(rod.points[0]), vec([0, 0, 1]), angle)
    O = where(case, "rocker_pivot")  # noqa: E741

    def moved(turn, point):
        return O + turned(at(case, point) - O, vec([1, 0, 0]), turn)

    def length(turn):
        arm = moved(turn, "rocker_pin") - pin
        return dot(arm, arm) - mp.mpf(rod.rod_length) ** 2

    design = at(case, "rocker_pin") - O
    guess = mp.atan2(near["rocker_pin"][2] - O[2], near["rocker_pin"][1] - O[1]) - mp.atan2(
        design[2], design[1]
    )
    turn = mp.findroot(length, guess)
    return {
        "crank_pin": list(pin),
        **{point: list(moved(turn, point)) for point in ("rocker_pin", "rocker_tip")},
    }


def solve_spatial_slider_crank(case, angle, near):
    """Slider: the conrod keeps its length; side point: distances from both ends, and the axes of
    the universal joint.
    """
    A, B, S = (where(case, joint) for joint in ("crank_pivot", "crank_pin", "gudgeon"))
    cross_axes = case.mechanism.joint("gudgeon").axes
    pin, X = A + turned(B - A, vec([1, 0, 0]), angle), vec([1, 0, 0])

    def length(x):
        return dot(pin - x * X, pin - x * X) - dot(B - S, B - S)

    slider = mp.findroot(length, near["slider"][0]) * X

    def universal(*a):
        """The axis on the conrod: of constant length and angle to the conrod, perpendicular to the
        axis on the slider.
        """
        axis, design = mp.matrix(a), vec(cross_axes[0])
        same = [dot(axis, axis) - dot(design, design), dot(axis, pin - slider) - dot(design, B - S)]
        return [*same, dot(axis, vec(cross_axes[1]))]

    axis = mp.matrix(mp.findroot(universal, (0, -2 * pin[2], 2 * pin[1])))
    frame, moved = [
        [u, a, cross(u, a)] for u, a in ((B - S, vec(cross_axes[0])), (pin - slider, axis))
    ]
    arm, side = at(case, "conrod_side") - S, slider
    for before, now in zip(frame, moved, strict=True):
        side += dot(arm, before) / dot(before, before) * now
    return {
        "slider": list(slider),
        "conrod_centre": list((slider + pin) / 2),
        "conrod_side": list(side),
    }


SOLVERS: dict[str, Callable[[Case, mp.mpf, Points], Points]] = {
    "four_bar": solve_four_bar,
    "rssr": solve_rssr,
    "spatial_slider_crank": solve_spatial_slider_crank,
}


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_forms_satisfy_constraints(name, angle):
    case, rate = cases.load(name), 1.7
    motion = CLOSED_FORMS[name].motion(jet.steady(np.array([angle]), rate))
    near = {point: [mp.mpf(each.x[0]) for each in xyz] for point, xyz in motion.items()}

    @cache
    def solved(t, prec):
        """All coordinates at a time, solved once with a precision: higher derivatives take more."""
        return SOLVERS[name](case, angle + rate * t, near)

    with mp.workdps(40):
        for point, xyz in motion.items():
            for k, closed in enumerate(xyz):

                def coordinate(t, point=point, k=k):
                    return solved(t, mp.mp.prec)[point][k]

                for order, found in enumerate((closed.x, closed.v, closed.a)):
                    expected = float(mp.diff(coordinate, 0, order))
                    assert found[0] == pytest.approx(
                        expected, abs=ROUND_OFF * 10 ** (order / 2), rel=ROUND_OFF
                    ), (point, k, order)
