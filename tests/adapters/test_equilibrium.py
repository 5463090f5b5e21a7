"""Equilibria by each simulator's own kinematics, gravity and rows, against closed forms."""

import math

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.case.case import TIME, Balance, Case, Output, Sweep, Truth
from kincheck.core.case.measures import ElementForce
from kincheck.core.case.quantity import with_markers
from kincheck.core.harness.execution import Pair, attempt
from kincheck.core.joints import Revolute, Translational
from kincheck.core.kinematics import LoadPoint
from kincheck.core.mechanism.body import Body
from kincheck.core.mechanism.loads import Bushing, SpringDamper, TorsionSpringDamper
from kincheck.core.mechanism.mechanism import GROUND, Mechanism, Point
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from ..support.engine_motion import SIMULATORS, installed

ORIGIN, Z = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
STOP = ((-0.1, -100.0), (0.0, 0.0), (0.1, 100.0), (0.1001, 120.0), (0.2, 18100.0))
PROGRESSIVE = PchipInterpolator(*np.array(STOP).T)
ENGINES = pytest.mark.parametrize("name", ["native", *SIMULATORS, "exudyn-static"])


def engine_of(name):
    if name not in adapters.SIMULATIONS or name in adapters.ENGINES:
        return installed(name)
    engine = adapters.engine(name, "simulate")
    return engine if engine.version() else pytest.skip(f"{name} is not installed")


def held_in(mechanism, place, force):
    """Return equilibria under forces on a point, shape (n, 3)."""
    force = np.array(force, dtype=float)
    loads = {place.name: np.hstack([force, np.zeros_like(force)])}
    outputs = [
        Output(k, place.name, axis, False, 1e-12, 0.0, "round-off")
        for k, axis in zip("xyz", np.eye(3).tolist(), strict=True)
    ]
    amount = ElementForce("amount", 1e-9, 0.0, "round-off", force=mechanism.forces[0].name)
    outputs.append(amount.bound(mechanism))
    mechanism = with_markers(mechanism, outputs)
    sweep = Sweep(TIME, np.arange(len(force), dtype=float), 0.0)
    at = LoadPoint(place.name, place.body, place.position)
    facts = (mechanism.name, "closed form", Truth.CONSENSUS_ONLY, mechanism, sweep, tuple(outputs))
    return Case(*facts, balance=Balance((at,), loads))


@ENGINES
@pytest.mark.parametrize(
    ("element", "load", "angle"),
    [
        # k sin(th) = F a cos(th)
        (
            Bushing("t", GROUND, "arm", ORIGIN, turning_stiffness=(0.0, 0.0, 500.0)),
            300.0,
            math.atan(300.0 * 0.4 / 500.0),
        ),
        # k th = F a cos(th)
        (
            Bushing("t", GROUND, "arm", ORIGIN, turning_stiffness=500.0, law="cardan"),
            300.0,
            brentq(lambda x: 500.0 * x - 120.0 * math.cos(x), 0.0, 1.5, xtol=1e-15),
        ),
        # k b sin(th) b cos(th) = F a cos(th)
        (
            Bushing("s", GROUND, "arm", (0.25, 0.0, 0.0), stiffness=(0.0, 2e5, 0.0)),
            8000.0,
            math.asin(8000.0 * 0.4 / (2e5 * 0.25**2)),
        ),
        # k (th - free) = F a cos(th)
        (
            TorsionSpringDamper("c", "hinge", 500.0, free_angle=0.1),
            900.0,
            brentq(lambda x: 500.0 * (x - 0.1) - 360.0 * math.cos(x), 0.0, 1.5, xtol=1e-15),
        ),
        # progressive(th) = F a cos(th), beyond its stop
        (
            TorsionSpringDamper("c", "hinge", curve=STOP),
            1000.0,
            brentq(lambda x: PROGRESSIVE(x) - 400.0 * math.cos(x), 0.0, 0.2, xtol=1e-16),
        ),
        # progressive(b sin(th)) b cos(th) = F a cos(th), beyond the stop
        (
            Bushing("b", GROUND, "arm", (0.25, 0.0, 0.0), curve=((), STOP, ())),
            400.0,
            math.asin(brentq(lambda x: PROGRESSIVE(x) * 0.25 - 160.0, 0.0, 0.2, xtol=1e-16) / 0.25),
        ),
    ],
    ids=["torsion", "cardan", "side", "coil", "coil stop", "stop"],
)
def test_equilibrium_of_loaded_arm(name, element, load, angle):
    arm = Mechanism(
        "arm",
        [Body("arm")],
        [Revolute("hinge", GROUND, "arm", point=ORIGIN, axis=Z)],
        [tip := Point("tip", "arm", (0.4, 0.0, 0.0))],
        forces=[element],
    )
    found = engine_of(name).equilibria(held_in(arm, tip, [[0.0, load, 0.0], [0.0, 0.0, 0.0]]))
    assert found.solved.all()
    (x, y, _), (x0, y0, _) = found.points["tip"].position
    assert math.atan2(y, x) == pytest.approx(angle, abs=1e-13)
    at_rest = 0.1 if getattr(element, "free_angle", 0.0) else 0.0
    assert math.atan2(y0, x0) == pytest.approx(at_rest, abs=1e-13)


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
        forces=[SpringDamper("s", "arm", GROUND, (ORIGIN, (0.0, 0.0, 1.0)), 1e5)],
    )
    found = attempt(Pair(held_in(loose, tip, [[0.0, 1.0, 0.0]]), engine_of("mujoco"), 1e-12))
    assert "nothing holds a body" in found.result.message
