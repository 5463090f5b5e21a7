"""Solve many designs of one mechanism: the geometry varies, the programs are compiled once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..dataset import Dataset, Variable
from ..driving import Driving, in_words
from ..errors import SolveError, number_of
from ..input_checks import no_such, real
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Motion
from ..tabular import Tabular
from ..trajectory import QUANTITIES, Array, PointMotion, as_variables
from .compiled.samples import recent_route
from .design_batch import solve_variants
from .formulation.parameters import places
from .one_design import asked, driving
from .solver_selection import start_notes

# Variants solved at once: their lanes stay in the second-level cache. Fewer where the table of
# their motions takes more bytes than these, which costs up to a third of the time; of fewer than
# the least the calls around them would be felt.
MOST, LEAST, ROOM = 256, 32, 4_000_000


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
    path, request = asked(
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
    together = max(LEAST, min(MOST, ROOM // (8 * route.model.kept * max(1, n)) // LEAST * LEAST))
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
    notes = start_notes(mechanism, request, path, tol)
    drive = driving(mechanism, path, driver, np.array(values, dtype=float))
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
