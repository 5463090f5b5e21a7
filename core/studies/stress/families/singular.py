"""Near-singular geometry: change points, dead centres, platforms, and overconstrained loops with
one freedom.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ....algebra import triple
from ....failures import FailureKind
from ....joints import Cylindrical, Distance, Joint, Revolute, Spherical, Translational, Universal
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point
from ....mechanism.motions import JointAngle, JointDisplacement
from ....trajectory import Array
from ...truth.motion import closed, followed
from .base import Family, Rng, Specimen, as_case, direction, power
from .dimensions import nearly_kite, nearly_parallel
from .planar import JOINTS_OF_A_LOOP, any_plane, flats, four_bar, four_bar_motion

TURN = 0.97 * np.pi
# A platform with a smaller error may be refused for an excess freedom: its smallest singular value
# is a tenth of the error or less, and the rank tolerance is 1e-9.
UNTOLD = 3e-8


class Singular(Family):
    """Mechanisms close to a singular shape."""

    name = "singular"
    about = (
        "parallelograms (exact, and off by 1e-12 to 1e-2) and kites at their change points; Bennett"
        " and Bricard loops; platforms on six legs, off by 1e-8 to 0.1 from the similar hexagons"
        " that are singular"
    )

    samples = 61

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a parallelogram, kite, Bennett loop, Bricard loop or platform."""
        return (_parallelogram, _kite, _bennett, _bricard, _platform)[int(rng.integers(5))](
            rng, samples
        )


def _parallelogram(rng: Rng, samples: int) -> Specimen:
    """Return a parallelogram; it folds flat twice a turn.

    Correct answers for an exact parallelogram are its own motion or a refusal, never the motion
    that crosses there. With an error of one sign it becomes the antiparallel linkage, within the
    root of the error. With an error of the other sign it cannot pass.
    """
    plane, way = any_plane(rng), str(rng.choice(JOINTS_OF_A_LOOP))
    b, d, c, off = nearly_parallel(rng)
    motion = four_bar_motion(plane, b, d, c, parallel=off == 0.0)
    values = np.linspace(-TURN, TURN, samples)
    return Specimen(
        f"parallelogram with {way}, off by {off:.2g}",
        partial(as_case, four_bar(plane, b, d, c, way), "turn", values),
        partial(closed, motion=motion, nearest=flats(b, d)),
        facts=(("off", off),),
    )


def _kite(rng: Rng, samples: int) -> Specimen:
    """Return a kite, whose crank is nearly as long as the ground and passes the rocker's pivot."""
    plane, way = any_plane(rng), str(rng.choice(JOINTS_OF_A_LOOP))
    b, d, c, off = nearly_kite(rng)
    return Specimen(
        f"kite with {way}, off by {off:.2g}",
        partial(as_case, four_bar(plane, b, d, c, way), "turn", np.linspace(-TURN, TURN, samples)),
        partial(closed, motion=four_bar_motion(plane, b, d, c), nearest=flats(b, d)),
        facts=(("off", off),),
    )


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
    for turn, length, twist in (
        (first, a, alpha),
        (second, b, beta),
        (-first, a, alpha),
        (-second, b, beta),
    ):
        hinges.append((frame[:3, 3].copy(), frame[:3, 2].copy()))
        frame = frame @ _screwed(turn, length, twist)
    if np.abs(frame - np.eye(4)).max() > 1e-12:
        raise ArithmeticError("the Bennett loop does not close")
    mechanism = _ring("bennett", hinges)
    return Specimen(
        f"bennett, alpha {alpha:.3g}, beta {beta:.3g}",
        partial(as_case, mechanism, "turn", np.linspace(-7.0, 7.0, samples)),
    )


def _screwed(turn: float, length: float, twist: float) -> Array:
    """Return the frame of the next hinge: a rotation about z, then a translation along and a
    rotation about x.
    """
    c, s, k, m = np.cos(turn), np.sin(turn), np.cos(twist), np.sin(twist)
    return np.array(
        [
            [c, -s * k, s * m, length * c],
            [s, c * k, -c * m, length * s],
            [0.0, m, k, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _ring(name: str, hinges: list[tuple[Array, Array]]) -> Mechanism:
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
        (0.0 * x, -y),
        (1.0 * x, -z),
        (x - y, -x),
        (x - y + z, -y),
        (-y + z, -z),
        (1.0 * z, -x),
    ]
    size, turn = power(rng, -2.0, 2.0), -1.0 if rng.random() < 0.5 else 1.0
    ring = _ring("bricard", [(size * point, axis) for point, axis in [*hinges[1:], hinges[0]]])
    # the first hinge turns freely to one side; to the other side the motion ends after 30 degrees
    values = np.linspace(-0.9, 0.9, samples) if turn > 0 else np.linspace(0.9, -0.9, samples)
    return Specimen(f"bricard of {size:.3g} m", partial(as_case, ring, "turn", values))


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
    joints: list[Joint] = [
        Distance(f"rod_{k}", GROUND, "platform", pair) for k, pair in enumerate(ends[1:], 1)
    ]
    hung: Any = Universal(
        "foot", GROUND, "cylinder", low, (across, triple(np.cross(along, across)))
    )
    slide: Joint = (Translational if rng.random() < 0.5 else Cylindrical)(
        "leg", "cylinder", "piston", low, along
    )
    head: Joint = (
        Spherical("head", "piston", "platform", high)
        if isinstance(slide, Translational)
        else Universal(
            "head", "piston", "platform", high, (across, triple(np.cross(along, across)))
        )
    )
    mechanism = Mechanism(
        "platform",
        [Body("platform"), Body("cylinder"), Body("piston")],
        [*joints, hung, slide, head],
        [Point("centre", "platform", triple(top.mean(axis=0)))],
        [JointDisplacement("stroke", "leg")],
    )
    return Specimen(
        f"platform off by {off:.2g} from its singular shape",
        partial(as_case, mechanism, "stroke", np.linspace(-0.05, 0.05, samples)),
        followed,
        reasons=frozenset({FailureKind.FREE, FailureKind.OVERDRIVEN}),
        excused=off < UNTOLD,
        facts=(("off", off),),
    )
