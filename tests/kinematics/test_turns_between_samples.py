"""A driver that stands at two neighbouring samples and makes whole turns between them, in every
engine.

Where it stands says nothing of the turns, but a wheel that is geared to it does.
"""

import numpy as np
from kincheck import adapters
from kincheck.core import (
    Body,
    Gear,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    Revolute,
    Table,
    Translational,
)
from kincheck.core.case.case import Case, Output, Series, Sweep, Truth
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run

X, Y, Z, ORIGIN = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
RATIO, VALUES = 0.25, np.array([0.0, 0.1])


def indexing():
    """A wheel that a second one turns by a part of its turns, and a slide that tells the time."""
    joints = [
        Revolute("first", "ground", "wheel", ORIGIN, Z),
        Revolute("second", "ground", "driven", X, Z),
        Translational("guide", "ground", "slide", Z, X),
    ]
    return Mechanism(
        "indexing",
        [Body("wheel"), Body("driven"), Body("slide")],
        joints,
        [Point("rim", "driven", (1.2, 0.0, 0.0))],
        [JointDisplacement("clock", "guide"), JointAngle("turn", "first")],
        [Gear("gear", ("second", "first"), RATIO)],
    )


def test_engines_count_turns_between_samples():
    turns = -3
    rest = np.arange(-40.0, 41.0) * 0.01
    table = Table(
        tuple(np.concatenate([rest, 1.0 + rest])),
        tuple(np.repeat([0.0, 2.0 * np.pi * turns], len(rest))),
    )
    angle, still = RATIO * 2.0 * np.pi * turns * np.array([0.0, 1.0]), np.zeros(2)
    outputs = [
        Output(name, "rim", along, False, 1e-12, 0.0, "round-off")
        for name, along in (("x", X), ("y", Y))
    ]
    reference = {
        "x": Series(1.0 + 0.2 * np.cos(angle), still, still),
        "y": Series(0.2 * np.sin(angle), still, still),
    }
    sweep = Sweep("clock", VALUES, 0.1, motions={"turn": table})
    case = Case(
        "indexing", "closed form", Truth.CLOSED_FORM, indexing(), sweep, tuple(outputs), reference
    )
    engines = [
        each for each in map(adapters.engine, adapters.ENGINES) if each.version() is not None
    ]
    for record in run([case], engines, tol=1e-12).records:
        assert record.outcome is Outcome.PASS, record
