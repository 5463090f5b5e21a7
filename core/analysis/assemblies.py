"""All assemblies of a mechanism that many starts lead to, told apart by their poses and named by their branch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra import Quat, Vec3, vec
from ..drivers import JointAngle
from ..joints import AxialJoint, Fixed, Joint
from ..joints.base import unit
from ..mechanism import Mechanism
from ..primitives.base import GROUND_POSE, Pose
from ..topology import spanning_tree
from ..trajectory import Array, BodyMotion
from .assemble import Assembled, Closing
from .poses import displaced
from .signature import Branches

# Starts around an estimate: turned by up to this [rad], and shifted by about this part of the mechanism's size. Farther ones tell
# of other assemblies than the estimate's: from 0.8 rad the damped steps still come back to it.
SPREAD = 0.8, 0.2
# Poses nearer than this are one assembly. Where two meet, the residual of 1e-12 grows with the square of the way: 1e-6, and a digit.
SAME = 1e-5


@dataclass(frozen=True, eq=False)
class Assembly:
    """One way to put the mechanism together.

    Attributes:
        poses: of every moving body, origin r [m], shape (3,), and Euler parameters p [-], shape (4,).
        distance: from the estimate: rms over its bodies of displacement [mechanism sizes] and turn [rad].
        starts: how many of the starts led there.
        residual: largest constraint residual, relative to the mechanism's size.
        smallest: smallest singular value of all rows in units of the mechanism's size; zero where assemblies meet.
        orientation: sign of the determinant of the rows, against that at design.
        signs: by joint, the sign of a triple product of its neighbours, against that at design (see `Branches`).
    """

    poses: Mapping[str, tuple[Array, Array]]
    distance: float
    starts: int
    residual: float
    smallest: float
    orientation: int
    signs: Mapping[str, int]


@dataclass(frozen=True, eq=False)
class Assemblies:
    """What became of the starts.

    Attributes:
        found: the assemblies, nearest to the estimate first.
        starts: how many starts there were.
        lost: how many of them did not close.
        spurious: how many ended where the rows vanish and yet no assembly is (none, in the mixed style).
    """

    found: tuple[Assembly, ...]
    starts: int
    lost: int
    spurious: int


def find_assemblies(
    mechanism: Mechanism,
    estimate: Mapping[str, tuple[Array, Array]],
    values: Mapping[str, float] | None = None,
    *,
    samples: int = 200,
    seed: int = 0,
    spread: tuple[float, float] | None = SPREAD,
    tol: float = 1e-12,
) -> Assemblies:
    """Close a mechanism from many starts, and tell the assemblies apart.

    Args:
        estimate: by body, origin r [m], shape (3,), and Euler parameters p [-], shape (4,): the first start, and what the assemblies
            are ranked by. Bodies left out may be anywhere.
        values: of the drivers, from their design values [m or rad]; those left out hold theirs.
        samples: number of starts.
        seed: of the random starts.
        spread: how far the other starts are from the estimate [rad, mechanism sizes]; None for anywhere.

    Raises:
        SolveError: drivers and degrees of freedom do not match.
    """
    closing = Closing(mechanism, values or {})
    frame = closing.tracer.frame
    near = displaced(mechanism, frame, estimate)
    starts = _Starts(mechanism, closing, samples, np.random.default_rng(seed)).poses(near, spread)
    ended = closing.run(starts, samples, tol)
    lanes = np.flatnonzero(ended.converged)
    r, q = _coordinates(displaced(mechanism, frame, {name: (m.r[lanes], m.p[lanes]) for name, m in ended.bodies.items()}))
    sought = near or {name: GROUND_POSE for name in closing.moving}
    places = [closing.moving.index(name) for name in sought]
    distances = _distances(r[:, places], q[:, places], *_coordinates(sought)) if len(lanes) else np.zeros(0)
    branches = Branches.of(mechanism, closing.values)
    groups = _groups(r, q)
    found = [_assembly(ended, lanes[group], float(distances[group].min()), branches) for group in groups]
    found.sort(key=lambda each: each.distance)
    return Assemblies(tuple(found), samples, samples - len(lanes) - int(ended.spurious.sum()), int(ended.spurious.sum()))


def as_assembly(mechanism: Mechanism, poses: Mapping[str, tuple[Array, Array]], values: Mapping[str, float]) -> Assembly:
    """A known assembly, as if found: it is its own estimate."""
    (found,) = find_assemblies(mechanism, poses, values, samples=1).found
    return found


def distance(mechanism: Mechanism, one: Assembly, other: Mapping[str, tuple[Array, Array]]) -> float:
    """How far an assembly is from given poses; see `Assembly.distance`."""
    raise NotImplementedError


def same(mechanism: Mechanism, one: Assembly, other: Assembly) -> bool:
    raise NotImplementedError


