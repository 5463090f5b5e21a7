"""Passage over a singular pose: the motion on both sides, and the pose itself by interpolation, if
the motion continues.

The equations at the pose do not determine it, but the motion is smooth there. Eight poses around
it, followed from before to beyond, give it by Lagrange's formula. If they belong to two different
motions, or the motion turns back, the formula does not hold or there are no eight. If the motion
turns a corner too narrow for these poses, or has a gap as narrow, the last followed pose before the
singular one does not lie on the polynomial.

`bridge` passes a pose of one program and interpolates samples there. `cross` passes a pose of any
solver that can go from a pose to a time: without an interpolation it is enough to see one curve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from ...mechanism.motions import Path
from ...trajectory import QUANTITIES, Array
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
# A smallest singular value above this part of its largest is sound enough to look over a singular
# pose from.
SOUND = 0.1
# Nothing is interpolated by `cross`: it is enough to see that there is one curve, and other
# assemblies are farther off.
SMOOTH = 1e-7
# The last pose before is followed to where rounding leaves rates uncertain by a hundredth: itself
# by this.
NEARLY = 1e-7
# Number of the first of the eight that is beyond.
BEYOND = 4


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


class Numbers(NamedTuple):
    """A pose as numbers: its state, and the rates of it with their rates."""

    state: Array
    rates: Array


class Followed(Protocol):
    """A pose of a motion that goes on from it."""

    @property
    def time(self) -> float:
        """The time of the pose on its path [s]."""
        ...

    @property
    def numbers(self) -> Numbers:
        """The numbers of the pose."""
        ...


AnyPose = TypeVar("AnyPose", bound=Followed)


Reach = Callable[[AnyPose, float, bool], AnyPose | None]
"""Goes from a pose to a time, over a singular pose if that is true; None if it is out of reach."""


def cross(
    sound: AnyPose, near: AnyPose, aim: float, reach: Reach[AnyPose]
) -> Sequence[AnyPose] | None:
    """Return eight poses around a singular pose, or None if the motion is not known to go on: they
    and the last one before it are on one smooth curve.

    Args:
        sound: the last pose far from singular.
        near: the last pose before the singular one.
        aim: time of a sample out of reach from there.
    """
    for poses in around(sound, near.time, aim - near.time, reach):
        state, rates = numbers_of(poses)
        off = [
            float(np.abs(x @ (EIGHT - SIX)).max() / max(1.0, np.abs(x).max()))
            for x in (state, rates)
        ]
        if max(off) <= SMOOTH and on_curve(state, near.numbers.state, NEARLY):
            return poses
    return None


def around(
    sound: AnyPose, time: float, way: float, reach: Reach[AnyPose]
) -> Iterator[Sequence[AnyPose]]:
    """Yield eight poses around a time, at different distances, for a motion in the direction of a
    way.
    """
    speed = float(np.abs(sound.numbers.rates).max(initial=0.0))
    for node in NODES if speed > 0.0 else ():
        here: AnyPose | None = sound
        found: list[AnyPose] = []
        for k, each in enumerate((time + np.copysign(node / speed, way) * PLACES).tolist()):
            here = reach(here, each, k == BEYOND)
            if here is None:
                break
            found.append(here)
        if len(found) == len(PLACES):
            yield found


def numbers_of(poses: Sequence[Followed]) -> Numbers:
    """Return the numbers of poses, shape (numbers, poses)."""
    state, rates = (
        np.stack(each, axis=1) for each in zip(*(pose.numbers for pose in poses), strict=True)
    )
    return Numbers(state, rates)


def on_curve(eight: Array, near: Array, error: float) -> bool:
    """Return whether a state, known to an error, is on the polynomial through eight others at the
    middle time.
    """
    known = COVERED * np.abs(eight @ (EIGHT - SIX)) + error
    return bool((np.abs(eight @ EIGHT - near) <= known).all())


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
        off = max(own, interpolated(model.rows, whole, model.frame.unit, speed, rates=rates))
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
    return on_curve(system.state(lanes), solved.state[:, 0], WORSE * float(solved.error[0, 0]))


def interpolated(
    rows: Mapping[str, slice], whole: Array, unit: float, speed: float, *, rates: bool = True
) -> float:
    """Return a bound of the errors of motions interpolated between eight poses: of positions by the
    mechanism's size, of rates by their own.

    Args:
        rows: of every motion; tests are left out.
        whole: the motions at the poses, shape (rows, 8).
        unit: the mechanism's size [m].
        speed: largest rate of the unknowns.
        rates: whether they are wanted.
    """
    differences, off = np.abs(whole @ (EIGHT - SIX)), 0.0
    for name, at in rows.items():
        label = name.split(" ")[0]
        order = (
            1
            if label in ("velocity", "rdot", "omega")
            else 2
            if label in ("acceleration", "rddot", "omega_t")
            else 0
        )
        if label in TESTS or (order and not rates):
            continue
        length = unit if label in (*QUANTITIES, "r", "rdot", "rddot") else 1.0
        own = float(np.abs(whole[at]).max()) if order else 0.0
        off = max(off, COVERED * float(differences[at].max()) / max(own, length * speed**order))
    return off
