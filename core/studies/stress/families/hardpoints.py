"""Suspensions with errors in their hardpoints, from the rounding of a table to a wrong cell."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ....algebra import triple
from ....joints import Distance, Revolute, Spherical, Translational
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point
from ....mechanism.motions import PointCoordinate
from .base import Family, Rng, Specimen, as_case, power

At = Callable[[float, float, float], tuple[float, float, float]]
"""Function from a hardpoint to the perturbed hardpoint [m]."""


class Hardpoints(Family):
    """Wheel suspensions of cars."""

    name = "hardpoints"
    about = (
        "McPherson, double wishbone and five-link corners, hardpoints off by 1e-6 to 0.05 m,"
        " strokes of 0.1 m both ways"
    )

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a suspension driven at its wheel centre."""
        off = power(rng, -6.0, -1.3)

        def at(x: float, y: float, z: float) -> tuple[float, float, float]:
            return triple(np.array([x, y, z]) + off * rng.normal(size=3))

        make = (_mcpherson, _wishbones, _five_link)[int(rng.integers(3))]
        mechanism = make(at)
        return Specimen(
            f"{mechanism.name}, hardpoints off by {off:.2g} m",
            partial(as_case, mechanism, "stroke", np.linspace(-0.1, 0.1, samples)),
            facts=(("off", off),),
        )


def _corner(
    name: str,
    bodies: list[Body],
    joints: list[Revolute | Spherical | Translational | Distance],
    wheel: Point,
) -> Mechanism:
    return Mechanism(
        name, bodies, joints, [wheel], [PointCoordinate("stroke", wheel.name, (0.0, 0.0, 1.0))]
    )


def _mcpherson(at: At) -> Mechanism:
    top, lower, ball, pivot = (
        at(0.0, 0.55, 0.6),
        at(-0.02, 0.61, 0.18),
        at(-0.03, 0.66, -0.01),
        at(0.17, 0.35, 0.0),
    )
    return _corner(
        "mcpherson",
        [Body("arm"), Body("knuckle"), Body("strut")],
        [
            Revolute(
                "pivot", GROUND, "arm", pivot, triple(np.subtract(at(-0.17, 0.35, 0.0), pivot))
            ),
            Spherical("ball", "arm", "knuckle", ball),
            Spherical("top", "strut", GROUND, top),
            Translational("slide", "knuckle", "strut", top, triple(np.subtract(top, lower))),
            Distance("tie_rod", "knuckle", GROUND, (at(0.12, 0.66, 0.12), at(0.14, 0.35, 0.15))),
        ],
        Point("wheel", "knuckle", at(0.0, 0.72, 0.1)),
    )


def _wishbones(at: At) -> Mechanism:
    lower, upper = at(0.15, 0.3, 0.0), at(0.12, 0.4, 0.4)
    return _corner(
        "double_wishbone",
        [Body("lower"), Body("upper"), Body("knuckle")],
        [
            Revolute(
                "lower_pivot",
                GROUND,
                "lower",
                lower,
                triple(np.subtract(at(-0.15, 0.3, 0.02), lower)),
            ),
            Revolute(
                "upper_pivot",
                GROUND,
                "upper",
                upper,
                triple(np.subtract(at(-0.12, 0.4, 0.38), upper)),
            ),
            Spherical("lower_ball", "lower", "knuckle", at(-0.02, 0.7, 0.0)),
            Spherical("upper_ball", "upper", "knuckle", at(0.02, 0.66, 0.38)),
            Distance("tie_rod", "knuckle", GROUND, (at(0.15, 0.68, 0.1), at(0.15, 0.33, 0.1))),
        ],
        Point("wheel", "knuckle", at(0.0, 0.75, 0.2)),
    )


def _five_link(at: At) -> Mechanism:
    rods = (
        ((0.15, 0.3, 0.0), (0.02, 0.7, -0.02)),
        ((-0.2, 0.35, 0.02), (-0.03, 0.7, 0.0)),
        ((0.12, 0.4, 0.36), (0.03, 0.66, 0.35)),
        ((-0.18, 0.42, 0.38), (-0.02, 0.66, 0.36)),
        ((0.2, 0.33, 0.12), (0.15, 0.68, 0.13)),
    )
    return _corner(
        "five_link",
        [Body("knuckle")],
        [
            Distance(f"rod_{k}", "knuckle", GROUND, (at(*outer), at(*inner)))
            for k, (inner, outer) in enumerate(rods, 1)
        ],
        Point("wheel", "knuckle", at(0.0, 0.75, 0.2)),
    )
