"""Execution of plans with numpy: one ufunc call per operation, over all lanes at once.

No start-up cost; the oracle of the tests.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from .plan import DONE, ITERATIONS, MARGIN, Parts, Plan, Side
from .straight_line import Program
from .tape import LEAVES, NODES, operands, place_of

_UFUNCS: dict[str, Callable[..., Any]] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "neg": np.negative,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "atan2": np.arctan2,
    "abs": np.absolute,
}
# by keyword: these reject a third positional array
_EXTREMES = {"min": np.minimum, "max": np.maximum}

# The iteration of neighbours goes on while each takes as many more of them again: the others are
# iterated with the next group, which is nearer.
WORTH = 2.0
# A group is at most so many times as long as what was accepted of the one before: lanes farther
# away would take more iterations for nothing.
GROWS = 1.5
# Up to so many lanes are run by themselves: beside a call's own time theirs counts little.
NARROW = 64

Call = tuple[Callable[..., Any], tuple[Any, ...]]


def _written_at_once(program: Program, last: Mapping[int, int]) -> dict[int, int]:
    """Return the slots of results that nothing reads later, by node: one slot for each."""
    read = dict[int, int]()
    for k, (op, *rest) in enumerate(program.nodes):
        if op in ("input", "node"):
            read[int(rest[0])] = max(read.get(int(rest[0]), 0), last.get(k, k))
    return {
        node: slot
        for slot, node in program.outputs.items()
        if program.nodes[node][0] not in LEAVES and node > read.get(slot, -1)
    }


def _largest(out: Array, values: Array) -> None:
    np.maximum.reduce(values, axis=0, out=out)


class NumpyExecutor:
    """A plan bound to a number of lanes, here a block of shape (slots, lanes). Every executor has
    these methods. Lanes that divide by zero hold inf or nan; no error is raised.

    Attributes:
        lanes, group: number of lanes, and of those that a track attempts together.
        margin: samples that a track may read beyond the last.
    """

    margin = 0

    def __init__(self, plan: Plan, lanes: int) -> None:
        self.lanes = self.group = self._width = lanes
        self.block: Array = np.zeros((len(plan.slots), lanes))
        self.plan = plan
        self._calls: dict[tuple[str, int], list[Call]] = {}

    def clear(self) -> None:
        """Set all slots of all lanes to zero."""
        self.block[:] = 0.0

    def put(self, slots: Sequence[int], values: Array) -> None:
        """Set slots of all lanes, shape (slots, lanes) or (slots, 1)."""
        self.block[slots] = values

    def get(self, slots: Sequence[int]) -> Array:
        """Return a copy of slots of all lanes, shape (slots, lanes)."""
        return self.block[slots]

    def window(self, slots: range) -> Array:
        """Return a view of slots in memory, lane by lane as an executor arranges them."""
        return self.block[slots.start : slots.stop]

    def run(self, name: str) -> None:
        """Run one of `Plan.programs` over all lanes."""
        key = name, self._width
        if key not in self._calls:
            self._calls[key] = self._bind(self.plan.programs[name])
        with np.errstate(all="ignore"):
            for call, arguments in self._calls[key]:
                call(*arguments)

    def attempt(self) -> None:
        """Attempt all lanes, each alone."""
        self.settle("predict", self.plan.alone)

    def settle(self, start: str, tests: Sequence[str], neighbours: int = 0) -> None:
        """Attempt all lanes: predict by `start`, iterate Newton, run the tests.

        Args:
            neighbours: number of lanes that are wanted, none after one that is not accepted: the
                iteration ends when it takes few more of them.
        """
        slots, ready = self.plan.slots, 0
        self._width = NARROW if 0 < neighbours <= NARROW < self.lanes else self.lanes
        block = self.block[:, : self._width]
        residual, iterations = (block[slots[name]] for name in ("residual", ITERATIONS))
        done = np.zeros(self._width, dtype=np.bool_)
        iterations[:] = 0.0
        self.run(start)
        for _ in range(self.plan.most):
            self.run("newton")
            iterations += ~done
            done |= residual < self.plan.tolerance
            before, ready = ready, leading(done[:neighbours])
            if 0 < ready < WORTH * before or (done | ~np.isfinite(residual)).all():
                break
        for name in self.plan.after:
            self.run(name)
        block[slots[DONE]] = done
        for name in tests:
            self.run(name)
        self._width = self.lanes

    def carry(self) -> None:
        """Copy `Plan.carried` of all lanes, for the next prediction."""
        source, target = np.array(self.plan.carried).T
        self.block[target] = self.block[source]

    def go_back(self, sample: Array) -> None:
        """Restore the lanes to the state they were predicted from, ready for a new prediction.

        Args:
            sample: values of `Plan.sampled` there, shape (sampled, 1).
        """
        source, target = np.array(self.plan.carried).T
        self.block[source], self.block[list(self.plan.sampled)] = self.block[target], sample
        for name in self.plan.onward:
            self.run(name)

    def _before(self, x: Array, first: Array, out: Array) -> None:
        out[..., 1:] = x[..., :-1]
        out[..., :1] = first[..., :1]

    def _bind(self, program: Program) -> list[Call]:
        """Return the calls of a program; a register is free again after its last reader."""
        times, block = program.times, self.block[:, : self._width]
        functions = {**_UFUNCS, "before": self._before}
        shape = (self._width,) if times == 1 else (times, self._width)
        scratch = np.empty((2, *shape))
        kept = set(program.outputs.values())
        last = {x: k for k, node in enumerate(program.nodes) for x in operands(node)}
        last |= dict.fromkeys(kept, len(program.nodes))
        own = {} if times > 1 else _written_at_once(program, last)
        place: list[Any] = []
        free: dict[type, list[Array]] = {np.float64: [], np.bool_: []}
        calls: list[Call] = []
        for k, (op, *rest) in enumerate(program.nodes):
            if op == "input":
                slot = int(rest[0])
                place.append(block[slot] if times == 1 else block[slot : slot + times])
                continue
            if op == "node":
                _, lane = place_of(int(rest[1]), self.lanes)
                place.append(self.block[int(rest[0]), lane : lane + 1])
                continue
            if op == "const":
                place.append(np.float64(rest[0]))
                continue
            arguments = [int(x) for x in rest]
            kind = np.bool_ if op == "larger" else np.float64
            read = [place[x] for x in arguments]
            ended = {x for x in arguments if last[x] == k and program.nodes[x][0] not in LEAVES}
            if op == "where" and arguments[2] in ended:  # chosen in the place of its last operand
                ended.remove(arguments[2])
                out = read[2]
            elif k in own:
                out = block[own[k]]
            else:
                out = free[kind].pop() if free[kind] else np.empty(shape, kind)
            place.append(out)
            if op == "larger":
                sizes = zip(read, scratch, strict=True)
                calls += [(np.absolute, pair) for pair in sizes] + [(np.greater, (*scratch, out))]
            elif op == "where":  # every other operation where rows are chosen; two calls are
                decision, chosen, otherwise = read  # quicker than one of Python around them
                calls += [(np.copyto, (out, otherwise))] if out is not otherwise else []
                calls.append((np.putmask, (out, decision, chosen)))
            elif op in _EXTREMES:
                calls.append((partial(_EXTREMES[op], out=out), (*read,)))
            else:
                calls.append((functions[op], (*read, out)))
            for x in ended:
                free[np.bool_ if program.nodes[x][0] == "larger" else np.float64].append(place[x])
        # an input that goes to another slot must survive the output that overwrites its own
        for node in kept:
            if program.nodes[node][0] in ("input", "node"):
                copy = np.empty(shape)
                calls.append((np.copyto, (copy, place[node])))
                place[node] = copy
        write = np.copyto if times == 1 else _largest
        return calls + [
            (write, (block[slot], place[node]))
            for slot, node in program.outputs.items()
            if own.get(node) != slot or place[node].base is not self.block
        ]

    def track(self, sides: Sequence[Side], start: Array, n: int) -> NumpyTrack:
        """Bind the samples of one motion, n in all, and its start: values of the targets in
        `Plan.carried`, in order.
        """
        return NumpyTrack(self, sides, start, n)

    @property
    def room(self) -> int:
        """Lanes with those that fill up the last vector."""
        return self.lanes

    def table(self, columns: int) -> Array:
        """Return an empty output array of `run_motions`, shape (kept, columns, room)."""
        return np.empty((len(self.plan.kept), columns, self.room))

    def run_motions(self, samples: Array, out: Array, worst: Array, first: int, step: int) -> None:
        """Follow one motion per lane through the same samples, each lane alone.

        Args:
            samples: `Plan.sampled`, shape (sampled, n).
            out: output table of `Plan.kept`; NaN from the first rejected sample of a lane.
            worst: in and out: the largest of `Plan.largest` and the smallest of `Plan.smallest` per
                lane, over its previous value and all samples; NaN for a lane with a rejected
                sample. Shape (largest and smallest, room).
            first, step: column of the first sample, and the step to the next: 1 or -1.
        """
        plan, block = self.plan, self.block
        kept, remembered = list(plan.kept), list(plan.remembered)
        source, target = np.array(plan.carried_on).T
        past = block[plan.past : plan.past + NODES * len(remembered)].reshape(NODES, -1, self.lanes)
        alive = np.ones(self.lanes, dtype=np.bool_)
        for k, sample in enumerate(samples.T):
            accepted = self._try_sample("extend", sample) if k >= NODES else ~alive
            if (alive & ~accepted).any():
                if k >= NODES:
                    self.go_back(samples[:, k - 1, None])
                    self.carry()
                accepted = self._try_sample("predict", sample)
            alive &= accepted
            out[:, first + step * k] = np.where(alive, block[kept], np.nan)
            self._worsen(worst)
            past[k % NODES] = block[remembered]
            if k + 1 < NODES:
                for name in plan.remaining:
                    self.run(name)
                self.carry()
            else:
                block[target] = block[source]
        worst[:, ~alive] = np.nan

    def _worsen(self, worst: Array) -> None:
        largest, smallest = np.split(worst, [len(self.plan.largest)])
        np.maximum(largest, self.block[list(self.plan.largest)], out=largest)
        np.minimum(smallest, self.block[list(self.plan.smallest)], out=smallest)

    def _try_sample(self, start: str, sample: Array) -> NDArray[np.bool_]:
        self.block[list(self.plan.sampled)] = sample[:, None]
        self.settle(start, self.plan.alone)
        return self.block[self.plan.slots[MARGIN]] > 0.0

    def groups(self, lanes: int) -> int:
        """Return the number of vector groups that hold so many lanes."""
        return 1

    def parts(self, parts: Parts) -> Callable[[int, int], object]:
        """Return a call that attempts the parts of a large mechanism in order, on the current
        values of their arrays.

        Its arguments are a solved lane, whose values carried slots of each part take before, -1 for
        none; and the number of groups. Each lane is attempted alone.
        """
        plan, block = self.plan, self.block
        solved, given = map(plan.fixed_from, (plan.kept, plan.sampled))

        def call(lane: int, groups: int) -> None:
            for member, sources in zip(parts.members.tolist(), parts.taken, strict=True):
                row, own = parts.base + member * len(plan.kept), parts.fixed[member]
                if lane >= 0:
                    for k, to in solved:
                        own[to] = parts.world[row + k, lane]
                    for k, to in given:
                        own[to] = parts.samples[k, lane]
                if not groups:
                    continue
                block[list(plan.fixed)] = own[:, None]
                block[list(plan.sampled)] = parts.samples
                block[list(plan.taken)] = parts.world[sources]
                self.attempt()
                parts.world[row : row + len(plan.kept)] = block[list(plan.kept)]
                self._worsen(parts.worst)

        return call


def leading(margins: Array | NDArray[np.bool_]) -> int:
    """Return the number of accepted lanes before the first rejected one."""
    good = margins > 0.0
    return len(good) if good.all() else int(good.argmin())


def _spread(lanes: int) -> NDArray[np.intp]:
    """Return the lanes of the `NODES` among as many lanes or more."""
    return np.array([place_of(k, lanes)[1] for k in range(NODES)])


def lagrange(times: Array, nodes: Array) -> Array:
    """Lagrange's weights for the times, shape (n,), of nodes for each; nodes and weights have shape
    (nodes, n).
    """
    found, ahead = np.empty_like(nodes), times - nodes
    with np.errstate(all="ignore"):
        for k, node in enumerate(nodes):  # one after the other: there may be millions of samples
            factors = ahead / (node - nodes)
            factors[k] = 1.0
            found[k] = factors.prod(axis=0)
    return found


class NumpyTrack:
    """One motion, followed along both sides of its start, through known samples.

    Attributes:
        anchors: current state of each side: values of the targets in `Plan.carried`, a row per
            side.
        worst: the largest of `Plan.largest`, or zero, and the smallest of `Plan.smallest`, over all
            samples stored since `begin`.
    """

    def __init__(
        self, executor: NumpyExecutor, sides: Sequence[Side], start: Array, n: int
    ) -> None:
        self._executor, self._sides, self._start, self._n = executor, sides, start, n
        self.anchors = np.tile(start, (len(sides), 1))

    def begin(self) -> Array:
        """Return an array for `Plan.kept` of all samples, shape (kept, n), filled from now on.

        The caller must hold it during the motion: it may be large, so the track keeps no reference.
        """
        plan = self._executor.plan
        self.worst = np.repeat([0.0, np.inf], [len(plan.largest), len(plan.smallest)])
        self._kept = np.empty((len(plan.kept), self._n))
        return self._kept

    def run(self) -> Sequence[int]:
        """Follow every side from the start to its end; return the first rejected sample of each, or
        its count.

        The anchor of a completed side is invalid: no program prepares it for a continuation.
        """
        return [self.follow(k, 0, side.count, anew=True) for k, side in enumerate(self._sides)]

    def follow(self, side: int, at: int, stop: int, *, anew: bool) -> int:
        """Attempt the next samples of a side as neighbouring lanes, and go on from the last
        accepted one.

        Args:
            at, stop: the next sample, and the one before which to end.
            anew: begin at the start instead of the side's anchor. The anchor moves along.

        Returns:
            The first rejected sample, or stop.
        """
        executor, samples = self._executor, self._sides[side].samples
        plan, block, lanes = executor.plan, executor.block, executor.lanes
        extrapolates = plan.extrapolates(lanes)
        carried, moved = (
            np.array(each).T
            for each in (plan.carried, plan.moves if extrapolates else plan.carried)
        )
        sampled, smooth, wanted = list(plan.sampled), False, lanes
        nodes, times = _spread(lanes), samples[0, :0]
        block[carried[1]] = (self._start if anew else self.anchors[side])[:, None]
        while at < stop:
            count = min(wanted, stop - at)
            block[sampled, :count] = samples[:, at : at + count]
            block[sampled, count:] = samples[:, at + count - 1, None]
            if smooth:
                block[sampled[-NODES:]] = lagrange(block[sampled[0]], times)
            executor.settle("extrapolate" if smooth else "predict", plan.joined, count)
            accepted = leading(block[plan.slots[MARGIN], :count])
            if accepted:
                self._keep(self._sides[side], at, block[:, :accepted])
            elif smooth:  # continue from the last accepted sample by its rates
                executor.go_back(samples[:, at - 1 : at])
            else:
                break
            smooth = extrapolates and accepted >= NODES and at + accepted < stop
            for name in () if smooth or not accepted else plan.remaining:
                executor.run(name)
            if smooth:  # the nodes are all over the lanes accepted, however many
                chosen = _spread(accepted)
                block[:, nodes] = block[:, chosen]
                times = np.repeat(samples[0, at + chosen, None], lanes, axis=1)
            source, target = moved if smooth else carried
            block[target] = block[source, nodes[-1] if smooth else max(accepted - 1, 0), None]
            at, wanted = at + accepted, min(lanes, 1 + int(GROWS * accepted))
        self.anchors[side] = block[carried[1], 0]
        return at

    def _keep(self, side: Side, at: int, found: Array) -> None:
        plan = self._executor.plan
        self._kept[:, side.first + side.step * np.arange(at, at + found.shape[1])] = found[
            list(plan.kept)
        ]
        largest, smallest = np.split(self.worst, [len(plan.largest)])
        np.maximum(largest, found[list(plan.largest)].max(axis=1), out=largest)
        np.minimum(smallest, found[list(plan.smallest)].min(axis=1), out=smallest)
