"""Large numbers: many turns and samples, extreme rates, very small tolerances."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ....failures import FailureKind
from ...truth.motion import closed
from .base import Family, Rng, Specimen, as_case, power
from .dimensions import crank_rocker
from .planar import JOINTS_OF_A_LOOP, any_plane, four_bar, four_bar_motion
from .sizes import linkage

TURNS = 1000
# Correct refusals of a tolerance below round-off, which name the residual.
BELOW_ROUNDING = frozenset(
    {
        FailureKind.BELOW_ROUNDING,
        FailureKind.NOT_CONVERGED,
        FailureKind.NOT_SETTLED,
        FailureKind.NO_POSE,
    }
)
# Largest number of turns between samples. The solver divides a step into at most 2,000 parts, and a
# turn needs some twelve.
MOST_BETWEEN = 100


class Drift(Family):
    """Accumulation of errors over many turns."""

    name = "drift"
    about = "crank-rockers over 1,000 turns in one sweep of all the samples, up to 1e6"
    samples = 1_000_000
    several = False

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a crank-rocker over many turns; its closed form ignores earlier turns."""
        plane, points, way = any_plane(rng), crank_rocker(rng), str(rng.choice(JOINTS_OF_A_LOOP))
        turns = min(TURNS, MOST_BETWEEN * (samples - 1))
        return Specimen(
            f"four_bar with {way}, {turns} turns",
            partial(
                as_case,
                four_bar(plane, *points, way),
                "turn",
                np.linspace(0.0, 2.0 * np.pi * turns, samples),
            ),
            partial(closed, motion=four_bar_motion(plane, *points)),
        )


class Rates(Family):
    """Very slow and very fast drivers."""

    name = "rates"
    about = "four-bars and slider-cranks driven at 1e-9 to 1e9 rad/s either way"

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a linkage at a random rate; accelerations grow with the square of the rate."""
        rate = power(rng, -9.0, 9.0) * float(rng.choice([-1.0, 1.0]))
        found = linkage(rng, any_plane(rng), samples, rate=rate)
        return replace(found, name=f"{found.name} at {rate:.3g} rad/s", facts=(("rate", rate),))


class Tolerances(Family):
    """Tolerances below the precision of doubles."""

    name = "tolerances"
    about = "four-bars and slider-cranks with requested residuals of 1e-15 to 1e-300"

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a linkage with a tiny tolerance.

        Correct outcomes are the best possible solution, or a refusal with the reached residual.
        """
        tol = power(rng, -300.0, -15.0) if rng.random() < 0.2 else power(rng, -20.0, -15.0)
        found = linkage(rng, any_plane(rng), samples)
        return replace(
            found,
            name=f"{found.name} to {tol:.3g}",
            tol=tol,
            reasons=BELOW_ROUNDING,
            excused=True,
            facts=(("tol", tol),),
        )
