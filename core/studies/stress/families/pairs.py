"""Two loops on one crank: equal loops, or a small loop beside a large one."""

from __future__ import annotations

from collections.abc import Mapping

from ....joints import Revolute
from ....mechanism.mechanism import Body, Mechanism, Point
from ...truth.motion import Motion
from ...truth.rows import Real
from .planar import Plan, Plane, coupled


def beside(
    single: Mechanism, plane: Plane, b: Plan, d: Plan, c: Plan, way: str, label: str
) -> Mechanism:
    """Return a four-bar with a second coupler and rocker on its crank at other points, whose names
    begin with the label.
    """
    rocker = f"{label}rocker"
    bodies, joints = coupled(way, plane, ("crank", rocker, f"{label}coupler"), (b, c), label)
    rest = Revolute(f"{label}rest", "ground", rocker, plane.point(d), plane.normal)
    points = [*single.points, Point(f"{label}C", rocker, plane.point(c))]
    return Mechanism(
        "two_loops",
        [*single.bodies, Body(rocker), *bodies],
        [*single.joints, rest, *joints],
        points,
        single.drivers,
    )


def beside_motion(first: Motion, second: Motion, label: str) -> Motion:
    """Return the closed form of both loops from the closed forms of the two four-bars; only the
    crank connects the loops.
    """

    def motion(drives: Real) -> Mapping[str, tuple[Real, Real, Real]]:
        return {
            **first(drives),
            **{f"{label}{name}": moved for name, moved in second(drives).items()},
        }

    return motion
