"""Degrees of freedom: the paper's count, the rank, the rows that are left out, and what is said
where the numbers do not match.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Distance,
    Fixed,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    SolveError,
    Spherical,
    Translational,
    Universal,
    solve,
)
from kincheck.core.failures import FailureKind
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.structure.degrees_of_freedom import account

from ..support.mechanisms import (
    CRANK,
    D0,
    ORIGIN,
    ROD,
    Z,
    four_bar,
    mcpherson,
    placed,
    slider_crank,
    solve_all,
)


def account_of(mechanism):
    return account(mechanism, frames(mechanism))


def jacobian(formulation, at):
    """All rows as a dense matrix."""
    matrix = np.zeros((len(formulation.owners), formulation.unknowns))
    for k, row in enumerate(formulation.rows(at)):
        matrix[k, list(row)] = list(row.values())
    return matrix


def test_freedom_account_of_mcpherson():
    """Table 5 of the paper: five bodies, 35 coordinates, 34 equations; the native count: 18
    coordinates, rank 17.
    """
    found = account_of(mcpherson())
    assert found.paper_count == "35 - 34 = 1"
    assert (found.bodies, found.coordinates, found.equations) == (5, 35, 34)
    assert (found.moving_coordinates, found.rows, found.rank, found.dof) == (18, 17, 17, 1)
    assert found.redundant_rows == ()
    details = solve(mcpherson(), "stroke", [0.0]).details
    assert details.items() >= found.details.items()


A, B, X = (0.1, -0.2, 0.3), (0.5, 0.4, 0.9), (1.0, 2.0, -0.5)


@pytest.mark.parametrize(
    ("joint", "dof"),
    [
        (Revolute("j", "ground", "body", A, X), 1),
        (Spherical("j", "ground", "body", A), 3),
        (Translational("j", "ground", "body", A, X), 1),
        (Universal("j", "ground", "body", A, ((1.0, 1.0, 0.0), (1.0, -1.0, 0.5))), 2),
        (Fixed("j", "ground", "body", A), 0),
        (Distance("j", "ground", "body", (A, B)), 5),
    ],
    ids=lambda each: str(getattr(each, "type", each)),
)
def test_freedom_of_joints(joint, dof):
    """Formulation section 6."""
    found = account_of(Mechanism("m", [Body("body")], [joint]))
    assert (found.dof, found.rank) == (dof, joint.rows)


# Redundant rows


TILT = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
TILT *= np.sign(np.linalg.det(TILT))


def tilted(point):
    return tuple(TILT @ point)


@pytest.mark.parametrize(
    "mechanism", [four_bar(), placed(four_bar(), tilted, tilted)], ids=["upright", "tilted"]
)
def test_freedom_of_spatial_four_bar(mechanism):
    """20 rows, 18 coordinates, rank 17 (formulation section 7): three rows are left out, named, and
    hold all the same.
    """
    found = account_of(mechanism)
    assert (found.rows, found.moving_coordinates, found.rank, found.dof) == (20, 18, 17, 1)
    assert len(found.redundant_rows) == 3
    assert all(re.fullmatch("[ABCD]: (Spherical|Dot11)", name) for name in found.redundant_rows)
    motion = solve_all(mechanism, "turn", np.linspace(0.0, 6.0, 40))
    assert motion.details["redundant_residual"] < 1e-14


def test_contradicting_redundant_rows_are_refused():
    """A rod across a guide gives way to first order only: its row is redundant at design and
    violated beyond.
    """
    guided = [
        Translational("guide", "ground", "slider", ORIGIN, (1.0, 0.0, 0.0)),
        Distance("rod", "ground", "slider", (Z, ORIGIN)),
    ]
    m = Mechanism("m", [Body("slider")], guided, [], [JointDisplacement("push", "guide")])
    assert account_of(m).redundant_rows == ("rod: Distance",)
    motion = solve(m, "push", [0.0, 0.1])
    assert motion.solved.tolist() == [True, False]
    assert "the redundant rows (rod: Distance) contradict the others" in motion.message


def test_freedom_of_body_held_twice():
    welds = Fixed("weld", "ground", "a", A), Fixed("weld again", "ground", "a", B)
    m = mechanism_of(*welds, Revolute("r", "a", "b", A, X))
    found = account_of(m)
    assert (found.rows, found.rank, found.dof) == (17, 11, 1)
    solve_all(m, "turn", [0.0, 0.5])


def mechanism_of(*joints, drivers=None):
    drivers = [JointAngle("turn", "r")] if drivers is None else drivers
    return Mechanism("m", [Body("a"), Body("b")], joints, [Point("tip", "b", B)], drivers)


# Freedoms and drivers that do not match


def rod_between_balls(count):
    """A slider-crank whose rod is a body between two balls and so spins about itself."""
    base = slider_crank()
    pin, end = (CRANK, 0.0, 0.0), (CRANK + ROD, 0.0, 0.0)
    joints = [
        base.joint("pivot"),
        Spherical("big end", "crank", "con rod", pin),
        Spherical("small end", "con rod", "slider", end),
    ]
    return replace(
        base, bodies=[*base.bodies, Body("con rod")], joints=[*joints, base.joint("guide")][:count]
    )


SLIDER, STUCK, SPINNING = slider_crank(), FailureKind.LOCKED, rod_between_balls(4)
PUSH, FREE, OVER = JointDisplacement("push", "guide"), FailureKind.FREE, FailureKind.OVERDRIVEN
SKEW = Revolute("D", "ground", "rocker", D0, (1e-6, 1.0, 0.0))
SHORT = Distance("rod", "crank", "slider", ((CRANK, 0.0, 0.0), (CRANK + ROD, 2.0, 0.0)), 1.0)
AXLES = [
    Revolute(name, "ground", name, (x, 0.0, 0.0), Z)
    for name, x in (("a", 0.0), ("b", 1.0), ("c", 2.0))
]
TWICE = [JointAngle("first", "a"), JointAngle("second", "a"), JointAngle("sound", "b")]
REFUSED = {
    "a hinge out of parallel": (
        replace(four_bar(), joints=[*four_bar().joints[:3], SKEW]),
        OVER,
        "0 degrees of freedom",
    ),
    # it alone: the driver holds the crank
    "a rod that spins": (
        SPINNING,
        FREE,
        r"2 degrees of freedom .* 1 driver; 'con rod' can turn; .*use distance",
    ),
    "no drivers": (
        replace(SPINNING, drivers=[]),
        FREE,
        r"0 drivers; 'crank' can turn, 'con rod' can",
    ),
    "no joints": (
        Mechanism("m", [Body("a")], []),
        FREE,
        r"6 degrees of freedom .* 0 drivers; 'a' can move; add a driver",
    ),
    "a loose body": (rod_between_balls(3), FREE, "'slider' can move"),
    "too many drivers": (
        replace(SLIDER, drivers=[*SLIDER.drivers, PUSH]),
        OVER,
        r"1 degree of freedom .* 2 drivers; remove 1",
    ),
    # stretched out, the slider does not move the crank to first order
    "a dead centre": (
        replace(SLIDER, drivers=[PUSH]),
        STUCK,
        r"driver 'push' does not move it .*dead",
    ),
    "across a guide": (
        replace(SLIDER, drivers=[PointCoordinate("lift", "end", Z)]),
        STUCK,
        "'lift'",
    ),
    "nothing moves": (Mechanism("m", [Body("a", fixed=True)], []), OVER, "no body can move"),
    "too short a rod": (
        replace(SLIDER, joints=[SLIDER.joint("pivot"), SHORT, SLIDER.joint("guide")]),
        FailureKind.NOT_CLOSED,
        r"does not close at the design position: residual .* m",
    ),
    "drivers of one joint": (
        Mechanism("twice", [Body("a"), Body("b"), Body("c")], AXLES, [], TWICE),
        STUCK,
        r"drivers 'first', 'second' do not move it .* follows already from each other; give",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_freedom_is_refused(case):
    mechanism, kind, message = REFUSED[case]
    driver = mechanism.drivers[0].name if mechanism.drivers else "none"
    with pytest.raises(SolveError, match=message) as error:
        solve(mechanism, driver, [0.0])
    assert error.value.kind is kind


def test_drivers_of_same_freedom():
    """Two freedoms, two drivers, but both drive the same one."""
    m = mechanism_of(
        Revolute("r", "ground", "a", A, X),
        Revolute("s", "ground", "b", A, X),
        drivers=[JointAngle("turn", "r"), PointCoordinate("again", "tip", Z)],
    )
    solve_all(m, "turn", [0.0, 0.1])
    same = replace(m, points=[Point("tip", "a", B)])
    with pytest.raises(SolveError, match="'turn', 'again'"):
        solve(same, "turn", [0.0])


@pytest.mark.needs("laboratory")
@pytest.mark.parametrize("style", ["native", "mixed", "conventional"])
def test_locked_driver_names_its_joints(style):
    pushed = replace(slider_crank(), drivers=[PointCoordinate("push", "end", (1.0, 0.0, 0.0))])
    said = (
        r"driver 'push' does not move it .* already from 'pivot', 'rod'; give the design in another"
        r" pose"
    )
    with pytest.raises(SolveError, match=said):
        solve(pushed, "push", [0.0], style=style)
