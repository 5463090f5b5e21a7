"""The turn of a planar joint, driven and coupled: a ladder against the wall, by its closed form, in
every engine.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    Gear,
    InPlane,
    JointAngle,
    JointDisplacement,
    Mechanism,
    MechanismError,
    Outcome,
    Planar,
    Point,
    Revolute,
    adapters,
    solve,
)
from kincheck.core.case.case import Output, Series, Sweep, Truth
from kincheck.core.harness.run import run
from kincheck.core.kinematics import styles
from kincheck.core.trajectory import QUANTITIES

TILT, RATIO, RATE = 0.3, -1.5, 2.0
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
TURNS = np.linspace(-0.25, 8.0, 34)
"""More than one turn: what follows an angle by its sine alone, or by arctan, is off by some of
them.
"""


def ladder(bodies, axis):
    """A ladder of 1 m that lies in a plane, its foot on the floor and its head at the wall, geared
    to a wheel, and turned.
    """
    foot, head = (math.cos(TILT), 0.0, 0.0), (0.0, math.sin(TILT), 0.0)
    return Mechanism(
        "ladder",
        [Body("ladder"), Body("wheel")],
        [
            Planar("plane", *bodies, point=(0.2, 0.1, 0.0), axis=axis),
            InPlane("wall", "ground", "ladder", head, X),
            InPlane("floor", "ground", "ladder", foot, Y),
            Revolute("axle", "ground", "wheel", (2.0, 0.0, 0.0), Z),
        ],
        [
            Point("foot", "ladder", foot),
            Point("head", "ladder", head),
            Point("rim", "wheel", (2.5, 0.0, 0.0)),
        ],
        [JointAngle("turn", "plane")],
        [Gear("gear", ("axle", "plane"), RATIO)],
    )


@pytest.fixture(
    params=[
        (("ground", "ladder"), Z),
        (("ladder", "ground"), Z),
        (("ground", "ladder"), (0.0, 0.0, -2.0)),
    ],
    ids=["", "reversed", "down"],
)
def case(request):
    """With the angle's sense by the order of bodies and by the axis."""
    bodies, axis = request.param
    sense = (1.0 if bodies[0] == "ground" else -1.0) * math.copysign(1.0, axis[2])
    # turned by t about z the ladder falls: its slope is TILT - t
    slope, wheel = TILT - sense * TURNS, RATIO * TURNS
    s, w = -sense * RATE, RATIO * RATE
    reference = {
        "foot": Series(np.cos(slope), -s * np.sin(slope), -(s**2) * np.cos(slope)),
        "head": Series(np.sin(slope), s * np.cos(slope), -(s**2) * np.sin(slope)),
        "rim": Series(0.5 * np.sin(wheel), 0.5 * w * np.cos(wheel), -0.5 * w**2 * np.sin(wheel)),
    }
    outputs = [
        Output(name, name, along, False, 1e-12, 0.0, "round-off")
        for name, along in (("foot", X), ("head", Y), ("rim", Y))
    ]
    sweep = Sweep("turn", TURNS, RATE)
    return Case(
        "ladder",
        "closed form",
        Truth.CLOSED_FORM,
        ladder(bodies, axis),
        sweep,
        tuple(outputs),
        reference,
    )


@pytest.mark.parametrize("style", styles())
def test_planar_turn_in_row_styles(case, style):
    found = solve(case.mechanism, "turn", TURNS, rate=RATE, style=style)
    assert found.solved.all(), found.message
    for output in case.outputs:
        motion, true = found.points[output.point], case.reference[output.name]
        for quantity, atol in zip(QUANTITIES, (1e-14, 1e-14, 1e-13), strict=True):
            along = getattr(motion, quantity) @ np.array(output.direction)
            assert along == pytest.approx(getattr(true, quantity), abs=atol)


def test_planar_turn_in_all_engines(case):
    engines = [
        each for each in map(adapters.engine, adapters.ENGINES) if each.version() is not None
    ]
    for record in run([case], engines, tol=1e-12).records:
        assert record.outcome is Outcome.PASS, record


@pytest.mark.needs("simulate")
@pytest.mark.parametrize("name", ["mujoco-projecting", "pinocchio", "exudyn-static"])
def test_planar_turn_by_simulation(case, name):
    """Of those with drift by what they drift; a turn lost, or of the other sense, is off by a
    metre.
    """
    engine = adapters.engine(name, "simulate")
    if engine.version() is None:
        pytest.skip("not installed")
    m = case.mechanism  # without the gear, which is beyond some of them
    alone = replace(m, bodies=m.bodies[:1], joints=m.joints[:3], points=m.points[:2], couplers=())
    loose = replace(
        case, mechanism=alone, outputs=tuple(replace(each, atol=1e-2) for each in case.outputs[:2])
    )
    (record,) = run([loose], [engine], tol=1e-12).records
    for name in ("foot", "head"):
        assert record.errors[name].position.within, record


def test_planar_translation_driver_is_refused():
    mechanism = ladder(("ground", "ladder"), Z)
    with pytest.raises(
        MechanismError,
        match=(
            r"joint 'plane' is planar and has no translation to drive; its freedoms:"
            r" translation x, "
        ),
    ):
        replace(mechanism, drivers=[JointDisplacement("shift", "plane")])
