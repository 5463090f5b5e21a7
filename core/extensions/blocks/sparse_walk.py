"""The walk of a sparse system by machine code: eight samples are predicted, iterated and tested,
and the walk goes on from the last of them.

Its programs test as `SparseLanes` tests with arrays. If a factor strays, or other rows are to be
chosen, the walk ends, and arrays decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar
from ...kinematics.compiled.dense_equations import GEOMETRY
from ...kinematics.compiled.request import (
    ACCEPT,
    FROM,
    MAX_ITERATIONS,
    PREDICTED,
    RATE,
    RATE_T,
    SIGMA,
    SMALLEST_OF_PARTS,
    TIME,
    Layout,
)
from ...kinematics.compiled.step_programs import GAPS, MOVED, candidate, limits
from ...kinematics.formulation.acceptance_criteria import (
    EPSILON,
    FALLS,
    LOW,
    Block,
    known_slope,
    margins,
    slope_between,
)
from ...program import (
    ITERATIONS,
    MARGIN,
    Parts,
    Plan,
    Program,
    Tape,
    before,
    maximum,
    minimum,
    program,
    where_larger,
)
from ...program.numpy_executor import lagrange
from ...trajectory import Array
from ..llvm.bytecode import Bytecode, bytecode, repeated
from ..llvm.executor import LlvmExecutor, LlvmWalk
from ..llvm.jit import LlvmCode
from ..llvm.plan import address, aligned
from .elements import AFTER, LargeSystem
from .fixed_order import LANES, load_loops
from .sparse_lu import GROWTH, Rows
from .sweep import CLOSURES, MARGINS, SIGMAS

Indices = NDArray[np.intp]
# Residuals below this, some round-offs in rows of size one, are as small as they get; elsewhere an
# iteration that gains less than a digit shows that they are.
SETTLED, STALLS = 1e-15, 0.1
FARTHEST = 1.2
"""Largest reach of the polynomial beyond its poses, in their span: the next eight samples of an
even sweep are 8 / 7 of it ahead.
"""


@dataclass(frozen=True, eq=False)
class Poses:
    """Solved poses, one a lane along the last axis, or a single one without that axis.

    Attributes:
        sample: inputs of the equations, the time first.
        state: the pose.
        rates, accelerations: of the unknowns.
        sigmas, slopes: of the blocks, and their change by the pose, zero if unknown.
        largest, high: largest sigmas so far, and since other rows were looked for.
        sign: of the determinant.
    """

    sample: Array
    state: Array
    rates: Array
    accelerations: Array
    sigmas: Array
    slopes: Array
    largest: Array
    high: Array
    sign: Array

    def lane(self, k: int) -> Poses:
        """Return one of the poses."""
        return Poses(*(getattr(self, each.name)[..., k] for each in fields(self)))

    @property
    def time(self) -> float:
        """The time of a single pose [s]."""
        return float(self.sample[0])


def _joined(x: Scalar, join: Callable[[Scalar, Scalar], Scalar], fall: float = 1.0) -> Scalar:
    """Return the join of a lane and all before it, which fall by a factor a lane."""
    for lanes in (1, 2, 4):
        there = reduce(lambda y, _: before(y, y), range(lanes), x)
        x = join(x, fall**lanes * there)
    return x


def _strays(growth: Scalar, inverse: Scalar) -> Scalar:
    """Return one for lanes with an unbelievable factor, else zero."""
    return where_larger(GROWTH, growth, where_larger(math.inf, inverse, 0.0, 1.0), 1.0)


def _taylor(time: Scalar, start: Scalar, rate: Scalar, rate_t: Scalar) -> Sequence[Scalar]:
    h = time - start
    return [h * (rate + (0.5 * h) * rate_t)]


def _decide(
    closure: Scalar,
    last: Scalar,
    tol: Scalar,
    active: Scalar,
    count: Scalar,
    strayed: Scalar,
    growth: Scalar,
    inverse: Scalar,
) -> Sequence[Scalar]:
    """Return zero for lanes that are done, one for others, infinity for lost ones; the residual
    before the next iteration; the others, the iterations, and whether a factor has strayed.
    """
    gains = where_larger(closure, STALLS * last, 1.0, 0.0)
    done = where_larger(SETTLED, closure, 1.0, where_larger(tol, closure, gains, 0.0))
    going = where_larger(math.inf, closure, 1.0, math.inf)
    residual = where_larger(done, 0.5, 0.0, going)
    strayed = maximum(strayed, active * _strays(growth, inverse))
    return residual, closure, where_larger(2.0, residual, residual, 0.0), count + active, strayed


def _same(x: Scalar) -> Sequence[Scalar]:
    return [x]


def _begin() -> Sequence[Scalar]:
    return math.inf, 0.0, 0.0, 0.0


def _zero() -> Sequence[Scalar]:
    return [0.0]


def _infinite() -> Sequence[Scalar]:
    return [math.inf]


def _step(step: Scalar, active: Scalar) -> Sequence[Scalar]:
    return [where_larger(active, 0.5, -step, 0.0)]


def _distances(
    x: Scalar, predicted: Scalar, start: Scalar, scale: Scalar, zero: Scalar
) -> Sequence[Scalar]:
    """Return the distances of a number of the state: from its prediction, less the same of the lane
    before; from the lane before; and from the start.
    """
    off = x - predicted
    return [scale * each for each in (off - before(off, zero), x - before(x, start), x - start)]


def _sigma(left: Any, right: Scalar, last: Scalar, largest: Scalar, high: Scalar) -> Sequence[Any]:
    """Return sigma of a block, its largest values so far, and its least distance from low before
    the lane.
    """
    sigma = (left / right).sqrt()
    found = _joined(sigma, maximum)
    now = maximum(high, found)
    low = before(_joined(sigma - LOW * now, minimum), last - LOW * high)
    return sigma, maximum(largest, found), now, low


def _test(read: Callable[[str], Scalar], turns: Sequence[str]) -> Sequence[Scalar]:
    """Return the margin of a lane by the tests of one block, NaN if arrays decide; the known slope
    of the block; and the orientation.
    """
    sigma, last = read("block_sigma"), before(read("block_sigma"), read("from_block_sigma"))
    seen = slope_between(sigma, last, read(MOVED))
    known = _joined(before(seen, known_slope(read("from_slope"))), maximum, FALLS)
    orientation = read("exchanges") * read("block_sign")
    pose = candidate(
        read,
        before=before(read(SIGMA), read("from_sigma")),
        reversal=orientation - before(orientation, read("from_orientation")),
        largest=read("largest"),
        blocks=[Block(sigma, last, maximum(seen, maximum(known, EPSILON)))],
        turns=turns,
    )
    doubts = [
        read("strayed"),
        _strays(read("growth"), read("inverse")),
        _strays(read("block_growth"), read("block_inverse")),
        where_larger(read("from_time") - read("comes"), 0.0, 1.0, 0.0),
        where_larger(maximum(-read("lowest"), 0.0), 0.0, 1.0, 0.0),
    ]
    margin = reduce(minimum, margins(pose, limits(read)).values())
    margin = where_larger(reduce(maximum, doubts), 0.5, math.nan, margin)
    return margin, maximum(seen, maximum(FALLS * known, EPSILON)), orientation


EACH: Mapping[str, Sequence[tuple[Callable[..., Sequence[Scalar]], str, str]]] = {
    "begin": [
        (_same, "from_state", "state"),
        (_taylor, "time from_time from_rate from_rate_t", "step"),
        (_begin, "", "last active iterated strayed"),
    ],
    "predicted": [(_same, "after", "predicted"), (_zero, "", "step")],
    "state": [(_same, "after", "state"), (_zero, "", "closure")],
    "decide": [
        (
            _decide,
            "closure last tolerance active iterated strayed growth inverse",
            "residual last active iterated strayed",
        )
    ],
    "turn": [(_step, "step active", "step")],
    "clear": [
        *((_zero, "", name) for name in ("block_left", "block_right")),
        *((_zero, "", name) for name in (*GAPS, "leftover")),
        *((_infinite, "", name) for name in (SIGMA, "largest", "lowest", MARGIN)),
    ],
    "sigmas": [
        (
            _sigma,
            "block_left block_right from_block_sigma from_block_largest from_block_high",
            "block_sigma block_largest block_high block_lowest",
        ),
        (_distances, "state predicted from_state scale zero", "gaps moves reaches"),
    ],
}
"""Functions of each element of vectors: their inputs and outputs."""
TESTED = (
    "gap moved reach done closure leftover branch sigma largest lowest exchanges strayed comes"
    " block_sigma tolerance consistent crossing growth inverse block_growth block_inverse"
    " block_sign from_time from_sigma from_block_sigma from_slope from_orientation"
)
JOINED = {
    "squares": ("squares", "left block_left_of_row right block_right_of_column"),
    "close": ("largest", "solved_phi closure"),
    "differ": ("largest", "left_out leftover gaps gap moves moved reaches reach"),
    "least": ("least", "block_sigma sigma block_largest largest low lowest"),
    "accept": ("least", "block_margin margin"),
}
"""What is joined to what, see `fixed_order.JOINED`."""
SOLVED: Mapping[str, Mapping[str, tuple[str, str, bool]]] = {
    "growth": {
        "solve": ("solved_phi", "step", False),
        "rates": ("solved_nu", RATE, False),
        "accelerations": ("solved_gamma", RATE_T, False),
    },
    "block_growth": {"left": ("tried", "left", True), "right": ("left", "right", False)},
}
"""What is solved by the factors with this growth: right-hand sides, solutions, and whether by the
transposed ones.
"""
EVALUATED = "state rows close decide"
SEQUENCES = {
    "predict": f"begin retract predicted continue retract {EVALUATED}",
    "newton": f"growth solve turn retract {EVALUATED}",
    "alone": "growth rates gamma accelerations outputs block_growth left right clear squares sigmas"
    " differ least test accept",
}
"""The calls of the programs of a walk."""
CARRIED = "state rate rate_t block_sigma slope block_largest block_high orientation sigma"
"""Carried from one sample to the next, in the order of `Poses`, and sigma."""


def _each(
    function: Callable[..., Sequence[Scalar]], read: Sequence[Indices], write: Sequence[Indices]
) -> tuple[Bytecode, Indices]:
    """Return a function of slots, of each element its own, as a table with their places."""
    tape = Tape()
    found = enumerate(function(*map(tape.input, range(len(read)))), len(read))
    traced = program("each", tape, dict(found))
    places = np.stack(np.broadcast_arrays(*read, *write))
    return bytecode(traced, len(places), 1), places


def _in_pairs(slots: Sequence[Indices]) -> Indices:
    """Return the number of pairs of slots, and the pairs."""
    pairs = [
        np.stack(np.broadcast_arrays(*each), axis=1)
        for each in zip(slots[::2], slots[1::2], strict=True)
    ]
    return np.append(sum(map(len, pairs)), np.concatenate(pairs))


class SparseWalk:
    """A sparse system with its solved rows, ready to walk.

    Args:
        scale: unit of the changes of each number of the state, shape (numbers, 1).
        turns: names of the angles of turning drivers.
        wanted: vectors of the wanted motions.

    Attributes:
        rows: the solved ones.
        worst: tests of the last eight samples, see `Lanes`.
    """

    def __init__(
        self,
        system: LargeSystem,
        rows: Rows,
        scale: Array,
        turns: Sequence[str],
        wanted: Sequence[str],
    ) -> None:
        self.rows, self._orders, self._layout = rows, list[object](), Layout()
        layout, n, blocks = self._layout, system.unknowns, rows.blocks.count
        layout.slots, layout.vectors = ({**x} for x in vars(system.tracer.layout).values())
        for k in range(system.stride - len(layout.slots)):
            layout.scalar(f"cell {k}")
        sizes = {
            "rate rate_t from_rate from_rate_t left right tried": n,
            "block_sigma slope block_largest block_high from_block_sigma from_slope": blocks,
            "from_block_largest from_block_high block_left block_right": blocks,
            "block_lowest block_margin": blocks,
            "gaps moves reaches scale": len(scale),
            "weights": LANES,
            "exchanges": 1,
        }
        for names, count in sizes.items():
            for name in names.split():
                layout.vector(name, count)
        # factors write three slots, one after the other
        self._slots("growth inverse sign block_growth block_inverse block_sign")
        vectors = layout.vectors
        labels = {"state": "", "predicted": PREDICTED, "from_state": FROM, "after": AFTER}
        for name, label in labels.items():
            vectors[name] = [slot for each in system.names for slot in vectors[label + each]]
        chosen = {
            **{f"solved_{name}": (name, rows.kept) for name in ("phi", "nu", "gamma")},
            "left_out": ("phi", rows.dropped),
            "low": ("block_lowest", range(blocks if len(rows.dropped) else 0)),
            "block_left_of_row": ("block_left", rows.blocks.of_rows),
            "block_right_of_column": ("block_right", rows.blocks.of_columns),
        }
        for name, (whole, places) in chosen.items():
            vectors[name] = [vectors[whole][k] for k in places]
        of_turns = *turns, *(FROM + name for name in turns)
        tested = *TESTED.split(), *of_turns

        def test(*values: Scalar) -> Sequence[Scalar]:
            given = dict(zip(tested, values, strict=True))
            given |= {FROM + each: before(given[each], given[FROM + each]) for each in turns}
            return _test(given.__getitem__, turns)

        tests = {"test": [(test, tested, "block_margin slope orientation")]}
        found = {
            name: [_each(how, self._slots(given), self._slots(out)) for how, given, out in parts]
            for name, parts in {**EACH, **tests}.items()
        }
        self._joined = {
            name: (how, _in_pairs(self._slots(slots))) for name, (how, slots) in JOINED.items()
        }
        carried = [*zip(self._slots(CARRIED), self._slots(CARRIED, "from_"), strict=True)]
        kept = np.concatenate([source for source, _ in carried]).tolist()
        self._ends = np.cumsum([len(source) for source, _ in carried])
        since = "from_time", *of_turns[len(turns) :]
        carried += zip(self._slots((TIME, *turns)), self._slots(since), strict=True)
        pairs = np.concatenate([np.stack(each, axis=1) for each in carried]).tolist()
        sampled = np.concatenate([system.sampled, *self._slots("weights near comes")]).tolist()
        motions = np.concatenate([np.empty(0, np.intp), *self._slots(wanted)]).tolist()
        self._slots(("residual", ITERATIONS))
        tables = {name: repeated(each, len(layout.slots), LANES) for name, each in found.items()}
        tables |= system.tables or {}
        calls = {each for name, parts in SEQUENCES.items() for each in (name, *parts.split())}
        plan = Plan(
            {name: Program(name, (), {}) for name in sorted(calls)},
            layout.slots,
            alone=["alone"],
            sampled=sampled,
            carried=[*map(tuple, pairs)],
            kept=[*kept, *motions],
            largest=[layout.scalar(name) for name in ("closure", "leftover", "iterated")],
            smallest=[layout.scalar(name) for name in SMALLEST_OF_PARTS],
            fixed=[*(target for _, target in pairs), *map(layout.scalar, ACCEPT)],
            tolerance=0.5,
            most=MAX_ITERATIONS,
        )
        self._code = LlvmCode(plan, math.inf, tables, LANES)
        self._executor = LlvmExecutor(self._code, LANES)
        constants = {GEOMETRY: system.geometry, "scale": scale, "tried": rows.blocks.start}
        for name, values in constants.items():
            if len(values):
                self._executor.put(vectors[name], values)
        room = [aligned(len(x) * LANES).reshape(-1, LANES) for x in (plan.kept, plan.best, sampled)]
        self._own, (self._world, self.worst, given) = np.zeros((1, len(plan.fixed))), room
        whither, weights = _in_pairs(self._slots("after state")), self._slots("weights near")
        at = address(self._world), weights[0][0], weights[1][0]
        self._joined["continue"] = "continue", np.insert(whither, 1, at)
        one, none = np.zeros(1, np.int64), np.zeros((1, 0), np.int64)
        parts = Parts(one, self._own, given, none, self._world, 0, self.worst)
        self._walk = LlvmWalk(
            [self._executor.parts(parts)],
            LANES,
            np.arange(len(kept), len(plan.kept)),
            plan.best.ravel(),
            (CLOSURES, SIGMAS, MARGINS),
        )

    def _slots(self, names: str | Sequence[str], before: str = "") -> list[Indices]:
        """Return the slots of vectors, or of scalars."""
        given = names.split() if isinstance(names, str) else names
        vectors, scalar = self._layout.vectors, self._layout.scalar
        return [
            np.array(vectors[name] if name in vectors else [scalar(name)], np.intp)
            for name in (before + each for each in given)
        ]

    def _take_orders(self) -> bool:
        """Take the present orders of elimination; return whether there are any."""
        orders = [each.order for each in (self.rows.pattern, self.rows.blocks.pattern)]
        if None in orders:
            return False
        if orders == self._orders:
            return True
        self._orders, tables = orders, dict[str, Sequence[Any]](self._joined)
        sources = np.concatenate(self._slots("entries zero"))
        for (growth, solved), order in zip(SOLVED.items(), orders, strict=True):
            assert order is not None
            tables[growth] = "factor_lanes", *order.factors.factoring(sources, *self._slots(growth))
            for name, (right, solution, transposed) in solved.items():
                given, found = self._slots((right, solution))
                tables[name] = "solve_lanes", *order.solving(given, found, transposed=transposed)
            # that of the blocks stays
            self._executor.put(self._layout.vectors["exchanges"], np.full((1, 1), order.sign))
        entries, calls, loops = self._code.memory.entries, self._code.memory.calls, load_loops()
        for name, (function, table, *_) in tables.items():
            entries[calls[name]] = loops.address(function), address(table)
        for name, sequence in SEQUENCES.items():
            parts = sequence.split()
            table = np.append(len(parts), entries[[calls[each] for each in parts]])
            tables[name], entries[calls[name]] = (
                [table],
                (loops.address("sequence"), address(table)),
            )
        self._alive = tables
        return True

    def __call__(
        self,
        here: Poses,
        since: Array,
        table: Array,
        count: int,
        known: tuple[Array, Array] | None,
        bound: float,
    ) -> tuple[Array, Array, Poses]:
        """Follow samples; return the wanted motions and the tests of those followed, and the pose
        of the last.

        Args:
            here: the pose before.
            since: its time and angles of turning drivers, and the numbers of `ACCEPT`.
            table: of samples, eight more than their count.
            known: times and poses of the eight samples before, or None.
            bound: of the residual, by the square of sigma.
        """
        if not self._take_orders():
            return np.empty((0, 0)), np.empty((0, 0)), here
        start = [getattr(here, each.name).reshape(-1) for each in fields(here)[1:]]
        self._own[0] = np.concatenate([*start, here.sigmas.min(keepdims=True), since])
        times, before = table[0], np.full(LANES, np.nan)
        if known is not None:
            before, self._world[: self._ends[0]] = known
        groups = LANES * (np.arange(len(times)) // LANES)
        nodes = np.append(before, times)[groups + np.arange(LANES)[:, None]]
        near = np.abs(times - nodes[-1]) <= FARTHEST * np.abs(nodes[-1] - nodes[0])
        weights, comes = lagrange(times, nodes), nodes[-1].copy()
        comes[:LANES] = here.time
        samples = np.concatenate([table, weights, near[None], comes[None]])
        motions, tests = self._walk([samples], count, (EPSILON, bound))
        if followed := tests.shape[1]:
            parts = [table[:, followed - 1], *np.split(self._own[0].copy(), self._ends)]
            of_pose = {each.name: part for each, part in zip(fields(here), parts, strict=False)}
            here = Poses(**of_pose | {"sign": of_pose["sign"][0]})
        return motions, tests, here

    @property
    def poses(self) -> Array:
        """The poses of the last eight samples, shape (numbers, lanes)."""
        return self._world[: self._ends[0]].copy()
