"""Assembly of a model: its start, projected onto the equalities of its loops.

Files have six to nine digits, keyframes fewer, and polynomial couplings may have offsets: the start
is open. Joint coordinates move by the shortest way until it is closed; far away by damped steps, as
in `kinematics.assembly`, near by Newton's, without directions weak within the digits.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ....errors import CaseError, shortened
from ....trajectory import Array
from ...io.document import fault
from .closing import ADDED_UP, Closing, rotation_vector
from .digits import Digits
from .equalities import Connect, Equality, Relation
from .frames import Place
from .pose import UNKNOWNS, Pose
from .start import Start
from .tree import Tree

MAX_ITERATIONS = 100
# Below this residual, or that of the file's digits, Newton's steps end the assembly: damped ones
# would follow the digits along weak directions. Damping as in kinematics.assembly.
NEAR, DAMPING = 1e-6, 0.1
# A gap of this part of the model's size is no rounding, and its assembly may be another one than
# meant.
FAR = 0.1
# Points nearer to each other are one, and rounding is between them [m].
SMALLEST_MODEL = 1e-9
# Rounding of composed frames, relative to the size: not worth an assembly.
CLOSED = 1e-12
MOST_TOLD = 12


@dataclass(frozen=True, eq=False)
class Assembled:
    """A model in its closed start.

    Attributes:
        free: motions left by the equalities, orthonormal, by the unknowns of `Pose`, shape
            (freedoms, unknowns).
        pose: the tree itself, for its columns.
        size: largest extent [m].
        digits: gaps up to this are those of the file.
        start: origin of the start, in words.
        notes: how it was closed.
    """

    tree: Tree
    equalities: Sequence[Equality]
    free: Array
    pose: Pose
    size: float
    digits: Digits
    start: str
    notes: tuple[str, ...]

    @property
    def exact(self) -> bool:
        """Whether the file has all digits, so that redundant rows are so to round-off."""
        return self.digits.tolerance <= CLOSED * self.size


def assemble(
    file: Path,
    equalities: Sequence[Equality],
    start: Start,
    digits: Digits,
    driven: Sequence[str] = (),
) -> Assembled:
    """Return the model in the start, closed.

    Args:
        driven: driven and held joints; they stay if the closures let them.

    Raises:
        CaseError: the start is too far open, or no pose near it closes.
    """
    closing = Closing(equalities, size_of(start.pose, equalities), digits)
    opened = closing.gap(start.pose)
    pose, notes = start.pose, list[str]()
    if opened > CLOSED * closing.size:
        # who gives some joints' values leaves the others to the assembly
        if start.closed and (apart := closing.apart(pose)) > FAR * closing.size:
            raise _open(
                closing.widest(pose).element.file,
                closing,
                pose,
                f"is open in the start ({start.text}) by {apart:.4g} m, expected"
                f" {FAR * closing.size:.3g} m at most, a tenth of the model's size; give a start"
                " that is nearer by --start keyframe:NAME, or values of some joints by --start"
                " JOINT=VALUE ..., from which the nearest closed pose is taken however far it is",
            )
        pose = _closed(closing, pose, ((*start.given, *driven), start.given, ()))
        left = closing.gap(pose)
        if left > max(ADDED_UP * digits.tolerance, CLOSED * closing.size):
            raise _open(
                file,
                closing,
                pose,
                f"is open: the start ({start.text}) by {opened:.4g} m or rad, and the nearest pose"
                f" that was found by {left:.4g}, expected {digits.tolerance:.3g} m at most"
                f" ({digits.why}); still open are {_open_ones(closing, pose)}; give a start that"
                " can be closed by --start, another tolerance by --closure, or correct the model",
            )
        notes.append(_note(start, closing, pose, opened, left))
    tree = pose.settled()
    settled = Pose.of(tree)
    posed = [_settled(each, pose) for each in equalities]
    # of the tree in this pose, whose changes since qpos0 it knows itself
    rows = Closing(posed, closing.size, digits).rows(settled)[1]
    free = closing.null(rows)
    return Assembled(tree, posed, free, settled, closing.size, digits, start.text, tuple(notes))


def size_of(pose: Pose, equalities: Sequence[Equality]) -> float:
    """Return the largest extent along a global axis of joints and ends of equalities [m]."""
    points = [pose.carried[each.outer].point(each.point) for each in pose.tree.chain]
    for each in equalities:
        if not isinstance(each, Relation):
            ends = zip((each.i, each.j), each.points, strict=True)
            points += [pose.carried[body].point(point) for body, point in ends]
    extent = float(np.ptp(np.array([[*each] for each in points]), axis=0).max())
    return extent if extent > SMALLEST_MODEL else 1.0


def _closed(closing: Closing, start: Pose, at_rest: Sequence[Collection[str]]) -> Pose:
    """Return the nearest closed pose found, with the first possible one of some sets of joints
    at rest.
    """
    found = start
    for given in dict.fromkeys(at_rest):
        moving = np.ones(start.unknowns)
        for name in given:
            moving[[*start.columns[name]]] = 0.0
        found = _descended(closing, start, moving)
        if closing.gap(found) <= max(closing.digits.tolerance, CLOSED * closing.size):
            break
    return found


def _descended(closing: Closing, pose: Pose, moving: Array) -> Pose:
    metres, last = closing.metres(pose), math.inf
    near = max(NEAR, closing.digits.tolerance / closing.size)
    best, least = pose, math.inf
    for _ in range(MAX_ITERATIONS):
        residual, slope = closing.rows(pose)
        slope = slope * moving
        if (left := float(np.abs(residual).max())) < least:
            best, least = pose, left
        if left < near:
            step = _newton(closing, slope, residual)
            # a residual within the digits may stay; steps that do not shrink are round-off
            if (length := float(np.abs(step).max())) >= 0.5 * last:
                break
            last = length
        else:
            mu, last = DAMPING * min(1.0, float(residual @ residual)), math.inf
            damped = slope @ slope.T + mu * np.eye(len(slope))
            step = -slope.T @ np.linalg.lstsq(damped, residual, rcond=None)[0]
        pose = pose.moved(metres * moving * step)
    return best


def _newton(closing: Closing, slope: Array, residual: Array) -> Array:
    left, sizes, right = np.linalg.svd(slope, full_matrices=False)
    inverse = np.where(sizes > closing.weak, 1.0 / np.maximum(sizes, closing.weak), 0.0)
    return -right.T @ (inverse * (left.T @ residual))


def _settled(each: Equality, pose: Pose) -> Equality:
    """Return an equality by its points in a pose."""
    if isinstance(each, Relation):
        return each
    p, q = (
        pose.carried[body].point(point)
        for body, point in zip((each.i, each.j), each.points, strict=True)
    )
    if not isinstance(each, Connect) or each.turns is None:
        return replace(each, points=(p, q))
    one, two = (
        pose.carried[body].turn * turn
        for body, turn in zip((each.i, each.j), each.turns, strict=True)
    )
    return replace(each, points=(p, q), turns=(one, two))


def _note(start: Start, closing: Closing, pose: Pose, opened: float, left: float) -> str:
    """Return the note on the assembly: the gap, and how far each joint moved."""
    moves = sorted(_moves(start.pose, pose), key=lambda each: -each[0])
    told = [text for size, text in moves if size > 1e-3 * moves[0][0]]
    widest = closing.widest(start.pose).element
    kept = f", of which {left:.2g} m are left, within {closing.digits.why}" * (
        left > CLOSED * closing.size
    )
    return (
        f"the start ({start.text}) is assembled: {widest} was open by {opened:.3g} m or rad{kept};"
        f" {f'moved were {shortened(told, MOST_TOLD)}' if told else 'no joint moved'}"
    )


def _moves(before: Pose, after: Pose) -> Iterator[tuple[float, str]]:
    """Yield the size and text of each joint's move."""
    for joint, old, new in zip(before.tree.chain, before.values, after.values, strict=True):
        if not isinstance(old, Place) and not isinstance(new, Place):
            change = new - old
            if change:
                unit = "m" if joint.type == "slide" else "rad"
                yield abs(change), f"{joint.name} by {change:.3g} {unit}"
        elif isinstance(old, Place) and isinstance(new, Place):
            turn = math.sqrt(
                rotation_vector(new.turn * old.turn.conjugate())
                @ rotation_vector(new.turn * old.turn.conjugate())
            )
            apart = new.point(joint.point) - old.point(joint.point)
            shift = math.sqrt(apart @ apart)
            if turn or shift:
                far = f" and {shift:.3g} m" if UNKNOWNS[joint.type] == 6 else ""
                yield max(turn, shift), f"{joint.name} by {turn:.3g} rad{far}"


def _open_ones(closing: Closing, pose: Pose) -> str:
    """Return the equalities open beyond the digits, the widest ones first."""
    gaps = [(closing.gap_of(each, pose), each.name) for each in closing.equalities]
    told = [f"{name} by {gap:.2g}" for gap, name in sorted(gaps, reverse=True)]
    limit = max(ADDED_UP * closing.digits.tolerance, CLOSED * closing.size)
    return shortened(told[: sum(gap > limit for gap, _ in gaps)], MOST_TOLD)


def _open(file: Path, closing: Closing, pose: Pose, problem: str) -> CaseError:
    return fault(file, str(closing.widest(pose).element), problem)
