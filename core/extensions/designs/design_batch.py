"""Many variants of one mechanism along one path: lanes of the programs are variants, and geometry
is an input. The programs are compiled once.

All variants take the same samples, each predicted from its own earlier poses. Variants with a
refused sample are solved again in parts of steps, and then alone, by the march with divided steps.
Samples still out of reach are NaN, with the reason. With many bodies tied together each variant is
solved by itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...case.quantity import point_jets, still_jets
from ...dataset import Dataset, Variable
from ...driving import Driving, in_words
from ...errors import SolveError, number_of
from ...input_checks import no_such, real
from ...kinematics.compiled.compiled_model import Executor, Model
from ...kinematics.compiled.request import (
    LARGEST,
    OUTPUT,
    RESTING,
    SIGMA,
    SLOPE_OF,
    SMALLEST,
    TOWARDS,
    WantedOutput,
    accept_by,
    slots_of,
)
from ...kinematics.compiled.routes import SAME_TIME, Route, recent_route
from ...kinematics.continuation.walk import FINER, ROOM, follow_samples
from ...kinematics.formulation.acceptance_criteria import is_uncertain
from ...kinematics.formulation.parameters import every_place, placed, places
from ...kinematics.motion_solver import ONE_PROGRAM
from ...kinematics.one_design import driving_of, parse_solve_arguments, prepare
from ...kinematics.structure.degrees_of_freedom import require_driven
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Motion, Path
from ...program import ITERATIONS
from ...tabular import Tabular
from ...trajectory import QUANTITIES, Array, PointMotion, Trajectory, as_variables

# Steps of the straight way from the design to a start away from it: a sixteenth of it is a step
# like those of a sweep, and a lane for which it is too long is solved again alone.
LEAD = 16
# So many variants are solved again together in parts of steps, of which there are as many more:
# their table stays small.
SOME = 32
# Bytes of the largest blocks that are used again: glibc's own limit is twice that.
RECYCLED = 16_000_000
# What a batch does not do.
BY_ITSELF = "by itself, a variant may pass a singular pose; many at once do not"
# Nor this: it would be another program, made for the geometry of one variant.
OTHER_ROWS = (
    "what is singular may be the {count} rows chosen at the nominal design out of {all}, and not"
    " the mechanism: solve this variant by itself, and rows are chosen anew where these come to"
    " depend on each other; those of many at once stay"
)


@dataclass(frozen=True, eq=False)
class Variants:
    """Solutions of V variants at n samples, in the order of the path.

    Attributes:
        kept: the kept rows of the model (`Model.rows`), shape (kept, n, V); NaN at samples not
            reached.
        solved: whether each sample of each variant was reached, shape (n, V).
        retried: number of variants solved again.
        messages: by variant with missing samples, the reason.
    """

    kept: Array
    solved: NDArray[np.bool_]
    retried: int
    messages: Mapping[int, str]


def solve_variants(route: Route, geometry: Array, tol: float, *, alone: bool = True) -> Variants:
    """Solve all variants at all samples. Drivers are measured from the design position of each
    variant.

    A variant's numbers depend to round-off on its own geometry only, not on which others are solved
    with it.

    Args:
        route: of a model with varied places.
        geometry: numbers of the varied places in their order, shape (numbers, V).
        tol: as for `solve`.
        alone: whether to solve variants alone that fail in parts of steps too, which takes a
            hundred times as long; otherwise they end there.

    Raises:
        SolveError: the model has no varied place, or the geometry another shape.
    """
    _recycle()
    model, numbers = route.model, len(route.model.geometry)
    if not numbers or not geometry.size or len(geometry) != numbers:
        raise SolveError(
            f"designs: found numbers of shape {geometry.shape}, expected ({numbers}, designs), a"
            " row for each number of the varied places; vary one place at least"
        )
    kept, closes, worst = _together(route, geometry, tol)
    closure, sigma = (kept[model.rows[name].start] for name in ("closure", SIGMA))
    solved = np.ones(closure.shape, dtype=np.bool_)
    failed = np.flatnonzero(np.isnan(worst[SIGMA]))
    solved[:, failed] = ~np.isnan(closure[:, failed])
    again = failed[closes[failed]]
    if FINER[0] * len(closure) <= ROOM:
        for first in range(0, len(again), SOME):
            some = again[first : first + SOME]
            filled = np.resize(some, SOME)  # the executor of as many is kept
            kept[:, :, some] = _together(route, geometry[:, filled], tol, FINER[0])[0][
                :, :, : len(some)
            ]
            solved[:, some] = ~np.isnan(closure[:, some])
    messages = dict[int, str]()
    for k in failed[~solved[:, failed].all(axis=0)].tolist():
        if not closes[k]:
            messages[k] = (
                "does not close at its design position; check the points, axes and lengths of this"
                " variant"
            )
            continue
        if not alone:
            messages[k] = "ends at the first step that fails in equal parts too"
            continue
        found = follow_samples(
            replace(
                route, design=model.design_lanes(geometry[:, k : k + 1])[:, 0], given=route.begin
            ),
            tol,
        )
        kept[:, :, k], solved[:, k] = found.kept[:, route.by_time], found.solved[route.by_time]
        if found.messages:
            kept_rows, others = len(model.selection.chosen), len(model.selection.dropped)
            rows = [OTHER_ROWS.format(count=kept_rows, all=kept_rows + others)] if others else []
            messages[k] = "; ".join([*found.messages, BY_ITSELF, *rows])
    for k, message in _held(route, geometry, solved).items():
        kept[:, :, k], solved[:, k], messages[k] = np.nan, False, message
    # by the worst of each variant: to judge all samples takes a twentieth of the time
    for k in np.union1d(
        failed, np.flatnonzero(is_uncertain(worst[SIGMA], worst["closure"], tol))
    ).tolist():
        doubted = solved[:, k] & is_uncertain(sigma[:, k], closure[:, k], tol)
        if not doubted.any():
            continue
        # what is known of sigma here is an estimate, which is far too small then
        if len(model.frame.moving) > ONE_PROGRAM:
            kept[:, :, k], solved[:, k], messages[k] = _by_itself(route, geometry[:, k], tol)
            continue
        kept[:, doubted, k], solved[doubted, k] = np.nan, False
        near = route.path.where(float(route.path.times[route.by_time][doubted.argmax()]))
        refused = (
            f"refused at {number_of(int(doubted.sum()), 'sample')} so near a singular pose that"
            f" residuals leave them uncertain, as at {near}; "
        )
        messages[k] = "; ".join(
            filter(
                None,
                [
                    messages.get(k, ""),
                    f"{refused}solve this variant by itself, or keep away from it",
                ],
            )
        )
    return Variants(
        kept[:, route.back],
        solved[route.back],
        len(failed),
        {k: message for k, message in messages.items() if message},
    )


# Lanes that slopes are computed of at once: in the second-level cache.
LANES = 512


def slopes_of(route: Route, found: Variants, geometry: Array, towards: Array) -> dict[str, Array]:
    """Return the slopes of vectors; see `PreparedDesigns.slopes`."""
    model, (n, count) = route.model, found.solved.shape
    outputs = [name for name in model.vectors if name.startswith(SLOPE_OF)]
    state = [*model.state]
    poses = np.concatenate([found.kept[model.rows[name]] for name in state]).reshape(-1, n * count)
    drives = np.repeat(model.samples(route.path, route.path.times), count, axis=1)
    shifts = slots_of(model.vectors, (TOWARDS + place for place in model.varied))
    slots = slots_of(model.vectors, outputs)
    table = np.full((towards.shape[1], len(slots), n * count), np.nan)
    for first in range(0, n * count, LANES):
        some = np.arange(first, min(first + LANES, n * count))
        lanes = np.resize(some, min(LANES, n * count))  # the executor of as many is kept
        executor = model.executor(len(lanes))
        executor.clear()
        executor.put(slots_of(model.vectors, state), poses[:, lanes])
        executor.put(model.sampled[: len(drives)], drives[:, lanes])
        executor.put(model.geometry, geometry[:, lanes % count])
        executor.run("prepare")
        executor.run("outputs")
        for k, motion in enumerate(towards.T):
            executor.put(shifts, motion[:, None])
            executor.run("slopes")
            table[k][:, some] = executor.get(slots)[:, : len(some)]
    table[:, :, ~found.solved.ravel()] = np.nan
    table = table.reshape(len(table), len(slots), n, count)
    sizes = np.cumsum([len(model.vectors[name]) for name in outputs])[:-1]
    parts = np.split(table, sizes, axis=1)
    return {name.removeprefix(SLOPE_OF): each for name, each in zip(outputs, parts, strict=True)}


def _by_itself(route: Route, numbers: Array, tol: float) -> tuple[Array, NDArray[np.bool_], str]:
    """Return the kept rows of a variant solved alone, as any mechanism of its size, by time; the
    solved samples, and the reason of missing ones.
    """
    model, n = route.model, len(route.path.times)
    kept = np.full((model.kept, n), np.nan)
    try:
        variant, request = variant_of(model, numbers), model.request
        read = [name for each in request.outputs for name in each.equation.points]
        points = tuple(dict.fromkeys((*request.points, *read)))
        alone = replace(request, varied=(), points=points, outputs=())
        found = prepare(variant, alone, route.path)(tol)
    except SolveError as error:
        return kept, np.zeros(n, dtype=np.bool_), str(error)
    for name, motion in found.points.items():
        for label, values in zip(
            QUANTITIES, (motion.position, motion.velocity, motion.acceleration), strict=True
        ):
            if values is not None and f"{label} {name}" in model.rows:
                kept[model.rows[f"{label} {name}"]] = values.T
    for name, values in _outputs_of(request.outputs, variant, found).items():
        kept[model.rows[name]] = values
    kept[model.rows["closure"]], kept[model.rows[ITERATIONS]] = (
        found.residual / model.frame.unit,
        found.iterations,
    )
    kept[:, ~found.solved] = np.nan
    return kept[:, route.by_time], found.solved[route.by_time], found.message


def _outputs_of(
    outputs: Sequence[WantedOutput], mechanism: Mechanism, found: Trajectory
) -> dict[str, Array]:
    """Return the terms of outputs of the motion itself, and the speeds at which they rest, from
    points.
    """
    rows = dict[str, Array]()
    for each in (each for each in outputs if not each.alone):
        names = each.equation.points
        at = {name: point_jets(found.points[name]) for name in names}
        design = {name: still_jets(mechanism.point(name).position) for name in names}
        with np.errstate(all="ignore"):
            terms, speeds = each.equation.terms(at, design), each.equation.resting(at)
        for label, order in zip(QUANTITIES[: each.derivative + 1], "xva", strict=False):
            name = f"{OUTPUT}{label} {each.equation.name}"
            rows[name] = np.stack([getattr(term, order) for term in terms])
        if speeds is not None:
            rows[f"{RESTING}{each.equation.name}"] = np.stack(speeds)
    return rows


def _held(route: Route, geometry: Array, solved: NDArray[np.bool_]) -> dict[int, str]:
    """Return the variants that cannot move, with the rows that hold them.

    At its design every variant closes. If rows redundant at the nominal design hold it there, the
    solved rows still give it rates, and the residuals do not show it: only at a distance from the
    design do they.

    Args:
        solved: shape (n, V), by time.
    """
    model, found = route.model, dict[int, str]()
    if not model.selection.dropped:
        return found
    times = route.path.times[route.by_time]
    away = np.abs(times - route.start) > SAME_TIME * np.abs(times).max(initial=0.0)
    for k in np.flatnonzero(solved.any(axis=0) & ~solved[away].any(axis=0)).tolist():
        try:
            require_driven(variant_of(model, geometry[:, k]))
        except SolveError as error:
            found[k] = str(error)
    return found


def variant_of(model: Model, numbers: Array) -> Mechanism:
    """Return the mechanism with the numbers of a variant at the varied places."""
    known, given = every_place(model.mechanism), iter(numbers.tolist())
    return placed(
        model.mechanism, {name: [next(given) for _ in known[name]] for name in model.request.varied}
    )


def _together(
    route: Route, geometry: Array, tol: float, parts: int = 1
) -> tuple[Array, NDArray[np.bool_], Mapping[str, Array]]:
    """Follow variants through all samples, each step in as many parts.

    Returns:
        The kept rows, by time; which variants close at their design; and the worst value of each
        test, NaN for missing samples.
    """
    model, count = route.model, geometry.shape[1]
    executor = model.executor(count)
    closes = model.solve_at_design(executor, geometry)
    accepted_by = accept_by(tol)
    executor.put(
        [model.slots[name] for name in accepted_by], np.array([*accepted_by.values()])[:, None]
    )
    arrived = (
        np.ones(count, dtype=np.bool_) if route.starts_at_design else _lead(executor, route, count)
    )
    model.set_prediction_start(executor, route.origin)
    # what lanes are predicted from, with what stands between: one stretch is copied in half the
    # time of single slots
    ahead = executor.window(range(min(model.ahead), max(model.ahead) + 1))
    start = ahead.copy()
    whole = executor.table(parts * len(route.path.times))
    worst = np.repeat(model.plan.best, executor.room, axis=1)
    for k, (side, samples) in enumerate(zip(route.sides, route.for_motions(parts), strict=True)):
        if k:
            ahead[:] = start
        executor.run_motions(
            samples, whole, worst, parts * route.count_before_start - (side.step < 0), side.step
        )
    kept = whole[:, route.ends(parts) if parts > 1 else slice(None), :count]
    if not (arrived & closes).all():
        kept[:, :, ~(arrived & closes)] = worst[:, :count][:, ~(arrived & closes)] = np.nan
    return kept, closes, dict(zip((*LARGEST, *SMALLEST), worst[:, :count], strict=True))


@cache
def _recycle() -> None:
    """Let the allocator keep freed blocks for the next ones. Otherwise the system clears every page
    of every table again, which takes half as long as filling it. glibc keeps blocks up to the size
    of the largest one ever freed.
    """
    np.empty(RECYCLED, dtype=np.uint8)


def _lead(executor: Executor, route: Route, count: int) -> NDArray[np.bool_]:
    """Take lanes straight from the design to the start; return which of them arrived."""
    model, last = route.model, route.path.lead_in(route.start)
    way = Route(model, Path(last.motions, np.arange(1, LEAD + 1) / LEAD))
    model.set_prediction_start(executor, way.origin)
    found = executor.table(LEAD)
    (side,) = way.sides
    worst = np.repeat(model.plan.best, executor.room, axis=1)
    executor.run_motions(way.for_motions()[0], found, worst, side.first, side.step)
    return ~np.isnan(worst[0, :count])


# Variants solved at once: their lanes stay in the second-level cache. Fewer where the table of
# their motions takes more bytes than these, which costs up to a third of the time; of fewer than
# the least the calls around them would be felt.
MOST, LEAST, BYTES = 256, 32, 4_000_000


@dataclass(frozen=True, eq=False, repr=False)
class Designs(Tabular):
    """The motion of V designs over n samples.

    Attributes:
        points: motion by point name, each array of shape (V, n, 3); NaN at samples not reached.
        solved: whether each sample of each design was reached, shape (V, n).
        messages: by design, the reason of missing samples.
        notes: on the assumed start of all designs, by the nominal design.
        drive: driver values, times and their units.
    """

    points: Mapping[str, PointMotion]
    solved: NDArray[np.bool_]
    messages: Mapping[int, str]
    notes: Sequence[str] = ()
    drive: Driving | None = None

    def summary(self) -> str:
        """Return the driver's range, the designs, the samples and points."""
        count, samples = self.solved.shape
        designs = f"{number_of(count, 'design')} of {number_of(samples, 'sample')}"
        missing = (
            f"{number_of(len(self.messages), 'design')} with missing samples"
            if self.messages
            else ""
        )
        points = f"points {', '.join(self.points) or 'none'}"
        return ", ".join(filter(None, [in_words(self.drive), designs, points, missing]))

    def dataset(self) -> Dataset:
        """Return the motion of the points by design and sample."""
        dims = ("design", "sample")
        coords, variables, x = as_variables(self.points, dims, self.drive)
        coords["design"] = Variable("design", np.arange(len(self.solved)))
        return Dataset(dims, coords, variables | {"solved": Variable(dims, self.solved)}, x)


def solve_designs(
    mechanism: Mechanism,
    driver: str,
    values: Sequence[float] | Array,
    geometry: Mapping[str, ArrayLike],
    *,
    rate: float = 1.0,
    points: Sequence[str] | None = None,
    order: int = 0,
    tol: float = 1e-12,
    motions: Mapping[str, Motion] | None = None,
) -> Designs:
    """Sweep one driver over values for many designs, each with its own hardpoints, directions and
    lengths.

    The geometry is an input of the compiled programs: a design costs about a tenth of a microsecond
    per sample. Geometry without variation is constant in them. All results are held at once:
    `kincheck sweep` reduces them on the way.

    Args:
        mechanism: the nominal design.
        driver: as for `solve`, and so are values, rate, points, tol and motions. Drivers are
            measured from the design position of each design: only the change of a varied point can
            be driven.
        geometry: varied places [m or -] with names as in a case file ("joints.tie_rod.points.0",
            "joints.hinge.axis", "points.wheel_center.position", a length); values of shape (V, 3),
            or (V,) for a length. Give every place of a shared hardpoint. They are not checked as a
            joint checks its own: two axes of a cross may be askew.
        order: 0 for positions, 1 for velocities too, 2 for accelerations too.

    Raises:
        SolveError: there is no such place, a shape is wrong, a number is not finite, or the nominal
            mechanism cannot be solved.
    """
    path, request = parse_solve_arguments(
        "solve_designs",
        mechanism,
        driver,
        values,
        motions or {},
        rate=rate,
        points=points,
        order=order,
        tol=tol,
    )
    known = places(mechanism)
    if not geometry:
        raise SolveError(
            f"solve_designs: geometry names no place to vary; known: {', '.join(known) or 'none'}"
        )
    for name in path.design:
        moved = f"points.{getattr(mechanism.driver(name), 'point', '')}.position"
        if moved in geometry:
            problem = f"driver {name!r} gives the absolute position of a point that varies, {moved}"
            raise SolveError(
                f"solve_designs: {problem}; drive it with relative = True, or leave the point"
            )
    numbers: list[Array] = []
    for place, given in geometry.items():
        if place not in known:
            raise no_such("solve_designs", "place to vary", place, [*known])
        numbers.append(
            _numbers(
                place,
                real("solve_designs", place, given, "a row for each design"),
                len(known[place]),
            )
        )
    counts = {found.shape[1] for found in numbers}
    if len(counts) != 1:
        raise SolveError(
            f"solve_designs: found {sorted(counts)} designs for different places, expected as many"
            " of each"
        )
    (count,) = counts
    route = recent_route(mechanism, replace(request, varied=tuple(geometry)), path)
    rows, lanes, n = route.model.rows, np.concatenate(numbers), len(path.times)
    labels = QUANTITIES[: request.order + 1]
    # in memory designs stand side by side, as they are solved: to turn what is found takes as long
    # as solving it
    motion: dict[str, dict[str, Any]] = {
        name: {label: np.empty((3, n, count)).T for label in labels} for name in request.points
    }
    solved, messages = np.empty((n, count), dtype=np.bool_).T, dict[int, str]()
    together = max(LEAST, min(MOST, BYTES // (8 * route.model.kept * max(1, n)) // LEAST * LEAST))
    for first in range(0, count, together):
        here = slice(first, min(first + together, count))
        part = solve_variants(route, lanes[:, here], tol)
        solved[here] = part.solved.T
        messages |= {first + k: message for k, message in part.messages.items()}
        for name, each in motion.items():
            for label, values_of in each.items():
                values_of[here] = part.kept[rows[f"{label} {name}"]].T
    found = {
        name: PointMotion(each["position"], each.get("velocity"), each.get("acceleration"))
        for name, each in motion.items()
    }
    notes = start_notes(route, tol)
    drive = driving_of(mechanism, path, driver, np.array(values, dtype=float))
    return Designs(found, solved, messages, notes, drive)


def _numbers(place: str, given: Array, size: int) -> Array:
    """The numbers of a place, shape (size, V)."""
    columns = given[:, None] if size == 1 and given.ndim == 1 else given
    if columns.ndim != 2 or columns.shape[1] != size:
        raise SolveError(
            f"solve_designs: {place} has shape {given.shape}, expected (designs, {size}): a row for"
            " each design"
        )
    if not np.isfinite(columns).all():
        raise SolveError(f"solve_designs: {place} is not finite everywhere; give finite numbers")
    return columns.T


def start_notes(route: Route, tol: float) -> list[str]:
    """Return notes on the assumed start of many designs, by the nominal one; none if the design
    decides it.
    """
    model = route.model
    if route.begin.starts_at_design and not route.begin.ambiguous:
        return []
    nominal = prepare(model.mechanism, replace(model.request, varied=()), route.path)
    return [*nominal(tol).details.get("notes", ())]
