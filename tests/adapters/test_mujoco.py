"""MuJoCo's own closures: their rows off the solution, and those that it leaves out."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Distance,
    Fixed,
    Inline,
    JointDisplacement,
    PointCoordinate,
    Screw,
    Spherical,
    Translational,
)
from kincheck.adapters.mujoco import mujoco as adapter

from ..support.engine_motion import (
    B0,
    C0,
    CRANK_RATE,
    CRANK_TURN,
    PERIODIC,
    SLIDER,
    TOL,
    assert_motion,
    cutting,
    mechanism_of,
    motion_case,
    periodic,
    slider_crank,
    solved,
    with_joints,
)
from ..support.mechanisms import ORIGIN, X

pytest.importorskip("mujoco", reason="MuJoCo is not installed")


def test_mujoco_rows_are_consistent_derivatives():
    """Off the solution too, for connects, a weld, a tendon, a joint equality and a point driver."""
    brace = Distance("brace", "ground", "slider", ((0.5, 0.4, 0.3), (0.2, 0.0, 0.0)))
    extra = Spherical("extra", "peg", "ground", (0.1, 0.3, 0.3))
    groove = Inline("groove", "rod", "ground", (0.3, 0.1, 0.2), (1.0, 2.0, 0.0))
    thread = Screw("pivot", "ground", "crank", (0.0, 0.1, 0.12), X, 0.3)
    drivers = (PointCoordinate("crank", "peg", (1.0, 2.0, -2.0)),)
    mechanism = with_joints(slider_crank(), brace, extra, groove, thread, drivers=drivers)
    with cutting("gudgeon"):
        model = adapter.MuJoCo().build(motion_case(mechanism, [0.0]))
    random = np.random.default_rng(1)
    model.reset()
    model.residual(np.zeros(1))
    start, v = random.normal(size=(2, model.jacobian().shape[1]))
    model.move(0.2 * start)
    here, h = model.save(), 1e-3

    def along(t):
        model.restore(here)
        model.move(t * v)
        r = model.residual(np.zeros(1))
        return np.stack([r, model.jacobian() @ v])

    difference = (
        sum(w * (along(k * h) - along(-k * h)) for k, w in ((1, 0.75), (2, -0.15), (3, 1 / 60))) / h
    )
    along(0.0)
    np.testing.assert_allclose(
        np.stack([model.jacobian() @ v, model.bias(v)]), difference, rtol=0, atol=1e-10
    )


def test_mujoco_degenerate_closures_are_solved():
    """A weld inside one rigid body, a rod between fixed bodies, and a bearing on the crank's axis:
    rows of zeros or nearly so.
    """
    glue, base = Fixed("more glue", "peg", "rod"), Fixed("base", "ground", "post")
    bearing, brace = (
        Spherical("bearing", "ground", "crank", (0.5, 0.1, 0.12)),
        Distance("brace", "ground", "post", (C0, B0[0])),
    )
    bodies = [Body(name) for name in ("crank", "rod", "slider", "peg", "post")]
    redundant = with_joints(slider_crank(), glue, bearing, base, brace, bodies=bodies)
    found = solved("mujoco", redundant, CRANK_TURN, CRANK_RATE).points["slider"]
    assert_motion(found, *periodic(SLIDER), atol=PERIODIC)
    case = motion_case(with_joints(redundant, replace(brace, length=0.2)), [0.0])
    engine = adapter.MuJoCo()
    failed = engine.solve(engine.build(case), case, TOL)
    assert "no assembly at the design position" in failed.message


def test_mujoco_rod_at_dead_centre():
    """At its dead centre MuJoCo leaves the rod's row out; the row is zero there, its rate v^2 /
    span.
    """
    guide = Translational("guide", "ground", "slider", ORIGIN, X)
    rod = Distance("rod", "ground", "slider", ((0.0, 0.3, 0.0), (0.4, 0.0, 0.0)))
    mechanism = mechanism_of([guide, rod], {}, [JointDisplacement("push", "guide")])
    model = adapter.MuJoCoModel(adapter.mujoco(), motion_case(mechanism, [0.0]))
    for shift, span, row, rate in ((0.0, 0.5, 0.8, 0.6**2 / 0.5), (-0.4, 0.3, 0.0, 1 / 0.3)):
        model.move(np.array([shift]))
        np.testing.assert_allclose(
            model.residual(np.zeros(1)), [span - 0.5, shift], rtol=0, atol=1e-15
        )
        np.testing.assert_allclose(model.jacobian(), [[row], [1.0]], rtol=0, atol=1e-15)
        np.testing.assert_allclose(model.bias(np.ones(1)), [rate, 0.0], rtol=0, atol=1e-14)
