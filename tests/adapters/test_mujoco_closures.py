"""Loop closures in MuJoCo: any joint cut or mirrored, closures that it leaves out, rods."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters.mujoco import mujoco as adapter
from kincheck.adapters.shared import tree_plan
from kincheck.core.joints import (
    Distance,
    Fixed,
    Inline,
    Joint,
    Revolute,
    Screw,
    Spherical,
    Translational,
)
from kincheck.core.mechanism.mechanism import Body, SpanningTree, spanning_tree
from kincheck.core.mechanism.motions import JointDisplacement, PointCoordinate

from ..support.mujoco_cases import (
    B0,
    C0,
    SLIDER,
    assert_motion,
    case,
    change,
    periodic,
    slider_crank,
    solve,
)

pytest.importorskip("mujoco", reason="MuJoCo is not installed")


def cut(monkeypatch, name):
    """The adapter cuts this joint; its bodies hang on others, or are free."""

    def tree(mechanism):
        rest = spanning_tree(
            replace(
                mechanism,
                joints=[each for each in mechanism.joints if each.name != name],
                drivers=(),
            )
        )
        return SpanningTree(rest.branches, (*rest.cut, mechanism.joint(name)))

    monkeypatch.setattr(tree_plan, "spanning_tree", tree)


@pytest.fixture(scope="module")
def peg():
    """Where the peg of the slider-crank goes, with no joint cut or mirrored."""
    return solve(slider_crank()).points["peg"].position


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("cutting", [False, True])
@pytest.mark.parametrize("name", ["pivot", "pin", "gudgeon", "guide", "glue"])
def test_any_joint_can_be_mirrored_and_cut(name, cutting, mirrored, peg, monkeypatch):
    """The driven joint among them; its value keeps its sign when both the bodies and the axis are
    exchanged.
    """
    whole = slider_crank()
    joint = whole.mechanism.joint(name)
    if mirrored:
        joint = joint.reversed()
        joint = (
            replace(joint, axis=tuple(-x for x in joint.axis))
            if isinstance(joint, Revolute)
            else joint
        )
    if cutting:
        cut(monkeypatch, name)
    trajectory = solve(change(whole, joint))
    assert not cutting or trajectory.details["closures"][name].startswith(
        "connect" if name == "pin" else "weld"
    )
    assert_motion(trajectory.points["slider"], *periodic(SLIDER))
    assert_motion(trajectory.points["peg"], *periodic(peg))


def test_rows_are_the_derivatives_of_one_another(monkeypatch):
    """Off the solution too, for connects, a weld, a tendon, a joint equality and a point driver."""
    cut(monkeypatch, "gudgeon")
    brace = Distance("brace", "ground", "slider", ((0.5, 0.4, 0.3), (0.2, 0.0, 0.0)))
    extra = Spherical("extra", "peg", "ground", (0.1, 0.3, 0.3))
    groove = Inline("groove", "rod", "ground", (0.3, 0.1, 0.2), (1.0, 2.0, 0.0))
    thread = Screw("pivot", "ground", "crank", (0.0, 0.1, 0.12), (1.0, 0.0, 0.0), 0.3)
    drivers = (PointCoordinate("crank", "peg", (1.0, 2.0, -2.0)),)
    mechanism = change(slider_crank(), brace, extra, groove, thread, drivers=drivers)
    model, random = adapter.MuJoCo().build(mechanism), np.random.default_rng(1)
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


def test_closures_that_mujoco_leaves_out():
    """A weld inside one rigid body, a rod between fixed bodies, and a bearing on the crank's axis:
    rows of zeros or nearly so.
    """
    glue, base = Fixed("more glue", "peg", "rod"), Fixed("base", "ground", "post")
    bearing, brace = (
        Spherical("bearing", "ground", "crank", (0.5, 0.1, 0.12)),
        Distance("brace", "ground", "post", (C0, B0[0])),
    )
    bodies = [Body(name) for name in ("crank", "rod", "slider", "peg", "post")]
    redundant = change(slider_crank(), glue, bearing, base, brace, bodies=bodies)
    assert_motion(solve(redundant).points["slider"], *periodic(SLIDER))
    assert (
        "no assembly at the design position"
        in solve(change(redundant, replace(brace, length=0.2)), complete=False).message
    )


def test_a_rod_square_to_a_slider():
    """At its dead centre MuJoCo leaves the rod's row out; the row is zero there, its rate v^2 /
    span.
    """
    guide = Translational("guide", "ground", "slider", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rod = Distance("rod", "ground", "slider", ((0.0, 0.3, 0.0), (0.4, 0.0, 0.0)))
    model = adapter.MuJoCoModel(
        adapter.mujoco(), case([guide, rod], {}, [JointDisplacement("push", "guide")], [0.0])
    )
    for shift, span, row, rate in ((0.0, 0.5, 0.8, 0.6**2 / 0.5), (-0.4, 0.3, 0.0, 1 / 0.3)):
        model.move(np.array([shift]))
        np.testing.assert_allclose(
            model.residual(np.zeros(1)), [span - 0.5, shift], rtol=0, atol=1e-15
        )
        np.testing.assert_allclose(model.jacobian(), [[row], [1.0]], rtol=0, atol=1e-15)
        np.testing.assert_allclose(model.bias(np.ones(1)), [rate, 0.0], rtol=0, atol=1e-14)


def test_a_body_on_rods_is_a_body_on_arms():
    """Two rods to one ball do what an arm on a revolute does."""
    upper, lower = (
        ((-0.1, 0.4, 0.3), (0.2, 0.4, 0.3), (0.0, 0.7, 0.3)),
        ((-0.1, 0.3, -0.1), (0.2, 0.35, -0.1), (0.05, 0.8, -0.1)),
    )
    rods: list[Joint] = [Distance("tie", "knuckle", "ground", ((0.2, 0.7, 0.0), (0.2, 0.4, 0.02)))]
    arms = rods.copy()
    for name, (front, rear, ball) in {"upper": upper, "lower": lower}.items():
        rods += [
            Distance(f"{name} {k}", "ground", "knuckle", (foot, ball))
            for k, foot in enumerate((front, rear))
        ]
        arms += [Revolute(f"{name} pivot", "ground", name, front, tuple(np.subtract(rear, front)))]
        arms += [Spherical(f"{name} ball", name, "knuckle", ball)]
    points, stroke = (
        {"hub": ("knuckle", (0.0, 0.8, 0.1))},
        [PointCoordinate("stroke", "hub", (0.0, 0.1, 1.0))],
    )
    on_rods, on_arms = (
        solve(case(joints, points, stroke, np.linspace(-0.08, 0.08, 9))) for joints in (rods, arms)
    )
    assert on_rods.details["tree"] == {"knuckle": "free"}
    hub = on_arms.points["hub"]
    assert_motion(
        on_rods.points["hub"],
        hub.position,
        hub.velocity,
        hub.acceleration,
        atol=(1e-13, 1e-12, 1e-11),
    )
