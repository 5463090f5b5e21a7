"""Passage over a singular pose: the motion on both sides, and the pose itself by interpolation, if
the motion continues.

The equations at the pose do not determine it, but the motion is smooth there. Eight poses around
it, followed from before to beyond, give it by Lagrange's formula. If they belong to two different
motions, or the motion turns back, the formula does not hold or there are no eight. If the motion
turns a corner too narrow for these poses, or has a gap as narrow, the last followed pose before the
singular one does not lie on the polynomial.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...mechanism.motions import Path
from ...trajectory import QUANTITIES, Array
from ..compiled.compiled_model import Model
from ..compiled.dense_equations import system_of
from ..compiled.request import FROM, ORIENTATION, RATE, SIGMA, TIME
from ..compiled.sample_rows import TESTS
from ..compiled.samples import Route
from ..formulation.acceptance_criteria import AMPLIFIED, EPSILON, WORSE
from .singularity import solve_closely
from .walk import arrived, march

# The motion from each of the eight to the next [units of the mechanism's size, rad]. Long ways cost
# accuracy by the motion's curvature, short ones by the poses' own nearness to the singular one; the
# first that is accurate enough is taken.
NODES = (0.02, 0.01, 0.005, 0.002)
PLACES = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
# Lagrange's weights at the middle of the eight, and of the inner six: the values differ by the
# error of the latter. Rounding adds up to 2.7 times its size in a value, to 0.46 times in the
# difference, which may be less by chance: thirty differences cover both.
EIGHT = np.array([-1.0, 8.0, -28.0, 56.0, 56.0, -28.0, 8.0, -1.0]) / 70.0
SIX = np.array([0.0, 1.0, -6.0, 15.0, 15.0, -6.0, 1.0, 0.0]) / 20.0
COVERED = 30.0


@dataclass(frozen=True, eq=False)
class Bridge:
    """A singular pose on a motion.

    Attributes:
        kept: the kept rows there (`Model.rows`), shape (kept,); its tests are those of a pose right
            before it.
        off: bound of its errors: of the pose by the mechanism's size, of rates by their own.
        beyond: a lane beyond it.
    """

    kept: Array
    off: float
    beyond: Array


def onward(route: Route, lane: Array, times: Array) -> Route:
    """Return the route from a lane on this one to other times."""
    since = float(lane[route.model.slots[FROM + TIME]])
    return Route(
        route.model,
        Path(route.path.motions, times, route.path.design),
        arrived(route.model, lane),
        since,
    )


def bridge(
    route: Route, lane: Array, time: float, tol: float, near: Array | None, *, rates: bool = True
) -> Bridge | None:
    """Pass a time on a route, from a lane; return None if the motion does not continue, or is not
    known well enough.

    Args:
        near: last followed lane at or right before the singular pose: it must be on the same curve.
            Without one, the interpolated pose may be accepted, but not the continuation of the
            motion.
        rates: whether they are wanted there too. A passage needs only the pose, even if the request
            wants rates elsewhere.
    """
    model = route.model
    speed = float(np.abs(lane[model.vectors[FROM + RATE]]).max())
    side = 1.0 if time >= lane[model.slots[FROM + TIME]] else -1.0
    for node in NODES if speed > 0.0 else ():
        found = _eight(route, lane, time + side * node / speed * PLACES, tol)
        if found is None:
            continue
        whole, lanes = found
        closure, sigma = (whole[model.rows[name].start] for name in ("closure", SIGMA))
        own = WORSE * float((np.maximum(closure, EPSILON) / sigma).max())
        differences = np.abs(whole @ (EIGHT - SIX))
        scales = _scales(model, whole, speed, rates=rates)
        off = max(
            [own, *(COVERED * float(differences[rows].max()) / scale for rows, scale in scales)]
        )
        if off <= AMPLIFIED * tol and (near is None or _on_curve(route, lanes, near)):
            kept = whole @ EIGHT
            tests = slice(model.rows[TESTS[0]].start, None)
            kept[tests] = whole[tests, 3]
            return Bridge(kept, off, lanes[:, -1])
    return None


def _eight(route: Route, lane: Array, times: Array, tol: float) -> tuple[Array, Array] | None:
    """Return the kept rows of poses at eight times, and their lanes; a singular pose lies between
    the fourth and the fifth.
    """
    before = march(onward(route, lane, times[:4]), tol, visit=range(4))
    if not before.solved.all():
        return None
    beyond = march(onward(route, before.visited[3], times[4:]), tol, visit=range(4), crossing=True)
    turned = beyond.kept[route.model.rows[ORIENTATION].start]
    if not (beyond.solved.all() and (turned == turned[0]).all()):
        return None
    lanes = [march.visited[k] for march in (before, beyond) for k in range(4)]
    return np.hstack([before.kept, beyond.kept]), np.stack(lanes, axis=1)


def _on_curve(route: Route, lanes: Array, near: Array) -> bool:
    """Return whether the pose of a lane at the middle time is on the polynomial through eight
    others.
    """
    system, time = system_of(route.model), near[[route.model.slots[FROM + TIME]]]
    solved = solve_closely(system, system.state(near[:, None]), route.sampled(time))
    eight = system.state(lanes)
    off, known = np.abs(eight @ EIGHT - solved.state[:, 0]), COVERED * np.abs(eight @ (EIGHT - SIX))
    return bool((off <= known + WORSE * solved.error[0, 0]).all())


def _scales(
    model: Model, kept: Array, speed: float, *, rates: bool
) -> Iterator[tuple[slice, float]]:
    """Return the rows of every motion and the scales of their errors: the mechanism's size, and for
    rates their own size.
    """
    for name, rows in model.rows.items():
        label = name.split(" ")[0]
        if label in TESTS:
            continue
        length = model.frame.unit if label in (*QUANTITIES, "r", "rdot", "rddot") else 1.0
        order = (
            1
            if label in ("velocity", "rdot", "omega")
            else 2
            if label in ("acceleration", "rddot", "omega_t")
            else 0
        )
        if order and not rates:
            continue
        own = float(np.abs(kept[rows]).max()) if order else 0.0
        yield rows, max(own, length * speed**order)
