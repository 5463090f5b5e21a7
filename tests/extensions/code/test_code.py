"""Solved cases as code: C, JavaScript and FMUs against the native engine and `kincheck.curves`."""

import ctypes
import importlib.util
import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import kincheck
import numpy as np
import pytest
from kincheck import KincheckError, cases
from kincheck.core.cli.main import main
from kincheck.core.extensions.code import c, fmu, js
from scipy.interpolate import CubicSpline

from ...support.examples import examples

REFUSED, LOCKS = examples(__file__, "refused", "locks")

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared")
CLOSE = 1e-13
"""Largest difference to native, relative to the largest value: a thousand round-offs."""
SOME = ("mcpherson_strut", "four_bar", "rssr", "five_bar", "delta_robot", "bennett")
FINER = {"bennett": "native's accelerations and torque lose a digit near its singular pose"}
compiled = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
node = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
MOTIONS = ("position", "velocity", "acceleration")
CRANK = """schema = "kincheck-case/1"
name = "crank"
source = "a body on a hinge"
[bodies.crank]
[joints.pivot]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
"""


def library(folder, name, *flags, compiler="gcc"):
    """Compile NAME.c, and return its functions by their names without the prefix."""
    file = folder / f"{name}.so"
    command = [compiler, *STRICT, *flags, "-o", str(file), f"{name}.c", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    found = ctypes.CDLL(str(file))
    for function in ("output", "parameter", "driver"):
        if hasattr(found, f"{name}_{function}"):
            getattr(found, f"{name}_{function}").restype = ctypes.c_char_p
    getattr(found, f"{name}_size").restype = ctypes.c_size_t
    getattr(found, f"{name}_nominal").restype = ctypes.c_double
    number, state = ctypes.c_double, ctypes.c_void_p
    getattr(found, f"{name}_move").argtypes = [state, number, number, state]
    getattr(found, f"{name}_set").argtypes = [state, ctypes.c_int, number]
    return lambda function, *args: getattr(found, f"{name}_{function}")(*args)


def write(folder, contents):
    for name, content in contents.items():
        (folder / name).write_bytes(content)


def solve(call, case):
    """Return the outputs of the code at the samples of a case, shape (n, outputs, 3)."""
    state = (ctypes.c_double * (call("size") // 8))()
    out = (ctypes.c_double * (3 * call("outputs")))()
    found = np.full((len(case.sweep.values), call("outputs"), 3), np.nan)
    for k in way(case):
        if k is None:
            call("start", state)
            continue
        if call("move", state, float(case.sweep.values[k]), float(case.sweep.rate), out) == 0:
            found[k] = np.frombuffer(out).reshape(-1, 3)
    return found


def way(case):
    """Samples outwards from the start, both ways; None before each."""
    times = case.sweep.path.times
    yield None
    yield from (k for k in np.argsort(times) if times[k] >= 0.0)
    yield None
    yield from (k for k in np.argsort(-times) if times[k] < 0.0)


def native(case, *, forces=False):
    """Return the same numbers by native; NaN where it has none."""
    (record,) = kincheck.run(case, "native").records
    measured = [each.name for each in case.outputs if forces or not each.forces]
    found = np.full((len(case.sweep.values), len(measured), 3), np.nan)
    for j, name in enumerate(measured):
        for order, motion in enumerate(MOTIONS):
            values = getattr(record.outputs[name], motion)
            if values is not None:
                found[:, j, order] = [np.nan if x is None else x for x in values]
    return found


def truth(case, *, forces=False):
    """Return what the code is compared with: native, or the closed form where that loses digits."""
    found = native(case, forces=forces)
    if case.name in FINER:
        for j, each in enumerate(each for each in case.outputs if forces or not each.forces):
            known = case.reference[each.name]
            for order, motion in enumerate(MOTIONS[: each.orders]):
                found[:, j, order] = getattr(known, motion)
    return found


def assert_equal(found, expected):
    known = np.isfinite(expected)
    assert known.any()
    assert np.isfinite(found[known]).all()
    scale = np.maximum(1.0, np.max(np.abs(expected), axis=0, where=known, initial=0.0))
    assert np.abs((found - expected) / scale)[known].max() < CLOSE


@pytest.mark.by_day(2)
@compiled
@pytest.mark.parametrize("name", SOME)
def test_c_of_case_equals_native(name, tmp_path):
    case = kincheck.load(name)
    write(tmp_path, c.files(case, ()))
    assert_equal(solve(library(tmp_path, name, "-O1"), case), truth(case))


@node
@pytest.mark.nightly
@pytest.mark.parametrize("name", cases.names())
def test_javascript_of_every_case(name, tmp_path):
    case = kincheck.load(name)
    write(tmp_path, js.files(case, (), forces=True))
    assert_equal(javascript(tmp_path, name, case), truth(case, forces=True))


@pytest.mark.nightly
@pytest.mark.parametrize("name", cases.names())
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_c_of_every_case(name, compiler, level, tmp_path):
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    case = kincheck.load(name)
    write(tmp_path, c.files(case, (), forces=True))
    found = solve(library(tmp_path, name, level, compiler=compiler), case)
    assert_equal(found, truth(case, forces=True))


def javascript(folder, name, case):
    """Return the outputs of NAME.mjs at the samples of a case, shape (n, outputs, 3)."""
    steps = [None if k is None else float(case.sweep.values[k]) for k in way(case)]
    (folder / "run.mjs").write_text(
        f"""import {{ Mechanism }} from "./{name}.mjs";
const m = new Mechanism(), out = new Float64Array(3 * m.outputs()), found = [];
for (const x of {json.dumps(steps)})
  if (x === null) m.start();
  else found.push(m.move(x, {case.sweep.rate}, out) ? [...out].map((y) => null) : [...out]);
console.log(JSON.stringify(found));
"""
    )
    said = subprocess.run(
        ["node", "run.mjs"], cwd=folder, capture_output=True, text=True, check=True
    )
    rows = np.array(json.loads(said.stdout), dtype=float)
    found = np.empty((len(rows), rows.shape[1] // 3, 3))
    found[[k for k in way(case) if k is not None]] = rows.reshape(len(rows), -1, 3)
    return found


@compiled
@pytest.mark.parametrize("name", ["five_bar", "mcpherson_steered"])
def test_drivers_move_to_own_values(name, tmp_path):
    """Straight from one value to another that is far, back and forth, then along the sweep."""
    case = kincheck.load(name)
    write(tmp_path, c.files(case, ()))
    call = library(tmp_path, name, "-O1")
    names = [each.name for each in case.mechanism.drivers]
    assert [call("driver", k).decode().split()[0] for k in range(call("drivers"))] == names
    path, expected = case.sweep.path, truth(case)
    velocities = path.drive(names, path.times)[1]
    moved = np.array([case.sweep.moved.get(each, 0.0 * path.times) for each in names])
    count = len(names)
    state = (ctypes.c_double * (call("size") // 8))()
    out = (ctypes.c_double * (3 * call("outputs")))()
    call("start", state)
    for k in (2, -3, 5, 0, 1):
        given = [(ctypes.c_double * count)(*each[:, k]) for each in (moved, velocities)]
        assert call("move_all", state, *given, out) == 0
        found = np.frombuffer(out).reshape(-1, 3)
        assert_equal(found[:, :2], expected[k][:, :2])
    given[0][1] = float("nan")
    before = bytes(state)
    assert call("move_all", state, *given, out) == 1
    assert bytes(state) == before
    k = next(each for each in way(case) if each is not None)
    assert call("move", state, float(case.sweep.values[k]), float(case.sweep.rate), out) == 0
    assert_equal(np.frombuffer(out).reshape(-1, 3), expected[k])


@node
@pytest.mark.parametrize(
    "name",
    ["four_bar", pytest.param("mcpherson_suspension", marks=pytest.mark.needs("hardpoints"))],
)
def test_javascript_of_case_equals_native(name, tmp_path):
    case = kincheck.load(name)
    write(tmp_path, js.files(case, ()))
    assert_equal(javascript(tmp_path, name, case), truth(case))


@compiled
def test_parameters_equal_curves(tmp_path):
    templates = pytest.importorskip("kincheck.core.extensions.hardpoints.templates")
    table = tmp_path / "car.csv"
    table.write_text(templates.sample_table(templates.TEMPLATES["double_wishbone"]))
    case = kincheck.load(table, kincheck.Supplied(travel="30mm:7"))
    places, moved = ["tierod_inner z", "uca_outer x"], [0.004, -0.003]
    write(tmp_path, c.files(case, places))
    call = library(tmp_path, "car", "-O1")
    assert [call("parameter", k) for k in range(call("parameters"))] == [
        b"tierod_inner z [m]",
        b"uca_outer x [m]",
    ]
    state = (ctypes.c_double * (call("size") // 8))()
    out = (ctypes.c_double * (3 * call("outputs")))()
    call("start", state)
    for k, change in enumerate(moved):
        call("set", state, k, call("nominal", k) + change)
    curves = kincheck.curves(case, places, [moved])
    for sample, x in enumerate(case.sweep.values):
        assert call("move", state, float(x), 1.0, out) == 0
        for j, name in enumerate(each.name for each in case.outputs):
            expected = curves.values[name][0, sample]
            assert out[3 * j] == pytest.approx(expected, abs=CLOSE, nan_ok=True)


@compiled
def test_turns_count_and_signs_go_on(tmp_path):
    """Three turns of a crank, in steps of a third of a turn: by closed form."""
    text = (
        CRANK
        + """[drivers.turn]
type = "joint_angle"
joint = "pivot"
[sweep]
driver = "turn"
start = 0.0
stop = 18.0
steps = 10
[outputs.angle]
type = "joint_angle"
joint = "pivot"
[outputs.e3]
type = "orientation"
body = "crank"
component = "e3"
[outputs.around]
type = "orientation"
body = "crank"
component = "z"
"""
    )
    (tmp_path / "crank.toml").write_text(text)
    case = kincheck.load(tmp_path / "crank.toml")
    write(tmp_path, c.files(case, ()))
    found = solve(library(tmp_path, "crank"), case)
    turn = case.sweep.values
    assert found[:, 0, 0] == pytest.approx(turn, abs=CLOSE)
    assert found[:, 1, 0] == pytest.approx(np.sin(0.5 * turn), abs=CLOSE)
    assert found[:, 2, 0] == pytest.approx(np.angle(np.exp(1j * turn)), abs=CLOSE)
    assert found[:, 0, 1] == pytest.approx(1.0, abs=CLOSE)


@compiled
def test_lock_up_leaves_state_alone(tmp_path):
    """The slide reaches sqrt(3^2 - 1.2^2) m: beyond, a code and no numbers."""
    (tmp_path / "locks.toml").write_text(LOCKS)
    write(tmp_path, c.files(kincheck.load(tmp_path / "locks.toml"), ()))
    call = library(tmp_path, "locks")
    state = (ctypes.c_double * (call("size") // 8))()
    out = (ctypes.c_double * 3)()
    call("start", state)
    limit = np.sqrt(9.0 - 1.44) - 0.6
    assert call("move", state, limit - 1e-3, 1.0, out) == 0
    before, told = bytes(state), bytes(out)
    for beyond in (limit + 1e-6, limit + 0.5, 1e6):
        assert call("move", state, beyond, 1.0, out) == 2
    assert call("move", state, float("nan"), 1.0, out) == 1
    assert (bytes(state), bytes(out)) == (before, told)
    assert call("move", state, 0.0, 1.0, out) == 0
    assert out[0] == pytest.approx(0.0, abs=CLOSE)


@compiled
@pytest.mark.skipif(importlib.util.find_spec("fmpy") is None, reason="no FMPy")
@pytest.mark.needs("recorded")
@pytest.mark.parametrize("version", ["2", "3"])
def test_fmu_passes_as_engine(version, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", "mcpherson_strut", "--to", "fmu", "--fmi", version, "--out", "."]) == 0
    validation = importlib.import_module("fmpy.validation")
    assert validation.validate_fmu("mcpherson_strut.fmu") == []
    argv = ["run", "mcpherson_strut", "--fmu", "mcpherson_strut.fmu", "--engine", "native"]
    assert main([*argv, "--json", "found.json"]) == 0
    *_, record = json.loads(Path("found.json").read_text())["records"]
    assert (record["engine"], record["outcome"]) == ("mcpherson_strut", "pass")
    errors = record["errors"]["half_track_change"]
    assert max(errors[motion]["max_abs"] for motion in MOTIONS) < CLOSE
    capsys.readouterr()


@compiled
@pytest.mark.skipif(importlib.util.find_spec("fmpy") is None, reason="no FMPy")
@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.nightly), 3])
def test_fmu_takes_held_drivers(version, tmp_path):
    fmpy, case = importlib.import_module("fmpy"), kincheck.load("five_bar")
    k, expected = 3, truth(case)
    held = replace(case, sweep=replace(case.sweep, motions={}), reference={})
    write(tmp_path, fmu.files(held, ["joints.left_pivot.point x"], version))
    file = str(tmp_path / "five_bar.fmu")
    assert importlib.import_module("fmpy.validation").validate_fmu(file) == []
    given = {name: float(values[k]) for name, values in case.sweep.moved.items()}
    velocities = case.sweep.path.drive(list(given), case.sweep.path.times)[1][:, k]
    given |= {f"{name}.velocity": float(v) for name, v in zip(given, velocities, strict=True)}
    names = [each.name for each in case.outputs]
    found = fmpy.simulate_fmu(file, start_values=given, stop_time=0.1, output=names)[0]
    assert_equal(np.array([found[name] for name in names]), expected[k, :, 0])
    found = fmpy.simulate_fmu(
        file, start_values=given, stop_time=0.1, output=[f"{each}.velocity" for each in names]
    )[0]
    assert_equal(np.array([found[f"{name}.velocity"] for name in names]), expected[k, :, 1])


@pytest.mark.parametrize(("argv", "said"), REFUSED)
def test_export_of_code_is_refused(argv, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", *argv.split()]) == 2
    assert said in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


@pytest.mark.by_day(3)
@compiled
@pytest.mark.parametrize("rate", [0.0, 1.0, -3.0])
@pytest.mark.parametrize("name", ["mcpherson_strut_loaded", "planar_slider_crank"])
def test_forces_equal_native(name, rate, tmp_path):
    """At any rate of the driver: at rest, too."""
    case = kincheck.load(name)
    case = replace(case, sweep=replace(case.sweep, rate=rate))
    assert any(each.forces for each in case.outputs)
    write(tmp_path, c.files(case, (), forces=True))
    assert_equal(solve(library(tmp_path, name, "-O1"), case), native(case, forces=True))


def test_code_of_loose_force_is_refused(tmp_path):
    """Four hinges of a plane: nothing tells which of them holds the links in it."""
    text = (Path(cases.__file__).parent / "four_bar.toml").read_text("utf-8")
    text = text.partition("[reference]")[0].replace("closed_form", "consensus_only", 1)
    text += '[outputs.loose]\ntype = "joint_force"\njoint = "coupler_pin"\ncomponent = "y"\n'
    (tmp_path / "four_bar.toml").write_text(text)
    case = kincheck.load(tmp_path / "four_bar.toml")
    with pytest.raises(KincheckError, match="redundant rows leave loose undetermined"):
        c.files(case, (), forces=True)


def test_code_of_forces_alone_is_refused():
    case = kincheck.load("mcpherson_strut_loaded")
    forces = tuple(each for each in case.outputs if each.forces)
    with pytest.raises(KincheckError, match="all outputs are forces"):
        c.files(replace(case, outputs=forces), ())


def test_code_leaves_forces_out(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", "mcpherson_strut_loaded", "--to", "js", "--out", "code"]) == 0
    said = capsys.readouterr()
    assert said.out == "code/mcpherson_strut_loaded.mjs\n"
    assert "the code has no forces, which --forces adds" in said.err


def driven_by(motion, folder):
    """A crank that follows a motion over time."""
    text = f"""{CRANK}[drivers.turn]
type = "joint_angle"
joint = "pivot"
[drivers.turn.motion]
{motion}
[sweep]
driver = "time"
start = 0.0
stop = 2.0
steps = 41
[outputs.angle]
type = "joint_angle"
joint = "pivot"
"""
    (folder / "crank.toml").write_text(text)
    return kincheck.load(folder / "crank.toml")


@compiled
def test_table_motion_equals_spline(tmp_path):
    times, values = [-0.5, 0.0, 0.4, 1.1, 2.0], [0.3, 0.0, 0.9, -0.4, 0.2]
    case = driven_by(f'type = "table"\ntimes = {times}\nvalues = {values}', tmp_path)
    write(tmp_path, c.files(case, ()))
    call = library(tmp_path, "crank")
    found = solve(call, case)
    spline = CubicSpline(times, values, bc_type="natural")
    expected = np.stack([spline(case.sweep.values, k) for k in range(3)], axis=-1)
    assert_equal(found[:, 0], expected)
    state = (ctypes.c_double * (call("size") // 8))()
    out = (ctypes.c_double * 3)()
    call("start", state)
    assert call("move", state, 2.1, 1.0, out) == 1  # the table ends before


@pytest.mark.needs("formulas")
def test_formula_motion_is_refused(tmp_path):
    case = driven_by('type = "formula"\nformula = "STEP(TIME, 0, 0, 1, 2)"', tmp_path)
    with pytest.raises(KincheckError, match="the driver turn follows a formula"):
        c.files(case, ())
