"""The mechanism in the results and as the report draws it: hardpoints where the native engine says,
and nothing it did not say.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    Distance,
    JointAngle,
    Mechanism,
    Outcome,
    Point,
    Results,
    Revolute,
    cases,
    solve,
)
from kincheck.core.case.case import MARKER, Sweep, Truth
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.scene import FRAMES, scene, with_scenes
from kincheck.core.harness.scene_record import Scene, SceneBody
from kincheck.core.report.axis import driver_axis
from kincheck.core.report.drawing import drawing
from msgspec.structs import replace as replaced

from ..oracles.naive import A
from ..support.mechanisms import ORIGIN, X, Z
from ..support.strut_results import GRID, STROKE, record

STRUT = cases.load("mcpherson_strut")
AXIS = driver_axis(
    {"driver": STROKE},
    [record("strut", "closed_form", "one", 0.0, STRUT.sweep.values.tolist())],
    [],
)


def place(drawn, node, frame):
    """Where a hardpoint is, as the page works it out: r + A s."""
    number, *local = drawn.nodes[node]
    body = drawn.bodies[number]
    k = min(frame, len(body["r"]) - 1)
    return np.array(body["r"][k]) + A(np.array(body["p"][k])) @ np.array(local)


def test_scene_hardpoints_follow_native():
    shown = scene(STRUT)
    drawn = drawing(shown, AXIS)
    assert len(shown.frames) == FRAMES
    assert (shown.frames[0], shown.frames[-1]) == (0, 160)
    motion = solve(STRUT.mechanism, "stroke", STRUT.sweep.values[shown.frames]).points[
        "wheel_center"
    ]
    [path] = drawn.paths
    for frame in (0, 17, 60):
        # rounded to a millionth
        assert place(drawn, path, frame) == pytest.approx(motion.position[frame], abs=2e-6)
    assert shown.frames[drawn.start] == 80
    assert drawn.steps[0] == "sample 0 · wheel travel −80 mm"


def test_scene_keeps_joints_and_rods():
    drawn = drawing(scene(STRUT), AXIS)
    [rod] = drawn.rods
    lengths = [
        math.dist(place(drawn, rod[0], frame), place(drawn, rod[1], frame))
        for frame in range(FRAMES)
    ]
    assert lengths == pytest.approx(
        [math.dist((1.115, 0.665, 0.118), (1.14, 0.355, 0.1455))] * FRAMES, abs=5e-6
    )
    names = [body["name"] for body in drawn.bodies]
    ball = np.array([0.9676, 0.66, -0.01])
    sides = [
        k
        for k, (b, *_) in enumerate(drawn.nodes)
        if np.allclose(place(drawn, k, 30), ball, atol=1e-5)
    ]
    assert sorted(names[drawn.nodes[k][0]] for k in sides) == ["knuckle", "lca"]
    for frame in (0, 60):
        assert math.dist(place(drawn, sides[0], frame), place(drawn, sides[1], frame)) < 5e-6


def test_scene_links_hardpoints_of_bodies():
    drawn = drawing(scene(STRUT), AXIS)
    names = [body["name"] for body in drawn.bodies]
    linked = [names[drawn.nodes[a][0]] for a, _ in drawn.links]
    assert {name: linked.count(name) for name in set(linked)} == {
        "lca": 1,
        "knuckle": 6,
        "strut": 1,
    }
    assert all(drawn.nodes[a][0] == drawn.nodes[b][0] for a, b in drawn.links)
    assert {text for *_, text in drawn.labels} == {
        "lca_pivot",
        "ball",
        "strut_slide",
        "strut_top",
        "tie_rod",
        "wheel_center",
    }
    kinds = [(kind, on_fixed) for _, kind, _, on_fixed in drawn.marks]
    assert sorted(kinds) == [
        ("ball", False),
        ("ball", True),
        ("end", False),
        ("end", True),
        ("hinge", True),
        ("slide", False),
    ]


def star(count):
    """A body with so many hardpoints about its turned frame."""
    turned = [math.cos(0.4), 0.0, 0.0, math.sin(0.4)]
    body = SceneBody(name="plate", fixed=False, origin=[5.0, 0.0, 0.0], euler_parameters=turned)
    points = [
        {
            "name": f"P{k}",
            "body": "plate",
            "position": [5.0 + math.cos(k), math.sin(k), 0.1 * k],
            "output": False,
        }
        for k in range(count)
    ]
    return msgspec.convert(
        {"bodies": [msgspec.to_builtins(body)], "joints": [], "points": points}, Scene
    )


@pytest.mark.needs("hardpoints")
def test_scene_omits_marker_points():
    shown = scene(cases.load("mcpherson_suspension"), poses=False)
    names = [point.name for point in shown.points]
    assert "wheel_center" in names
    assert not [name for name in names if name.startswith(MARKER)]
    # a joint and a point of one name, said once
    assert "strut_top" in {text for *_, text in drawing(shown, AXIS).labels}


@pytest.mark.parametrize(("count", "nodes", "links"), [(1, 2, 1), (2, 2, 1), (4, 4, 6), (7, 8, 7)])
def test_scene_links_many_hardpoints_by_hub(count, nodes, links):
    drawn = drawing(star(count), AXIS)
    assert (len(drawn.nodes), len(drawn.links)) == (nodes, links)
    assert place(drawn, 0, 0) == pytest.approx([6.0, 0.0, 0.0], abs=1e-12)


def test_scene_of_single_hardpoint():
    body = SceneBody(name="plate", fixed=False, origin=[0, 0, 0], euler_parameters=[1, 0, 0, 0])
    assert drawing(replaced(star(1), bodies=[body]), AXIS).links == []


def test_scene_axes_of_far_origin():
    near, far = (
        drawing(star(4), AXIS),
        drawing(
            replaced(
                star(4),
                bodies=[
                    SceneBody(
                        name="plate", fixed=False, origin=[0, 0, 0], euler_parameters=[1, 0, 0, 0]
                    )
                ],
            ),
            AXIS,
        ),
    )
    assert near.bodies[1]["frame"] == [0.0, 0.0, 0.0]
    assert far.bodies[1]["frame"] == pytest.approx(
        np.mean([node[1:] for node in far.nodes], axis=0)
    )


def dead_centre():
    """A crank-rocker turned beyond where its rod reaches."""
    mechanism = Mechanism(
        "short",
        [Body("crank"), Body("rocker")],
        [
            Revolute("a", "ground", "crank", ORIGIN, Z),
            Revolute("b", "ground", "rocker", (3, 0, 0), Z),
            Distance("rod", "crank", "rocker", (X, (3, 1, 0))),
        ],
        [Point("pin", "crank", X)],
        [JointAngle("turn", "a")],
    )
    return Case(
        "short", "", Truth.CONSENSUS_ONLY, mechanism, Sweep("turn", np.linspace(0.0, 3.1, 301)), ()
    )


def test_scene_skips_unreached_samples():
    shown = scene(dead_centre())
    assert 0 < len(shown.frames) < FRAMES
    assert "cannot be followed beyond" in shown.message
    assert all(len(body.r) == len(body.p) == len(shown.frames) for body in shown.bodies)
    assert np.isfinite([body.r for body in shown.bodies]).all()
    assert drawing(shown, AXIS).caption.endswith(f"C{shown.message[1:]}.")


def test_unsolved_scene_shows_design():
    case = dead_centre()
    undriven = replace(case.mechanism, joints=case.mechanism.joints[:2])
    shown = scene(replace(case, mechanism=undriven))
    assert shown.frames == []
    assert all(body.r == [] for body in shown.bodies)
    assert "this is the design position: " in shown.message
    assert len(drawing(shown, AXIS).nodes) > 2


@pytest.mark.parametrize(
    ("engine", "outcome", "solved", "posed"),
    [
        ("native", Outcome.PASS, 161, True),
        ("native", Outcome.FAIL, 3, True),
        ("native", Outcome.CRASHED, None, False),
        ("mujoco", Outcome.PASS, 161, False),
    ],
)
def test_scene_poses_need_native_answer(engine, outcome, solved, posed):
    made = record(
        "mcpherson_strut", "closed_form", engine, 0.0, GRID, outcome=outcome, solved=solved
    )
    results = with_scenes(Results(run={}, records=[made]), [STRUT])
    assert bool(results.scenes["mcpherson_strut"].frames) == posed
    assert ("this is the design position" in results.scenes["mcpherson_strut"].message) != posed
    assert ("was not run" in results.scenes["mcpherson_strut"].message) == (engine != "native")
    assert from_json(to_json(results)) == results


def test_results_without_scenes_are_read():
    text = b'{"schema": "kincheck-results/1", "run": {}, "records": []}'
    assert from_json(text).scenes == {}


UP: Any = {"name": "lift", "type": "point_coordinate", "point": "wheel_center", "relative": True}
