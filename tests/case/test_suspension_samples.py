"""The samples of suspensions driven at the wheel, which nobody published: two more ways to the same
numbers.

Struts and double wishbones have a closed form in the angle of their lower arm, which is sought for
every sample. A multi-link has none: its five distances are solved by mpmath to 40 digits.
"""

from collections.abc import Callable, Mapping

import mpmath as mp
import numpy as np
import pytest
from kincheck import cases
from kincheck.cases import (
    chrono_double_wishbone_arm,
    chrono_macpherson_arm,
    chrono_sedan_double_wishbone_arm,
    mcpherson_arm,
)
from kincheck.cases.jet import Jet
from kincheck.cases.vectors import Vec
from kincheck.core import Distance
from kincheck.core.case.case import Case

# Round-off of metres, through a division by the wheel's rate of rise over the arm's angle, 0.3 m,
# for each derivative.
LIMITS = {"position": 1e-15, "velocity": 1e-14, "acceleration": 1e-13}


ARMS = {
    "chrono_double_wishbone": lambda turn, rack: chrono_double_wishbone_arm.motion(turn),
    "chrono_macpherson": lambda turn, rack: chrono_macpherson_arm.motion(turn),
    "chrono_sedan_double_wishbone": lambda turn, rack: chrono_sedan_double_wishbone_arm.motion(
        turn
    ),
    "mcpherson_steered": mcpherson_arm.motion,
    "mcpherson_strut": mcpherson_arm.motion,
}


def turned(motion: Callable[[Jet], Mapping[str, Vec]], height: Jet) -> Jet:
    """The arm's motion that lifts the wheel to that height: Newton's iteration for its angle, then
    twice the chain rule.
    """
    angle, still = np.zeros_like(height.x), np.zeros_like(height.x)

    def z(rate: np.ndarray) -> Jet:
        return motion(Jet(angle, rate, still))["wheel_center"].z

    for _ in range(8):
        slope = z(still + 1.0).v - z(still).v
        angle = angle - (z(still).x - height.x) / slope
    slope = z(still + 1.0).v - z(still).v
    rate = (height.v - z(still).v) / slope
    return Jet(angle, rate, (height.a - z(rate).a) / slope)


@pytest.mark.parametrize("name", ARMS)
def test_samples_by_the_closed_form_of_the_arm(name: str):
    case = cases.load(name)
    design = case.mechanism.point("wheel_center").position
    stroke, rack = (
        Jet(*each)
        for each in case.sweep.path.drive(["stroke", "rack"], case.sweep.path.times).swapaxes(0, 1)
    )

    def motion(turn: Jet) -> Mapping[str, Vec]:
        return ARMS[name](turn, rack)

    turn = turned(motion, stroke + design[2])
    assert np.ptp(turn.x) > 0.2
    wheel = motion(turn)["wheel_center"]
    for output, found in (
        ("wheelbase_change", wheel.x - design[0]),
        ("half_track_change", wheel.y - design[1]),
    ):
        for (order, limit), values in zip(LIMITS.items(), (found.x, found.v, found.a), strict=True):
            truth = getattr(case.reference[output], order)
            assert np.abs(values - truth).max() <= limit * max(1.0, np.abs(truth).max()), (
                output,
                order,
            )


def test_the_decompositions_have_one_truth():
    for one, other in (
        ("chrono_macpherson", "chrono_macpherson_cylindrical"),
        ("chrono_multi_link", "chrono_multi_link_bodies"),
    ):
        (first, second) = (cases.load(name) for name in (one, other))
        assert {type(joint) for joint in first.mechanism.joints} != {
            type(joint) for joint in second.mechanism.joints
        }
        for name, series in first.reference.items():
            assert (series.position == second.reference[name].position).all()


# The multi-link by five distances


def rods(case: Case) -> list[tuple[mp.matrix, mp.matrix]]:
    """Both ends of each, the inner first; the arm is two rods from its hinge to its ball."""
    hinge, ball = case.mechanism.joint("upper_pivot"), case.mechanism.joint("upper_ball")
    found = [
        (joint.points[0], joint.points[1])
        for joint in case.mechanism.joints
        if isinstance(joint, Distance)
    ]
    found += [
        (hinge.point, ball.point),
        (np.subtract(hinge.point, hinge.axis).tolist(), ball.point),
    ]
    return [(mp.matrix([*inner]), mp.matrix([*outer])) for inner, outer in found]


def upright(case: Case, stroke: mp.mpf, near: list) -> list:
    """Shift and half of the rotation's vector (Cayley's) of the upright with the wheel centre
    lifted by the stroke.
    """
    centre, links = mp.matrix([*case.mechanism.point("wheel_center").position]), rods(case)

    def closure(*x):
        a, b, c = x[3:]
        skew = mp.matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])
        turn = mp.inverse(mp.eye(3) - skew) * (mp.eye(3) + skew)
        arms = [
            (centre + mp.matrix(x[:3]) + turn * (outer - centre) - inner, outer - inner)
            for inner, outer in links
        ]
        return [*((now.T * now)[0] - (before.T * before)[0] for now, before in arms), x[2] - stroke]

    return list(mp.findroot(closure, near))


@pytest.mark.parametrize("sample", [3, 24])
def test_the_multi_link_by_five_distances(sample: int):
    case = cases.load("chrono_multi_link")
    with mp.workdps(40):
        stroke, near = mp.mpf(case.sweep.values[sample]), [0] * 6
        for part in range(1, 5):
            near = upright(case, stroke * part / 4, near)
        for k, name in enumerate(("wheelbase_change", "half_track_change")):
            for order, limit in LIMITS.items():

                def coordinate(t: mp.mpf, k: int = k) -> mp.mpf:
                    return upright(case, t, near)[k]

                expected = float(mp.diff(coordinate, stroke, list(LIMITS).index(order)))
                assert getattr(case.reference[name], order)[sample] == pytest.approx(
                    expected, abs=limit
                ), (name, order)
