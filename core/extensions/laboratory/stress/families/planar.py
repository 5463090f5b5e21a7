"""Families of planar linkages with closed forms: sizes, places, rates, tolerances, reach, change
points, two loops on one crank, and contradictory hinges.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from .....algebra import triple
from .....case.case import Case
from .....failures import FailureKind
from .....mechanism.mechanism import Mechanism
from ...truth.motion import Motion, System, Truth, chunks, closed, closed_poses
from ...truth.rows import extended
from .base import TOL, Rng, Specimen, direction, family, power, sign, swept
from .linkages import (
    JOINTS_OF_A_LOOP,
    Plane,
    add_loop,
    any_plane,
    area,
    crank_rocker,
    flat_plane,
    flats,
    four_bar,
    meet,
    nearly_kite,
    nearly_parallel,
    plan,
    polar,
    rockers,
    slider_crank,
    turning_crank,
)

NEARLY_A_TURN = 0.97 * np.pi


def linkage(
    rng: Rng,
    plane: Plane,
    samples: int,
    *,
    scale: float = 1.0,
    grid: float = 0.0,
    rate: float = 1.0,
) -> Specimen:
    """Return a four-bar or a slider-crank, whose crank makes one full turn."""
    way = str(rng.choice(JOINTS_OF_A_LOOP))
    if rng.random() < 0.5:
        found = four_bar(plane, *crank_rocker(rng, scale, grid), way)
    else:
        b, c = (scale * each for each in turning_crank(rng, grid))
        found = slider_crank(plane, b, c, way, "turn")
    return swept(f"{found[0].name} with {way}", *found, -np.pi, np.pi, samples, rate=rate)


@family("four-bars and slider-cranks of 1e-6 to 1e3 m in any orientation, one turn")
def units(rng: Rng, samples: int) -> Specimen:
    """Return a linkage of random size, at a similar distance from the origin."""
    scale, plane = power(rng, -6.0, 3.0), any_plane(rng)
    return linkage(rng, replace(plane, origin=scale * plane.origin), samples, scale=scale)


@family(
    "four-bars and slider-cranks of 1 m, up to 1e7 m from the origin, coordinates on a grid that"
    " avoids rounding"
)
def offset(rng: Rng, samples: int) -> Specimen:
    """Return a linkage in a plane along the global axes.

    A double holds both the 24 bits of the offset and the 20 bits of the grid.
    """
    grid = 2.0**-20
    origin = np.round(rng.uniform(-1.0, 1.0, 3) * power(rng, 0.0, 7.0) / grid) * grid
    return linkage(rng, flat_plane(rng, origin), samples, grid=grid)


@family("cranks, and cranks with rockers, of 1e-6 to 1 of the other links' lengths, one turn")
def ratios(rng: Rng, samples: int) -> Specimen:
    """Return a slider-crank with a short crank, or a four-bar with two opposite short bars or one
    short crank.
    """
    plane, way = any_plane(rng), str(rng.choice(JOINTS_OF_A_LOOP))
    ratio = power(rng, -6.0, 0.0)
    short, kind = polar(0.3 * ratio, rng.uniform(0.3, 2.8)), int(rng.integers(3))
    if kind == 0:
        found = slider_crank(plane, short, complex(rng.uniform(1.0, 1.3)), way, "turn")
    else:
        # the rocker is 1.3 / 0.3 times the crank and perpendicular to the ground, or about as long
        # as the other links
        c = (
            complex(1.0, 1.3 * ratio)
            if kind == 1
            else complex(rng.uniform(0.4, 0.6), rng.uniform(0.6, 0.8))
        )
        found = four_bar(plane, short, 1.0 + 0j, c, way)
    name = f"{found[0].name} with {way}, ratio {ratio:.3g}"
    return swept(name, *found, -np.pi, np.pi, samples)


# Largest number of turns between samples. The solver divides a step into at most 2,000 parts, and a
# turn needs some twelve.
TURNS, MOST_BETWEEN = 1000, 100


@family(
    "crank-rockers over 1,000 turns in one sweep of all the samples, up to 1e6",
    samples=1_000_000,
    several=False,
)
def drift(rng: Rng, samples: int) -> Specimen:
    """Return a crank-rocker over many turns; its closed form ignores earlier turns."""
    plane, points, way = any_plane(rng), crank_rocker(rng), str(rng.choice(JOINTS_OF_A_LOOP))
    turns = min(TURNS, MOST_BETWEEN * (samples - 1))
    name, last = f"four_bar with {way}, {turns} turns", 2.0 * np.pi * turns
    return swept(name, *four_bar(plane, *points, way), 0.0, last, samples)


@family("four-bars and slider-cranks driven at 1e-9 to 1e9 rad/s either way")
def rates(rng: Rng, samples: int) -> Specimen:
    """Return a linkage at a random rate; accelerations grow with the square of the rate."""
    rate = power(rng, -9.0, 9.0) * sign(rng)
    found = linkage(rng, any_plane(rng), samples, rate=rate)
    return replace(found, name=f"{found.name} at {rate:.3g} rad/s")


# Correct refusals of a tolerance below round-off, which name the residual.
BELOW_ROUNDING = frozenset(
    {
        FailureKind.BELOW_ROUNDING,
        FailureKind.NOT_CONVERGED,
        FailureKind.NOT_SETTLED,
        FailureKind.NO_POSE,
    }
)


@family("four-bars and slider-cranks with requested residuals of 1e-15 to 1e-300")
def tolerances(rng: Rng, samples: int) -> Specimen:
    """Return a linkage with a tiny tolerance.

    Correct outcomes are the best possible solution, or a refusal with the reached residual.
    """
    tol = power(rng, -300.0, -15.0) if rng.random() < 0.2 else power(rng, -20.0, -15.0)
    found = linkage(rng, any_plane(rng), samples)
    name = f"{found.name} to {tol:.3g}"
    return replace(found, name=name, tol=tol, reasons=BELOW_ROUNDING, excused=True)


@family(
    "sliders driven past the stretched rod, rockers past their dead centres, struts and tie rods"
    " within 1e-6 of them at design",
    samples=81,
)
def reach(rng: Rng, samples: int) -> Specimen:
    """Return a driven slider, or a four-bar whose driven bar cannot turn fully. No engine may have
    values at a pose without an assembly.
    """
    plane, way = any_plane(rng), str(rng.choice(JOINTS_OF_A_LOOP))
    if rng.random() < 0.5:
        crank, rod = float(rng.uniform(0.2, 0.6)), float(rng.uniform(0.7, 1.3))
        # the angle at the crank pin: stretched out at 0, folded at pi
        bend = power(rng, -6.0, 0.0) if rng.random() < 0.5 else float(rng.uniform(0.3, 2.8))
        c = float(np.sqrt(crank**2 + rod**2 + 2.0 * crank * rod * np.cos(bend)))
        b = polar(crank, np.arctan2(rod * np.sin(bend), crank + rod * np.cos(bend)))
        found = slider_crank(plane, b, complex(c), way, "slide")
        first, last = -1.2 * (c - abs(rod - crank)), 1.2 * (crank + rod - c) + 0.1 * crank
        return swept(f"slider_crank with {way}, bend {bend:.3g}", *found, first, last, samples)
    name, last = f"four_bar with {way}, driven past its dead centres", 0.99 * np.pi
    return swept(name, *four_bar(plane, *rockers(rng), way), -last, last, samples)


# Near change points


FLAT: Mapping[str, Callable[[Rng], tuple[complex, complex, complex, float]]] = {
    "parallelogram": nearly_parallel,
    "kite": nearly_kite,
    "rocker": lambda rng: (*rockers(rng), 1.0),  # far from any singular shape
}
"""Makers of B, D, C and an error."""


def near_change_points(rng: Rng, samples: int, kind: str = "") -> Specimen:
    """Return a four-bar of a kind; without one, two equal four-bars of any kind on one crank.

    A parallelogram folds flat twice a turn. Correct answers for an exact one are its own motion or
    a refusal, never the motion that crosses there. With an error of one sign it becomes the
    antiparallel linkage, within the root of the error. With an error of the other sign it cannot
    pass. The crank of a kite is nearly as long as the ground and passes the rocker's pivot.
    """
    plane = any_plane(rng)
    way, *twins = rng.choice(JOINTS_OF_A_LOOP, 1 if kind else 2).tolist()
    kind = kind or [*FLAT][int(rng.integers(len(FLAT)))]
    b, d, c, off = FLAT[kind](rng)
    parallel = kind == "parallelogram" and off == 0.0
    found, name = four_bar(plane, b, d, c, way, parallel=parallel), f"{kind} with {way}"
    for twin in twins:
        found = add_loop(found, plane, b, d, c, twin, "twin ", parallel=parallel)
        name = f"{kind}s with {way} and {twin}"
    name, last = f"{name}, off by {off:.2g}", NEARLY_A_TURN
    return swept(name, *found, -last, last, samples, nearest=flats(b, d))


@family(
    "two equal loops on one crank, with equal or different joints, so that the sign of the whole"
    " determinant shows no singular pose: parallelograms (exact, and off by 1e-12 to 1e-2), kites,"
    " and four-bars driven past their dead centres",
    samples=61,
)
def twins(rng: Rng, samples: int) -> Specimen:
    """Return two equal loops on one crank with the same singular poses: the determinant of all rows
    changes its sign twice there, so that it shows nothing.
    """
    return near_change_points(rng, samples)


# Smallest relative area of a design: the coordinates of a nearly folded shape have too few digits.
FOLDED = 0.05
# Lengths of crank, ground, coupler and rocker, from three sizes and an error.
SHAPES: Mapping[str, Callable[[float, float, float, float], tuple[float, float, float, float]]] = {
    "kite": lambda a, g, x, off: (g + off, g, x, x),
    "kite on its side": lambda a, g, x, off: (a, g, a + off, g),
    "parallelogram": lambda a, g, x, off: (a, g, g + off, a),
    "stretched four-bar": lambda a, g, x, off: (a, g, x, a + g - x + off),
    "folded four-bar": lambda a, g, x, off: (a, g, x, x + abs(g - a) + off),
}


@family(
    "four-bars of any sizes, off by 1e-7 to 0.1 from kites, parallelograms and others that can lie"
    " flat, from anywhere in coarse steps: rods on hinges (three redundant rows), on two"
    " universals (one), and on what leaves none; half of them with a regular loop of 1e-3 to 0.3 of"
    " their size on the same crank",
    samples=31,
)
def corners(rng: Rng, samples: int) -> Specimen:
    """Return a random four-bar, half of them beside a regular loop. Redundant rows or a second loop
    must not hide the sharp corners of its motion, or a narrowly missed passage, anywhere along a
    step.
    """
    plane, way = any_plane(rng), str(rng.choice(["universals", "revolutes", *JOINTS_OF_A_LOOP]))
    off = power(rng, -7.0, -1.0) * sign(rng)
    kind = [*SHAPES][int(rng.integers(len(SHAPES)))]
    b, d, c = _loop(rng, kind, off)
    last = float(rng.uniform(2.0, 6.2) * sign(rng))
    found = four_bar(plane, b, d, c, way)
    name = f"{kind} with {way}, off by {off:.2g}"
    # the small loop's singular values are always small, and hide the singular values of the large
    # loop
    if rng.random() < 0.5:
        ratio, hung = power(rng, -3.0, -0.5), str(rng.choice(JOINTS_OF_A_LOOP))
        found = add_loop(found, plane, *crank_rocker(rng, ratio), hung, "small ")
        name = f"{name}, beside a loop of {ratio:.2g} with {hung}"
    return swept(name, *found, 0.0, last, samples, nearest=flats(b, d))


def _loop(rng: Rng, kind: str, off: float) -> tuple[complex, complex, complex]:
    """Return B, D and C of a four-bar of this kind, at any unfolded pose."""
    while True:
        a, g, x = (float(size) for size in rng.uniform(0.3, 1.5, 3))
        crank, ground, coupler, rocker = SHAPES[kind](a, g, x, off)
        b, side = polar(crank, rng.uniform(-np.pi, np.pi)), sign(rng)
        d, squares = complex(ground), extended([coupler, rocker]) ** 2
        c = complex(meet(plan(b), squares[0], plan(d), squares[1], side))
        # twice the area; NaN if the circles do not meet
        if min(coupler, rocker) > 0.1 and abs(area(c - b, d - b)) > FOLDED * abs(d - b):
            return b, d, c


# Contradictory hinges

# Directions have a precision of 1e-16; a smaller tilt than this is rounding, not a contradiction.
ROUNDED = 1e-14
CONTRADICTIONS = frozenset(
    {
        FailureKind.CONTRADICTORY,
        FailureKind.DEAD_CENTRE,
        FailureKind.FREE,
        FailureKind.NO_POSE,
        FailureKind.OVERDRIVEN,
    }
)
"""Correct refusals of a loop whose hinges are not parallel."""


@family("four-bars of four hinges, one of them off by 1e-12 to 1e-3 rad, or exact")
def redundant(rng: Rng, samples: int) -> Specimen:
    """Return a four-bar with one tilted hinge.

    Correct outcomes are the best possible solution with its residual, or a refusal with the
    contradiction.
    """
    tilt = 0.0 if rng.random() < 0.15 else power(rng, -12.0, -3.0)
    sound, motion = four_bar(any_plane(rng), *crank_rocker(rng))
    joint: Any = sound.joint("pin_2")
    bent = replace(joint, axis=triple(np.array(joint.axis) + tilt * direction(rng)))
    tilted = replace(sound, joints=[bent if each is joint else each for each in sound.joints])
    found = swept(f"four_bar, one hinge off by {tilt:.2g} rad", tilted, None, -2.0, 2.0, samples)
    return replace(
        found,
        truth=partial(_truth_with_tilt, sound=sound, motion=motion, tilt=tilt),
        reasons=CONTRADICTIONS,
        excused=tilt > ROUNDED,
        tilt=tilt,
    )


def _truth_with_tilt(case: Case, sound: Mechanism, motion: Motion, tilt: float) -> Truth:
    """Return the truth of the untilted mechanism, with bounds that allow for another choice of
    rows. Rows with an error of the tilt move the pose by K times the tilt. The inverse of another
    choice of rows is at most K times larger.
    """
    found, system = closed(replace(case, mechanism=sound), motion), System(case)
    rows, times = system.rows, system.path.times
    violated = np.zeros(len(times))
    for samples in chunks(np.arange(len(times))):
        drives = system.sampled(samples)
        poses = closed_poses(found.system.rows, motion, drives[0])
        at = system.solved(poses, drives, times[samples], rows.angles(poses))
        violated[samples] = np.abs(rows.residual(at.poses, drives[0], at.angles)).max(axis=0)
    slack = found.condition * (1.0 + found.condition) * tilt * rows.unit
    for bound in found.bounds.values():
        bound[0] += slack
        if tilt > ROUNDED:  # rates depend on inexact poses and contradictory rows
            bound[1:] = np.inf
    return replace(found, violated=np.where(violated > TOL, violated * rows.unit, 0.0))
