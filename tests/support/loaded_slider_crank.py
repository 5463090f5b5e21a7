"""A mechanism with every kind of load: a crank and slider beside the origin."""

import numpy as np
from kincheck import (
    Body,
    Case,
    Distance,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    Translational,
)
from kincheck.core.case.case import Sweep, Truth
from kincheck.core.case.io.outputs import with_all_coordinates
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper

from .mechanisms import ORIGIN, X, Z

INERTIA = (0.5, 0.75, 1.0, 0.0625, -0.03125, 0.125)
GRAVITY = (0.5, 0.0, -9.75)


def loaded(driver=None):
    """Return a slider-crank in space with masses, gravity and four force elements; all numbers are
    exact in binary.
    """
    return Mechanism(
        name="loaded",
        bodies=[
            Body("crank", mass=2.0, center_of_mass=(0.125, 0.0, 0.25), inertia=INERTIA),
            Body("slider", (2.0, 0.5, 0.0), mass=3.5),
            Body("wall", fixed=True),
        ],
        joints=[
            Revolute("pin", "ground", "crank", point=ORIGIN, axis=Z),
            Translational("rail", "wall", "slider", point=(2.0, 0.5, 0.0), axis=X),
            Distance("rod", "crank", "slider", points=((0.0, 0.5, 0.0), (2.0, 0.5, 0.0))),
        ],
        points=[Point("tip", "slider", (2.0, 0.5, 0.25))],
        drivers=[driver or JointAngle("turn", "pin")],
        gravity=GRAVITY,
        forces=[
            SpringDamper(
                *("spring", "wall", "slider"),
                points=((4.0, 0.5, 0.0), (2.0, 0.5, 0.0)),
                stiffness=800.0,
                damping=16.0,
                free_length=1.75,
            ),
            TorsionSpringDamper("clock", "pin", stiffness=4.0, damping=0.5, free_angle=-0.25),
            Force("push", "slider", (2.25, 0.5, 0.0), (-8.0, 0.0, 1.0), "body"),
            Torque("twist", "crank", (0.0, 0.0, 3.0)),
        ],
    )


def pushed():
    """Return the same, driven at its tip."""
    return loaded(PointCoordinate("push_tip", "tip", X))


def case_of(mechanism):
    """A case of a mechanism with all coordinates, at three samples of its first driver."""
    sweep = Sweep(mechanism.drivers[0].name, np.linspace(0.0, 0.25, 3))
    return with_all_coordinates(
        Case(mechanism.name, "made up", Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    )
