"""Redundant and contradictory geometry, whose contradiction an engine must report."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ....algebra import triple
from ....case.case import Case
from ....failures import FailureKind
from ....mechanism.mechanism import Mechanism
from ...truth.motion import Motion, Truth, closed, closed_poses
from ...truth.path import LANES, System
from .base import TOL, Family, Rng, Specimen, as_case, direction, power
from .dimensions import crank_rocker
from .planar import any_plane, four_bar, four_bar_motion

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


class Redundant(Family):
    """Four-bars with one hinge that is not exactly parallel to the others."""

    name = "redundant"
    about = "four-bars of four hinges, one of them off by 1e-12 to 1e-3 rad, or exact"

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a four-bar with one tilted hinge.

        Correct outcomes are the best possible solution with its residual, or a refusal with the
        contradiction.
        """
        tilt = 0.0 if rng.random() < 0.15 else power(rng, -12.0, -3.0)
        plane, points = any_plane(rng), crank_rocker(rng)
        sound = four_bar(plane, *points)
        joint: Any = sound.joint("pin_2")
        bent = replace(joint, axis=triple(np.array(joint.axis) + tilt * direction(rng)))
        mechanism = replace(
            sound, joints=[bent if each is joint else each for each in sound.joints]
        )
        values = np.linspace(-2.0, 2.0, samples)
        return Specimen(
            f"four_bar, one hinge off by {tilt:.2g} rad",
            partial(as_case, mechanism, "turn", values),
            partial(_tilted, sound=sound, motion=four_bar_motion(plane, *points), tilt=tilt),
            reasons=CONTRADICTIONS,
            excused=tilt > ROUNDED,
            reported=True,
            facts=(("tilt", tilt),),
        )


def _tilted(case: Case, sound: Mechanism, motion: Motion, tilt: float) -> Truth:
    """Return the truth of the untilted mechanism, with bounds that allow for another choice of
    rows. Rows with an error of the tilt move the pose by K times the tilt. The inverse of another
    choice of rows is at most K times larger.
    """
    found = closed(replace(case, mechanism=sound), motion)
    system = System(case)
    exact = System(replace(case, mechanism=sound))
    violated = np.zeros(len(case.sweep.values))
    size = system.rows.unit
    for sample in np.split(np.arange(len(violated)), range(LANES, len(violated), LANES)):
        poses = closed_poses(exact.rows, motion, exact.sampled(sample)[0])
        drives = system.sampled(sample)
        at = system.solved(poses, drives, system.path.times[sample], system.rows.angles(poses))
        violated[sample] = np.abs(system.rows.residual(at.poses, drives[0], at.angles)).max(axis=0)
    slack = found.condition * (1.0 + found.condition) * tilt * size
    # rates depend on inexact poses and contradictory rows, and have no bounds
    bounds = {
        name: np.stack(
            [bound[0] + slack, *(bound[1:] if tilt <= ROUNDED else np.full_like(bound[1:], np.inf))]
        )
        for name, bound in found.bounds.items()
    }
    return replace(found, bounds=bounds, violated=np.where(violated > TOL, violated * size, 0.0))
