"""Cases with measures."""

from dataclasses import replace

import numpy as np
from kincheck import Body, Case, Cylindrical, Fixed, Mechanism, Point, Ramp, Revolute
from kincheck import JointAngle as AngleDriver
from kincheck import JointDisplacement as DisplacementDriver
from kincheck.core.case.case import Sweep, Truth

AXIS = (1.0, 2.0, 2.0)
RATE = 2.0


def arm(values, **more):
    """A disc that turns about an oblique axis, and a slide that moves along it on the disc."""
    mechanism = Mechanism(
        "arm",
        [Body("disc"), Body("slide"), Body("weld")],
        [
            Revolute("hinge", "ground", "disc", (1.0, 0.0, 0.0), AXIS),
            Cylindrical("bore", "disc", "slide", (1.0, 0.5, 0.0), AXIS),
            Fixed("glue", "slide", "weld"),
        ],
        [Point("A", "ground", (0.0, 0.0, 0.0)), Point("B", "disc", (1.0, 1.0, 0.0))],
        [
            AngleDriver("turn", "hinge"),
            AngleDriver("spin", "bore"),
            DisplacementDriver("push", "bore"),
        ],
    )
    motions = {"spin": Ramp(-3.0 * RATE), "push": Ramp(0.25)}
    sweep = Sweep("turn", np.array(values), RATE, 0.0, motions)
    return replace(Case("arm", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, ()), **more)
