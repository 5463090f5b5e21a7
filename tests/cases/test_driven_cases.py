"""Several driven motions, from case file to records: a strut steered by its rack while the wheel
strokes, in every engine.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from kincheck import Outcome, Ramp, Sine, Table, adapters, cases
from kincheck.core.case.case import Sweep
from kincheck.core.case.io.case_file import load_case
from kincheck.core.cli import main
from kincheck.core.harness.compare import pace
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.mechanism.motions import Absolute
from kincheck.core.report.junit import to_junit
from kincheck.core.report.report import write_report

from ..report.page import Page
from ..support.case_texts import edited, write
from ..support.fakes import swept

STRUT = (cases.FOLDER / "mcpherson_strut.toml").read_text()
RACK = """[joints.rack_guide]
type = "translational"
bodies = ["chassis", "rack"]
point = [1.14, 0.0, 0.1455]
axis = [0.0, 1.0, 0.0]

[drivers.steer]
type = "joint_displacement"
joint = "rack_guide"
"""
SINE = '[drivers.steer.motion]\ntype = "sine"\namplitude = 0.012\nfrequency = 4.0\n'
TABLE = """[drivers.steer.motion]
type = "table"
times = [-0.1, -0.033, 0.0045, 0.0525, 0.1]
values = [0.01, -0.01, 0.004, 0.012, -0.005]
"""
# the bounce of a wheel in time: 30 mm about the design, a quarter of a period ahead, so that it
# does not start there
BOUNCE = (
    '[drivers.stroke.motion]\ntype = "sine"\namplitude = 0.03\nfrequency = 2.0\nphase ='
    " 1.5707963267948966\n"
)
STROKE = STRUT[STRUT.index("[sweep]") : STRUT.index("[outputs.half")]
COARSE = STROKE.replace("steps = 161", "steps = 41")
CLOCK = "[sweep]\nstart = 0.0\nstop = 0.5\nsteps = 51\n\n"
REFERENCE = STRUT[STRUT.index("[reference]") :]


def steered(motion, sweep=COARSE):
    """The text of the strut's case with a rack that slides and does not stand still."""
    return edited(
        ('name = "mcpherson_strut"', 'name = "strut/steered"'),
        ('truth = "in_house_oracle"\n', ""),
        ("[bodies.rack]\nfixed = true\n", "[bodies.rack]\n"),
        (STROKE, RACK + motion + "\n" + sweep),
        (REFERENCE, ""),
        base=STRUT,
    )


STEER = '[sweep]\ndriver = "steer"\nstart = -0.01\nstop = 0.01\nsteps = 21\nrate = 0.1\n\n'
BACK = CLOCK.replace("start = 0.0", "start = -0.3").replace("stop = 0.5", "stop = -0.6")

CASES = {
    "sine": steered(SINE),
    "table": steered(TABLE),
    "ramp": steered('[drivers.steer.motion]\ntype = "ramp"\nrate = -0.2\n'),
    "steer swept, wheel bounces": steered(BOUNCE.replace("1.57", "0.57"), STEER),
    "time": steered(SINE + BOUNCE, CLOCK),
    "time, away from zero": steered(SINE + BOUNCE, BACK),
}


@pytest.fixture(params=CASES)
def case(request, tmp_path):
    return load_case(write(tmp_path, CASES[request.param]))


def solved(case, engine="native"):
    found = adapters.engine(engine).solve(adapters.engine(engine).build(case), case, 1e-12)
    assert found.solved.all(), found.message
    return found


@pytest.mark.by_day(3)
@pytest.mark.parametrize("engine", ["mujoco", "pinocchio", "exudyn"])
def test_driven_case_engines_agree(case, engine):
    if adapters.engine(engine).version() is None:
        pytest.skip(f"{engine} is not installed")
    native, found = (solved(case, name).points["wheel_center"] for name in ("native", engine))
    for quantity in ("position", "velocity", "acceleration"):
        # residuals of 1e-12 at most; a velocity or acceleration of another path would be off by its
        # own size, 0.1 and more
        assert np.abs(getattr(found, quantity) - getattr(native, quantity)).max() <= 1e-11


def test_driven_case_rates_follow_path(case):
    """Differences of positions over time, sixth order, on the same motions sampled more finely
    about every tenth sample.
    """
    path, native = case.sweep.path, solved(case).points["wheel_center"]
    h = 2e-4  # seconds: truncation (omega h)^6 of 1e-11, round-off 1e-16 / h^2 of 1e-8
    weights = {1: (3 / 4, -3 / 20, 1 / 60), 2: (3 / 2, -3 / 20, 1 / 90)}
    for k in range(0, len(path.times), 10):
        near = path.times[k] + h * np.arange(-3, 4)
        at = near * case.sweep.rate + case.sweep.design if case.sweep.driver != "time" else near
        x = solved(swept(case, at)).points["wheel_center"].position
        velocity = sum(w * (x[3 + m] - x[3 - m]) for m, w in enumerate(weights[1], 1)) / h
        acceleration = (
            sum(w * (x[3 + m] + x[3 - m]) for m, w in enumerate(weights[2], 1)) - 49 / 18 * x[3]
        ) / h**2
        assert native.velocity[k] == pytest.approx(velocity, abs=1e-9)
        assert native.acceleration[k] == pytest.approx(acceleration, abs=2e-6)


# From the sweep to the records, and to what is made of them


@pytest.fixture
def both(tmp_path):
    """Two drivers over time, one of them absolute: its values are the wheel's height, 0.101 m at
    design.
    """
    height = BOUNCE.replace(
        "[drivers.stroke.motion]", "relative = false\n[drivers.stroke.motion]"
    ).replace("sine", "table")
    height = (
        height[: height.index("amplitude")]
        + "times = [0, 0.2, 0.5]\nvalues = [0.091, 0.131, 0.101]\n"
    )
    text = steered(SINE, CLOCK)
    where = "direction = [0.0, 0.0, 1.0]\n"
    return load_case(write(tmp_path, edited((where, where + height), base=text)))


def test_absolute_driver_values(both):
    assert both.sweep.driver == "time"
    assert both.sweep.motions["stroke"] == Absolute(
        Table((0.0, 0.2, 0.5), (0.091, 0.131, 0.101)), 0.101
    )
    z = solved(both).points["wheel_center"].position[:, 2]
    assert z[[0, 20, 50]] == pytest.approx([0.091, 0.131, 0.101], abs=1e-15)


def test_record_lists_swept_driver_first(both):
    (record,) = run([both], [adapters.engine("native")], tol=1e-12).records
    assert list(record.driver) == ["time", "stroke", "steer"]
    assert record.driver["time"] == np.linspace(0.0, 0.5, 51).tolist()
    assert record.driver["stroke"][20] == pytest.approx(0.131, abs=1e-15)
    assert (
        record.driver["steer"] == (0.012 * np.sin(8.0 * np.pi * np.linspace(0.0, 0.5, 51))).tolist()
    )


@pytest.mark.parametrize(("name", "swept"), [("sine", "stroke"), ("time", "time")])
def test_driven_case_run_and_report(tmp_path, name, swept):
    case = load_case(write(tmp_path, CASES[name]))
    engines = [adapters.engine(each) for each in adapters.ENGINES]
    results = run([case], engines, tol=1e-12)
    assert {each.outcome for each in results.records} <= {
        Outcome.PASS,
        Outcome.UNJUDGED,
        Outcome.UNAVAILABLE,
    }
    assert next(iter(results.records[0].driver)) == swept
    assert from_json(to_json(results)) == results
    facts = results.run["cases"]["strut/steered"]
    assert facts["driver"]["name"] == swept
    assert facts["motions"]["steer"]["motion"] == {
        "type": "sine",
        "amplitude": 0.012,
        "frequency": 4.0,
        "phase": 0.0,
    }
    write_report(results, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text("utf-8")
    said = {"stroke": "Also driven: steer (sine).", "time": "Driven: stroke (sine), steer (sine)."}[
        swept
    ]
    assert said in " ".join(page.split())
    axis = {"stroke": "wheel travel", "time": "time"}[swept]
    assert f"against {axis}, all engines" in page
    plots = json.dumps(Page(page).data, separators=(",", ":"))
    assert ('"title":{"text":"time [s]"}' in plots) == (swept == "time")


def test_deviation_is_located_in_time(both):
    native = adapters.engine("native")

    class Wrong:
        name, mode, loop, settings = "wrong", "projection", "python", native.settings
        version, unsupported, build = native.version, native.unsupported, native.build

        def solve(self, model, case, tol):
            found = native.solve(model, case, tol)
            found.points["wheel_center"].position[15, 1] += 1e-3
            return found

    results = run([both], [native, Wrong()], tol=1e-12)
    wrong = results.records[1]
    assert wrong.outcome is Outcome.FAIL
    assert (
        "half_track_change: position is off by 0.001 m at sample 15 (time = 0.15)" in wrong.message
    )
    assert b"at sample 15 (time = 0.15)" in to_junit(results)


def test_end_of_travel_names_drivers(tmp_path):
    case = load_case(write(tmp_path, steered(BOUNCE.replace("0.03", "0.9"), CLOCK)))
    (record,) = run([case], [adapters.engine("native")], tol=1e-12).records
    assert record.outcome is Outcome.FAIL
    assert "cannot be followed beyond stroke = " in record.message


def test_case_name_with_slashes_stays_local(tmp_path):
    here = tmp_path / "deep" / "down"
    here.mkdir(parents=True)
    file = write(here, CASES["time"].replace("strut/steered", "../../up/strut"))
    results, out, junit = here / "r.json", here / "out", here / "j.xml"
    argv = ["run", file, "--engine", "native", "--out", out, "--json", results, "--junit", junit]
    assert main.main([str(each) for each in argv]) == 2  # nothing was compared
    written = {path for path in tmp_path.rglob("*") if path.is_file()}
    assert written == {file, results, junit, out / "results.json", out / "report.html"}
    assert from_json(results.read_bytes()).records[0].case == "../../up/strut"


# Tolerances


def at_pace(case, **sweep):
    return pace(replace(case, sweep=replace(case.sweep, **sweep)))


def test_pace_of_fastest_driver(tmp_path):
    case = load_case(
        write(tmp_path, steered('[drivers.steer.motion]\ntype = "ramp"\nrate = -0.2\n'))
    )
    size = 1.0 / at_pace(case, motions={})  # a rate of 1 m/s
    assert 0.3 < size < 1.0
    assert pace(case) == pytest.approx(1.0 / size)
    assert at_pace(case, motions={"steer": Ramp(-3.0)}) == pytest.approx(3.0 / size)
    clock = np.linspace(0.0, 1.0, 401)
    # 20 m to and fro are the size, then
    long = Sweep("time", clock, motions={"steer": Sine(10.0, 1.0)})
    assert pace(replace(case, sweep=long)) == pytest.approx(
        max(10.0 * 2.0 * np.pi / 20.0, np.sqrt(10.0 * 4.0 * np.pi**2 / 20.0))
    )
    # at rest where it turns, and yet accelerated
    short = Sweep("time", clock, motions={"steer": Sine(1e-4, 1.0)})
    assert pace(replace(case, sweep=short)) == pytest.approx(2.0 * np.pi * np.sqrt(1e-4 / size))
