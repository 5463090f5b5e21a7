"""Results as tables, curves, notebook views and data of other libraries, by one mechanism."""

import json
import pickle
import re
import sys

import kincheck
import numpy as np
import pytest
from kincheck.core.dataset import Dataset, Variable
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.notebook.tables import columns_of, table_of
from kincheck.core.harness.scene_record import Scene, SceneBody, SceneJoint, ScenePoint
from kincheck.core.tabular import Tabular

from ...support.mechanisms import ORIGIN, X, Z


def rssr():
    return kincheck.Mechanism(
        "rssr",
        [kincheck.Body("crank"), kincheck.Body("rocker")],
        [
            kincheck.Revolute("input", "ground", "crank", point=ORIGIN, axis=Z),
            kincheck.Revolute("output", "ground", "rocker", point=(2, 1, 3), axis=X),
            kincheck.Distance("rod", "crank", "rocker", points=(X, (2, 4.9, 2.2))),
        ],
        [kincheck.Point("end", "rocker", (2, 4.9, 2.2))],
        [kincheck.JointAngle("turn", "input")],
    )


VALUES = np.linspace(0.0, 1.0, 12)
MOVED = {"joints.rod.points.0": np.array([[1.0, 0.0, 0.0], [1.01, 0.0, 0.0]])}


@pytest.fixture(scope="module")
def results():
    """One result of every kind, by the name of its class."""
    mechanism = rssr()
    run = kincheck.run("rssr", "native")
    found = [
        kincheck.solve(mechanism, "turn", VALUES, rate=2.0),
        kincheck.solve_designs(mechanism, "turn", VALUES, MOVED),
        kincheck.trace(mechanism, "turn", length=0.2),
        kincheck.assemble(mechanism, {}),
        kincheck.find_assemblies(mechanism, {}, samples=20),
        run,
        run.records[0],
    ]
    return {type(each).__name__: each for each in found}


KINDS = ["Trajectory", "Designs", "Curve", "Assembled", "Assemblies", "Results", "Record"]
DRAWN = {"Trajectory", "Designs", "Curve", "Record"}


@pytest.mark.parametrize("kind", KINDS)
def test_result_has_repr_and_html(results, kind):
    found = results[kind]
    assert re.fullmatch(f"<{kind}: .{{5,150}}>", repr(found))
    html = found._repr_html_()
    assert "<table>" in html
    assert ("<svg xmlns" in html) == (kind in DRAWN)
    json.dumps(found.to_dict(), allow_nan=False)


@pytest.mark.parametrize("kind", KINDS)
def test_result_pandas_and_xarray_equal_dataset(results, kind):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    data, frame, arrays = (
        results[kind].dataset(),
        results[kind].to_dataframe(),
        results[kind].to_xarray(),
    )
    assert list(frame.columns) == list(table_of(data))
    assert len(frame) == np.prod([data.sizes[dim] for dim in data.rows])
    for name, each in data.variables.items():
        assert np.array_equal(
            arrays[name].values, each.values, equal_nan=each.values.dtype == float
        )
        assert arrays[name].attrs.get("units", "") == each.unit


def test_suspension_plot_has_six_curves(tmp_path):
    pytest.importorskip("matplotlib")
    (tmp_path / "car.csv").write_text(sample_table(TEMPLATES["mcpherson"]))
    supplied = kincheck.Supplied(travel="0.05:3")
    record = kincheck.run(kincheck.load(tmp_path / "car.csv", supplied), "native").records[0]
    useful = ["toe", "camber", "caster", "roll_center_height", "half_track_change", "scrub_radius"]
    figure = record.plot()
    assert [each.get_ylabel().split(" [")[0] for each in figure.axes] == useful
    # in the units of the table, which the dataset is not
    curve = figure.axes[0].lines[0]
    assert figure.axes[0].get_ylabel() == "toe [deg]"
    assert figure.axes[3].get_ylabel() == "roll_center_height [mm]"
    assert figure.axes[-1].get_xlabel() == "stroke [mm]"
    assert curve.get_xdata() == pytest.approx([-50.0, 0.0, 50.0])
    assert curve.get_ydata() == pytest.approx(np.degrees(record.outputs["toe"].position))
    assert record.dataset().variables["toe"].unit == "rad"
    assert len(record.plot("toe.velocity").axes) == 1
    html = record.to_html()
    assert html.count("<svg xmlns") == 6
    assert re.search(r"\d\d further curves", html)


def test_mechanism_html_view(results):
    html = rssr()._repr_html_()
    assert html.count("<path") == 1 + 4  # the rod, and each body from its middle to its joints
    assert html.count("<rect") == 2  # on the ground
    assert ">crank</text>" in html
    assert "<animate" not in html
    moving = results["Results"]._repr_html_()
    assert "<animate" in moving
    assert "<script" not in html + moving
    assert "<svg" in kincheck.load("rssr")._repr_html_()
    assert kincheck.Mechanism("a<b", [kincheck.Body("x")], [])._repr_html_().count("a&lt;b") == 1


def test_scene_view_moves_as_bodies():
    """A crank from its pin at the origin, half a turn about z: its end passes to the other side."""
    half_turns = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    crank = SceneBody(
        name="crank",
        fixed=False,
        origin=[0.5, 0.0, 0.0],
        euler_parameters=half_turns[0],
        r=[[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]],
        p=half_turns,
    )
    pin = SceneJoint(name="pin", type="revolute", bodies=["ground", "crank"], points=[[0, 0, 0]])
    end = ScenePoint(name="end", body="crank", position=[1.0, 0.0, 0.0], output=True)
    html = Scene(bodies=[crank], joints=[pin], points=[end], frames=[0, 1]).view("crank")
    paths = re.findall(r"values='(M[^']+)'", html)
    first, last = (re.findall(r"[\d.]+", each) for each in paths[-1].split(";")[:2])
    (x, y) = re.search(r"<rect x='([\d.]+)' y='([\d.]+)'", html).groups()
    for a, b, at in zip(first[2:], last[2:], (x, y), strict=True):
        assert float(a) + float(b) == pytest.approx(2.0 * (float(at) + 4.0), abs=0.3)
    assert first != last


def test_trajectory_has_drive_time_and_units(results):
    motion = results["Trajectory"]
    assert np.array_equal(motion.drive.values["turn"], VALUES)
    assert motion.drive.units == {"turn": "rad"}
    assert np.allclose(motion.drive.times, VALUES / 2.0, rtol=1e-15, atol=0.0)
    assert repr(motion).startswith("<Trajectory: turn 0 to 1 rad, 12 samples, points end, residual")
    table = table_of(motion.dataset())
    assert np.array_equal(table["position.end.y"], motion.points["end"].position[:, 1])
    assert np.array_equal(table["acceleration.end.z"], motion.points["end"].acceleration[:, 2])
    units = {name: each.unit for name, each in columns_of(motion.dataset()).items()}
    assert units["turn"] == "rad"
    assert units["time"] == "s"
    assert units["velocity.end.x"] == "m/s"
    again = pickle.loads(pickle.dumps(motion))
    assert np.array_equal(again.drive.values["turn"], VALUES)


def test_trajectory_copies_driver_values():
    values = VALUES.copy()
    motion = kincheck.solve(rssr(), "turn", values)
    values[:] = 0.0
    assert np.array_equal(motion.drive.values["turn"], VALUES)


def test_trajectory_has_all_drivers():
    mechanism = kincheck.Mechanism(
        "arm",
        [kincheck.Body("upper"), kincheck.Body("lower")],
        [
            kincheck.Revolute("shoulder", "ground", "upper", ORIGIN, Z),
            kincheck.Translational("slide", "upper", "lower", X, X),
        ],
        [kincheck.Point("hand", "lower", (2, 0, 0))],
        [kincheck.JointAngle("turn", "shoulder"), kincheck.JointDisplacement("reach", "slide")],
    )
    sine = kincheck.Sine(amplitude=0.1, frequency=0.5)
    motion = kincheck.solve(mechanism, "turn", VALUES, rate=1.0, motions={"reach": sine})
    assert list(motion.drive.values) == ["turn", "reach"]
    assert motion.drive.units == {"turn": "rad", "reach": "m"}
    assert np.allclose(motion.drive.values["reach"], 0.1 * np.sin(np.pi * VALUES), atol=1e-15)


def test_designs_table_rows(results):
    designs = results["Designs"]
    table = table_of(designs.dataset())
    assert list(table)[:2] == ["design", "sample"]
    assert np.array_equal(table["design"], np.repeat([0, 1], 12))
    assert np.array_equal(table["turn"], np.tile(VALUES, 2))
    assert np.array_equal(table["position.end.z"], designs.points["end"].position[..., 2].ravel())


def test_results_table_rows(results):
    run = results["Results"]
    assert run.record("rssr", "native") is results["Record"]
    with pytest.raises(KeyError):
        run.record("rssr", "mujoco")
    table = table_of(run.dataset())
    assert table["outcome"].tolist() == ["pass"]
    assert 0.0 < table["position_error_over_tolerance"][0] < 1.0
    assert run.to_dict()["schema"] == "kincheck-results/1"


def test_plot_has_axes_per_variable(results):
    pytest.importorskip("matplotlib")
    figure = results["Trajectory"].plot()
    assert [each.get_ylabel() for each in figure.axes] == [
        "position [m]",
        "velocity [m/s]",
        "acceleration [m/s^2]",
    ]
    assert figure.axes[-1].get_xlabel() == "turn [rad]"
    lines = results["Designs"].plot("position").axes[0].lines
    assert len(lines) == 2 * 3
    assert lines[0].get_color() == lines[1].get_color() != lines[2].get_color()
    with pytest.raises(kincheck.KincheckError, match="no curve 'positon'; did you mean 'position'"):
        results["Trajectory"].plot("positon")
    with pytest.raises(kincheck.KincheckError, match="nothing to draw over record"):
        results["Results"].plot()


@pytest.mark.parametrize(
    ("method", "module"),
    [("to_dataframe", "pandas"), ("to_xarray", "xarray"), ("plot", "matplotlib.figure")],
)
def test_missing_plot_library_is_reported(results, monkeypatch, method, module):
    name = module.split(".")[0]
    monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setitem(sys.modules, name, None)
    expected = f"{method} needs {name}, which is not installed: pip install '{name}>="
    with pytest.raises(kincheck.KincheckError, match=re.escape(expected)):
        getattr(results["Trajectory"], method)()


class Made(Tabular):
    def __init__(self, **variables):
        self.data = Dataset(("k",), {"x": Variable("k", [0.0, 1.0, 2.0])}, variables, "x")

    def summary(self):
        return "<b>bold</b>"

    def dataset(self):
        return self.data


def test_html_curve_has_gaps_and_escapes():
    html = Made(**{"a<b": Variable("k", [1.0, np.nan, 3.0])})._repr_html_()
    assert re.search('d="M[^M"]+M[^M"]+" fill="none"', html)
    assert "a&lt;b" in html
    assert "a<b" not in html
    assert "<b>bold" not in html
    assert "–" in html


def test_unsolved_curve_is_shown():
    found = Made(y=Variable("k", [np.nan] * 3))
    assert 'd="" fill="none"' in found._repr_html_()
    assert found.to_dict()["data_vars"]["y"]["data"] == [None] * 3
    pytest.importorskip("matplotlib")
    assert found.plot().axes


def test_trajectory_without_samples_has_repr():
    motion = kincheck.solve(rssr(), "turn", [])
    assert "0 samples" in repr(motion)
    assert "<table>" in motion._repr_html_()


def test_repr_counts_one_in_singular(results):
    assert repr(results["Results"]) == "<Results: 1 case, 1 engine, 1 pass>"
    assert ", 1 sample, " in repr(kincheck.solve(rssr(), "turn", [0.0]))
