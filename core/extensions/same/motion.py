"""Poses of one file's links as poses of another's, and their residuals in its rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ...joints.base import Joint, unit
from ...mechanism.body import Body
from ...mechanism.mechanism import GROUND
from ...trajectory import Array
from ..free.free_poses import FreePoses, Poses
from ..residuals.replay import Residuals, residuals
from .links import Match
from .undriven import Coordinate, Undriven

SIDES = np.array([1.0, -1.0, -1.0, -1.0])
"""Signs of a conjugate quaternion."""
# Links whose frames may tell the placement, and poses that decide.
FEW_LINKS, FEW_POSES = 3, 8


def times(p: Array, q: Array) -> Array:
    """Return the product of quaternions e0..e3, shape (..., 4)."""
    a, b = p[..., :1], q[..., :1]
    u, v = np.broadcast_arrays(p[..., 1:], q[..., 1:])
    e0 = a * b - (u * v).sum(axis=-1, keepdims=True)
    return np.concatenate([e0, a * v + b * u + np.cross(u, v)], axis=-1)


def rotate_vectors(p: Array, x: Array) -> Array:
    """Return vectors turned by unit quaternions, shape (..., 3)."""
    p, x = np.broadcast_arrays(p, np.concatenate([np.zeros_like(x[..., :1]), x], axis=-1))
    return times(times(p, x), SIDES * p)[..., 1:]


@dataclass(frozen=True, eq=False)
class Placement:
    """Place of the whole of one file in another: a turn and then a shift.

    Attributes:
        turn: Euler parameters, shape (4,).
        shift: [m], shape (3,).
        by_frames: links' frames are the same in both files; otherwise their designs are.
    """

    turn: Array
    shift: Array
    by_frames: bool

    @property
    def reversed(self) -> Placement:
        """The same seen from the second file."""
        back = SIDES * self.turn
        return Placement(back, -rotate_vectors(back, self.shift), self.by_frames)

    @property
    def angle(self) -> float:
        """Its turn [rad]."""
        return float(2.0 * np.arctan2(np.linalg.norm(self.turn[1:]), abs(self.turn[0])))

    def put(self, poses: Array, a: Body, b: Body) -> Array:
        """Return poses of a link of the first file as those of its partner, shape (n, 7)."""
        r, p = poses[:, :3], poses[:, 3:]
        if not self.by_frames:  # moved as since design
            q = times(p, SIDES * np.array(a.euler_parameters))
            origin = rotate_vectors(self.reversed.turn, np.array(b.origin) - self.shift)
            r = r + rotate_vectors(q, origin - np.array(a.origin))
            p = times(q, times(self.reversed.turn, np.array(b.euler_parameters)))
        return np.hstack([self.shift + rotate_vectors(self.turn, r), times(self.turn, p)])

    def all(self, poses: Poses, a: Undriven, b: Undriven, match: Match) -> Poses:
        """Return poses of all links with partners as poses of these, but for links that spin."""
        return {
            y: self.put(poses[x], a.mechanism.body(x), b.mechanism.body(y))
            for x, y in match.partner.items()
            if x not in a.spinning and y not in b.spinning
        }


def candidates(a: Undriven, b: Undriven, match: Match) -> Iterator[Placement]:
    """Yield placements of the first file in the second, likely ones first."""
    still = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)
    found = [still]
    for x, y in [*match.partner.items()][:FEW_LINKS]:
        body, other = a.mechanism.body(x), b.mechanism.body(y)
        turn = times(np.array(other.euler_parameters), SIDES * np.array(body.euler_parameters))
        found.append((turn, np.array(other.origin) - rotate_vectors(turn, np.array(body.origin))))
    for turn, shift in found if a.is_model and b.is_model else found[:1]:
        yield Placement(turn, shift, by_frames=True)
    yield Placement(*still, by_frames=False)
    joints = joints_of_both(a, b, match)
    # of joints that are alike: their points; then their axes too, in either sense
    pairs = [(j.points_on(), k.points_on()) for j, k in joints]
    points = [(p[0], q[0]) for p, q in pairs if len(p) == len(q) == 1]
    axes = [(_axis(j), _axis(k)) for j, k in joints]
    for signs in (None, 1.0, -1.0):
        moved = _fit_pose(points, [] if signs is None else [(f, signs * g) for f, g in axes])
        for by_frames in (True, False) if a.is_model and b.is_model else (False,):
            yield Placement(*moved, by_frames=by_frames)


def _axis(joint: Joint) -> Array:
    axis = getattr(joint, "axis", None)
    return np.zeros(3) if axis is None else np.array([*unit(axis)], dtype=np.float64)


def _fit_pose(
    points: Sequence[tuple[Sequence[float], Sequence[float]]], axes: Sequence[tuple[Array, Array]]
) -> tuple[Array, Array]:
    """Return the turn and shift that fit points, and directions, best (Kabsch, Horn)."""
    p, q = (
        np.array([*side], dtype=np.float64).reshape(-1, 3)
        for side in (zip(*points, strict=True) if points else ((), ()))
    )
    a, b = (x.mean(axis=0) if len(x) else np.zeros(3) for x in (p, q))
    size = float(np.abs(p - a).max(initial=0.0)) or 1.0
    m = (p - a).T @ (q - b) + sum((size**2 * np.outer(f, g) for f, g in axes), np.zeros((3, 3)))
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = m
    horn = np.array(
        [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, yy - xx - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, zz - xx - yy],
        ]
    )
    turn: Array = np.linalg.eigh(horn)[1][:, -1] if np.any(m) else np.eye(4)[0]
    return turn, b - rotate_vectors(turn, a)


Links: TypeAlias = frozenset[str]


def joints_by_links(file: Undriven, partner: Mapping[str, str]) -> dict[Links, list[Joint]]:
    """Return the joints of a file by the partners of their links; the ground is its own."""
    found: dict[Links, list[Joint]] = {}
    for joint in file.mechanism.given_joints:
        names = [
            GROUND if file.mechanism.is_fixed(name) else partner.get(name, "")
            for name in joint.bodies
        ]
        found.setdefault(frozenset(names), []).append(joint)
    return found


def joints_of_both(a: Undriven, b: Undriven, match: Match) -> list[tuple[Joint, Joint]]:
    """Return joints of the same freedoms between partners: those of one name, or the only ones
    between them.
    """
    second = joints_by_links(b, {y: y for y in match.partner.values()})
    found: list[tuple[Joint, Joint]] = []
    for links, joints in joints_by_links(a, match.partner).items():
        others = second.get(links, [])
        if "" in links:
            continue
        for joint in joints:
            named = [each for each in others if each.name == joint.name]
            alone = others if len(joints) == len(others) == 1 else []
            found += [(joint, k) for k in (named or alone) if k.freedoms == joint.freedoms]
    return found


def tied_links(file: Undriven, partner: Mapping[str, str]) -> dict[Links, str]:
    """Return joints, and couplings by the links of both joints, by the partners of their links."""
    found = {links: joints[0].name for links, joints in joints_by_links(file, partner).items()}
    for each in file.mechanism.couplers:
        links = {name for joint in each.joints for name in file.mechanism.joint(joint).bodies}
        names = {GROUND if file.mechanism.is_fixed(x) else partner.get(x, "") for x in links}
        found[frozenset({*names, "coupled"})] = each.name
    return found


def measurable(file: Undriven, name: str) -> bool:
    """Return whether a joint of the file has an axis in the mechanism."""
    return any(
        j.name == name and getattr(j, "axis", None) is not None for j in file.mechanism.given_joints
    )


def left_in(b: Undriven, free: FreePoses, poses: Poses) -> Residuals:
    """Return residuals of poses in the rows of a file; links without poses are fitted."""
    return residuals(b.mechanism, free.placed(poses))


def placement(
    a: Undriven, b: Undriven, match: Match, poses: Poses, free: FreePoses, enough: float
) -> Placement:
    """Return the placement in which most joints of the second file hold.

    Couplings of models do not count: starts that differ by their offsets are no other placement. A
    case file has no start beside its design, and its frames may be turned along with a joint.

    Args:
        poses: of the first file.
        free: of the second file.
        enough: residual of a joint that holds [m].
    """
    few = {name: each[:FEW_POSES] for name, each in poses.items()}
    models = a.is_model and b.is_model
    couplers = {each.name for each in b.mechanism.couplers if models}
    best: tuple[int, Placement] | None = None
    for each in candidates(a, b, match):
        found = left_in(b, free, each.all(few, a, b, match))
        off = np.abs(found.position).max(axis=0)
        bad = {name for name, x in zip(found.joints, off, strict=True) if not x <= enough}
        bad -= couplers
        if best is None or len(bad) < best[0]:
            best = len(bad), each
        if not bad:
            break
    assert best is not None
    return best[1]


def values(file: Undriven, name: str, coordinate: Coordinate, poses: Poses) -> Array:
    """Return the values of a joint's coordinate at poses [rad or m], angles within half a turn of
    the value at design.
    """
    joint = file.mechanism.joint(name)
    lanes = len(next(iter(poses.values())))
    moved: list[tuple[Array, Array]] = []
    point, axis = (np.array(getattr(joint, key), dtype=np.float64) for key in ("point", "axis"))
    for link in joint.bodies:
        if link not in poses:
            moved.append((np.tile(point, (lanes, 1)), np.tile([1.0, 0.0, 0.0, 0.0], (lanes, 1))))
            continue
        body, each = file.mechanism.body(link), poses[link]
        q = times(each[:, 3:], SIDES * np.array(body.euler_parameters))
        moved.append((each[:, :3] + rotate_vectors(q, point - np.array(body.origin)), q))
    (r_i, q_i), (r_j, q_j) = moved
    axis = axis / np.linalg.norm(axis)
    if not coordinate.turns:
        return coordinate.start + ((r_j - r_i) * rotate_vectors(q_i, axis)).sum(axis=1)
    between = times(SIDES * q_i, q_j)
    angle = 2.0 * np.arctan2(between[:, 1:] @ axis, between[:, 0])
    return coordinate.start + angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
