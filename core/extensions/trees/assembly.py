"""Assembly of a model: its start, projected onto the ties of its loops.

Files have six to nine digits, keyframes fewer, and polynomial couplings may have offsets: the start
is open. Coordinates move by the shortest way until it is closed; far away by damped steps, as in
`assemblies.assemble`, near by Newton's, without directions weak within the digits. A `Mechanism` is
no help before that: its joints coincide at design, and its rows hold to round-off.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from ...algebra import ZERO, Vec3, X, Y, Z, cross
from ...errors import CaseError, shortened
from ...mechanism.mechanism import GROUND
from ...trajectory import Array
from .place import ORIGIN, Place, rotation_vector, turn_about, turn_by
from .tree import UNKNOWNS, Closure, Coupling, Move, Strut, Tie, Tree

MAX_ITERATIONS = 100
# Below this residual, or that of the file's digits, Newton's steps end the assembly: damped ones
# would follow the digits along weak directions. Damping as in assemblies.assemble.
NEAR, DAMPING = 1e-6, 0.1
# A gap of this part of the model's size is no rounding, and its assembly may be another one than
# meant.
FAR = 0.1
# Points nearer to each other are one, and rounding is between them [m].
SMALLEST_MODEL = 1e-9
# Rounding of composed frames, relative to the size: not worth an assembly.
CLOSED = 1e-12
# Gaps of several joints add up, and arms lengthen them; see kinematics.structure.redundancy.
ADDED_UP = 10.0
# Rows are of size one: a smaller singular value is round-off of a redundant row.
ROUND_OFF = 1e-9
# Rows are of size one: one gives an unknown if it has a part of it far above round-off.
CLEAR = 0.1
# Tolerances that the digits of a file leave, relative to the size: six digits, and all.
COARSEST, FINEST = 1e-5, 1e-12
MOST_SHOWN = 12
# Of motions of length one: less of a coordinate is round-off, or at rest within the digits.
AT_REST = 1e-6

Value: TypeAlias = float | Place
"""Change of a move since the pose of the tree: a coordinate [rad or m]; of a ball or a free link,
the displacement of the inner link, in global axes there.
"""


@dataclass(frozen=True, eq=False)
class Pose:
    """Values of all moves of a tree, in order.

    Its unknowns are one of a hinge or slide, a rotation vector of a ball, and a shift and a
    rotation vector of a free link.
    """

    tree: Tree
    values: Sequence[Value]

    @staticmethod
    def of(tree: Tree) -> Pose:
        """Return the pose of the tree itself."""
        return Pose(tree, [0.0 if move.is_axial else ORIGIN for move in tree.moves.values()])

    @cached_property
    def columns(self) -> Mapping[str, range]:
        """Unknowns of each move, by its name."""
        return _columns((name, UNKNOWNS[move.kind]) for name, move in self.tree.moves.items())

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return sum(map(len, self.columns.values()))

    @cached_property
    def value_of(self) -> Mapping[str, Value]:
        """The values by the names of their moves."""
        return dict(zip(self.tree.moves, self.values, strict=True))

    @cached_property
    def displacements(self) -> Mapping[str, Place]:
        """Displacement of each moving link since the pose of the tree."""
        found: dict[str, Place] = {GROUND: ORIGIN}
        for move, value in zip(self.tree.moves.values(), self.values, strict=True):
            if not isinstance(value, Place):
                value = (
                    Place(value * move.axis)
                    if move.kind == "slide"
                    else _about(move.point, Place(turn=turn_about(move.axis, value)))
                )
            found[move.inner] = found[move.outer] * value
        return found

    @cached_property
    def _paths(self) -> Mapping[str, Sequence[Move]]:
        """Moves between the ground and each link."""
        found: dict[str, Sequence[Move]] = {GROUND: ()}
        for move in self.tree.moves.values():
            found[move.inner] = (*found[move.outer], move)
        return found

    def slopes(self, link: str, point: Vec3) -> tuple[Array, Array]:
        """Return the derivatives of a point of a link and of its turn by the unknowns, global.

        Args:
            point: its present position, global [m].

        Returns:
            Two arrays of shape (3, unknowns).
        """
        along, about = np.zeros((2, 3, self.unknowns))
        for move in self._paths[link]:
            columns, before = self.columns[move.name], self.displacements[move.outer]
            if move.kind == "slide":
                along[:, columns[0]] = [*before.direction(move.axis)]
                continue
            if move.kind == "free":
                along[:, columns[:3]] = np.eye(3)
            # a free link turns about its own point where that is now
            carrier = self.displacements[move.inner] if move.kind == "free" else before
            arm = point - carrier.point(move.point)
            axes = (move.axis,) if move.kind == "hinge" else (X, Y, Z)
            for column, axis in zip(columns[-len(axes) :], axes, strict=True):
                a = before.direction(axis)
                about[:, column], along[:, column] = [*a], [*cross(a, arm)]
        return along, about

    def step(self, step: Array) -> Pose:
        """Return the pose after a step of the unknowns."""
        values: list[Value] = []
        for move, value in zip(self.tree.moves.values(), self.values, strict=True):
            change: list[float] = step[[*self.columns[move.name]]].tolist()
            if not isinstance(value, Place):
                values.append(value + change[0])
                continue
            shift = Vec3(*change[:3]) if move.kind == "free" else ZERO
            turned = Place(shift, turn_by(Vec3(*change[-3:])))
            values.append(_about(value.point(move.point), turned) * value)
        return Pose(self.tree, values)

    def as_tree(self) -> Tree:
        """Return the tree in this pose."""
        tree, carried = self.tree, self.displacements
        moves: dict[str, Move] = {}
        for (name, move), value in zip(tree.moves.items(), self.values, strict=True):
            before = carried[move.inner if move.kind == "free" else move.outer]
            moves[name] = replace(
                move,
                point=before.point(move.point),
                axis=carried[move.outer].direction(move.axis),
                moved=move.moved + (0.0 if isinstance(value, Place) else value),
            )
        return replace(
            tree,
            moves=moves,
            moving={name: carried[name] * place for name, place in tree.moving.items()},
            places={
                name: carried[tree.carriers[name]] * place for name, place in tree.places.items()
            },
            sites={
                name: (link, carried[link] * place) for name, (link, place) in tree.sites.items()
            },
            ties=[
                replace(each, places=self.ends(each)) if isinstance(each, Closure) else each
                for each in tree.ties
            ],
            struts=[replace(each, places=self.ends(each)) for each in tree.struts],
        )

    def ends(self, joining: Closure | Strut) -> tuple[Place, Place]:
        """Return the present places of both frames of a closure or strut."""
        first, second = map(self._end, joining.links, joining.places)
        return first, second

    def _end(self, link: str, place: Place) -> Place:
        carried = self.displacements[link]
        return Place(carried.point(place.at), carried.turn * place.turn)


def _columns(counts: Iterable[tuple[str, int]]) -> dict[str, range]:
    """Return the ranges of names one after the other, by how many each has."""
    found, start = dict[str, range](), 0
    for name, count in counts:
        found[name] = range(start, start := start + count)
    return found


def _about(point: Vec3, moved: Place) -> Place:
    """Return a turn about a point and a shift."""
    return Place(point - Place(turn=moved.turn).direction(point) + moved.at, moved.turn)


@dataclass(frozen=True)
class Start:
    """A pose to begin with.

    Attributes:
        given: moves whose values the user gave; they stay if the closures let them.
        text: its source, for notes and messages.
        closes: whether it is meant to close; it is then refused far from closed.
    """

    pose: Pose
    given: tuple[str, ...]
    text: str
    closes: bool


@dataclass(eq=False)
class FreeMotions:
    """Motions of moves joined by ties, or of one move alone.

    Attributes:
        columns: unknowns of each of these moves, by its name.
        basis: orthonormal, shape (motions, unknowns).
    """

    columns: Mapping[str, range]
    basis: Array

    def of(self, move: str) -> Array:
        """Return the part of a move's unknowns in the motions, shape (motions, unknowns)."""
        return self.basis[:, [*self.columns[move]]]

    def restrict(self, rows: Array) -> None:
        """Leave the motions on which rows over them vanish, shape (rows, motions).

        Each independent row is turned to the first motion by a reflection, which is left out.
        """
        _, sizes, right = np.linalg.svd(rows, full_matrices=False)
        right = right[sizes > AT_REST]
        while len(right):
            normal = right[0].copy()
            normal[0] += math.copysign(1.0, normal[0])
            normal /= np.linalg.norm(normal)
            self.basis = (self.basis - 2.0 * np.outer(normal, normal @ self.basis))[1:]
            right = (right - 2.0 * np.outer(right @ normal, normal))[1:, 1:]


@dataclass(frozen=True, eq=False)
class Closing:
    """Ties as rows, lengths over the model's size.

    Attributes:
        size: largest extent of the model [m].
        tolerance: gaps up to this are those of the file's digits [m].
        why: its origin, in words.
    """

    ties: Sequence[Tie]
    size: float
    tolerance: float
    why: str

    @staticmethod
    def of(pose: Pose, closure: float | None) -> Closing:
        """Return the rows of a pose's ties.

        Args:
            closure: the user's own tolerance [m].
        """
        tree = pose.tree
        points = [pose.displacements[each.outer].point(each.point) for each in tree.moves.values()]
        for each in tree.ties:
            if isinstance(each, Closure):
                points += [end.at for end in pose.ends(each)]
        extent = float(np.ptp(np.array([[*each] for each in points]), axis=0).max())
        size = extent if extent > SMALLEST_MODEL else 1.0
        if closure is not None:
            return Closing(tree.ties, size, closure, "--closure")
        # the last digit, ten times: gaps of several places add up
        tolerance = size * min(COARSEST, max(FINEST, 10.0 ** (1 - tree.digits)))
        why = f"the file's digits, {tree.digits}: {tolerance:.2g} m"
        return Closing(tree.ties, size, tolerance, why)

    @property
    def weak(self) -> float:
        """Singular values below this belong to rows redundant within the digits."""
        return max(ROUND_OFF, ADDED_UP * self.tolerance / self.size)

    @property
    def limit(self) -> float:
        """Largest gap of an assembly [m]."""
        return max(self.tolerance, CLOSED * self.size)

    def gaps(self, pose: Pose) -> list[tuple[float, Tie]]:
        """Return the ties with their residuals [m], angles at arms of the size; of couplings [m or
        rad]. The largest come first.
        """

        def gap(tie: Tie) -> float:
            residual = np.abs(_residual(tie, pose))
            arms = 1.0 if isinstance(tie, Coupling) else self.size
            return float(max([*residual[:3], *(arms * residual[3:])]))

        return sorted(((gap(each), each) for each in self.ties), key=lambda each: -each[0])

    def gap(self, pose: Pose) -> float:
        """Return the largest residual of `gaps`."""
        return self.gaps(pose)[0][0] if self.ties else 0.0

    def closure_gap(self, pose: Pose) -> float:
        """Return the largest gap of closures [m]; offsets of coupled coordinates are meant, and do
        not count.
        """
        every = (gap for gap, tie in self.gaps(pose) if isinstance(tie, Closure))
        return max(every, default=0.0)

    def rows(self, pose: Pose) -> tuple[Array, Array]:
        """Return residuals and their derivatives, lengths over the size: (rows,), (rows, n)."""
        metres = self.metres(pose)
        residuals, slopes = [np.zeros(0)], [np.zeros((0, pose.unknowns))]
        for each in self.ties:
            residual, slope = _residual(each, pose), _slope(each, pose) * metres
            units = np.ones(len(residual))
            # lengths, then angles; of couplings the largest slope is one
            units[:3] = self.size
            if isinstance(each, Coupling):
                units[:] = float(np.abs(slope).max()) or 1.0
            residuals.append(residual / units)
            slopes.append(slope / units[:, None])
        return np.concatenate(residuals), np.concatenate(slopes)

    def metres(self, pose: Pose) -> Array:
        """Return the size for lengths among the unknowns, else one, shape (n,)."""
        found = np.ones(pose.unknowns)
        for name, columns in pose.columns.items():
            if (kind := pose.tree.moves[name].kind) in ("slide", "free"):
                found[columns[:3] if kind == "free" else columns[0]] = self.size
        return found

    def free(self, pose: Pose) -> list[FreeMotions]:
        """Return the motions left by the rows, by sets of moves without a row in common."""
        rows, columns = self.rows(pose)[1], pose.columns
        part = np.arange(pose.unknowns)
        for joined in (*map(list, columns.values()), *map(np.flatnonzero, rows)):
            if len(labels := np.unique(part[joined])) > 1:
                part[np.isin(part, labels)] = labels[0]
        together: dict[int, list[str]] = {}
        for name, unknowns in columns.items():
            together.setdefault(int(part[unknowns[0]]), []).append(name)
        found: list[FreeMotions] = []
        for names in together.values():
            unknowns = [k for name in names for k in columns[name]]
            own = rows[:, unknowns]
            basis = self._null(own[own.any(axis=1)])
            found.append(FreeMotions(_columns((each, len(columns[each])) for each in names), basis))
        return found

    def _null(self, rows: Array) -> Array:
        """Return an orthonormal basis of the motions left by rows, shape (freedoms, n)."""
        lonely = _unknowns_of_rows(rows)
        given = {*lonely.values()}
        rest = [k for k in range(rows.shape[1]) if k not in given]
        others = np.delete(rows, [*lonely], axis=0)[:, rest]
        if len(others) > len(rest):  # no matrix of rows by rows, of which a file may have many
            others = np.linalg.qr(others).R
        _, sizes, right = np.linalg.svd(others, full_matrices=True)
        found = np.zeros((rows.shape[1], len(rest) - int((sizes > self.weak).sum())))
        found[rest] = right[len(rest) - found.shape[1] :].T
        for row, column in reversed([*lonely.items()]):
            used = np.flatnonzero(rows[row])
            found[column] = -(rows[row, used] @ found[used]) / rows[row, column]
        return np.linalg.qr(found).Q.T if lonely else found.T


def _unknowns_of_rows(rows: Array) -> Mapping[int, int]:
    """Return rows that give an unknown, by its column, which no other row but earlier ones has.

    They are independent of all others, as couplings of many joints with one are: what is left of a
    large model is small.
    """
    columns = [np.flatnonzero(row).tolist() for row in rows]
    owners: list[set[int]] = [set() for _ in range(rows.shape[1])]
    for row, used in enumerate(columns):
        for column in used:
            owners[column].add(row)
    found = dict[int, int]()
    waiting = [column for column, each in enumerate(owners) if len(each) == 1]
    while waiting:
        column = waiting.pop()
        for row in tuple(owners[column]):
            if abs(rows[row, column]) >= CLEAR:
                found[row] = column
                for other in columns[row]:
                    owners[other].discard(row)
                    if len(owners[other]) == 1:
                        waiting.append(other)
    return found


def _residual(tie: Tie, pose: Pose) -> Array:
    """Return the residuals of a tie [m or rad]."""
    if isinstance(tie, Coupling):
        driven, driving = (_sum(weights, pose) for weights in (tie.driven, tie.driving))
        return np.array([driven - tie.function.at(driving)[0]])
    first, second = pose.ends(tie)
    apart = second.at - first.at
    if tie.holds == "distance":
        return np.array([math.sqrt(apart @ apart) - tie.length])
    turned: list[float] = []
    if tie.holds == "frame":
        turned = [*rotation_vector(second.turn * first.turn.conjugate())]
    return np.array([*apart, *turned], dtype=np.float64)


def _slope(tie: Tie, pose: Pose) -> Array:
    """Return the derivatives of the residuals of a tie by the unknowns, shape (rows, n)."""
    if isinstance(tie, Coupling):
        found = np.zeros((1, pose.unknowns))
        for name, k in tie.driven.items():
            found[0, pose.columns[name][0]] += k
        if tie.driving:
            slope = tie.function.at(_sum(tie.driving, pose))[1]
            for name, k in tie.driving.items():
                found[0, pose.columns[name][0]] -= slope * k
        return found
    p, q = (end.at for end in pose.ends(tie))
    (along_i, about_i), (along_j, about_j) = map(pose.slopes, tie.links, (p, q))
    moved = along_j - along_i
    if tie.holds == "distance":
        apart = np.array([*(q - p)])
        return (apart / np.linalg.norm(apart) @ moved)[None]
    return moved if tie.holds == "point" else np.vstack([moved, about_j - about_i])


def _sum(weights: Mapping[str, float], pose: Pose) -> float:
    """Return a weighted sum of changes since the zero pose [rad or m]."""
    found = 0.0
    for name, weight in weights.items():
        value = pose.value_of[name]
        assert not isinstance(value, Place)
        found += weight * (pose.tree.moves[name].moved + value)
    return found


@dataclass(frozen=True, eq=False)
class Assembled:
    """A model in its closed start.

    Attributes:
        free: motions left by the ties, of moves joined by ties together.
        start: origin of the start, in words.
        notes: how it was closed.
    """

    tree: Tree
    free: Sequence[FreeMotions]
    closing: Closing
    start: str
    notes: tuple[str, ...]

    @property
    def is_exact(self) -> bool:
        """Whether the file has all digits, so that redundant rows are so to round-off."""
        return self.closing.tolerance <= CLOSED * self.closing.size


def assemble(start: Start, closure: float | None, driven: Sequence[str] = ()) -> Assembled:
    """Return a model in its start, closed.

    Args:
        closure: tolerance of the closures [m]; by the file's digits unless given.
        driven: driven and held moves; they stay if the closures let them.

    Raises:
        CaseError: the start is too far open, or no pose near it closes.
    """
    pose, notes = start.pose, list[str]()
    closing = Closing.of(pose, closure)
    opened = closing.gap(pose)
    if opened > CLOSED * closing.size:
        # who gives some moves' values leaves the others to the assembly
        if start.closes and (apart := closing.closure_gap(pose)) > FAR * closing.size:
            raise closing.gaps(pose)[0][1].element.fault(
                f"is open in the start ({start.text}) by {apart:.4g} m, expected"
                f" {FAR * closing.size:.3g} m at most, a tenth of the model's size; give a start"
                " that is nearer by --start keyframe:NAME, or values of some joints by --start"
                " JOINT=VALUE ..., from which the nearest closed pose is taken however far it is"
            )
        pose = _nearest_closed(closing, pose, ((*start.given, *driven), start.given, ()))
        left = closing.gaps(pose)
        if left[0][0] > closing.limit:
            raise _open_error(closing, start, opened, left)
        notes.append(_note(closing, start, pose, left[0][0]))
    closed = Pose.of(pose.as_tree())
    # of the tree in this pose, whose changes since the zero pose it knows itself
    closing = replace(closing, ties=closed.tree.ties)
    free = closing.free(closed)
    return Assembled(closed.tree, free, closing, start.text, tuple(notes))


def _nearest_closed(closing: Closing, start: Pose, at_rest: Sequence[Collection[str]]) -> Pose:
    """Return the nearest closed pose found, with the first possible one of some sets of moves at
    rest.
    """
    found = start
    for given in dict.fromkeys(at_rest):
        moving = np.ones(start.unknowns)
        for name in given:
            moving[[*start.columns[name]]] = 0.0
        found = _descend(closing, start, moving)
        if closing.gap(found) <= closing.limit:
            break
    return found


def _descend(closing: Closing, pose: Pose, moving: Array) -> Pose:
    metres, last = closing.metres(pose), math.inf
    near = max(NEAR, closing.tolerance / closing.size)
    best, least = pose, math.inf
    for _ in range(MAX_ITERATIONS):
        residual, slope = closing.rows(pose)
        slope = slope * moving
        if (left := float(np.abs(residual).max())) < least:
            best, least = pose, left
        if left < near:
            u, sizes, v = np.linalg.svd(slope, full_matrices=False)
            inverse = np.where(sizes > closing.weak, 1.0 / np.maximum(sizes, closing.weak), 0.0)
            step = -v.T @ (inverse * (u.T @ residual))
            # a residual within the digits may stay; steps that do not shrink are round-off
            if (length := float(np.abs(step).max())) >= 0.5 * last:
                break
            last = length
        else:
            mu, last = DAMPING * min(1.0, float(residual @ residual)), math.inf
            damped = slope @ slope.T + mu * np.eye(len(slope))
            step = -slope.T @ np.linalg.lstsq(damped, residual, rcond=None)[0]
        pose = pose.step(metres * moving * step)
    return best


def _open_error(
    closing: Closing, start: Start, opened: float, left: Sequence[tuple[float, Tie]]
) -> CaseError:
    """Return the error of an open model."""
    texts = [f"{tie.name} by {gap:.2g}" for gap, tie in left if gap > closing.limit]
    gap, widest = left[0]
    return widest.element.fault(
        f"is open: the start ({start.text}) by {opened:.4g} m, and the nearest pose that was"
        f" found by {gap:.4g}, expected {closing.tolerance:.3g} m at most ({closing.why}); still"
        f" open are {shortened(texts, MOST_SHOWN)}; give a start that can be closed by --start,"
        " another tolerance by --closure, or correct the model",
    )


def _note(closing: Closing, start: Start, pose: Pose, left: float) -> str:
    """Return the note on the assembly: the gap, and how far each move went."""
    moved = sorted(_movements(start.pose, pose), key=lambda each: -each[0])
    texts = [text for size, text in moved if size > 1e-3 * moved[0][0]]
    kept = f", of which {left:.2g} m are left, within {closing.why}" * (
        left > CLOSED * closing.size
    )
    opened, widest = closing.gaps(start.pose)[0]
    return (
        f"the start ({start.text}) is assembled: {widest.element} was open by"
        f" {opened:.3g} m or rad{kept};"
        f" {f'moved were {shortened(texts, MOST_SHOWN)}' if texts else 'no joint moved'}"
    )


def _movements(before: Pose, after: Pose) -> Iterator[tuple[float, str]]:
    """Yield the size and text of each move's change."""
    for name, move in before.tree.moves.items():
        old, new = before.value_of[name], after.value_of[name]
        if not isinstance(old, Place) and not isinstance(new, Place):
            if change := new - old:
                unit = "m" if move.kind == "slide" else "rad"
                yield abs(change), f"{name} by {change:.3g} {unit}"
        elif isinstance(old, Place) and isinstance(new, Place):
            turned = rotation_vector(new.turn * old.turn.conjugate())
            apart = new.point(move.point) - old.point(move.point)
            turn, shift = math.sqrt(turned @ turned), math.sqrt(apart @ apart)
            if turn or shift:
                far = f" and {shift:.3g} m" if move.kind == "free" else ""
                yield max(turn, shift), f"{name} by {turn:.3g} rad{far}"
