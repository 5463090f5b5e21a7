"""The board of time steppers: rows against known figures, its site, and its reproducers."""

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import kincheck.cases
import numpy as np
import pytest
from kincheck.core.cli.main import main
from kincheck.core.doors import offers
from kincheck.core.extensions.board.page import report
from kincheck.core.extensions.board.results import Board, Row, Run, TruthFacts
from kincheck.core.extensions.board.run import better, order_and_floor
from kincheck.core.extensions.board.truth import truth_of
from kincheck.core.extensions.environments.environments import python_of
from kincheck.core.extensions.free.section import Free, with_free
from msgspec.structs import replace as replace_row

DATA = Path(__file__).parents[2] / "data"
FOUR_BAR = DATA / "free_four_bar.toml"


def short(tmp_path, duration=0.3, samples=16):
    text = FOUR_BAR.read_text("utf-8")
    text = text.replace("duration = 2.0", f"duration = {duration}\nrates = {{crank = 1.0}}")
    file = tmp_path / "four_bar.toml"
    file.write_text(text.replace("samples = 201", f"samples = {samples}"), "utf-8")
    return file


def board(folder, *options):
    """Status of a board in `folder / "site"`."""
    return main(["board", "--out", str(folder / "site"), *map(str, options)])


def rows_of(folder):
    return json.loads((folder / "site" / "board.json").read_text("utf-8"))["rows"]


def measured(folder, *options, steps=60):
    """The rows of a board of the four-bar and further cases."""
    if not (folder / "four_bar.toml").exists():
        short(folder)
    assert board(folder, "--case", folder / "four_bar.toml", "--steps", steps, *options) == 0
    return rows_of(folder)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("the board")
    measured(folder, "--engine", "mujoco", "exudyn", "pinocchio")
    return folder / "site"


@pytest.fixture(scope="module")
def rows(site):
    found = rows_of(site.parent)
    return {(row["engine"], row["integrator"], row["column"]): row for row in found}


def errors(row):
    return [run["error"] for run in row["runs"]]


def test_mujoco_runge_kutta_is_second_order(rows):
    # four-bar of the study: 7.8e-6, 1.9e-6, 4.5e-7
    row = rows["mujoco", "RK4", "best"]
    assert row["order"] == pytest.approx(2.0, abs=0.15)
    assert errors(row)[-1] < 1e-4


def test_mujoco_softness_sets_floor(rows):
    row = rows["mujoco", "RK4", "default"]
    assert row["floor"] == min(errors(row))
    assert errors(row)[-1] > 30 * errors(rows["mujoco", "RK4", "best"])[-1]


def test_semi_implicit_steppers_share_their_error(rows):
    one, other = (errors(rows["mujoco", name, "best"]) for name in ("Euler", "implicitfast"))
    assert one == pytest.approx(other, rel=0.05)
    assert rows["mujoco", "Euler", "best"]["order"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("engine", ["drake", "dart"])
def test_semi_implicit_engines_share_their_error(engine, rows, tmp_path):
    package = {"drake": "pydrake.multibody.plant", "dart": "dartpy"}[engine]
    pytest.importorskip(package, exc_type=ImportError)
    (*_, best) = measured(tmp_path, "--engine", engine)
    one = errors(rows["mujoco", "Euler", "best"])
    assert errors(best)[-2:] == pytest.approx(one[-2:], rel=0.05)


def test_drake_without_loops_is_also_continuous(tmp_path):
    pytest.importorskip("pydrake.multibody.plant", exc_type=ImportError)
    text = short(tmp_path, 0.1, 3).read_text("utf-8")
    case = tmp_path / "chain.toml"
    case.write_text(re.sub(r"\[joints\.D\]\n(.+\n)*", "", text).replace('"free_', '"chain_'))
    found = {
        (row["case"], row["integrator"]): row
        for row in measured(tmp_path, "--engine", "drake", "--case", case)
    }
    chain = found["chain_four_bar", "runge_kutta3"]
    assert errors(chain)[-1] < 1e-9
    assert chain["runs"][-1]["reaction"] < 1e-6
    assert "no constraints" in found["free_four_bar", "runge_kutta3"]["message"]


def welded(tmp_path):
    """The four-bar with a plate on its coupler, in the tree."""
    plate = "[bodies.plate]\nmass = 0.7\ncenter_of_mass = [0.5, 0.6, 0.1]\n"
    plate += "inertia = [0.002, 0.003, 0.004, 0, 0, 0]\n"
    plate += '[joints.weld]\ntype = "fixed"\nbodies = ["coupler", "plate"]\n\n'
    case = tmp_path / "welded.toml"
    text = short(tmp_path, 0.2, 11).read_text("utf-8")
    case.write_text(text.replace("[joints.A]", f"{plate}[joints.A]").replace('"free_', '"welded_'))
    return case


@pytest.mark.nightly
@pytest.mark.parametrize("engine", ["exudyn", "drake"])
def test_welded_body_is_stepped(engine, tmp_path):
    pytest.importorskip({"drake": "pydrake"}.get(engine, engine), exc_type=ImportError)
    found = measured(tmp_path, "--engine", engine, "--case", welded(tmp_path))
    row = [each for each in found if each["case"] == "welded_four_bar"][-1]
    *_, longer, shorter = row["runs"]
    for key in ("error", "reaction"):
        assert shorter[key] <= 0.6 * longer[key]


def test_board_tree_merges_fixed_bodies(tmp_path):
    """The strut's chassis is fixed, and has a name of its own."""
    truth = truth_of(kincheck.load(short_strut(tmp_path)))
    files = offers("steppers")["drake"].load().files(truth.case.mechanism, truth.twists)
    found = {each["name"]: each["parent"] for each in json.loads(files["model.json"])["bodies"]}
    assert found == {"lca": "ground", "knuckle": "lca", "strut": "knuckle"}


def test_board_urdf_has_welded_bodies(tmp_path):
    truth = truth_of(kincheck.load(welded(tmp_path)))
    text = (
        offers("steppers")["pybullet"]
        .load()
        .files(truth.case.mechanism, truth.twists)["model.urdf"]
    )
    assert re.search(r'<joint name="plate joint" type="fixed">', text)
    assert re.search(r'<mass value="0.7" />', text)


def short_strut(tmp_path):  # rod, spring, damper; a ball in the tree
    strut = tmp_path / "strut.toml"
    text = kincheck.cases.file("mcpherson_strut_loaded").read_text("utf-8")
    text = re.sub(r"\[reference\]\n.*\n", "", text)
    strut.write_text(text + "\n[free]\nduration = 0.1\nsamples = 6\n", "utf-8")
    return strut


def test_drake_forces_leave_balls_out(tmp_path):
    pytest.importorskip("pydrake.multibody.plant", exc_type=ImportError)
    *_, row = measured(tmp_path, "--engine", "drake", "--case", short_strut(tmp_path))
    *_, longer, shorter = (run["reaction"] for run in row["runs"])
    assert shorter == pytest.approx(0.5 * longer, rel=0.1)


def test_error_of_simbody_follows_its_accuracy(tmp_path):
    pytest.importorskip("opensim", exc_type=ImportError)
    row, other = measured(tmp_path, "--engine", "simbody", "--case", short_strut(tmp_path))
    assert errors(other)[-1] < 1e-8
    found = errors(row)
    assert found == sorted(found, reverse=True)
    assert found[-1] < 1e-8
    assert row["runs"][-1]["gap"] < 1e-9


@pytest.mark.parametrize("integrator", ["GeneralizedAlpha", "TrapezoidalIndex2"])
def test_implicit_steppers_are_of_second_order(rows, integrator):
    for column in ("default", "best"):
        assert rows["exudyn", integrator, column]["order"] == pytest.approx(2.0, abs=0.05)


def test_pinocchio_needs_its_proximal_setting(rows):
    assert rows["pinocchio", "RK4", "default"]["state"] == "diverged"
    best = rows["pinocchio", "RK4", "best"]
    assert errors(best)[-1] < 1e-8
    assert best["loop"] == "Python"


def test_energy_and_gap_follow_error(rows):
    last = rows["exudyn", "GeneralizedAlpha", "best"]["runs"][-1]
    assert last["gap"] < 1e-10
    assert 0.1 * last["error"] < last["energy"] < 1e3 * last["error"]


def test_stepper_forces_equal_truth(rows):
    def last(*key):
        return rows[key]["runs"][-1]["reaction"]

    # forces of up to 100 N, of which MuJoCo's impedance of 0.9999 leaves a ten-thousandth out
    assert last("pinocchio", "RK4", "best") < 1e-6
    assert last("exudyn", "TrapezoidalIndex2", "best") < 1e-3
    assert last("mujoco", "RK4", "best") < 2e-2
    assert last("mujoco", "RK4", "default") > 0.1


def test_undetermined_forces_are_left_open():
    truth = truth_of(with_free(kincheck.load("bricard"), Free(0.01, 2)))
    assert np.isfinite(truth.reactions).all()
    assert truth.facts.forces
    assert not truth_of(with_free(kincheck.load("bennett"), Free(0.01, 2))).facts.forces
    assert np.abs(truth.reactions[..., 3:]).max() > 0.1
    head, *values = truth.tables([], 1)["reactions.csv"].splitlines()
    assert len(values) == 1
    assert head.count(",") == 6 * len(truth.case.mechanism.joints) - 1


def test_board_site_has_every_row(site, rows):
    page = (site / "index.html").read_text("utf-8")
    for row in rows.values():
        folder = site / row["folder"]
        assert json.loads((folder / "row.json").read_text("utf-8")) == row
        assert f'href="{row["folder"]}/run.py"' in page
        assert "kincheck." not in (folder / "run.py").read_text("utf-8")
    assert page.count('scope="rowgroup"') == len({row["group"] for row in rows.values()})
    assert "://" not in page.replace("http://www.w3.org", "")


def test_row_is_worse_by_error():
    """Also by one that it has no more; without runs it compares with any."""
    better, worse = (
        Row(**GIVEN, column="best", state="measured", runs=[Run(error=error)])
        for error in (1e-6, 2e-6)
    )
    ends = [better, worse, Row(**GIVEN, column="best", state="error")]
    assert [[now.worse_than(before) for before in ends] for now in ends] == [
        [False, False, False],
        [True, False, False],
        [True, True, False],
    ]
    absent = Row(**GIVEN, column="best", state="unavailable")
    assert not absent.worse_than(better)


@pytest.mark.nightly
def test_board_keeps_row_history(tmp_path, capsys):
    given = ["--engine", "mujoco", "--case", short(tmp_path, 0.02, 3)]
    file = tmp_path / "site" / "board.json"
    assert board(tmp_path, *given, "--steps", 2) == 0
    page = file.parent / "index.html"
    assert "History" not in page.read_text("utf-8")
    found = json.loads(file.read_text("utf-8"))
    first, second, third, *_ = found["rows"]
    for row in (first, second, third):
        row["since"] = "2025-01-01"
    second["version"] = "3.9"
    third["runs"][-1]["error"] *= 0.5
    wrong = third["runs"][-1]["error"]
    old = tmp_path / "the old one.json"
    old.write_text(json.dumps(found), "utf-8")
    assert board(tmp_path, *given, "--steps", 2, "--against", old) == 1
    assert "mujoco implicitfast, default: measured, worse" in capsys.readouterr().err
    one, two, three, *_ = rows_of(tmp_path)
    assert one["since"] == "2025-01-01" < two["since"] == three["since"]
    assert not one["past"]
    assert [each["version"] for each in two["past"]] == ["3.9"]
    (before,) = three["past"]
    assert (before["since"], before["until"]) == ("2025-01-01", three["since"])
    assert before["error"] == wrong
    text = page.read_text("utf-8")
    for change in ("version 3.9 → ", "error alone", '<td class="number">2</td>'):
        assert change in text
    # the same again, and a board with other steps
    assert board(tmp_path, *given, "--steps", 2) == 0
    assert len(rows_of(tmp_path)[2]["past"]) == 1
    assert board(tmp_path, *given, "--steps", 4, "--against", old) == 0
    file.write_text("{}", "utf-8")
    assert board(tmp_path, *given) == 2
    assert board(tmp_path, *given, "--against", "none.json") == 2


@pytest.mark.parametrize(
    ("engine", "integrator"), [("mujoco", "RK4"), ("exudyn", "GeneralizedAlpha")]
)
def test_board_reproducer_repeats_row(site, rows, engine, integrator):
    row = rows[engine, integrator, "best"]
    folder = site / row["folder"]
    command = [sys.executable, "-P", "-S", "-c", ALONE, str(folder / "run.py")]
    environment = {**os.environ, "OWN": ENGINES}
    done = subprocess.run(command, check=True, capture_output=True, env=environment)
    assert b"Deprecation" not in done.stderr
    assert b"message" not in done.stdout
    again = json.loads((folder / "result.json").read_text("utf-8"))
    assert errors(again) == errors(row)


ENGINES = str(Path(np.__file__).parents[1])
# the packages of the engines, without those that .pth files add: kincheck is one
ALONE = """
import os, runpy, sys
sys.path.append(os.environ["OWN"])
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
assert not any(name.startswith("kincheck") for name in sys.modules)
"""


def test_board_truth_equals_free(site, rows):
    folder = site / rows["mujoco", "RK4", "best"]["folder"]
    with (folder / "truth.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    found = kincheck.free(FOUR_BAR, duration=0.3, samples=16, rates={"crank": 1.0})
    for axis in "xy":
        values = [float(row[f"P.{axis}"]) for row in table]
        assert values == pytest.approx(found.outputs[f"P_{axis}"], abs=1e-13)
    energy = [float(row["energy"]) for row in table]
    assert np.ptp(energy) < 1e-12  # of motion and weight, which nothing else works on


def test_board_truth_of_turned_body():
    case = with_free(kincheck.load("mcpherson_strut_loaded"), Free(0.05, 3))
    truth, found = truth_of(case), kincheck.free(case)
    place, _ = truth.frames["knuckle"].at([0.975, 0.715, 0.101])
    assert place[:, 1] - 0.715 == pytest.approx(found.outputs["half_track_change"], abs=1e-12)
    force = found.outputs["spring_force"]
    assert np.ptp(force) > 1.0
    lost = np.diff(truth.energy)  # into the damper
    assert (lost < 0.0).all()


GIVEN = {"case": "a", "engine": "b", "integrator": "c", "group": "d", "loop": "", "ties": ""}


def page_of(rows, **truth):
    """Return the sections of a page on given rows, by title."""
    numbers = dict.fromkeys(("duration", "error", "energy", "seconds"), 1.0)
    counts = dict.fromkeys(("samples", "freedoms", "redundant", "points"), 1)
    facts = TruthFacts(case="a", source="", method="", **numbers, **counts, **truth)
    board = Board(kincheck="", started="", processor="", platform="", truths=[facts], rows=rows)
    return {section.title: section for section in report(board).sections}


def test_board_page_groups_rows():
    reason = "no rods; pip install it"
    bad = Row(**GIVEN, column="default", state="unsupported", message=reason, folder="f")
    good = Row(**GIVEN, column="best", state="measured", runs=[Run(error=1.0)])
    section = page_of([bad, replace_row(bad, column="best"), replace_row(good, group="e")])["a"]
    assert [row[0] for row in section.rows] == ["d", "b c", "b c", "e", "b c"]
    assert [*section.links] == ["", "f/run.py", "f/run.py", "", ""]
    assert section.notes == ["b c, default; b c, best: unsupported: no rods."]


@pytest.mark.parametrize(("forces", "cell"), [(True, "not given"), (False, "open")])
def test_board_page_explains_missing_forces(forces, cell):
    row = Row(**GIVEN, column="best", state="measured", runs=[Run(error=1.0)])
    section = page_of([row], forces=forces)["a"]
    assert section.rows[1][section.columns.index("reaction [N]")] == cell
    assert forces != any("forces are compared" in each for each in section.verdict)


def test_board_page_keeps_best_settings():
    row = Row(**GIVEN, column="best", state="measured", settings={"mu": 0.1}, by="me", on="today")
    nearer = replace_row(row, settings={}, case="other")
    ((*_, best, by),) = page_of([row, nearer])["Settings and measures"].rows
    assert (best, by) == ("mu 0.1", "me today")


def test_board_best_is_by_error():
    default = Row(**GIVEN, column="default", state="measured", runs=[Run(error=3e-4)])
    row = replace_row(default, column="best", settings={"mu": 0.1})
    worse, nearer = (replace_row(row, runs=[Run(error=each)]) for each in (4e-4, 2e-4))
    found = better(default, worse)
    assert (found.column, found.settings, found.runs) == ("best", {}, default.runs)
    assert found.message == "the defaults are nearer: other settings have an error of 0.0004 m"
    assert better(default, nearer) is nearer
    assert better(replace_row(default, runs=[]), worse) is worse


def test_board_order_and_floor():
    def runs(*found):
        return [Run(step=0.5**k, error=error) for k, error in enumerate(found)]

    assert order_and_floor(runs(64.0, 16.0, 4.0, 1.0)) == (pytest.approx(2.0), None)
    assert order_and_floor(runs(64.0, 8.0, 1.0, 1.0)) == (pytest.approx(3.0), 1.0)
    # the first step is too long for any order
    assert order_and_floor(runs(3.0, 3.0, 0.75, 0.1875)) == (pytest.approx(2.0), None)
    assert order_and_floor(runs(1.0, 1.0, 1.0, 1.0)) == (None, 1.0)
    assert order_and_floor([*runs(8.0, 4.0), Run(step=0.25, message="not finite")]) == (None, None)


FAKES = {
    "mujoco": ("unavailable", "raise ImportError('libEGL is missing')"),
    "exudyn": ("crashed", "import os\nos._exit(139)"),
    "pinocchio": ("timeout", "import time\ntime.sleep(60)"),
}


def test_engine_fault_costs_own_rows(tmp_path, monkeypatch):
    for name, (_, text) in FAKES.items():
        (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    short(tmp_path, 0.02, 3)
    for row in measured(tmp_path, "--engine", *FAKES, "--timeout", 2, steps=1):
        assert row["state"] == FAKES[row["engine"]][0]
        assert row["message"]


def own_python(folder, text):
    program = folder / "environments" / "pybullet" / "bin" / "python"
    program.parent.mkdir(parents=True)
    program.write_text(f"#!/bin/sh\n{text}\n")
    program.chmod(0o755)
    return str(folder / "environments")


def pybullet_row(tmp_path):
    short(tmp_path, 0.02, 3)
    return measured(tmp_path, "--engine", "pybullet", steps=2)[0]


def test_board_engine_in_own_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("KINCHECK_ENVIRONMENTS", own_python(tmp_path, "echo own >&2\nexit 5"))
    row = pybullet_row(tmp_path)
    assert row["state"] == "crashed"
    assert row["message"].endswith("status 5; own")


def test_missing_environment_names_remedy(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("KINCHECK_ENVIRONMENTS", str(tmp_path))
    row = pybullet_row(tmp_path)
    remedy = f"python -m venv {tmp_path}/pybullet && {tmp_path}/pybullet/bin/pip install"
    assert row["state"] == "unavailable"
    assert remedy in row["message"]
    assert remedy in (tmp_path / "site" / "index.html").read_text("utf-8").replace("&amp;", "&")
    monkeypatch.setenv("KINCHECK_ENVIRONMENTS", str(tmp_path / "none"))
    assert board(tmp_path) == 2
    assert "KINCHECK_ENVIRONMENTS: there is no folder" in capsys.readouterr().err


@pytest.mark.parametrize("engine", ["pybullet", "mjx", "mujoco-warp"])
def test_environment_engines_share_error(engine, rows, tmp_path):
    if python_of(engine) == sys.executable:
        pytest.skip(f"KINCHECK_ENVIRONMENTS has no {engine}")
    (*_, best) = measured(tmp_path, "--engine", engine, "--timeout", "600")
    one = errors(rows["mujoco", "Euler", "best"])
    # rounding to float32 shifts the phase
    assert errors(best)[-1] == pytest.approx(one[-1], rel=0.06)
    assert best["version"][0].isdigit()
    if engine == "pybullet":  # forces of the step, of first order
        *_, longer, shorter = (run["reaction"] for run in best["runs"])
        assert shorter == pytest.approx(0.5 * longer, rel=0.1)


def test_board_urdf_equals_model(tmp_path):
    pin = pytest.importorskip("pinocchio")
    truth = truth_of(kincheck.load(short(tmp_path, 0.1, 3)))
    files = offers("steppers")["pybullet"].load().files(truth.case.mechanism, truth.twists)
    model, found = json.loads(files["model.json"]), pin.buildModelFromXML(files["model.urdf"])
    data = found.createData()
    for body in model["bodies"]:
        k = found.getJointId(f"{body['name']} joint")
        pin.forwardKinematics(found, data, pin.neutral(found))
        inertia = found.inertias[k]
        assert inertia.mass == body["mass"]
        assert data.oMi[k].act(inertia.lever) == pytest.approx(body["center"], abs=1e-15)
        assert inertia.inertia == pytest.approx(np.array(body["inertia"]), abs=1e-15)


def test_unsupported_constraint_is_board_row(tmp_path):
    case = tmp_path / "rssr.toml"
    text = kincheck.cases.file("rssr").read_text("utf-8")
    case.write_text(text + "\n[free]\nduration = 0.02\nsamples = 3\n", "utf-8")
    assert board(tmp_path, "--engine", "pinocchio", "--case", case, "--steps", 1) == 0
    for row in rows_of(tmp_path):
        assert row["state"] == "unsupported"
        assert "distance" in row["message"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--engine mujco", "did you mean 'mujoco'"),
        ("--case delta_robot", "add [free] with duration"),
        ("--case four_bra", "four_bar"),
    ],
)
def test_board_refuses_wrong_options(options, message, tmp_path, capsys):
    assert board(tmp_path, *options.split()) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--case four_bar nosuch", "there is no case 'nosuch'"),
        ("--steps abc", "--steps: 'abc' is not a whole number of 1 or more"),
        ("--timeout abc", "--timeout: 'abc' is not a positive number"),
    ],
)
def test_board_refuses_invalid_options(options, said, tmp_path, capsys):
    assert board(tmp_path, *options.split()) == 2
    out, err = capsys.readouterr()
    assert (out, said in err) == ("", True), err
