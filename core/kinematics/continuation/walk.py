"""March from the design position outwards, along the samples of a path on both sides of it.

The executor follows each side while the samples continue the motion. A failed step is divided, so a
coarse grid costs steps: into equal parts, followed by the executor alone, or else into parts found
one by one. If no part of a step succeeds the motion ends, and a message gives the place and the
reason.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from ...trajectory import Array
from ..compiled.compiled_model import Model
from ..compiled.request import FROM, accept_by, remembered
from ..compiled.samples import Route
from .side_follower import End, March, Marcher


def march(
    route: Route,
    tol: float,
    visit: Collection[int] = (),
    *,
    crossing: bool = False,
    low: float = 0.0,
) -> March:
    """Solve a model at the samples of a path, from the design outwards; see `solve` for the
    tolerance.

    Args:
        visit: samples whose lanes are wanted; nothing beyond them is.
        crossing: accept steps across singular poses, as a whole or not at all: parts of them end at
            the pose.
        low: with redundant rows, leave off at a failed step if the smallest singular value is below
            this fraction of its largest value so far: other rows may be better.
    """
    stands = route if route.stands else led(route, tol)
    if isinstance(stands, Route):
        return marcher(stands, tol, crossing=crossing).run(visit, low)
    n = len(route.path.times)
    kept = np.full((route.model.kept, n), np.nan)
    return March(kept, route.model.plan.best[:, 0].tolist(), np.zeros(n, np.bool_), (stands,))


def led(route: Route, tol: float) -> Route | End:
    """Return the route from a lane on its path, or the end of the straight way to there; kept with
    the route.
    """
    return route if route.stands else route.bound(("led", tol), lambda: _led(route, tol))


def _led(route: Route, tol: float) -> Route | End:
    model, begin = route.model, route.begin
    way = Route(model, begin.lead or route.path.lead_in(begin.time), route.design)
    found = marcher(way, tol, crossing=False).run({0})
    if found.ends:
        return replace(found.ends[0], message=f"on the way to {begin.name}: {found.messages[0]}")
    return Route(model, route.path, arrived(model, found.visited[0]), begin.time)


def marcher(route: Route, tol: float, *, crossing: bool) -> Marcher:
    """Return the marcher of a route from its departure; kept with it, because binding takes as long
    as a run.
    """
    return route.bound(
        (tol, crossing), lambda: Marcher(route, route.departure, accept_by(tol, crossing=crossing))
    )


def arrived(model: Model, lane: Array) -> Array:
    """Return a lane at the start of the given lane's prediction."""
    found = lane.copy()
    for name in model.state:
        found[model.vectors[name]] = lane[model.vectors[FROM + name]]
    for name in remembered(model.blocks):
        found[model.slots[name]] = lane[model.slots[FROM + name]]
    return found
