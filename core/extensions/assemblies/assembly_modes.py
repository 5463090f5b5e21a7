"""Assemblies of a mechanism found from many starts, distinguished by their poses and named by their
branch.

No count of starts proves a list complete. Counts of starts by assembly tell how many are missing:
Good, Biometrika 40 (1953) 237, and Chao, Scandinavian Journal of Statistics 11 (1984) 265.

The branch of a configuration are signs against the design position. The sign of the determinant of
the rows changes only at singular poses. It is one sign for the whole mechanism. A triple product at
every joint distinguishes further: of the directions to the far joints of its two bodies and its
axis (the two bends of an elbow, the two windings of a rod around its neighbours).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...algebra import Quat, Vec3, cross, quat, vec
from ...dataset import AXIS, Dataset, Variable
from ...errors import number_of
from ...input_checks import require_positive
from ...joints import Joint
from ...joints.base import unit
from ...kinematics.formulation.cartesian import Cartesian
from ...kinematics.formulation.constraints import Frames
from ...kinematics.formulation.state_vectors import displaced, jacobian, state_of
from ...kinematics.structure.redundancy import independent_rows
from ...mechanism.mechanism import Mechanism
from ...mechanism.tree import spanning_tree
from ...primitives.base import GROUND_POSE, Pose
from ...tabular import Tabular
from ...trajectory import Array
from .assemble import PARAMETER, Closing, require_named, require_shapes

# A normalised triple product below this at design (half a degree) has no sign that rounding of a
# table would not change.
FLAT = 1e-2
# Below this part of the largest singular value, the sign of the determinant is round-off.
SINGULAR = 1e-12


@dataclass(frozen=True)
class Triple:
    """a x b . n, of vectors on the joint's first body i and second body j, now against design.

    Attributes:
        n: normal on body i; None: the vector from the joint's point on i to its point on j, now.
        ends: arms of the joint's points on i and on j, from their origins.
    """

    i: str
    j: str
    a: Vec3
    b: Vec3
    n: Vec3 | None
    ends: tuple[Vec3, Vec3]
    origins: tuple[Vec3, Vec3]

    def value(self, poses: Mapping[str, Pose]) -> float:
        """The triple product of unit vectors [-]."""
        i, j = poses.get(self.i, GROUND_POSE), poses.get(self.j, GROUND_POSE)
        if self.n is None:
            points = (
                o + pose.u + pose.turn(end)
                for o, pose, end in zip(self.origins, (i, j), self.ends, strict=True)
            )
            first, second = points
            n = second - first
        else:
            n = i.turn(self.n)
        sizes = [float(np.sqrt(v @ v)) for v in (self.a, self.b, n)]
        return float(cross(i.turn(self.a), j.turn(self.b)) @ n) / max(float(np.prod(sizes)), 1e-300)


@dataclass(frozen=True, eq=False)
class Branches:
    """The signs of the branch of a configuration.

    Attributes:
        triples: by joint; a joint in one line or plane with its neighbours at design has none.
    """

    mechanism: Mechanism
    frame: Frames
    formulation: Cartesian
    values: Mapping[str, float]
    kept: Sequence[int]
    orientation: float
    triples: Mapping[str, Triple]

    @staticmethod
    def of(mechanism: Mechanism, frame: Frames, values: Mapping[str, float]) -> Branches:
        """The branches of a mechanism whose drivers have these values, from design."""
        formulation = Cartesian.of(mechanism, frame)
        matrix = jacobian(formulation)
        kept = independent_rows(matrix, len(mechanism.drivers), formulation.conditions)
        triples = {
            joint.name: triple
            for joint in mechanism.joints
            if (triple := _triple(mechanism, frame, joint)) is not None
        }
        return Branches(
            mechanism, frame, formulation, values, kept, _orientation(matrix[kept]), triples
        )

    def at(self, poses: Mapping[str, Pose]) -> tuple[float, int, dict[str, int]]:
        """Smallest singular value of all rows, orientation, and signs by joint; see `Assembly`."""
        state = state_of(self.formulation, self.mechanism, self.frame, poses, self.values)
        matrix = jacobian(self.formulation, self.formulation.configuration(state))
        signs = {
            name: int(np.sign(each.value(poses) * each.value({})))
            for name, each in self.triples.items()
        }
        smallest = float(np.linalg.svd(matrix, compute_uv=False).min())
        return smallest, int(_orientation(matrix[self.kept]) * self.orientation), signs


def _orientation(matrix: np.ndarray) -> float:
    """Return the sign of the determinant; 0 if unknown."""
    values = np.linalg.svd(matrix, compute_uv=False)
    return float(np.linalg.slogdet(matrix)[0]) if values.min() > SINGULAR * values.max() else 0.0


def _triple(mechanism: Mechanism, frame: Frames, joint: Joint) -> Triple | None:
    """Return the triple product at a joint farthest from zero at design."""
    ends = joint.points_on()
    if not ends:
        return None
    first, last = ends[0], ends[-1]
    axis = getattr(joint, "axis", None)
    best: Triple | None = None
    for a in _others(mechanism, joint.i, first):
        for b in _others(mechanism, joint.j, last):
            if len(ends) == 2:
                n = None
            elif axis is not None:
                n = unit(axis)
            else:
                normal = cross(a, b)
                if normal @ normal < FLAT**2 * (a @ a) * (b @ b):
                    continue
                n = unit([*normal])
            arms = frame.arm(joint.i, first), frame.arm(joint.j, last)
            found = Triple(
                joint.i, joint.j, a, b, n, arms, (frame.origins[joint.i], frame.origins[joint.j])
            )
            if abs(found.value({})) > max(FLAT, abs(best.value({})) if best else 0.0):
                best = found
    return best


def _others(mechanism: Mechanism, body: str, P: Sequence[float]) -> Iterator[Vec3]:
    """From a point of a body to its other joints' points, at design [m]."""
    fixed = mechanism.is_fixed(body)
    for joint in mechanism.joints:
        for end, owner in enumerate(joint.bodies):
            if owner == body or (fixed and mechanism.is_fixed(owner)):
                points = joint.points_on()
                if points and (away := vec(points[-1] if end else points[0]) - vec(P)) @ away > 0.0:
                    yield away


# Starts around an estimate: turned by up to this [rad], and shifted by about this part of the
# mechanism's size. Bodies that are farther from the estimate than this lead to other assemblies
# than its own more often than not.
SPREAD = 0.8, 0.2
# Poses nearer than this [rad, mechanism sizes] are one assembly. Where two assemblies meet, a
# residual grows with the square of the way from them: 1e-12 is 1e-6 away, and ten times as much for
# the mechanism's own lever.
SAME = 1e-5
# How far a body that may be anywhere starts from where a joint wants it [mechanism sizes]; one that
# no joint carries, a whole size.
ANYWHERE = 0.3


@dataclass(frozen=True, eq=False)
class Assembly:
    """One way to put the mechanism together.

    Attributes:
        poses: of every moving body, origin r [m], shape (3,), and Euler parameters p [-], shape
            (4,).
        distance: from the estimate: rms over its bodies of turn [rad] and displacement [mechanism
            sizes].
        starts: number of starts with this result.
        residual: largest constraint residual, relative to the mechanism's size.
        smallest: smallest singular value of all rows, lengths in mechanism sizes; zero at a
            meeting of assemblies.
        orientation: sign of the determinant of the rows, against the sign at design; 0 if singular.
        signs: by joint, the sign of a triple product of its neighbours against the sign at design;
            see `Branches`.
    """

    poses: Mapping[str, tuple[Array, Array]]
    distance: float
    starts: int
    residual: float
    smallest: float
    orientation: int
    signs: Mapping[str, int]


@dataclass(frozen=True, eq=False, repr=False)
class Assemblies(Tabular):
    """Results of many starts.

    Attributes:
        found: the assemblies, nearest to the estimate first.
        starts: number of starts.
        lost: number of starts without closure.
        spurious: number of starts that ended at a zero of the rows without an assembly: axes turned
            over, redundant rows contradicted.
    """

    found: tuple[Assembly, ...]
    starts: int
    lost: int
    spurious: int

    @property
    def once(self) -> int:
        """The number of assemblies to which one start only led."""
        return sum(each.starts == 1 for each in self.found)

    @property
    def estimated(self) -> float:
        """Chao's estimate of how many there are at the least: as many are missing as pairs can be
        made of the ones found once, by those found twice and one more.
        """
        twice = sum(each.starts == 2 for each in self.found)
        return len(self.found) + 0.5 * self.once * (self.once - 1) / (twice + 1)

    @property
    def unlisted(self) -> float:
        """Good's estimate of the share of starts, of those that close, to other assemblies."""
        return self.once / max(1, sum(each.starts for each in self.found))

    @property
    def missing(self) -> str:
        """A sentence on what the list may lack; empty for an empty one."""
        closed = sum(each.starts for each in self.found)
        if not closed:
            return ""
        head = "The list may be incomplete: "
        if not self.once:
            # with a share above 3 / n, no start of n leads to it with a chance of 5 % at most
            rare = max(1, closed // 3)
            return f"{head}one that fewer than 1 of {rare} starts reach can be missing"
        return (
            f"{head}{self.once} of these {len(self.found)} were found by one start only; by such"
            f" counts, some {100.0 * self.unlisted:.3g} % of further starts would lead to others"
            f" (Good 1953), and about {round(self.estimated)} or more exist (Chao 1984)"
        )

    def summary(self) -> str:
        """Return the number of assemblies and of starts, and what may be missing."""
        ended = f"{self.lost} without closure, {self.spurious} spurious"
        found = number_of(len(self.found), "assembly", "assemblies")
        counted = f"{found} from {number_of(self.starts, 'start')} ({ended})"
        return ". ".join(filter(None, (counted, self.missing)))

    def dataset(self) -> Dataset:
        """Return the numbers and the poses of the assemblies."""
        dims, bodies = ("assembly", "body"), [*self.found[0].poses] if self.found else []
        poses = [[each.poses[body] for body in bodies] for each in self.found]
        r, p = (
            np.array([[pose[k] for pose in one] for one in poses]).reshape(len(poses), -1, size)
            for k, size in ((0, 3), (1, 4))
        )
        numbers = ("distance", "starts", "residual", "smallest", "orientation")
        coords = {
            "assembly": Variable("assembly", np.arange(1, len(self.found) + 1)),
            "body": Variable("body", bodies),
            "axis": AXIS,
            "parameter": PARAMETER,
        }
        variables = {
            name: Variable("assembly", [getattr(each, name) for each in self.found])
            for name in numbers
        }
        variables["origin"] = Variable((*dims, "axis"), r, "m")
        variables["euler_parameters"] = Variable((*dims, "parameter"), p)
        return Dataset(("assembly",), coords, variables)


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
    """Close a mechanism from many starts, and return the different assemblies. More may exist than
    are found.

    Args:
        estimate: by body, origin r [m], shape (3,), and Euler parameters p [-], shape (4,): the
            first start, and the origin of the ranking (the design, if it is empty). Bodies
            left out may be anywhere.
        values: of the drivers, from their design values [m or rad]; those left out hold theirs.
        samples: number of starts.
        seed: of the random starts.
        spread: how far the other starts are from the estimate [rad, mechanism sizes]; None for
            anywhere.
        tol: largest accepted residual, relative to the mechanism's size.

    Raises:
        SolveError: drivers and degrees of freedom do not match, there is no moving body or driver
            of a name, or an estimate has another shape, or tolerance or samples are not positive
            and finite.
    """
    require_named("find_assemblies", mechanism, estimate, values or {})
    require_shapes("find_assemblies", estimate, ())
    require_positive("find_assemblies", "tol", tol)
    require_positive("find_assemblies", "samples", samples)
    closing = Closing(mechanism, values or {})
    frame = closing.tracer.frame
    near = displaced(mechanism, frame, estimate)
    starts = _starts(mechanism, frame, near, samples, spread, np.random.default_rng(seed))
    ended = closing.run(starts, samples, tol)
    lanes = np.flatnonzero(ended.converged)
    sought = near or dict.fromkeys(closing.moving, GROUND_POSE)
    placed = {name: (motion.r[lanes], motion.p[lanes]) for name, motion in ended.bodies.items()}
    poses = displaced(mechanism, frame, placed)
    apart = _distances({name: poses[name] for name in sought}, sought)
    distances = np.sqrt((apart * apart).sum(axis=-1).mean(axis=-1))
    branches = Branches.of(mechanism, frame, closing.values)
    found: list[Assembly] = []
    for group in _groups(poses, len(lanes)):
        lane = int(group[distances[group].argmin()])
        branch = branches.at({name: _lane(pose, lane) for name, pose in poses.items()})
        own = {name: (r[lane], p[lane]) for name, (r, p) in placed.items()}
        residual = float(ended.residual[lanes[lane]])
        found.append(Assembly(own, float(distances[lane]), len(group), residual, *branch))
    found.sort(key=lambda each: each.distance)
    spurious = int(ended.spurious.sum())
    return Assemblies(tuple(found), samples, samples - len(lanes) - spurious, spurious)


def _distances(poses: Mapping[str, Pose], others: Mapping[str, Pose]) -> Array:
    """Displacements [mechanism sizes] and turns [rad] between poses of the same bodies, shape (n,
    bodies, 2).
    """
    (u, q), (u0, q0) = map(_numbers, (poses, others))
    # q and -q are one rotation
    turn = np.minimum(np.linalg.norm(q - q0, axis=-1), np.linalg.norm(q + q0, axis=-1))
    return np.stack(
        [np.linalg.norm(u - u0, axis=-1), 4.0 * np.arcsin(np.minimum(0.5 * turn, 1.0))], axis=-1
    )


def _numbers(poses: Mapping[str, Pose]) -> tuple[Array, Array]:
    """Displacements and quaternions, shapes (n, bodies, 3) and (n, bodies, 4), or without n for a
    single configuration.
    """
    u = [np.stack(np.broadcast_arrays(*pose.u), axis=-1) for pose in poses.values()]
    q = [np.stack(np.broadcast_arrays(pose.q.e0, *pose.q.e), axis=-1) for pose in poses.values()]
    return np.stack(u, axis=-2), np.stack(q, axis=-2)


def _lane(pose: Pose, k: int) -> Pose:
    u, q = (values[k, 0].tolist() for values in _numbers({"": pose}))
    return Pose.of(vec(u), quat(q))


def _groups(poses: Mapping[str, Pose], n: int) -> list[NDArray[np.intp]]:
    """Return the lanes of each assembly."""
    groups: list[NDArray[np.intp]] = []
    left = np.arange(n)
    while len(left):
        first = {name: _lane(pose, int(left[0])) for name, pose in poses.items()}
        alike = _distances(poses, first)[left].max(axis=(1, 2)) <= SAME
        groups.append(left[alike])
        left = left[~alike]
    return groups


def _starts(
    mechanism: Mechanism,
    frame: Frames,
    near: Mapping[str, Pose],
    n: int,
    spread: tuple[float, float] | None,
    rng: np.random.Generator,
) -> dict[str, Pose]:
    """Return the poses of the starts, scalars of shape (n,); the first is the estimate.

    A body without an estimate has any attitude, near its place by the spanning tree's joint with
    its parent. Rejected: motions of this joint only, so only the loops are open; 200 such starts
    find 8 assemblies of the delta robot, these 16.
    """
    first = np.arange(n) == 0
    found: dict[str, Pose] = {}
    for branch in spanning_tree(mechanism).branches:
        known = near.get(branch.child)
        if known is not None and spread is not None:
            turn, shift = spread
            found[branch.child] = _select_lanes(
                first, known, _shake(known, turn * rng.uniform(size=n), shift, n, rng)
            )
            continue
        parent = found.get(branch.parent, GROUND_POSE)
        origin = tuple(frame.unit * frame.origins[branch.child])
        carried = parent.u + parent.swing(frame.arm(branch.parent, origin))
        apart = (1.0 if branch.joint is None else ANYWHERE) * rng.normal(size=(3, n))
        e = rng.normal(size=(4, n))  # of such rotations none is likelier than another
        pose = Pose.of(carried + vec([*apart]), quat(e / np.linalg.norm(e, axis=0)))
        found[branch.child] = pose if known is None else _select_lanes(first, known, pose)
    return found


def _shake(pose: Pose, angle: Array, shift: float, n: int, rng: np.random.Generator) -> Pose:
    """The pose turned by the angles about axes of any direction, and shifted."""
    axis = rng.normal(size=(3, n))
    axis /= np.linalg.norm(axis, axis=0)
    turn = Quat(np.cos(0.5 * angle), np.sin(0.5 * angle) * vec([*axis]))
    return Pose.of(pose.u + vec([*(shift * rng.normal(size=(3, n)))]), turn * pose.q)


def _select_lanes(these: NDArray[np.bool_], one: Pose, other: Pose) -> Pose:
    """One pose in these lanes, the other elsewhere."""
    pairs = zip((*one.u, one.q.e0, *one.q.e), (*other.u, other.q.e0, *other.q.e), strict=True)
    numbers: list[Any] = [np.where(these, a, b) for a, b in pairs]
    return Pose.of(vec(numbers[:3]), quat(numbers[3:]))
