"""Travel, wheels, large mechanisms and force arrows in scenes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from kincheck import cases, load
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.harness.record import Results
from kincheck.core.harness.scene import LARGEST, POSES, scene, with_scenes
from kincheck.core.report.axis import Axis, driver_axis
from kincheck.core.report.drawing import drawing
from kincheck.core.report.report import write_report
from msgspec.structs import replace

from ...oracles.naive import A
from ...report.test_report_scene import AXIS, STRUT, UP
from ...support.examples import examples
from ...support.mechanisms import chain
from ...support.strut_results import GRID, record, results, series

(AXES,) = examples(__file__, "axes")


@pytest.mark.parametrize(("driver", "up", "name"), AXES.values(), ids=AXES)
def test_travel_axis_of_vertical_driver(driver, up, name):
    made = record(
        "strut", "closed_form", "one", 0.0, GRID, driver={"lift": GRID}, outputs={"x": series(GRID)}
    )
    axis: Axis = driver_axis({"driver": UP | driver}, [made], [])
    assert (axis.up, axis.name) == (up, name)


def test_large_scenes_have_fewer_frames():
    def case(loops):
        made = chain(loops)
        return Case(
            made.name, "", Truth.CONSENSUS_ONLY, made, Sweep("turn", np.linspace(0.0, 0.1, 101)), ()
        )

    assert len(scene(case(30)).frames) == POSES // 61
    # one crank more than loops
    assert with_scenes(Results(run={}, records=[]), [case(LARGEST // 2)]).scenes == {}


def test_scene_wheel_about_spin_axis():
    shown = scene(cases.load("mcpherson_suspension"), poses=False)
    [wheel] = shown.wheels
    # a right wheel in axes x rearward, y outboard and z up, without static angles
    assert wheel.spin == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    aslant = replace(wheel, spin=[0.6, 0.8, 0.0])
    drawn = drawing(replace(shown, wheels=[aslant]), AXIS)
    [(body, center, spin, up, radius, kingpin, middle)] = drawn.wheels
    assert drawn.bodies[body]["name"] == "knuckle"
    turn = A(np.array(drawn.bodies[body]["p"][0]))
    assert np.array(drawn.bodies[body]["r"][0]) + turn @ center == pytest.approx(
        (0.975, 0.715, 0.101)
    )
    assert turn @ spin == pytest.approx((0.6, 0.8, 0.0), abs=1e-12)
    assert (up, radius) == ([0.0, 0.0, 1.0], 0.3)
    assert (len(kingpin), middle) == (2, [0.0, 0.0, 0.0])
    assert drawing(scene(STRUT, poses=False), AXIS).wheels == []


def test_scene_arrows_are_output_forces():
    shown = replace(scene(cases.load("mcpherson_strut_loaded"), poses=False), frames=[0, 2])
    components = [(force.name, force.output, force.direction) for force in shown.forces]
    assert components == [
        ("stroke", "wheel_load", [0.0, 0.0, 1.0]),
        ("tie_rod", "tie_rod_force_y", [0.0, 1.0, 0.0]),
        ("ball", "ball_force_y", [0.0, 1.0, 0.0]),
        ("strut_top", "strut_top_force_z", [0.0, 0.0, 1.0]),
    ]
    further = [
        replace(shown.forces[2], output="ball_force_x", direction=[1.0, 0.0, 0.0]),
        replace(shown.forces[2], output="aslant", direction=[0.6, 0.8, 0.0]),
    ]
    shown = replace(shown, forces=[*shown.forces[:3], *further])
    values = {
        "wheel_load": [5.0, 6.0, None],
        "ball_force_x": [1.0, 2.0, 3.0],
        "ball_force_y": [-4.0, 0.0, -6.0],
        "aslant": [10.0, 0.0, 5.0],
    }
    drawn = drawing(shown, AXIS, values)
    # components along axes are one vector; what is unknown has no arrow
    assert {name: forces for _, _, name, forces in drawn.arrows} == {
        "stroke": [[0.0, 0.0, 5.0], None],
        "ball": [[1.0, -4.0, 0.0], [3.0, -6.0, 0.0]],
        "aslant": [[6.0, 8.0, 0.0], [3.0, 4.0, 0.0]],
    }
    body, place, *_ = next(each for each in drawn.arrows if each[2] == "ball")
    assert drawn.bodies[body]["name"] == "knuckle"
    turn = A(np.array(drawn.bodies[body]["p"][0]))
    assert np.array(drawn.bodies[body]["r"][0]) + turn @ place == pytest.approx(
        (0.9676, 0.66, -0.01)
    )


def test_scene_arm_has_both_pivots(tmp_path):
    (tmp_path / "car.csv").write_text(sample_table(TEMPLATES["double_wishbone"]), "utf-8")
    case = load(tmp_path / "car.csv")
    drawn = drawing(scene(case, poses=False), AXIS)
    names = [body["name"] for body in drawn.bodies]
    arm = [place for b, *place in drawn.nodes if names[b] == "lca"]
    pivots = [[0.12, 0.21, 0.125], [-0.13, 0.215, 0.12]]
    assert [min(math.dist(pivot, place) for place in arm) for pivot in pivots] == pytest.approx(
        [0.0, 0.0], abs=1e-12
    )
    marks = [node for node, kind, *_ in drawn.marks if kind == "hinge"]
    assert len(marks) == 4
    [(lower, upper, kind)] = drawn.springs
    assert [names[drawn.nodes[node][0]] for node in (lower, upper)] == ["lca", "ground"]
    assert kind == "spring"
    contact = next(k for k, (*_, z) in enumerate(drawn.nodes) if z == 0.0)
    assert contact not in {node for link in drawn.links for node in link}


def test_scene_strut_has_tube(tmp_path):
    (tmp_path / "car.csv").write_text(sample_table(TEMPLATES["mcpherson"]), "utf-8")
    drawn = drawing(scene(load(tmp_path / "car.csv"), poses=False), AXIS)
    names = [body["name"] for body in drawn.bodies]
    [(tube, far)] = drawn.tubes
    assert [names[drawn.nodes[node][0]] for node in (tube, far)] == ["knuckle", "strut"]


@pytest.mark.parametrize(
    ("axle", "rack", "middle"),
    [(None, None, 3), (None, "0.01", 0), ("heave", None, 3), ("steer", None, 0)],
)
def test_steered_sweep_has_no_centre(tmp_path, axle, rack, middle):
    (tmp_path / "car.csv").write_text(sample_table(TEMPLATES["mcpherson"]), "utf-8")
    case = load(tmp_path / "car.csv", Supplied(axle=axle, rack=rack, travel="0.02:3"))
    assert [len(wheel.middle) for wheel in scene(case, poses=False).wheels] == [middle] * (
        1 if axle is None else 2
    )


def test_scene_mirrored_bodies_share_colours(tmp_path):
    (tmp_path / "car.csv").write_text(sample_table(TEMPLATES["double_wishbone"]), "utf-8")
    drawn = drawing(scene(load(tmp_path / "car.csv", Supplied(axle="heave")), poses=False), AXIS)
    colours = {each["name"]: each["colour"] for each in drawn.bodies if not each["fixed"]}
    kinds = [colours[f"left_{name}"] for name in ("uca", "lca", "knuckle")]
    assert [colours[f"right_{name}"] for name in ("uca", "lca", "knuckle")] == kinds
    assert len({*kinds}) == 3


@pytest.mark.nightly
@pytest.mark.parametrize(("axle", "named"), [(None, True), ("heave", False)])
def test_crowded_names_begin_hidden(browser, tmp_path, axle, named):
    """Those of a strut's few points have room, those of an axle have not."""
    (tmp_path / "car.csv").write_text(sample_table(TEMPLATES["double_wishbone"]), "utf-8")
    case = load(tmp_path / "car.csv", Supplied(axle=axle)) if axle else cases.load("four_bar")
    shown = replace(results(), scenes={"strut": scene(case, poses=False)})
    write_report(shown, file := tmp_path / "report.html")
    browser.visit(file.as_uri())
    assert browser.run("await settled(); return one('[data-layer=names]').checked;") == named
