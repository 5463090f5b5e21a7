"""Over a singular pose: the motion on both sides of it, and by interpolation the pose itself, where the motion goes on.

At the pose its own equations say too little, but the motion is smooth there. Eight poses beside it, followed from before to beyond,
give it by Lagrange's formula; if they are of two different motions, or the motion turns back, the formula does not hold or there
are no eight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..motions import Path
from ..trajectory import Array
from .continuity import AMPLIFIED, EPSILON, PIVOT
from .march import Route, arrived, march
from .model import TESTS, Model
from .request import FROM, RATE, TIME

# The motion from each of the eight to the next [units of the mechanism's size, rad]. Long ways cost accuracy by the motion's
# curvature, short ones by the poses' own nearness to the singular one; the first that is accurate enough is taken.
NODES = (0.02, 0.01, 0.005, 0.002)
PLACES = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
# Lagrange's weights at the middle of the eight, and of the inner six: the values differ by the error of the latter. Rounding adds
# up to 2.7 times its size in a value, to 0.46 times in the difference, which may be less by chance: thirty differences cover both.
EIGHT = np.array([-1.0, 8.0, -28.0, 56.0, 56.0, -28.0, 8.0, -1.0]) / 70.0
SIX = np.array([0.0, 1.0, -6.0, 15.0, 15.0, -6.0, 1.0, 0.0]) / 20.0
COVERED = 30.0


@dataclass(frozen=True, eq=False)
class Bridge:
    """A singular pose that a motion passes.

    Attributes:
        kept: the kept rows there (`Model.rows`), shape (kept,); motions only, its tests are NaN.
        off: bound of its errors: of the pose by the mechanism's size, of rates by their own.
        beyond: a lane that stands beyond it.
    """

    kept: Array
    off: float
    beyond: Array


def onward(route: Route, lane: Array, times: Array) -> Route:
    """From where a lane stands on a route to other times."""
    since = float(lane[route.model.slots[FROM + TIME]])
    return Route(route.model, Path(route.path.motions, times, route.path.design), arrived(route.model, lane), since)


def bridge(route: Route, lane: Array, time: float, tol: float) -> Bridge | None:
    """Pass a time on a route, coming from a lane; None where the motion does not go on, or is not known well enough."""
    model = route.model
    speed = float(np.abs(lane[model.vectors[FROM + RATE]]).max())
    side = 1.0 if time >= lane[model.slots[FROM + TIME]] else -1.0
    for node in NODES if speed > 0.0 else ():
        found = march(onward(route, lane, time + side * node / speed * PLACES), tol, visit={len(PLACES) - 1})
        if not found.solved.all():
            continue
        closure, pivot = (found.kept[model.rows[name].start] for name in ("closure", "pivot"))
        own = PIVOT * float((np.maximum(closure, EPSILON) / np.abs(pivot)).max())
        differences = np.abs(found.kept @ (EIGHT - SIX))
        off = max([own, *(COVERED * float(differences[rows].max()) / scale for rows, scale in _scales(model, found.kept, speed))])
        if off <= AMPLIFIED * tol:
            kept = found.kept @ EIGHT
            kept[model.rows[TESTS[0]].start :] = np.nan
            return Bridge(kept, off, found.visited[len(PLACES) - 1])
    return None


def _scales(model: Model, kept: Array, speed: float) -> Iterator[tuple[slice, float]]:
    """Rows of every motion and what errors of it are measured by: the mechanism's size, and the motion's own where it is a rate."""
    for name, rows in model.rows.items():
        label = name.split(" ")[0]
        if label in TESTS:
            continue
        length = model.frame.unit if label in ("position", "velocity", "acceleration", "r", "rdot", "rddot") else 1.0
        order = 1 if label in ("velocity", "rdot", "omega") else 2 if label in ("acceleration", "rddot", "omega_t") else 0
        own = float(np.abs(kept[rows]).max()) if order else 0.0
        yield rows, max(own, length * speed**order)
