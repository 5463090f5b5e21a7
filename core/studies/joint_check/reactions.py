"""Checks of a joint's reaction in its probe with masses, gravity and a spring.

The reaction does no work on the freedoms of the joint, the first body gets the opposite of what the
second gets, and neither depends on the order of bodies and joints, on units or on place. Bodies are
balanced by Newton and Euler from their motion: no equation of the forces takes part.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...case.case import Case
from ...errors import KincheckError
from ...joints import Kind
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Sine
from ..findings import Finding, Verdict, judged
from .balance import speed, unbalanced, work
from .loaded_probe import Probe, solved

# Round-off of sums of some thirty products over the smallest singular value of the probes (0.01),
# squared for accelerations, and ten times that.
LIMIT = 1e-10
WHY = "round-off over the squared smallest singular value of the probe, relative to the forces"
# An exact change of units, and a shift of the probe [m]: its coordinates lose three digits.
SMALLER, SHIFT = 2.0**-10, 128.0
PLACE_LIMIT = 1e3 * LIMIT


def reactions(probe: Probe, case: Case, what: str = "reaction") -> Iterator[Finding]:
    """Yield the findings on the reaction of the joint under test.

    Args:
        case: from `loaded` or `driven`, solved as `probe`.
        what: first part of the names of the findings.
    """
    forces = probe.motion.forces
    assert forces is not None
    largest = float(np.nanmax(forces.largest_power))
    yield judged(
        f"{what}: power",
        np.abs(forces.power)[None] / largest,
        LIMIT,
        WHY,
        ["power"],
        remedy="drivers, masses and springs do not balance: a joint has nu = 0",
    )
    yield judged(
        f"{what}: no work",
        np.abs(work(probe))[None] / (probe.size * speed(probe)),
        LIMIT,
        WHY,
        ["work"],
        remedy="the reaction works on the joint's freedoms: see rows and nu",
    )
    off = np.array([unbalanced(probe, body) for body in probe.joint.bodies])
    yield judged(
        f"{what}: acts and reacts",
        np.abs(off).max(axis=2) / probe.size,
        LIMIT,
        WHY,
        [f"body {body}" for body in probe.joint.bodies],
        remedy="what one body gets is not the opposite of what the other gets: see rows; a driver's"
        " force acts along the axis through the point: see measured()",
    )
    yield from _variants(probe, case, what)


def _variants(probe: Probe, case: Case, what: str) -> Iterator[Finding]:
    """Check that forces do not depend on what is arbitrary."""
    mechanism = case.mechanism
    others: Sequence[tuple[str, Mechanism, float, float]] = (
        ("order", _turned_round(mechanism), 1.0, LIMIT),
        ("units", _scaled(mechanism, SMALLER), SMALLER, LIMIT),
        ("place", _shifted(mechanism, SHIFT), 1.0, PLACE_LIMIT),
    )
    for name, other, scale, limit in others:
        remedy = (
            f"the reaction depends on the {name}: use no constants of length, no global coordinates"
            " and no internal origins in primitives()"
        )
        try:
            found = solved(_paced(case, scale), other).reaction
        except KincheckError as error:
            yield Finding(f"{what}: {name}", Verdict.FAIL, message=f"{error}; {remedy}")
            continue
        off = np.concatenate(
            [
                found.force / scale - probe.reaction.force,
                found.moment / scale**2 - probe.reaction.moment,
            ],
            axis=1,
        )
        yield judged(
            f"{what}: {name}",
            np.abs(off).T / probe.size,
            limit,
            WHY,
            ["force x", "force y", "force z", "moment x", "moment y", "moment z"],
            remedy=remedy,
        )


def _paced(case: Case, factor: float) -> Case:
    """Return the case with lengths in the motions of its drivers by a factor."""
    motions = {
        name: replace(motion, amplitude=factor * motion.amplitude)
        if isinstance(motion, Sine) and not case.mechanism.driver(name).turns
        else motion
        for name, motion in case.sweep.motions.items()
    }
    return replace(case, sweep=replace(case.sweep, motions=motions))


def _turned_round(mechanism: Mechanism) -> Mechanism:
    return replace(mechanism, bodies=mechanism.bodies[::-1], joints=mechanism.joints[::-1])


def _scaled(mechanism: Mechanism, factor: float) -> Mechanism:
    """Return the mechanism with all lengths by a factor, the same mass and times."""

    def place(point: Any) -> Any:
        return tuple(factor * x for x in point)

    return replace(
        mechanism,
        bodies=[body.in_frame(place, 1.0 / factor) for body in mechanism.bodies],
        joints=[joint.scaled(factor) for joint in mechanism.joints],
        points=[replace(point, position=place(point.position)) for point in mechanism.points],
        gravity=place(mechanism.gravity),
        forces=[force.in_frame(place, 1.0 / factor) for force in mechanism.forces],
    )


def _shifted(mechanism: Mechanism, offset: float) -> Mechanism:
    def place(point: Any) -> Any:
        return tuple(x + offset for x in point)

    return replace(
        mechanism,
        bodies=[body.in_frame(place) for body in mechanism.bodies],
        joints=[replace(j, **j.mapped({Kind.POSITION: place})) for j in mechanism.joints],
        points=[replace(point, position=place(point.position)) for point in mechanism.points],
        forces=[force.in_frame(place) for force in mechanism.forces],
    )
