"""A large mechanism as one sparse system bound to lanes, one sample a lane: a list of one block.

The equations are elements without an elimination; the poses of all lanes are factored at once.
Lengths are measured near the size of the bodies, not of the whole mechanism: the entries of the
matrix and the round-off of the rows depend on that size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SolveError
from ...failures import FailureKind, PoseFailure
from ...kinematics.compiled.compiled_model import ASSEMBLING, CLOSED, STILL
from ...kinematics.compiled.dense_equations import System
from ...kinematics.compiled.programs import Tracer
from ...kinematics.compiled.request import ACCEPT, MAX_ITERATIONS, Request
from ...kinematics.compiled.solution import Columns
from ...kinematics.continuation.segments import BETTER, SEEN
from ...kinematics.continuation.singular_poses import SOUND, Anchor, Numbers
from ...kinematics.continuation.walk import failure_kind
from ...kinematics.formulation.acceptance_criteria import (
    EPSILON,
    FALLS,
    LOW,
    Block,
    Candidate,
    Limits,
    known_slope,
    least_slope,
    margins,
    slope_between,
)
from ...kinematics.formulation.constraints import measured
from ...kinematics.formulation.state_vectors import turns
from ...kinematics.structure.degrees_of_freedom import (
    NullSpaces,
    freedom_account,
    locked_drivers,
    require_driven,
)
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import before, maximum
from ...program.numpy_executor import lagrange
from ...trajectory import Array
from ..llvm.machine_code import works
from .elements import LargeSystem
from .sparse_lu import FactorsOfLanes, Rows, SingularError
from .sparse_walk import FARTHEST, SETTLED, STALLS, Poses, SparseWalk
from .sweep import CERTAIN, MARGINS, WORST, Indices, Lanes

POSES = 8
"""Poses evaluated together: samples that are so far from the last one are still predicted well."""
FEW = 5
"""Names listed in a message, at most."""
# Steps of inverse iteration: each divides what is left of other directions by the square of how
# much better they are determined.
STEPS = 3


class Rest(NamedTuple):
    """Residuals, right-hand sides of the velocities and entries of the Jacobian at poses, and the
    largest residual of the solved rows of each.
    """

    phi: Array
    nu: Array
    entries: Array
    closure: Array


class Solved(NamedTuple):
    """Poses after Newton's iteration, shape (numbers, lanes) or (lanes,)."""

    state: Array
    rest: Rest
    iterations: Array
    done: NDArray[np.bool_]


class Motion(NamedTuple):
    """Rates and accelerations at poses, NaN where rows are singular; the factors, and the regular
    lanes.
    """

    rates: Array
    accelerations: Array
    factors: FactorsOfLanes
    regular: Indices


def largest_size(values: Array) -> Array:
    """Return the largest size of the numbers of each lane, zero without any; NaN if one is."""
    found: Array = np.maximum.reduce(np.abs(values), axis=0, initial=0.0)
    return found


def falling(slope: Array, observed: Array) -> tuple[Array, Array]:
    """Return the slopes known before and after neighbouring lanes, shape (blocks, lanes): what is
    known falls by a factor a lane, as if each were attempted alone.
    """
    powers = FALLS ** np.arange(POSES + 1.0)
    seen = np.maximum.accumulate(np.column_stack([slope, observed]) / powers, axis=1)
    known = np.maximum(powers * seen, EPSILON)
    return known[:, :-1], known[:, 1:]


def _numbers(here: Poses) -> Numbers:
    return Numbers(here.state, np.concatenate([here.rates, here.accelerations]))


class SparseLanes(Lanes):
    """A sparse system bound to lanes.

    Attributes:
        system: the equations.
        here: the pose before the lanes.
        rows: the solved ones.

    Raises:
        SolveError: the mechanism cannot move, has more degrees of freedom than drivers, or does not
            close at the design position.
    """

    many = POSES
    here: Poses
    rows: Rows
    _walk: SparseWalk | None = None
    _known: tuple[Array, Array] | None = None
    """Times and poses of the lanes before, if all were accepted."""

    def __init__(self, mechanism: Mechanism, request: Request) -> None:
        if not mechanism.moving:
            require_driven(mechanism)
        self.mechanism, self.request = mechanism, request
        extent, frame = measured(mechanism)
        self.unit = frame.unit
        system = LargeSystem if request.compiled and works() else System
        self.system = system(Tracer(mechanism, request, frame=frame))
        # what a change of the state is measured by: lengths by the mechanism's size
        self._scale = np.ones((len(self.system.design), 1))
        for name, at in self.system.names.items():
            if name.startswith("u ") or name.endswith(".translation"):
                self._scale[at] = frame.unit / extent
        names = ["time", *(f"drive {name}.{k}" for name in request.drivers for k in range(5))]
        self._turns = turns(mechanism, request.drivers)
        self._angles = [names.index(name) for name in self._turns]
        self._vectors = [*Columns(request).by_vector]
        self.worst = np.zeros((len(WORST), POSES))
        self.here = self._close_design()
        self.design = self.anchor(0.0)
        self.begin()

    def _close_design(self) -> Poses:
        """Choose the rows, and return the design position; a rod given longer or shorter than its
        design distance is taken up here.
        """
        mechanism, system = self.mechanism, self.system
        sample = system.samples(STILL, STILL.times)
        phi, _, entries = system.evaluate(system.design, sample)
        drivers = len(mechanism.drivers)
        kept = self._independent(entries[:, 0], len(phi)) if len(phi) >= system.unknowns else None
        if kept is None:
            require_driven(mechanism)
            raise SolveError(
                f"mechanism {mechanism.name!r}: driven by {locked_drivers(mechanism)} it"
                " does not move at the design position (lock-up or dead centre); give the design"
                " in another pose, some degrees on, and sweep from there, or drive another"
                " coordinate",
                FailureKind.LOCKED,
            )
        self.rows = self._rows_of(kept, entries[:, 0])
        redundant, count = self._redundant, len(phi) - drivers
        self.details = {
            **freedom_account(mechanism, system.unknowns, count, redundant).details,
            "unknowns": system.unknowns,
            "program": system.sizes,
            "factor_entries": self.rows.pattern.factor(entries[:, 0]).entries,
        }
        found = self._iterate(system.design, sample, CLOSED, ASSEMBLING)
        (closure,) = found.rest.closure
        zero = np.zeros((system.unknowns, 1))
        (branch,) = system.outputs(found.state, sample, zero, zero)["branch"]
        if not (closure <= CLOSED and branch[0] > 0.0):
            raise SolveError(
                f"mechanism {mechanism.name!r} does not close at the design position: residual"
                f" {closure * self.unit:.3g} m after Newton's iteration, expected 0; check"
                " points, axes and lengths",
                FailureKind.NOT_CLOSED,
            )
        none = np.zeros((self.rows.blocks.count, 1))
        pose = Poses(sample, found.state, zero, zero, none, none, none, none, sample[0])
        return pose.lane(0)

    def _independent(self, entries: Array, count: int) -> Indices | None:
        system = self.system
        null = NullSpaces(system.rows, system.columns, entries, (count, system.unknowns))
        return null.independent_rows(len(self.mechanism.drivers))

    def _rows_of(self, kept: Indices, entries: Array) -> Rows:
        return Rows(kept, self.system, entries, compiled=self.request.compiled)

    @property
    def _redundant(self) -> list[str]:
        """The rows left out, as "joint: primitive"."""
        names = self.system.tracer.formulation.row_names
        return [names[row] for row in self.rows.dropped]

    def begin(self) -> None:
        """See `Lanes`."""
        self._renewed, self._known = 0, None
        self.rows.begin()

    @property
    def findings(self) -> Mapping[str, Any]:
        """See `Lanes`."""
        return {"rows_chosen_anew": self._renewed} if self._renewed else {}

    def accept_by(self, limits: Mapping[str, float]) -> None:
        """See `Lanes`."""
        self._limits = Limits(*(limits[name] for name in ACCEPT))

    def set_prediction_start(self, time: float, path: Path) -> PoseFailure | None:
        """See `Lanes`."""
        self._known = None  # of another path, perhaps
        try:
            self._stand_at(self.sample_tables(np.array([time]), path)[0])
        except SingularError:
            return PoseFailure(FailureKind.SINGULAR_ROWS)
        return None

    def _stand_at(self, sample: Array) -> None:
        """Stand at the pose before the lanes, with rates by a sample and no step behind.

        Raises:
            SingularError: the rows are singular there.
        """
        here, state = self.here, self.here.state[:, None]
        rest = self._rest(state, sample)
        found = self._motion(state, sample, rest)
        of_lanes, (sign,) = self.rows.blocks.sigmas(rest.entries, np.arange(1))
        sigmas = of_lanes[:, 0]
        if np.isnan(sign):
            raise SingularError("a block is exactly singular")
        known = len(here.sigmas) == len(sigmas)
        largest = np.maximum(here.largest, sigmas) if known else sigmas
        self.here = replace(
            here,
            sample=sample[:, 0],
            rates=found.rates[:, 0],
            accelerations=found.accelerations[:, 0],
            sigmas=sigmas,
            slopes=here.slopes if known else np.zeros_like(sigmas),
            largest=largest,
            high=largest,
            sign=sign,
        )
        if not len(found.regular):
            raise SingularError("exactly singular")

    def anchor(self, time: float) -> Anchor:
        """See `Lanes`: the pose and its rows."""
        return Anchor(time, (self.here, self.rows), lambda pose: _numbers(pose[0]))

    def restore(self, anchor: Anchor) -> None:
        """See `Lanes`."""
        (self.here, self.rows), self._known = anchor.pose, None

    def sample_tables(self, times: Array, path: Path) -> list[Array]:
        """See `Lanes`."""
        return [self.system.samples(path, times)]

    @property
    def sound(self) -> bool:
        """See `Lanes`."""
        return bool((self.here.sigmas >= SOUND * self.here.largest).all())

    def attempt_at(self, tables: Sequence[Array], *, neighbours: bool = False) -> Array:
        """See `Lanes`."""
        (table,) = tables
        count, here = table.shape[1], self.here
        self.last = count - 1
        sample = table[:, np.minimum(np.arange(POSES), count - 1)]
        with np.errstate(all="ignore"):  # lanes that diverge are found by their residuals
            h = sample[0] - here.time
            state, rates, accelerations = (
                each[:, None] for each in (here.state, here.rates, here.accelerations)
            )
            whole = np.broadcast_to(state, (len(state), POSES))
            taylor = self.system.stepped(whole, h * (rates + (0.5 * h) * accelerations))
            start = self._start(sample[0], taylor) if neighbours else taylor
            solved = self._iterate(start, sample, self._limits.tol, MAX_ITERATIONS, count)
            self._judge(solved, sample, taylor, count, neighbours=neighbours)
        return self.worst[MARGINS, :count].copy()

    def _start(self, times: Array, taylor: Array) -> Array:
        """Return where Newton's iteration starts: on the polynomial through the lanes before, if
        the times are near enough, else at Taylor's poses. Up to eight samples ahead the polynomial
        saves an iteration. It magnifies round-off 1e4 times; one iteration removes that.
        """
        if self._known is None:
            return taylor
        nodes, states = self._known
        if np.abs(times - nodes[-1]).max() > FARTHEST * abs(nodes[-1] - nodes[0]):
            return taylor
        weights = lagrange(times, np.repeat(nodes[:, None], len(times), axis=1))
        return self.system.stepped(states @ weights, np.zeros((self.system.unknowns, len(times))))

    def _iterate(
        self, state: Array, sample: Array, tol: float, most: int, count: int = 1
    ) -> Solved:
        """Iterate the first lanes until their residuals get no smaller."""
        kept, iterations = self.rows.kept, np.zeros(state.shape[1])
        last = np.full(state.shape[1], np.inf)
        while True:
            rest = self._rest(state, sample)
            closure = rest.closure
            done = (closure <= SETTLED) | ((closure <= tol) & (closure > STALLS * last))
            active = np.flatnonzero((~done & (closure < np.inf))[:count])
            if not len(active) or iterations.max() >= most:
                return Solved(state, rest, iterations, done)
            factors = self.rows.pattern.factor_lanes(rest.entries, active)
            step = np.zeros((len(kept), len(done)))
            step[:, active] = -factors.solve(rest.phi.take(kept, axis=0))[:, active]
            state, last = self.system.stepped(state, step), closure
            iterations[active] += 1.0

    def _rest(self, state: Array, sample: Array) -> Rest:
        phi, nu, entries = self.system.evaluate(state, sample)
        return Rest(phi, nu, entries, largest_size(phi.take(self.rows.kept, axis=0)))

    def _motion(self, state: Array, sample: Array, rest: Rest, count: int | None = None) -> Motion:
        """Return the motion of the first lanes."""
        kept, lanes = self.rows.kept, np.flatnonzero(rest.closure[:count] < np.inf)
        factors = self.rows.pattern.factor_lanes(rest.entries, lanes)
        rates = factors.solve(rest.nu.take(kept, axis=0))
        gamma = self.system.gamma(state, sample, rates)
        return Motion(
            rates, factors.solve(gamma.take(kept, axis=0)), factors, factors.regular(lanes)
        )

    def _judge(
        self, solved: Solved, sample: Array, taylor: Array, count: int, *, neighbours: bool
    ) -> None:
        """Test lanes, and keep what is found of them."""
        here, system, rows = self.here, self.system, self.rows

        def previous(values: Array, first: Array) -> Array:
            """Return the values of the pose before each lane, those of the first one given."""
            return (
                before(values, first)
                if neighbours
                else np.broadcast_to(first[..., None], values.shape)
            )

        state, rest = solved.state, solved.rest
        motion = self._motion(state, sample, rest, count)
        sigmas, sign = rows.blocks.sigmas(rest.entries, motion.regular)
        self.outputs = system.outputs(state, sample, motion.rates, motion.accelerations)
        (branch,) = self.outputs["branch"]
        closure, leftover = rest.closure, largest_size(rest.phi.take(rows.dropped, axis=0))
        off = previous(state - taylor, np.zeros(len(state)))
        moved = self._distance(state - previous(state, here.state))
        observed = slope_between(sigmas, previous(sigmas, here.sigmas), moved)
        known = known_slope(here.slopes)[:, None]
        slopes = maximum(observed, least_slope(known))
        if neighbours:
            known, slopes = falling(known[:, 0], observed)
        highest: Array = np.maximum.accumulate(sigmas, axis=1)
        largest, high = (maximum(each[:, None], highest) for each in (here.largest, here.high))
        sigma: Array = np.minimum.reduce(sigmas, axis=0)
        candidate = Candidate(
            done=solved.done.astype(float),
            closure=closure,
            leftover=leftover,
            branch=branch,
            gap=self._distance(state - taylor - off),
            moved=moved,
            reach=self._distance(state - here.state[:, None]),
            turns=[sample[k] - previous(sample[k], here.sample[k]) for k in self._angles],
            sigma=sigma,
            before=previous(sigma, here.sigmas.min()),
            largest=np.minimum.reduce(largest, axis=0),
            reversal=sign - previous(sign, here.sign),
            blocks=[Block(sigmas, previous(sigmas, here.sigmas), maximum(observed, known))],
        )
        self._margins = {
            name: np.minimum.reduce(margin.reshape(-1, POSES), axis=0)
            for name, margin in margins(candidate, self._limits).items()
        }
        margin: Array = np.minimum.reduce([*self._margins.values()])
        margin[np.isnan(margin)] = -np.inf
        if neighbours and len(rows.dropped):
            low = (sigmas < LOW * high).any(axis=0)
            # with other rows, what is found beyond may be better
            margin[1:][np.logical_or.accumulate(low)[:-1]] = -np.inf
        self.worst[:] = closure, leftover, solved.iterations, sigma, margin
        self._found = Poses(
            sample,
            state,
            motion.rates,
            motion.accelerations,
            sigmas,
            slopes,
            largest,
            high,
            sign,
        )
        self._branch = branch

    def _distance(self, change: Array) -> Array:
        """Return the largest of changes of the state, each number by its scale, shape (lanes,)."""
        return largest_size(change * self._scale)

    def carry(self, lane: int) -> None:
        """See `Lanes`."""
        found = self._found
        self.here = found.lane(lane)
        self._known = (found.sample[0], found.state) if lane == POSES - 1 else None
        self._look_for_rows()

    def walk(
        self, tables: Sequence[Array], count: int, certain: float = CERTAIN
    ) -> tuple[Array, Array]:
        """See `Lanes`."""
        (table,), here, limits = tables, self.here, self._limits
        if not isinstance(self.system, LargeSystem) or self.system.tables is None:
            return super().walk(tables, count, certain)
        if self._walk is None or self._walk.rows is not self.rows:
            wanted = self._scale, self._turns, self._vectors
            self._walk = SparseWalk(self.system, self.rows, *wanted)
        accept = limits.tol, limits.consistent, limits.crossing
        since = np.array([here.time, *here.sample[self._angles], *accept])
        motions, tests, self.here = self._walk(
            here, since, table, count, self._known, certain * limits.tol
        )
        followed = tests.shape[1]
        self.refused = not followed and bool(self._walk.worst[MARGINS, 0] <= 0.0)
        if followed:
            whole = followed == count and not count % POSES
            last = table[0, count - POSES : count], self._walk.poses
            self._known = last if whole else None
            self._look_for_rows()
        return motions, tests

    def reach(self, times: Array, path: Path) -> int:
        """See `Lanes`."""
        given = self.sample_tables(np.append(times, times[-1:].repeat(POSES)), path)
        walked = self.walk(given, len(times), np.inf)[1].shape[1]
        return walked or super().reach(times, path)

    def _look_for_rows(self) -> None:
        """Change to better rows at the pose before the lanes, if the present ones have become much
        more singular.
        """
        crossing = self._limits.crossing > 0.0
        if (
            not crossing
            and len(self.rows.dropped)
            and (self.here.sigmas < LOW * self.here.high).any()
        ):
            self._choose_rows()

    def _choose_rows(self) -> None:
        """Change to better rows at the pose before the lanes; if none are better, remember how
        singular it is.
        """
        here, before = self.here, self.rows
        sample = here.sample[:, None]
        phi, _, entries = self.system.evaluate(here.state[:, None], sample)
        kept = self._independent(entries[:, 0], len(phi))
        least = max(BETTER * here.sigmas.min(), SEEN * here.largest.min())
        if kept is not None:
            self.rows = self._rows_of(kept, entries[:, 0])
            self._stand_at(sample)
            if self.here.sigmas.min() > least:
                self._renewed += 1
                return
        self.rows, self.here = before, replace(here, high=here.sigmas)

    def motions(self, count: int) -> Array:
        """See `Lanes`."""
        none = np.empty((0, count))
        return np.concatenate([none, *(self.outputs[k][:, :count] for k in self._vectors)])

    def uncertain(self, doubtful: Indices, tol: float, path: Path) -> Mapping[int, float]:
        """See `Lanes`."""
        state, sample = (each[:, doubtful] for each in (self._found.state, self._found.sample))
        return self.refuse_uncertain(doubtful, self.error_bounds(state, sample), tol)

    def error_bounds(self, state: Array, sample: Array) -> Array:
        """Return bounds of the errors of poses [of the mechanism's size] and of their rates and
        accelerations [of their own], as far as they are wanted; NaN at singular poses.

        Each pose is displaced as far as its residuals allow, in the direction least determined by
        the rows. The smallest singular value alone would put all samples of a large ring in doubt,
        although they are known well.

        Args:
            state, sample: shape (numbers, n), for any number of poses.
        """
        n, found = state.shape[1], [np.empty(0)]
        for first in range(0, n, POSES):
            some = np.minimum(np.arange(first, first + POSES), n - 1)
            found.append(self._error_bounds(state[:, some], sample[:, some]))
        return np.concatenate(found)[:n]

    def _error_bounds(self, state: Array, sample: Array) -> Array:
        with np.errstate(all="ignore"):  # what overflows is no number
            rest = self._rest(state, sample)
            here = self._motion(state, sample, rest)
            left = np.ones(here.rates.shape)
            for _ in range(STEPS):
                right = here.factors.solve(left / largest_size(left))
                left = here.factors.solve(right, transposed=True)
            closure = rest.closure
            step = here.factors.solve(np.maximum(closure, EPSILON) * np.sign(left))
            moved = self.system.stepped(state, step)
            there = self._motion(moved, sample, self._rest(moved, sample))
            speed, acceleration = map(largest_size, (here.rates, here.accelerations))
            off = [
                largest_size(a - b) / np.where(size == 0.0, 1.0, size)
                for a, b, size in (
                    (there.rates, here.rates, speed),
                    (there.accelerations, here.accelerations, np.maximum(acceleration, speed**2)),
                )
            ]
            every = [self._distance(moved - state), *off]
            return np.max(every[: self.request.order + 1], axis=0)

    def failure(self, tol: float) -> PoseFailure:
        """See `Lanes`."""
        refused = np.flatnonzero(~(self.worst[MARGINS, : self.last + 1] > 0.0))
        lane = int(refused[-1]) if len(refused) else self.last
        failed = [name for name, margin in self._margins.items() if not margin[lane] > 0.0]
        closure, leftover = (float(each) for each in self.worst[:2, lane])
        names = self._redundant
        few = [*names[:FEW], "..."] if len(names) > FEW else names
        kind, sigma = failure_kind(failed, closure), float(self.here.sigmas.min())
        branch = float(self._branch[lane])
        return PoseFailure(kind, closure, tol, leftover, branch, few, sigma=sigma)
