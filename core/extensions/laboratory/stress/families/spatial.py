"""Families of spatial mechanisms: near-singular loops and platforms, and suspensions with errors in
their hardpoints.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .....algebra import triple
from .....failures import FailureKind
from .....joints import Cylindrical, Distance, Joint, Revolute, Spherical, Translational, Universal
from .....mechanism.mechanism import GROUND, Body, Mechanism, Point
from .....mechanism.motions import JointAngle, JointDisplacement, PointCoordinate
from .....trajectory import Array
from .base import Rng, Specimen, direction, family, power, swept
from .planar import near_change_points

# A platform with a smaller error may be refused for an excess freedom: its smallest singular value
# is a tenth of the error or less, and the rank tolerance is 1e-9.
UNTOLD = 3e-8


@family(
    "parallelograms (exact, and off by 1e-12 to 1e-2) and kites at their change points; Bennett"
    " and Bricard loops; platforms on six legs, off by 1e-8 to 0.1 from the similar hexagons"
    " that are singular",
    samples=61,
)
def singular(rng: Rng, samples: int) -> Specimen:
    """Return a mechanism close to a singular shape."""
    kind = int(rng.integers(5))
    if kind < 2:
        return near_change_points(rng, samples, ("parallelogram", "kite")[kind])
    return (_bennett, _bricard, _platform)[kind - 2](rng, samples)


def _bennett(rng: Rng, samples: int) -> Specimen:
    """Return four skew hinges, which turn fully because sin(alpha) / a = sin(beta) / b."""
    alpha, beta = float(rng.uniform(0.4, 1.2)), float(rng.uniform(1.3, 2.2))
    a = float(rng.uniform(0.3, 0.6))
    b = a * np.sin(beta) / np.sin(alpha)
    first = float(rng.uniform(0.8, 2.0))
    second = 2.0 * float(
        np.arctan2(np.sin(0.5 * (beta + alpha)), np.sin(0.5 * (beta - alpha)) * np.tan(0.5 * first))
    )
    frame, hinges = np.eye(4), list[tuple[Array, Array]]()
    links = (first, a, alpha), (second, b, beta), (-first, a, alpha), (-second, b, beta)
    for turn, length, twist in links:
        hinges.append((frame[:3, 3].copy(), frame[:3, 2].copy()))
        # a rotation about z, then a translation along and a rotation about x
        c, s, k, m = np.cos(turn), np.sin(turn), np.cos(twist), np.sin(twist)
        frame = frame @ [
            [c, -s * k, s * m, length * c],
            [s, c * k, -c * m, length * s],
            [0.0, m, k, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    if np.abs(frame - np.eye(4)).max() > 1e-12:
        raise ArithmeticError("the Bennett loop does not close")
    name = f"bennett, alpha {alpha:.3g}, beta {beta:.3g}"
    return swept(name, _ring("bennett", hinges), None, -7.0, 7.0, samples)


def _ring(name: str, hinges: Sequence[tuple[Array, Array]]) -> Mechanism:
    """Return bodies in a ring of hinges, with the ground between the last hinge and the first; the
    first is driven.
    """
    bodies = [Body(f"link_{k}") for k in range(1, len(hinges))]
    around = [GROUND, *(body.name for body in bodies), GROUND]
    joints = [
        Revolute(f"hinge_{k}", around[k], around[k + 1], triple(point), triple(axis))
        for k, (point, axis) in enumerate(hinges)
    ]
    points = [Point(f"P{k}", around[k], triple(hinges[k][0])) for k in range(1, len(hinges))]
    return Mechanism(name, bodies, joints, points, [JointAngle("turn", "hinge_0")])


def _bricard(rng: Rng, samples: int) -> Specimen:
    """Return six hinges along edges of a cube: no freedom by count, one by geometry. The dead
    centre is 30 degrees from the cube.
    """
    x, y, z = np.eye(3)
    hinges = [
        (1.0 * x, -z), (x - y, -x), (x - y + z, -y), (-y + z, -z), (1.0 * z, -x), (0.0 * x, -y),
    ]  # fmt: skip
    size, turn = power(rng, -2.0, 2.0), -1.0 if rng.random() < 0.5 else 1.0
    ring = _ring("bricard", [(size * point, axis) for point, axis in hinges])
    # the first hinge turns freely to one side; to the other side the motion ends after 30 degrees
    return swept(f"bricard of {size:.3g} m", ring, None, -0.9 * turn, 0.9 * turn, samples)


def _platform(rng: Rng, samples: int) -> Specimen:
    """Return a platform on five rods and a driven leg. Similar hexagons on base and platform would
    give an excess freedom.
    """
    off = power(rng, -8.0, -1.0)
    angles = np.sort(np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False) + rng.uniform(-0.3, 0.3, 6))
    base = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    top = 0.6 * base + np.array([0.1, -0.05, 0.8]) + off * rng.normal(size=(6, 3))
    ends = [(triple(low), triple(high)) for low, high in zip(base, top, strict=True)]
    low, high = ends[0]
    along = triple(np.subtract(high, low))
    across = triple(np.cross(along, direction(rng)))
    axes = across, triple(np.cross(along, across))
    leg: tuple[Joint, Joint] = (
        (
            Translational("leg", "cylinder", "piston", low, along),
            Spherical("head", "piston", "platform", high),
        )
        if rng.random() < 0.5
        else (
            Cylindrical("leg", "cylinder", "piston", low, along),
            Universal("head", "piston", "platform", high, axes),
        )
    )
    mechanism = Mechanism(
        "platform",
        [Body("platform"), Body("cylinder"), Body("piston")],
        [
            *(Distance(f"rod_{k}", GROUND, "platform", ends[k]) for k in range(1, 6)),
            Universal("foot", GROUND, "cylinder", low, axes),
            *leg,
        ],
        [Point("centre", "platform", triple(top.mean(axis=0)))],
        [JointDisplacement("stroke", "leg")],
    )
    name = f"platform off by {off:.2g} from its singular shape"
    return replace(
        swept(name, mechanism, None, -0.05, 0.05, samples),
        reasons=frozenset({FailureKind.FREE, FailureKind.OVERDRIVEN}),
        excused=off < UNTOLD,
    )


# Suspensions

CORNERS: Mapping[str, Any] = tomllib.loads(
    Path(__file__).with_name("corners.toml").read_text(encoding="utf-8")
)


@family(
    "McPherson, double wishbone and five-link corners, hardpoints off by 1e-6 to 0.05 m, strokes"
    " of 0.1 m both ways"
)
def hardpoints(rng: Rng, samples: int) -> Specimen:
    """Return a suspension driven at its wheel centre, with errors from the rounding of a table to a
    wrong cell.
    """
    off = power(rng, -6.0, -1.3)
    kind = [*CORNERS][int(rng.integers(len(CORNERS)))]
    corner, joints = CORNERS[kind], list[Joint]()
    places = {
        name: triple(np.array(place) + off * rng.normal(size=3))
        for name, place in corner["hardpoints"].items()
    }
    for name, (joint, i, j, *names) in corner["joints"].items():
        at, *others = (places[each] for each in names)
        given: dict[str, Any] = {"point": at}
        if joint == "distance":
            given = {"points": (at, *others)}
        elif others:
            given["axis"] = triple(np.subtract(others[1], others[0]))
        joints.append(Joint.registry[joint](name, i, j, **given))
    mechanism = Mechanism(
        kind,
        [*map(Body, corner["bodies"])],
        joints,
        [Point("wheel", "knuckle", places["wheel"])],
        [PointCoordinate("stroke", "wheel", (0.0, 0.0, 1.0))],
    )
    name = f"{kind}, hardpoints off by {off:.2g} m"
    return swept(name, mechanism, None, -0.1, 0.1, samples)
