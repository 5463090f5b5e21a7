"""Equilibria by each simulator's own kinematics, gravity and rows, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import GROUND, Body, Mechanism, Point, Revolute, Translational, adapters
from kincheck.core.case.case import Balance
from kincheck.core.case.measures import ElementForce
from kincheck.core.case.quantity import with_markers
from kincheck.core.harness.execution import Pair, attempt
from kincheck.core.mechanism.loads import Bushing, SpringDamper, TorsionSpringDamper
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from ...support.engine_motion import SIMULATORS, installed, motion_case
from ...support.mechanisms import Z

ORIGIN, Z = (0.0, 0.0, 0.0), Z
STOP = ((-0.1, -100.0), (0.0, 0.0), (0.1, 100.0), (0.1001, 120.0), (0.2, 18100.0))
PROGRESSIVE = PchipInterpolator(*np.array(STOP).T)
ENGINES = pytest.mark.parametrize("name", ["native", *SIMULATORS, "exudyn-static"])


def engine_of(name):
    return installed(name, "projection" if name in adapters.ENGINES else "simulate")


def held_in(mechanism, place, force):
    """Return equilibria under forces on a point, shape (n, 3)."""
    force = np.array(force, dtype=float)
    loads = {place.name: np.hstack([force, np.zeros_like(force)])}
    case = motion_case(mechanism, np.arange(len(force)), 0.0)
    amount = ElementForce("amount", 1e-9, 0.0, "round-off", force=mechanism.forces[0].name)
    outputs = *case.outputs, amount.bound(mechanism)
    return replace(
        case,
        mechanism=with_markers(mechanism, outputs),
        outputs=outputs,
        balance=Balance((Point(place.name, place.body, place.position),), loads),
    )


def progressive(x):
    return PROGRESSIVE(min(x, 0.2))


def balance(moment, force):
    """The angle at which a force on the arm of 0.4 m that keeps its direction has a moment."""
    ends = {"a": -0.1, "b": 1.2, "xtol": 1e-16, "rtol": 1e-15}
    return brentq(lambda turn: moment(turn) - 0.4 * force * math.cos(turn), **ends)


@pytest.mark.by_day(3)
@ENGINES
@pytest.mark.parametrize(
    ("element", "load", "moment"),
    [
        (
            Bushing("t", GROUND, "arm", ORIGIN, turning_stiffness=(0.0, 0.0, 500.0)),
            300.0,
            lambda turn: 500.0 * math.sin(turn),
        ),
        (
            Bushing("t", GROUND, "arm", ORIGIN, turning_stiffness=500.0, law="cardan"),
            300.0,
            lambda turn: 500.0 * turn,
        ),
        (
            Bushing("s", GROUND, "arm", (0.25, 0.0, 0.0), stiffness=(0.0, 2e5, 0.0)),
            8000.0,
            lambda turn: 2e5 * 0.25**2 * math.sin(turn) * math.cos(turn),
        ),
        (
            TorsionSpringDamper("c", "hinge", 500.0, free_angle=0.1),
            900.0,
            lambda turn: 500.0 * (turn - 0.1),
        ),
        # beyond the stop
        (TorsionSpringDamper("c", "hinge", curve=STOP), 1000.0, progressive),
        (
            Bushing("b", GROUND, "arm", (0.25, 0.0, 0.0), curve=((), STOP, ())),
            400.0,
            lambda turn: progressive(0.25 * math.sin(turn)) * 0.25 * math.cos(turn),
        ),
    ],
    ids=["torsion", "cardan", "side", "coil", "coil stop", "stop"],
)
def test_equilibrium_of_loaded_arm(name, element, load, moment):
    arm = Mechanism(
        "arm",
        [Body("arm")],
        [Revolute("hinge", GROUND, "arm", point=ORIGIN, axis=Z)],
        [tip := Point("tip", "arm", (0.4, 0.0, 0.0))],
        forces=[element],
    )
    found = engine_of(name).equilibria(held_in(arm, tip, [[0.0, load, 0.0], [0.0, 0.0, 0.0]]))
    assert found.solved.all()
    for (x, y, _), force in zip(found.points["tip"].position, (load, 0.0), strict=True):
        assert math.atan2(y, x) == pytest.approx(balance(moment, force), abs=1e-13)


@pytest.mark.parametrize("name", SIMULATORS)
def test_equilibrium_beyond_snap_through(name):
    """Beyond the limit load plain Newton lands at the far side, its residual zero."""
    engine, at, limit = engine_of(name), (0.0, 0.0, 0.06), 90.57442209975467
    springs = [
        SpringDamper(f"s{x:g}", "slider", GROUND, (at, (x, 0.0, 0.0)), 1e5) for x in (0.3, -0.3)
    ]
    guide = Translational("guide", GROUND, "slider", at, Z)
    top = Point("top", "slider", at)
    snap = Mechanism("snap", [Body("slider", at)], [guide], [top], forces=springs)
    loads = [[0.0, 0.0, -share * limit] for share in (0.5, 0.999, 1.001, 1.5, 20.0)]
    found = engine.equilibria(held_in(snap, top, loads))
    assert found.solved.tolist() == [True, True, False, False, False]
    z = found.points["top"].position[:2, 2]
    length, free = np.hypot(0.3, z), math.hypot(0.3, 0.06)
    balance = 2.0 * 1e5 * (free - length) * z / length
    assert balance == pytest.approx([0.5 * limit, 0.999 * limit], rel=1e-9)
    assert (z > 0.0344).all()


def test_equilibrium_of_loose_body_fails():
    loose = Mechanism(
        "loose",
        [Body("arm", mass=1.0)],
        [Revolute("hinge", GROUND, "arm", point=ORIGIN, axis=Z)],
        [tip := Point("tip", "arm", (0.4, 0.0, 0.0))],
        forces=[SpringDamper("s", "arm", GROUND, (ORIGIN, Z), 1e5)],
    )
    found = attempt(Pair(held_in(loose, tip, [[0.0, 1.0, 0.0]]), engine_of("mujoco"), 1e-12))
    assert "nothing holds a body" in found.result.message
