"""Degenerate descriptions: links without length, coincident points, antiparallel axes, undriven
freedoms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ....algebra import triple
from ....case.case import Case
from ....failures import FailureKind
from ....joints import (
    ConstantVelocity,
    Distance,
    Joint,
    Revolute,
    RevoluteSpherical,
    Spherical,
    Universal,
)
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point
from ....mechanism.motions import JointAngle, PointCoordinate
from ...truth.motion import followed
from .base import MOTION_ENDS, Family, Rng, Specimen, as_case, direction
from .dimensions import crank_rocker
from .planar import any_plane, four_bar, slider_crank

Values = np.ndarray[Any, Any]

NOT_FINITE = frozenset({FailureKind.NOT_FINITE})
NO_LENGTH = frozenset({FailureKind.NO_LENGTH})
WRONG_ANGLE = frozenset({FailureKind.WRONG_ANGLE})
FREE = frozenset({FailureKind.FREE})
NOT_CLOSED = frozenset({FailureKind.NOT_CLOSED, FailureKind.NO_POSE})


class Degenerate(Family):
    """Invalid mechanisms, to be refused with their defect, and valid mechanisms of unusual
    appearance, to be solved.
    """

    name = "degenerate"
    about = (
        "zero links, coincident points, antiparallel, zero and infinite axes, free spins, dead"
        " centres at design"
    )
    samples = 21

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return an invalid mechanism (70 %) or a valid one of unusual appearance."""
        make, reasons = (
            WRONG[int(rng.integers(len(WRONG)))]
            if rng.random() < 0.7
            else (SOUND[int(rng.integers(len(SOUND)))], frozenset[FailureKind]())
        )
        values = np.linspace(-0.5, 0.5, samples)
        name = make.__name__.strip("_").replace("_", " ")
        return Specimen(
            name,
            partial(_described, make, rng, values),
            None if reasons else followed,
            reasons=reasons,
        )


def _described(make: Callable[[Rng], Mechanism], rng: Rng, values: Values) -> Case:
    mechanism = make(rng)
    return as_case(mechanism, mechanism.drivers[0].name, values)


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


def _rod_between_coincident_points(rng: Rng) -> Mechanism:
    return _pair(Distance, points=(p := _place(rng), p))


def _rod_of_length_zero(rng: Rng) -> Mechanism:
    return _pair(Distance, points=(_place(rng), _place(rng)), length=0.0)


def _link_between_coincident_points(rng: Rng) -> Mechanism:
    return _pair(RevoluteSpherical, points=(p := _place(rng), p), axis=triple(direction(rng)))


def _axis_of_zero(rng: Rng) -> Mechanism:
    return _pair(Revolute, point=_place(rng), axis=(0.0, 0.0, 0.0))


def _axis_not_finite(rng: Rng) -> Mechanism:
    return _pair(Revolute, point=_place(rng), axis=(float("nan"), 0.0, 1.0))


def _point_at_infinity(rng: Rng) -> Mechanism:
    return _pair(Spherical, point=(float("inf"), 0.0, 0.0))


def _cross_of_parallel_axes(rng: Rng) -> Mechanism:
    return _pair(Universal, point=_place(rng), axes=(a := triple(direction(rng)), a))


def _shafts_that_turn_back(rng: Rng) -> Mechanism:
    a = direction(rng)
    return _pair(ConstantVelocity, point=_place(rng), axes=(triple(a), triple(-a)))


def _body_that_spins_freely(rng: Rng) -> Mechanism:
    """Return a four-bar with a coupler between two balls."""
    b, d, c = crank_rocker(rng)
    plane = any_plane(rng)
    found = four_bar(plane, b, d, c, "rod")
    balls = [
        Spherical("ball_1", "crank", "bar", plane.point(b)),
        Spherical("ball_2", "bar", "rocker", plane.point(c)),
    ]
    return replace(found, bodies=[*found.bodies, Body("bar")], joints=[*found.joints[:2], *balls])


def _rocker_of_length_zero(rng: Rng) -> Mechanism:
    b, d, _ = crank_rocker(rng)
    return four_bar(any_plane(rng), b, d, d, str(rng.choice(["revolutes", "rod"])))


def _driver_across_the_motion(rng: Rng) -> Mechanism:
    """Return a four-bar with its crank pin driven along the crank."""
    b, d, c = crank_rocker(rng)
    plane = any_plane(rng)
    return replace(
        four_bar(plane, b, d, c, "rod"), drivers=[PointCoordinate("pull", "B", plane.along(b))]
    )


def _slider_at_its_dead_centre(rng: Rng) -> Mechanism:
    r, length = rng.uniform(0.2, 0.4), rng.uniform(0.8, 1.2)
    return slider_crank(
        any_plane(rng),
        (float(r), 0.0),
        (float(r + length), 0.0),
        str(rng.choice(["rod", "revolutes"])),
        "slide",
    )


def _rod_too_long_to_close(rng: Rng) -> Mechanism:
    b, d, c = crank_rocker(rng)
    found = four_bar(any_plane(rng), b, d, c, "rod")
    rod: Any = found.joints[-1]
    return replace(found, joints=[*found.joints[:-1], replace(rod, length=20.0)])


def _same_ball_twice(rng: Rng) -> Mechanism:
    found = _pair(Spherical, point=(p := _place(rng)))
    return replace(found, joints=[*found.joints, Spherical("again", "a", "b", p)])


WRONG: tuple[tuple[Callable[[Rng], Mechanism], frozenset[FailureKind]], ...] = (
    (_rod_between_coincident_points, NO_LENGTH),
    (_rod_of_length_zero, NO_LENGTH),
    (_link_between_coincident_points, NO_LENGTH),
    (_axis_of_zero, NO_LENGTH),
    (_axis_not_finite, NOT_FINITE),
    (_point_at_infinity, NOT_FINITE),
    (_cross_of_parallel_axes, WRONG_ANGLE),
    (_shafts_that_turn_back, WRONG_ANGLE),
    (_body_that_spins_freely, FREE),
    (_rocker_of_length_zero, FREE | MOTION_ENDS),
    (_driver_across_the_motion, FREE | MOTION_ENDS),
    (_slider_at_its_dead_centre, FREE | MOTION_ENDS | NOT_CLOSED),
    (_rod_too_long_to_close, NOT_CLOSED),
    (_same_ball_twice, FREE),
)
"""Makers of invalid mechanisms, each with the kinds of its correct refusals."""


def _crank_of_length_zero(rng: Rng) -> Mechanism:
    """Return a slider-crank in which only the crank moves."""
    return slider_crank(
        any_plane(rng), (0.0, 0.0), (1.0, float(rng.uniform(0.1, 0.5))), "rod", "turn"
    )


def _pivots_that_coincide(rng: Rng) -> Mechanism:
    """Return a four-bar with crank and rocker about one axis: the whole triangle turns as one."""
    b, _, c = crank_rocker(rng)
    return four_bar(any_plane(rng), b, (0.0, 0.0), c, str(rng.choice(["rod", "revolutes"])))


def _hinges_the_other_way_round(rng: Rng) -> Mechanism:
    """Return a four-bar with hinge axes of any sign and length."""
    found = four_bar(any_plane(rng), *crank_rocker(rng))
    each: list[Any] = list(found.joints)
    joints = [
        replace(joint, axis=triple(s * np.array(joint.axis)))
        for joint, s in zip(each, (1.0, -2.0, -0.01, 1e6), strict=True)
    ]
    return replace(found, joints=joints)


def _bodies_far_from_their_joints(rng: Rng) -> Mechanism:
    """Return a four-bar with body origins a thousand sizes away; an origin only names a frame."""
    found = four_bar(any_plane(rng), *crank_rocker(rng))
    return replace(
        found, bodies=[replace(body, origin=triple(1e3 * direction(rng))) for body in found.bodies]
    )


SOUND: tuple[Callable[[Rng], Mechanism], ...] = (
    _crank_of_length_zero,
    _pivots_that_coincide,
    _hinges_the_other_way_round,
    _bodies_far_from_their_joints,
)
"""Makers of valid mechanisms of unusual appearance."""
