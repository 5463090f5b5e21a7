"""Degenerate descriptions: links without length, coincident points, antiparallel axes, undriven
freedoms.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from .....algebra import triple
from .....errors import KincheckError
from .....failures import FailureKind
from .....joints import (
    ConstantVelocity,
    Distance,
    Joint,
    Revolute,
    RevoluteSpherical,
    Spherical,
    Universal,
)
from .....mechanism.mechanism import GROUND, Body, Mechanism, Point
from .....mechanism.motions import JointAngle, PointCoordinate
from ...truth.motion import follow_motion
from .base import MOTION_ENDS, Rng, Specimen, as_case, direction, family
from .linkages import any_plane, crank_rocker, four_bar, slider_crank

Maker = Callable[[Rng], Mechanism]

NOT_FINITE = frozenset({FailureKind.NOT_FINITE})
NO_LENGTH = frozenset({FailureKind.NO_LENGTH})
WRONG_ANGLE = frozenset({FailureKind.WRONG_ANGLE})
FREE = frozenset({FailureKind.FREE})
NOT_CLOSED = frozenset({FailureKind.NOT_CLOSED, FailureKind.NO_POSE})


@family(
    "zero links, coincident points, antiparallel, zero and infinite axes, free spins, dead centres"
    " at design",
    samples=21,
)
def degenerate(rng: Rng, samples: int) -> Specimen:
    """Return an invalid mechanism (70 %), to be refused with its defect, or a valid one of unusual
    appearance, to be solved.
    """
    wrong = rng.random() < 0.7
    name = [*(WRONG if wrong else SOUND)][int(rng.integers(len(WRONG if wrong else SOUND)))]
    make, reasons = WRONG[name] if wrong else (SOUND[name], frozenset[FailureKind]())
    try:
        mechanism = make(rng)
        values = np.linspace(-0.5, 0.5, samples)
        case = as_case(mechanism, mechanism.drivers[0].name, values)
    except KincheckError as error:
        case = error
    return Specimen(name, case, None if wrong else follow_motion, reasons=reasons)


def _pair(joint: Callable[..., Joint], **given: Any) -> Mechanism:
    """Return a driven crank with a second body on it, connected by a joint."""
    return Mechanism(
        "pair",
        [Body("a"), Body("b")],
        [
            Revolute("pivot", GROUND, "a", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            joint("odd", "a", "b", **given),
        ],
        [Point("tip", "b", (1.0, 0.5, 0.2))],
        [JointAngle("turn", "pivot")],
    )


def _place(rng: Rng) -> tuple[float, float, float]:
    return triple(rng.uniform(0.2, 1.0, 3))


def _axis(rng: Rng) -> tuple[float, float, float]:
    return triple(direction(rng))


def _shafts_that_turn_back(rng: Rng) -> Mechanism:
    a = direction(rng)
    return _pair(ConstantVelocity, point=_place(rng), axes=(triple(a), triple(-a)))


def _body_that_spins_freely(rng: Rng) -> Mechanism:
    """Return a four-bar with a coupler between two balls."""
    (b, d, c), plane = crank_rocker(rng), any_plane(rng)
    found, _ = four_bar(plane, b, d, c, "rod")
    balls = [
        Spherical("ball_1", "crank", "bar", plane.point(b)),
        Spherical("ball_2", "bar", "rocker", plane.point(c)),
    ]
    return replace(found, bodies=[*found.bodies, Body("bar")], joints=[*found.joints[:2], *balls])


def _rocker_of_length_zero(rng: Rng) -> Mechanism:
    b, d, _ = crank_rocker(rng)
    return four_bar(any_plane(rng), b, d, d, str(rng.choice(["revolutes", "rod"])))[0]


def _driver_across_the_motion(rng: Rng) -> Mechanism:
    """Return a four-bar with its crank pin driven along the crank."""
    points, plane = crank_rocker(rng), any_plane(rng)
    pull = PointCoordinate("pull", "B", plane.direction(points[0]))
    return replace(four_bar(plane, *points, "rod")[0], drivers=[pull])


def _slider_at_its_dead_centre(rng: Rng) -> Mechanism:
    r, length = rng.uniform(0.2, 0.4), rng.uniform(0.8, 1.2)
    plane, way = any_plane(rng), str(rng.choice(["rod", "revolutes"]))
    return slider_crank(plane, complex(r), complex(r + length), way, "slide")[0]


def _rod_too_long_to_close(rng: Rng) -> Mechanism:
    points = crank_rocker(rng)
    found, _ = four_bar(any_plane(rng), *points, "rod")
    rod: Any = found.joints[-1]
    return replace(found, joints=[*found.joints[:-1], replace(rod, length=20.0)])


def _same_ball_twice(rng: Rng) -> Mechanism:
    found = _pair(Spherical, point=(p := _place(rng)))
    return replace(found, joints=[*found.joints, Spherical("again", "a", "b", p)])


WRONG: Mapping[str, tuple[Maker, frozenset[FailureKind]]] = {
    "rod between coincident points": (
        lambda rng: _pair(Distance, points=(p := _place(rng), p)),
        NO_LENGTH,
    ),
    "rod of length zero": (
        lambda rng: _pair(Distance, points=(_place(rng), _place(rng)), length=0.0),
        NO_LENGTH,
    ),
    "link between coincident points": (
        lambda rng: _pair(RevoluteSpherical, points=(p := _place(rng), p), axis=_axis(rng)),
        NO_LENGTH,
    ),
    "axis of zero": (
        lambda rng: _pair(Revolute, point=_place(rng), axis=(0.0, 0.0, 0.0)),
        NO_LENGTH,
    ),
    "axis not finite": (
        lambda rng: _pair(Revolute, point=_place(rng), axis=(float("nan"), 0.0, 1.0)),
        NOT_FINITE,
    ),
    "point at infinity": (lambda rng: _pair(Spherical, point=(np.inf, 0.0, 0.0)), NOT_FINITE),
    "cross of parallel axes": (
        lambda rng: _pair(Universal, point=_place(rng), axes=(a := _axis(rng), a)),
        WRONG_ANGLE,
    ),
    "shafts that turn back": (_shafts_that_turn_back, WRONG_ANGLE),
    "body that spins freely": (_body_that_spins_freely, FREE),
    "rocker of length zero": (_rocker_of_length_zero, FREE | MOTION_ENDS),
    "driver across the motion": (_driver_across_the_motion, FREE | MOTION_ENDS),
    "slider at its dead centre": (_slider_at_its_dead_centre, FREE | MOTION_ENDS | NOT_CLOSED),
    "rod too long to close": (_rod_too_long_to_close, NOT_CLOSED),
    "same ball twice": (_same_ball_twice, FREE),
}
"""Makers of invalid mechanisms, each with the kinds of its correct refusals."""


def _pivots_that_coincide(rng: Rng) -> Mechanism:
    """Return a four-bar with crank and rocker about one axis: the whole triangle turns as one."""
    b, _, c = crank_rocker(rng)
    return four_bar(any_plane(rng), b, 0j, c, str(rng.choice(["rod", "revolutes"])))[0]


def _crank_of_length_zero(rng: Rng) -> Mechanism:
    """Return a slider-crank in which only the crank moves."""
    plane, c = any_plane(rng), complex(1.0, rng.uniform(0.1, 0.5))
    return slider_crank(plane, 0j, c, "rod", "turn")[0]


def _hinges_the_other_way_round(rng: Rng) -> Mechanism:
    """Return a four-bar with hinge axes of any sign and length."""
    found, _ = four_bar(any_plane(rng), *crank_rocker(rng))
    each: list[Any] = list(found.joints)
    joints = [
        replace(joint, axis=triple(s * np.array(joint.axis)))
        for joint, s in zip(each, (1.0, -2.0, -0.01, 1e6), strict=True)
    ]
    return replace(found, joints=joints)


def _bodies_far_from_their_joints(rng: Rng) -> Mechanism:
    """Return a four-bar with body origins a thousand sizes away; an origin only names a frame."""
    found, _ = four_bar(any_plane(rng), *crank_rocker(rng))
    far = [replace(body, origin=triple(1e3 * direction(rng))) for body in found.bodies]
    return replace(found, bodies=far)


SOUND: Mapping[str, Maker] = {
    "crank of length zero": _crank_of_length_zero,
    "pivots that coincide": _pivots_that_coincide,
    "hinges the other way round": _hinges_the_other_way_round,
    "bodies far from their joints": _bodies_far_from_their_joints,
}
"""Makers of valid mechanisms of unusual appearance."""
