"""Exchange of rows along a motion: rows chosen at the design position are replaced if they become
dependent.

A mechanism with redundant rows has many choices of independent ones, and none may be good
everywhere: the rods of a locomotive, a Bennett loop. If the chosen rows become singular, but all
rows together do not, the mechanism is regular, and the motion continues with rows chosen at the new
pose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from ..compiled.compiled_model import Model, recent_model
from ..compiled.dense_equations import system_of
from ..compiled.request import CONSISTENT, FROM, LARGEST_SIGMA, TIME
from ..compiled.samples import Route
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import frames
from ..formulation.driver_inputs import standing_drives
from ..formulation.formulation import Condition
from ..formulation.state_vectors import jacobian
from ..structure.redundancy import independent_rows

# A motion that ends with a smallest singular value above this part of the largest that it has had
# does not end at a singular pose.
NEAR = 1e-2
# Rows are chosen anew where all together have a smallest singular value above this part of the
# largest that there was, thirty times what rounding can turn (TURNED); with NEAR kites off by 0.002
# to 0.008 of their size were refused beside their corner.
SEEN = 1e-4
# Rows are chosen anew where that makes the smallest singular value as many times larger.
BETTER = 3.0
# Rows of before are taken again where their smallest singular value is this part of that of all
# rows: of those that are chosen at a pose it is 0.5 to 0.95, and to choose takes up to 0.1 s.
AS_GOOD = 0.3


@dataclass(frozen=True, eq=False)
class Standing:
    """A lane of a model at a pose: the motion continues from there with the model's rows."""

    model: Model
    lane: Array


class Choice:
    """The rows of a motion so far.

    Attributes:
        models: one for each choice of rows; the first is the motion's own.
    """

    def __init__(self, model: Model) -> None:
        self.models = [model]

    def anew(self, route: Route, lane: Array) -> Standing | None:
        """Return rows chosen at the pose of a lane on a route, and a lane there with these rows;
        None if none are better.
        """
        model, slots = route.model, route.model.slots
        if not model.selection.dropped:
            return None
        system, sample = system_of(model), route.sampled(lane[[slots[FROM + TIME]]])
        found = system.equations(system.state(lane[:, None]), sample)
        matrix = np.empty(
            (len(model.selection.chosen) + len(model.selection.dropped), system.unknowns)
        )
        matrix[[*model.selection.chosen]], matrix[[*model.selection.dropped]] = (
            found.jacobian[0],
            found.redundant[0],
        )
        if not np.isfinite(matrix).all():
            return None
        largest = float(lane[slots[FROM + LARGEST_SIGMA]])
        least = max(BETTER * _sigma(matrix, model.selection.chosen), SEEN * largest)
        if not _sigma(matrix, range(len(matrix))) > least:
            return None
        known = {each.selection.chosen: each for each in self.models}
        rows = chosen(matrix, [*known], len(model.mechanism.drivers), system.conditions)
        sigma = _sigma(matrix, rows)
        if not sigma > least:
            return None
        best = known.get(rows)
        if best is None:
            best = recent_model(model.mechanism, replace(model.request, rows=rows))
            self.models.append(best)
        stands = _standing(
            best,
            {name: lane[model.vectors[FROM + name]] for name in model.state},
            sample,
            NEAR * sigma,
        )
        if stands is None:
            return None
        # beside a corner all rows are nearly singular: the scale is that of the motion, not of what
        # it is there
        for name in (LARGEST_SIGMA, FROM + LARGEST_SIGMA):
            stands[best.slots[name]] = max(stands[best.slots[name]], largest)
        return Standing(best, stands)


def chosen(
    matrix: Array, known: Sequence[tuple[int, ...]], drivers: int, conditions: Sequence[Condition]
) -> tuple[int, ...]:
    """Return the rows to solve at a pose: the best known ones if others are hardly better, else
    those chosen there.

    Args:
        matrix: Jacobian of all rows, the drivers' last.
        conditions: see `Formulation`.
    """
    best = max(known, key=lambda rows: _sigma(matrix, rows))
    if _sigma(matrix, best) >= AS_GOOD * _sigma(matrix, range(len(matrix))):
        return best
    rows = tuple(independent_rows(matrix, drivers, conditions))
    # where the mechanism is singular there are fewer
    return rows if len(rows) == len(best) else best


def chosen_at(
    mechanism: Mechanism, change: Mapping[str, float], state: Array, known: tuple[int, ...]
) -> tuple[int, ...]:
    """As `chosen`, at a pose of the native formulation.

    Args:
        change: of the moving drivers from the design [SI].
        state: the scalars of the pose, in the order of `Cartesian.design`.
    """
    frame = frames(mechanism)
    formulation = Cartesian.of(mechanism, frame, standing_drives(mechanism, frame.unit, change))
    numbers = iter(state.tolist())
    at = formulation.configuration(
        {name: [next(numbers) for _ in value] for name, value in formulation.design.items()}
    )
    return chosen(
        jacobian(formulation, at), [known], len(mechanism.drivers), formulation.conditions
    )


def _sigma(matrix: Array, rows: Sequence[int]) -> float:
    """Smallest singular value of rows of a matrix."""
    return float(np.linalg.svd(matrix[[*rows]], compute_uv=False)[-1])


def _standing(model: Model, state: dict[str, Array], sample: Array, nearby: float) -> Array | None:
    """Return a lane of a model at a sample, no farther from a state than the given distance, or
    None.

    The distance to another solution is the smallest singular value or more.
    """
    executor = model.executor(1)
    (closes,) = model.stand_at(executor, state, sample)
    lane = executor.get(range(len(model.slots)))[:, 0]
    moved = max(
        float(np.abs(lane[model.vectors[name]] - value).max()) for name, value in state.items()
    )
    return (
        lane if closes and lane[model.slots["leftover"]] <= CONSISTENT and moved <= nearby else None
    )
