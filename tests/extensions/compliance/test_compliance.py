"""Kinematics and compliance: strut and axle against their data, slopes against differences."""

import csv
import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import kincheck
import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.cli.main import main
from kincheck.core.errors import KincheckError
from kincheck.core.extensions.compliance.released import released
from kincheck.core.extensions.compliance.section import rig_of
from kincheck.core.extensions.compliance.study import compliance
from kincheck.core.extensions.statics.equilibrium import StaticModel
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.mechanism.loads import Bushing
from kincheck.core.mechanism.mechanism import Point

from ...kinematics.test_bushings import bushed
from ...support.engine_motion import SIMULATORS, installed
from ...support.examples import examples

REFUSED, SERIES, WHEEL, HINGES = examples(__file__, "refused", "series", "wheel", "hinges")

DATA = Path(__file__).parents[2] / "data" / "elastokinematics"
STRUT = json.loads((DATA / "5_strut_kc.json").read_text())
AXLE = json.loads((DATA / "8_hmmwv_axle.json").read_text())
AXLE_CASE = DATA / "8_hmmwv_axle.toml"
JOINTS = {"lca_front": "lca_pivot", "lca_rear": "lca_pivot", "top": "strut_top"}


def bushing_table(joint, name, bodies, point, axes, stiffness, turning):
    lines = {
        "bodies": json.dumps(bodies),
        "point": list(point),
        "axes": [list(map(float, axis)) for axis in axes[:2]],
        "stiffness": list(stiffness),
        "turning_stiffness": list(turning),
    }
    return f"[joints.{joint}.bushings.{name}]\n" + "".join(f"{k} = {v}\n" for k, v in lines.items())


def strut_text(more=""):
    """Return the built-in strut with bushings, its contact, and outputs of a wheel."""
    text = case_text(cases.load("mcpherson_strut_loaded")).partition("[reference]")[0]
    text = text.replace('truth = "in_house_oracle"\n', "")
    for each in STRUT["bushings"]:
        numbers = (each["point"], each["axes"], each["stiffness"], each["turning_stiffness"])
        text += bushing_table(JOINTS[each["name"]], each["name"], each["bodies"], *numbers)
    text += f'[points.contact_patch]\nbody = "knuckle"\nposition = {STRUT["contact_patch"]}\n'
    return text + more


OUTBOARD = WHEEL.replace("CONVENTION", "iso8855").replace(
    "wheel_radius", 'drive = "outboard"\nwheel_radius'
)


def loads_of(row):
    fx, fy, _, _, _, mz = row["load_at_contact_patch"]
    return {"longitudinal": fx, "lateral": fy, "aligning": mz}


def strut_file(tmp_path, more=""):
    file = tmp_path / "strut.toml"
    file.write_text(strut_text(more))
    return str(file)


def strut(tmp_path, more=""):
    return load_case(strut_file(tmp_path, more))


def test_kc_agrees_with_six_simulators(tmp_path, capsys):
    rows = STRUT["results"]
    files = [f"--{kind}={tmp_path / kind}" for kind in ("json", "csv", "out")]
    case = strut_file(tmp_path)
    assert main(["kc", case, "--travel=0:50mm:2", "--load", "lateral=0:1kN:2", *files]) == 0
    found = json.loads((tmp_path / "json").read_text())
    assert found["travel"] == [0.0, 0.05]
    assert found["wheel_center"][0] == pytest.approx(rows[0]["wheel_center"], abs=1e-15)
    assert found["spin_axis"][0] == pytest.approx(rows[0]["spin_axis"], abs=1e-14)
    assert found["wheel_load"][0] == pytest.approx(rows[0]["wheel_load"], abs=1e-10)
    given = np.array(rows[0]["compliance_contact_patch"])
    assert np.abs(np.array(found["compliance"][0]) - given).max() <= 1e-14 * np.abs(given).max()
    lateral = found["loads"]["lateral"]
    assert lateral["lateral"] == [0.0, 1000.0]
    assert lateral["wheel_center"][1] == pytest.approx(rows[1]["wheel_center"], abs=1e-15)
    given = np.array(rows[1]["compliance_contact_patch"])
    assert np.abs(np.array(lateral["compliance"][1]) - given).max() <= 1e-14 * np.abs(given).max()
    assert "wheel_rate [N/mm]" in capsys.readouterr().out
    table = [*csv.reader((tmp_path / "csv").read_text().splitlines()[1:])]
    assert [row[0] for row in table[1:]] == ["travel"] * 2 + ["lateral"] * 2
    assert float(table[2][table[0].index("wheel_rate [N/mm]")]) == pytest.approx(
        found["outputs"]["wheel_rate"]["position"][1] / 1000.0
    )
    page = (tmp_path / "out" / "kc.html").read_text()
    assert "Kinematics and compliance of mcpherson_strut_loaded" in page
    assert "https:" not in page


@pytest.mark.parametrize("travel", ["-10:10mm:3", "-10mm:10:3", "-0.01:0.01:3"])
def test_travel_unit_of_one_end_suffices(tmp_path, travel):
    out = tmp_path / "out.json"
    loads = ["--load", "lateral=-1:1kN:3", "--json", str(out)]
    assert main(["kc", strut_file(tmp_path), f"--travel={travel}", *loads]) == 0
    found = json.loads(out.read_text())
    assert found["travel"] == [-0.01, 0.0, 0.01]
    assert found["loads"]["lateral"]["lateral"] == [-1000.0, 0.0, 1000.0]


@pytest.mark.parametrize(
    ("travel", "first", "count"),
    [("10mm:3", -0.01, 3), ("10mm", -0.01, 25), ("0", 0.0, 1), ("0:10mm", 0.0, 25)],
)
def test_travel_is_spelled_as_in_run(tmp_path, travel, first, count):
    out = tmp_path / "out.json"
    assert main(["kc", strut_file(tmp_path), f"--travel={travel}", "--json", str(out)]) == 0
    found = json.loads(out.read_text())["travel"]
    assert (found[0], len(found)) == (first, count)


def test_kc_constant_load_acts_over_travel(tmp_path):
    """Loads at the contact, as the data have them, with a drive on the wheel carrier."""
    row = STRUT["results"][2]
    found = compliance(strut(tmp_path, OUTBOARD), [row["travel"]], loads_of(row)).travel
    assert found.wheel_center[0] == pytest.approx(row["wheel_center"], abs=1e-14)
    assert found.wheel_load[0] == pytest.approx(row["wheel_load"], abs=1e-9)


LOADS = product(["lateral", "longitudinal", "braking", "aligning"], ["iso8855", "sae_j670"])


@pytest.mark.by_day(3)
@pytest.mark.parametrize("given", [*LOADS], ids=str)
def test_slopes_by_load_equal_differences(tmp_path, given):
    load, convention = given
    case = strut(tmp_path, WHEEL.replace("CONVENTION", convention))
    results = compliance(case, [0.0], {load: [-1.0, 0.0, 1.0]})
    curve = results.loads[load]
    suffix = "torque" if load == "aligning" else "force"
    for name in ("toe", "camber"):
        slope = curve.outputs[f"{name}.per_{load}_{suffix}"].values[1]
        low, _, high = curve.outputs[name].values
        assert slope == pytest.approx(0.5 * (high - low), rel=1e-5)
    # a force to the left moves the wheel to the left: positive y in ISO 8855
    if load == "lateral":
        moved = curve.wheel_center[2, 1] - curve.wheel_center[0, 1]
        assert moved > 0.0 if convention == "iso8855" else moved < 0.0


def test_slope_by_travel_of_soft_suspension(tmp_path):
    case = strut(tmp_path, WHEEL.replace("CONVENTION", "iso8855"))
    found = compliance(case, [-1e-4, 0.0, 1e-4]).travel
    low, _, high = found.outputs["toe"].values
    slope = found.outputs["toe.per_travel"].values[1]
    assert slope == pytest.approx((high - low) / 2e-4, rel=1e-6)
    low, _, high = found.rigid["toe"]
    assert slope != pytest.approx((high - low) / 2e-4, rel=1e-3)


def test_axle_wheel_rates_heave_and_roll():
    rows, case = AXLE["rows"], load_case(AXLE_CASE)
    found = compliance(case, [0.0, 0.02])
    curves = found.travel.outputs
    assert found.travel.wheel_load[0] == pytest.approx(rows["static_wheel_load"], rel=1e-12)
    parallel, opposite = rows["wheel_rate_parallel"], rows["wheel_rate_opposite"]
    assert curves["wheel_rate"].values[0] == pytest.approx(parallel, rel=1e-10)
    assert curves["wheel_rate_opposite"].values[0] == pytest.approx(opposite, rel=1e-10)
    track = 2.0 * 0.91
    assert curves["roll_stiffness"].values[0] == pytest.approx(track**2 / 2 * opposite, rel=1e-10)
    share = (opposite - parallel) / opposite
    assert curves["anti_roll_share"].values[0] == pytest.approx(share, rel=1e-8)
    C = found.travel.compliance
    assert C.shape == (2, 12, 12)
    assert np.abs(C[0] - C[0].T).max() <= 1e-14 * np.abs(C[0]).max()
    rolled = compliance(case, [0.02], axle="roll").travel
    assert rolled.wheel_center[0, 2] == pytest.approx(found.travel.wheel_center[1, 2], abs=1e-12)
    assert rolled.wheel_load[0] > found.travel.wheel_load[1]  # the bar is twisted


@pytest.mark.nightly
def test_free_axle_compliance_equals_data():
    """Both wheels are free in height; loads and displacements at their centres."""
    rows = AXLE["rows"]
    soft = released(load_case(AXLE_CASE).mechanism)
    object.__setattr__(soft, "drivers", ())
    x, y, z = AXLE["points"]["wc"]
    ends = {"l": ("up_l", (x, y, z)), "r": ("up_r", (x, -y, z))}
    model = StaticModel(soft, [Point(name, *end) for name, end in ends.items()])
    load = np.array([[0.0, 0.0, rows["static_wheel_load"], 0.0, 0.0, 0.0]])
    found = model.solve({"l": load, "r": load}, {})
    motions = [[found.motion(found.by_load[k][0], *end)[0] for k in ends] for end in ends.values()]
    C = np.block(motions)
    assert 1.0 / (C[2, 2] + C[2, 8]) == pytest.approx(rows["wheel_rate_parallel"], rel=1e-9)
    assert C[0, 0] + C[0, 6] == pytest.approx(rows["wheel_center_x_compliance"], rel=1e-9)
    assert C[5, 5] + C[5, 11] == pytest.approx(rows["aligning_steer_compliance"], rel=1e-9)
    lateral = rows["lateral_steer_compliance_at_wheel_center"]
    assert C[5, 1] + C[5, 7] == pytest.approx(lateral, rel=1e-9)


def test_travel_beyond_equilibrium_is_error(tmp_path, capsys):
    """A tie rod that is pulled straight leaves no equilibrium at half a metre."""
    out = tmp_path / "found.json"
    case = strut_file(tmp_path)
    assert main(["kc", case, "--travel=0:0.9:2", "--json", str(out), "--out", str(tmp_path)]) == 2
    for said in (capsys.readouterr().err, (tmp_path / "kc.html").read_text()):
        assert "no equilibrium at travel 0.9 m: the last is at travel" in said
    found = json.loads(out.read_text())
    assert found["wheel_load"][0] > 0.0
    assert found["wheel_load"][1] is None


def test_load_beyond_equilibrium_is_counted(tmp_path, capsys):
    found = repr(compliance(strut(tmp_path), [0.0, 9.0]))
    assert found.endswith(", 2 samples of travel, 1 without equilibrium>")
    case = strut_file(tmp_path)
    page = ["--out", str(tmp_path)]
    assert main(["kc", case, "--travel=-0.06:0.06:7", "--load", "braking=3e9", *page]) == 2
    out, err = capsys.readouterr()
    assert "no equilibrium at any of 7 samples of travel" in out
    assert "nan" not in out + (tmp_path / "kc.html").read_text().partition('id="matrix"')[2]
    said = err.splitlines()
    assert "no equilibrium at travel -0.06 m with braking 3e+09 N: the last is" in said[-6]
    assert "2 further samples without equilibrium. Give less travel or load" in said[-1]


@pytest.mark.parametrize(("more", "options", "expected"), REFUSED)
def test_kc_without_facts_is_refused(tmp_path, capsys, more, options, expected):
    options = options.format(file=__file__).split()
    assert main(["kc", strut_file(tmp_path, more), *options]) == 2
    assert expected in capsys.readouterr().err


def test_table_without_bushings_is_rigid(tmp_path, capsys):
    assert main(["templates", "double_wishbone"]) == 0
    table = tmp_path / "car.csv"
    table.write_text(capsys.readouterr().out)
    rubber = tmp_path / "rubber.toml"
    rubber.write_text("[bushings.lca_front]\nstiffness = 1e6\nturning_stiffness = 100.0\n")
    for options, rigid in (([], True), ([f"--bushings={rubber}"], False)):
        assert main(["kc", str(table), "--travel=0:10mm:2", *options]) == 0
        assert ("note: nothing is elastic" in capsys.readouterr().err) == rigid


def test_rig_file_round_trip(tmp_path):
    table = '[compliance]\nwheel = "knuckle"\nloads = ["lateral"]\ntire_stiffness = 2e5\n'
    case = strut(tmp_path, table)
    again = tmp_path / "again.toml"
    again.write_text(case_text(case))
    assert rig_of(load_case(again)) == rig_of(case)
    found = compliance(case, [0.0]).travel.outputs
    assert not any("braking" in name for name in found)
    rate = found["wheel_rate"].values[0]
    assert found["ride_rate"].values[0] == pytest.approx(rate * 2e5 / (rate + 2e5))


def test_released_joint_with_held_driver_refused(tmp_path):
    text = strut_text('[compliance]\nheld = ["stroke", "turn"]\n').replace(
        "[sweep]", '[drivers.turn]\ntype = "joint_angle"\njoint = "lca_pivot"\n\n[sweep]'
    )
    file = tmp_path / "held.toml"
    file.write_text(text)
    with pytest.raises(KincheckError, match="'turn' is held, and its joint gives way"):
        compliance(load_case(file))


def test_bushing_file_for_hardpoint_table(tmp_path, capsys):
    table, rubber = tmp_path / "car.csv", tmp_path / "rubber.toml"
    assert main(["templates", "double_wishbone"]) == 0
    table.write_text(capsys.readouterr().out)
    rubber.write_text(
        "".join(
            bushing_table(arm, end, ["ground", arm[:3]], place, np.eye(3), [5e6] * 3, [50.0] * 3)
            for arm, ends in HINGES.items()
            for end, place in ends.items()
        )
    )
    out = tmp_path / "out.json"
    options = ["--bushings", str(rubber), "--travel=-0.03:0.03:3", "--json", str(out)]
    assert main(["kc", str(table), *options]) == 0
    assert "  -0  " not in capsys.readouterr().out
    found = json.loads(out.read_text())
    assert found["wheel_load"][1] == pytest.approx(0.0, abs=1e-6)  # it has no spring and no mass
    C = np.array(found["compliance"][1])
    assert np.abs(C - C.T).max() <= 1e-12 * np.abs(C).max()
    assert C[1, 1] > 1e-8
    assert main(["kc", str(table), *options, "--travel=30mm:30mm:1"]) == 0
    alone = json.loads(out.read_text())
    assert alone["travel"] == [0.03]
    assert alone["wheel_center"][0] == pytest.approx(found["wheel_center"][2], abs=1e-12)
    rubber.write_text(rubber.read_text().replace("lca_pivot", "lower_pivot"))
    assert main(["kc", str(table), *options]) == 2
    assert "'lower_pivot'" in capsys.readouterr().err


@pytest.fixture(scope="module")
def load_cases(tmp_path_factory):
    """The four load cases of the data as equilibria for engines, with their results."""
    case, found = strut(tmp_path_factory.mktemp("strut"), OUTBOARD), []
    for row in STRUT["results"]:
        found.append((compliance(case, [row["travel"]], loads_of(row)).cases[0], row))
    return found


@pytest.mark.needs("equilibria")
@pytest.mark.by_day(2)
@pytest.mark.parametrize("name", [*SIMULATORS, "exudyn-static"])
def test_engine_equilibria_equal_data(load_cases, name):
    """Wheel centre and load by its own kinematics, gravity and rows, for four load cases."""
    engine = engine_of(name)
    for asked, row in load_cases:
        found = engine.equilibria(asked)
        center = found.points["wheel_center"].position[0]
        assert center == pytest.approx(row["wheel_center"], abs=1e-12)
        assert found.forces.drivers["stroke"][0] == pytest.approx(row["wheel_load"], abs=4e-6)


@pytest.mark.nightly
def test_engine_verdicts_on_axle(tmp_path, capsys):
    """Both wheels against each other, with an anti-roll bar."""
    names = ["mujoco", "exudyn-static"]
    for name in names:
        engine_of(name)
    options = ["--travel=-60mm:50mm:2", "--axle=roll", "--jobs=0", "--engine", *names]
    out = tmp_path / "kc.json"
    assert main(["kc", str(AXLE_CASE), *options, f"--json={out}"]) == 0
    for row in json.loads(out.read_text())["agreement"][1:]:
        assert row["outcome"] == "pass"
        assert row["wheel_center"] <= 1e-12
        assert row["wheel_load"] <= 1e-5


def engine_of(name):
    if name in adapters.ENGINES:
        return installed(name)
    engine = adapters.engine(name, "simulate")
    if engine.version() is None:
        pytest.skip(f"{name} is not installed")
    return engine


def test_deviating_engine_is_named(tmp_path, capsys):
    """Its bushings are twice as stiff; history and page have its verdict."""
    options = ["--travel=0:20mm:2", "--jobs=0", "--engine", f"{__name__}:Stiff"]
    files = [f"--{what}={tmp_path / what}" for what in ("out", "history")]
    assert main(["kc", strut_file(tmp_path), *options, *files]) == 1
    assert "wheel_center_x: position is off by" in capsys.readouterr().out
    assert "wheel_load" in (tmp_path / "out" / "results.json").read_text()
    assert ">fail<" in (tmp_path / "out" / "kc.html").read_text()
    assert main(["history", "--history", str(tmp_path / "history")]) == 0
    assert "1 fail" in capsys.readouterr().out


class Stiff(NativeEngine):
    def __init__(self):
        super().__init__(name="stiff")

    def equilibria(self, case):
        def twice(each):
            return replace(each, stiffness=[2.0 * k for k in np.atleast_1d(each.stiffness)])

        forces = [twice(x) if isinstance(x, Bushing) else x for x in case.mechanism.forces]
        return super().equilibria(replace(case, mechanism=replace(case.mechanism, forces=forces)))


@pytest.mark.needs("simulate")
def test_engine_without_statics_is_unsupported(tmp_path, capsys):
    engine_of("mujoco")
    options = ["--travel=0:20mm:2", "--jobs=0", "--engine", "mujoco-default"]
    assert main(["kc", strut_file(tmp_path), *options]) == 0
    assert "finds no equilibria" in capsys.readouterr().out


@pytest.mark.nightly
def test_bench_compliance_times_samples_and_matrices(tmp_path, capsys):
    out = tmp_path / "bench.json"
    command = ["bench", "compliance", strut_file(tmp_path), "--rounds=1", f"--json={out}"]
    assert main(command) == 0
    found = json.loads(out.read_text())
    assert found["reached"] == found["samples"]
    assert found["us_per_sample"]["median"] > found["us_per_matrix"]["median"] > 0.0
    assert "us a matrix at least" in capsys.readouterr().out


@pytest.mark.needs("equilibria")
@pytest.mark.parametrize("name", ["mujoco", "exudyn", "exudyn-static"])
def test_bushings_in_series_closed_form(tmp_path, capsys, name):
    """In mm; the second bushing's axes turn with its first body, which carries a couple."""
    engine_of(name)
    (tmp_path / "series.toml").write_text(SERIES)
    out = tmp_path / "kc.json"
    options = ["--travel=0:10mm:2", "--load=lateral=0:1kN:2", "--jobs=0", f"--json={out}"]
    assert main(["kc", str(tmp_path / "series.toml"), *options, "--engine", name]) == 0
    found = json.loads(out.read_text())
    assert found["wheel_load"] == pytest.approx([0.0, 2000.0], abs=1e-9)
    rate = found["outputs"]["wheel_rate"]["position"]
    assert rate == pytest.approx([2e5, 2e5], rel=1e-12)
    # lateral: both along y, and turning about x by the arm of 0.3 m
    expected = 1.0 / 3e5 + 1.0 / 2e6 + 0.3**2 * 2.0 / 5e5
    assert found["compliance"][0][1][1] == pytest.approx(expected, rel=1e-12)
    assert {row["outcome"] for row in found["agreement"]} == {"pass", "not judged"}


@pytest.mark.needs("equilibria")
def test_python_compliance_with_engine_verdicts(tmp_path):
    """A stiff engine by itself, and a simulator by its name."""
    engine_of("pinocchio")
    case = strut(tmp_path)
    found = kincheck.compliance(case, [0.0, 0.02], engines=["pinocchio", Stiff()], jobs=0)
    outcomes = {each.engine: each.outcome.shown for each in found.checked.records}
    assert outcomes == {"native": "not judged", "pinocchio": "pass", "stiff": "fail"}
    assert kincheck.compliance(case, [0.0]).checked is None
    with pytest.raises(KincheckError, match="did you mean 'pinocchio'"):
        kincheck.compliance(case, [0.0], engines="pinochio")


def test_values_below_accuracy_print_zero(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for options, file in (("", "car.csv"), (" --bushings", "rubber.toml")):
        assert main(f"templates mcpherson{options}".split()) == 0
        Path(file).write_text(capsys.readouterr().out)
    assert main("kc car.csv --bushings rubber.toml --travel=-60mm:60mm:5 --out .".split()) == 0
    line = "wheel_center.z.per_lateral_force [mm/kN]  0  (from 0 to 0)"
    assert line in capsys.readouterr().out
    assert "e-24" not in Path("kc.html").read_text().partition("Compliance at design")[2]


def test_released_joint_keeps_its_bushings(tmp_path):
    soft = released(bushed(tmp_path, "cardan").mechanism)
    assert [joint.name for joint in soft.joints] == ["g"]
    assert [each.name for each in soft.forces] == ["b", "s", "h.front"]
    assert [each.name for each in soft.drivers] == ["e"]
