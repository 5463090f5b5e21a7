"""March the lanes of a model outwards from the design position.

Many samples are solved at once as lanes, predicted from the last accepted pose; those are accepted that connect to it without a
gap, and the march goes on from the last of them. A step that fails is divided, so a coarse grid costs steps; where no part of a
step succeeds the motion ends, and a message says where and why.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..motions import Path
from ..trajectory import Array
from .continuity import LARGEST_DEVIATION, NEGLIGIBLE
from .model import Model

# Samples tried at once: many share the overhead of a call, and the block of a mechanism of few bodies stays below a megabyte.
LANES = 256
# A failing step is tried at its halves, quarters, ... down to this many halvings, all at once.
HALVINGS = 16
# A front that needs more rounds than this without reaching a sample makes no headway.
MAX_ROUNDS = 200
# Redundant rows may be violated by this much [units of the mechanism's size]: hardpoint tables carry at most about nine digits.
CONSISTENT = 1e-9


@dataclass(frozen=True, eq=False)
class March:
    """What a march found, sample by sample in the order given.

    Attributes:
        lanes: the kept slots of every sample (`Model.kept`), shape (kept, n); NaN where it was not reached.
        last: all slots of the pose where the last direction ended.
        solved, iterations: shape (n,).
        messages: one for each direction that ended before its last sample.
    """

    lanes: Array
    last: Array
    solved: NDArray[np.bool_]
    iterations: NDArray[np.int64]
    messages: tuple[str, ...]


@dataclass
class _Front:
    """One direction of the march: the samples still ahead, and the pose it stands at."""

    ahead: NDArray[np.intp]
    anchor: Array
    at: float
    reach: int = LANES
    dividing: bool = False
    rounds: int = 0
    message: str = ""
    lanes: slice = field(default_factory=lambda: slice(0))
    aims: Array = field(default_factory=lambda: np.empty(0))

    @property
    def samples(self) -> int:
        """How many of its lanes are samples; the others are parts of the step to the first of them."""
        return len(self.aims) - HALVINGS * self.dividing


def march(model: Model, path: Path, tol: float) -> March:
    """Solve a model at the samples of a path, from the design outwards; see `solve` for the tolerance."""
    if path.from_design:
        return _Marcher(model, path, tol, model.design(path.drive(model.request.drivers, np.zeros(1))), 0.0).run()
    way = path.lead_in()
    lead_in = _Marcher(model, way, tol, model.design(way.drive(model.request.drivers, np.zeros(1))), 0.0)
    found = lead_in.run()
    if not found.solved.all():
        n = len(path.times)
        nothing = np.full((len(found.lanes), n), np.nan)
        message = f"on the way to the first sample: {found.messages[0]}"
        return March(nothing, found.last, np.zeros(n, np.bool_), np.zeros(n, np.int64), (message,))
    first = model.moving(found.last, path.drive(model.request.drivers, path.times[:1]))
    return _Marcher(model, path, tol, first, float(path.times[0])).run()


class _Marcher:
    def __init__(self, model: Model, path: Path, tol: float, anchor: Array, at: float) -> None:
        self.model, self.path, self.values, self.tol = model, path, path.times, tol
        self.anchor, self.at = anchor, at
        self.slots = model.slots
        self.executor = model.executor(min(LANES, len(path.times)) + 2 * HALVINGS)
        self.block = self.executor.block
        n = len(path.times)
        self.lanes = np.full((len(model.kept), n), np.nan)
        self.solved, self.iterations = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.int64)

    def run(self) -> March:
        outward = np.argsort(np.abs(self.values - self.at), kind="stable")
        ahead = self.values[outward] >= self.at
        fronts = [_Front(side, self.anchor, self.at) for side in (outward[ahead], outward[~ahead]) if len(side)]
        while active := [front for front in fronts if len(front.ahead) and not front.message]:
            self._round(active)
        messages = tuple(front.message for front in fronts if front.message)
        last = fronts[-1].anchor if fronts else self.anchor
        return March(self.lanes, last, self.solved, self.iterations, messages)

    def _round(self, active: Sequence[_Front]) -> None:
        """Try the next samples of every front as lanes of one block, and move each front as far as it holds."""
        used = 0
        for waiting, front in zip(range(len(active), 0, -1), reversed(active), strict=True):
            # what is left, less the parts that each front still to be laid out may need
            free = self.block.shape[1] - used - HALVINGS * waiting
            share = free // waiting
            front.aims = self.values[front.ahead[: min(front.reach, share)]]
            if front.dividing:
                parts = front.at + (front.aims[0] - front.at) * 0.5 ** np.arange(1, HALVINGS + 1)
                front.aims = np.concatenate([front.aims, parts])
            front.lanes = slice(used, used + len(front.aims))
            used = front.lanes.stop
            self.block[:, front.lanes] = front.anchor[:, None]
            self.block[self.slots["h"], front.lanes] = front.aims - front.at
        aims = np.concatenate([front.aims for front in reversed(active)])  # in the order of the lanes
        self.model.drive(self.block[:, :used], self.path.drive(self.model.request.drivers, aims))
        self.executor.attempt(used)
        iterations = self.block[self.slots["iterations"], :used]
        done = (self.block[self.slots["done"], :used] > 0.0) & self._closed()[:used]
        drift = self.block[self.model.state, :used] - self.block[self.model.predicted, :used]
        moves = [self._accept(front, done, drift, iterations) for front in active]
        if self.model.request.order < 2 and any(len(front.ahead) for front in active):
            self.executor.run("tangent")
        for front, lane in zip(active, moves, strict=True):
            if lane is not None:
                front.anchor = self.block[:, lane].copy()

    def _closed(self) -> NDArray[np.bool_]:
        """Lanes that close within the tolerance, on the intended branch, and agree with the redundant rows."""
        closure, branch, leftover = (self.block[self.slots[name]] for name in ("closure", "branch", "leftover"))
        return (closure <= self.tol) & (branch > 0.0) & (leftover <= max(CONSISTENT, self.tol))

    def _accept(self, front: _Front, done: NDArray[np.bool_], drift: Array, iterations: Array) -> int | None:
        """Keep the samples that connect to the front; the lane to go on from, or None where the front stays or ends."""
        first, count = front.lanes.start, front.samples
        good = done[front.lanes] & self._connected(front, drift[:, front.lanes])
        accepted = count if good[:count].all() else int(good[:count].argmin())
        if accepted:
            taken = front.ahead[:accepted]
            self.lanes[:, taken] = self.block[self.model.kept, first : first + accepted]
            self.solved[taken], self.iterations[taken] = True, iterations[first : first + accepted]
            front.ahead, front.reach, front.dividing, front.rounds = front.ahead[accepted:], 2 * accepted, False, 0
            return self._go_to(front, accepted - 1)
        front.rounds += 1
        parts = np.flatnonzero(good[count:])
        if front.dividing and len(parts) and front.rounds < MAX_ROUNDS:
            return self._go_to(front, count + int(parts[0]))
        if front.dividing:
            front.message = self._end(front)
        # few samples while the way to the first of them is sought
        front.dividing, front.reach = True, 4
        return None

    def _connected(self, front: _Front, drift: Array) -> NDArray[np.bool_]:
        """Whether each lane continues its neighbour: the correction changes by much less than the pose does.

        The neighbour of a sample is the one before it, that of the first one and of the parts of its step is the front itself.
        """
        x, here = self.block[self.model.state, front.lanes], front.anchor[self.model.state][:, None]
        before = np.repeat(here, x.shape[1], axis=1)
        drift_before = np.zeros_like(drift)
        before[:, 1 : front.samples], drift_before[:, 1 : front.samples] = (a[:, : front.samples - 1] for a in (x, drift))
        gap, moved = np.abs(drift - drift_before).max(axis=0), np.abs(x - before).max(axis=0)
        return gap <= LARGEST_DEVIATION * moved + NEGLIGIBLE

    def _go_to(self, front: _Front, k: int) -> int:
        front.at = float(front.aims[k])
        return front.lanes.start + k

    def _end(self, front: _Front) -> str:
        wanted, where = float(front.aims[0]), self.path.where
        side = self.solved & ((self.values >= self.at) == (wanted >= self.at))
        farthest = self.values[side][np.abs(self.values[side] - self.at).argmax()] if side.any() else None
        last = f"last reachable sample at {where(farthest)}" if farthest is not None else "no sample reached on this side"
        return (
            f"cannot be followed beyond {where(front.at)} (wanted {where(wanted)}): {self._reason(front.lanes.stop - 1)}; smallest "
            f"pivot there {front.anchor[self.slots['pivot']]:.3g} (zero at a lock-up or dead centre); {last}; shorten the sweep or "
            "drive another coordinate"
        )

    def _reason(self, lane: int) -> str:
        """Why a lane was not accepted, with the number found."""
        closure, branch, leftover = (self.block[self.slots[name], lane] for name in ("closure", "branch", "leftover"))
        if not np.isfinite(closure):
            return "Newton diverges to numbers that are not finite"
        if not branch > 0.0:
            return f"Newton reaches a wrong branch (axes turned over, cosine {branch:.3g})"
        if closure <= self.tol and leftover > max(CONSISTENT, self.tol):
            names = ", ".join(self.model.selection.account.redundant_rows)
            return f"the redundant rows ({names}) contradict the others by {leftover:.3g}"
        if closure > self.tol:
            return f"Newton does not converge, residual {closure:.3g} of the mechanism's size"
        return "Newton jumps to another assembly"
