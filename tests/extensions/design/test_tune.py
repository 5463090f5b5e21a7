"""kincheck tune, against an own double wishbone and another optimiser."""

import json
from dataclasses import replace
from types import SimpleNamespace

import kincheck
import msgspec
import numpy as np
import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.design.goals import parts_of, unit_in_table
from kincheck.core.extensions.design.least_move import least_move
from kincheck.core.extensions.design.new_table import NewTable
from kincheck.core.extensions.design.rods import with_rods
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.harness import run as running
from kincheck.core.harness.record import Outcome
from scipy.optimize import minimize

from ...support.examples import examples

(BAD_TEXTS,) = examples(__file__, "bad_texts")

DEG = np.pi / 180.0
TRAVEL = np.linspace(-0.03, 0.03, 7)
RODS = [
    ("uca_front", "uca_outer"),
    ("uca_rear", "uca_outer"),
    ("lca_front", "lca_outer"),
    ("lca_rear", "lca_outer"),
    ("tierod_inner", "tierod_outer"),
]
SAMPLE = {name: np.array(place) for name, place in TEMPLATES["double_wishbone"].sample.items()}
PLACES = ["tierod_inner y", "tierod_inner z", "tierod_outer z", "uca_outer z"]
GOALS = ["toe = 0 +- 0.02 deg", "camber at 30mm = -1.15 +- 0.02 deg"]
BOX = 0.015


def turned(w, x):
    """Turn vectors by rotation vectors, shape (..., 3) each (Rodrigues)."""
    angle = np.maximum(np.linalg.norm(w, axis=-1, keepdims=True), 1e-14)
    k = w / angle
    along = k * np.sum(k * x, axis=-1, keepdims=True)
    return along + np.cos(angle) * (x - along) + np.sin(angle) * np.cross(k, x)


def lengths(points):
    inner, outer = (np.array([points[rod[k]] for rod in RODS]) for k in (0, 1))
    return np.linalg.norm(outer - inner, axis=-1)


def poses(points, travel=TRAVEL, kept=None):
    """Return the displacement and the rotation vector of the knuckle at each travel, shape (n, 6):
    six equations by Newton's method.
    """
    center = points["wheel_center"]
    inner, outer = (np.array([points[rod[k]] for rod in RODS]) for k in (0, 1))
    rest = (lengths(points) if kept is None else kept) ** 2

    def rows(q):
        ends = center + q[..., None, :3] + turned(q[..., None, 3:], outer - center)
        off = np.sum((ends - inner) ** 2, axis=-1) - rest
        return np.concatenate([off, q[..., 2:3] - travel[:, None]], axis=-1)

    q, steps = np.zeros((len(travel), 6)), 1e-6 * np.eye(6)[:, None]
    for _ in range(30):
        slopes = np.moveaxis((rows(q + steps) - rows(q - steps)) / 2e-6, 0, -1)
        change = np.linalg.solve(slopes, rows(q)[..., None])[..., 0]
        q = q - change
        if np.abs(change).max() < 1e-13:
            break
    return q


def wheel(points):
    """Return toe and camber at each travel."""
    q = poses(points)
    x, y, z = turned(q[:, 3:], np.array([0.0, 1.0, 0.0])).T
    return np.arctan2(x, y), -np.arcsin(z)


def moved(offsets, places=PLACES):
    points = {name: place.copy() for name, place in SAMPLE.items()}
    for place, offset in zip(places, offsets, strict=True):
        name, axis = place.split()
        points[name]["xyz".index(axis)] += offset
    return points


def beyond(u):
    """Return the margins of all bands, over their half-widths; positive within."""
    toe, camber = wheel(moved(u * BOX))
    off = np.append(toe, camber[-1] + 1.15 * DEG) / (0.02 * DEG)
    return np.concatenate([1.0 - off, 1.0 + off])


def slopes_of(function, u, step=1e-4):
    ways = step * np.eye(len(u))
    return np.array([(function(u + e) - function(u - e)) / (2.0 * step) for e in ways]).T


def test_rates_have_units_of_table():
    """Slopes by travel are per metre, and slopes by load per kN."""
    case = replace(kincheck.load("four_bar"), length_unit="mm", angle_unit="deg")
    sizes = {"rad": "deg", "m": "mm", "rad/m": "deg/m", "rad/N": "deg/kN", "m/N": "mm/kN"}
    assert {si: unit_in_table(si, case).name for si in sizes} == sizes


@pytest.fixture
def car(tmp_path):
    lines = [f"{name},{','.join(repr(float(1e3 * x)) for x in at)}" for name, at in SAMPLE.items()]
    head = "# template: double_wishbone\n# units: mm\n# axes: forward,left,up\nname,x,y,z\n"
    file = tmp_path / "car.csv"
    file.write_text(head + "\n".join(lines) + "\n")
    return file


def tune(car, goals, *moves, more=()):
    """Return the exit status, the JSON and the path of the new table."""
    new, found = car.with_name("new.csv"), car.with_name("found.json")
    new.unlink(missing_ok=True)
    words = [word for goal in goals for word in ("--goal", goal)]
    words += [word for move in moves for word in ("--move", move)]
    files = ["--travel", "30mm:7", "--out", str(new), "--json", str(found)]
    status = main(["tune", str(car), *words, *files, *more])
    return status, json.loads(found.read_text()), new


@pytest.mark.parametrize("starts", [2, pytest.param(20, marks=pytest.mark.nightly)])
def test_tune_agrees_with_another_optimiser(car, starts):
    moves = "tierod_inner: y z +- 15mm", "tierod_outer, uca_outer: z +- 15 mm"
    status, found, new = tune(car, GOALS, *moves)
    assert status == 0
    assert found["checked_by"] in ("mujoco", "pinocchio", "exudyn", None)
    u = np.array([found["moves_m"][place] for place in PLACES]) / BOX
    assert beyond(u).min() > -1e-6
    ends = []
    random = np.random.default_rng(5)
    for start in [np.zeros(4), *random.uniform(-0.5, 0.5, (starts - 1, 4))]:
        end = minimize(
            lambda u: u @ u,
            start,
            jac=lambda u: 2.0 * u,
            bounds=[(-1.0, 1.0)] * 4,
            constraints={"type": "ineq", "fun": beyond, "jac": lambda u: slopes_of(beyond, u)},
            options={"ftol": 1e-14, "maxiter": 200},
        )
        if beyond(end.x).min() > -1e-8:
            ends.append(np.linalg.norm(end.x))
    assert found["norm"] == pytest.approx(min(ends), abs=1e-6)
    written = kincheck.curves(kincheck.load(new), ["tierod_inner z"], [[0.0]], ["toe"]).values[
        "toe"
    ]
    assert np.abs(written).max() <= 0.05 * DEG  # over a travel of 50 mm
    points = {each.name: np.array(each.position) for each in kincheck.load(new).hardpoints}
    for name, place in moved(u * BOX).items():
        assert points[name] == pytest.approx(place, abs=1e-11)


def test_tune_multiplier_is_slope_of_norm(car):
    move = "tierod_inner: y z +- 15 mm"
    norms = [tune(car, [f"toe = 0 +- {x} deg"], move)[1] for x in ("0.02", "0.0201")]
    slope = (norms[0]["norm"] - norms[1]["norm"]) / (0.0001 * DEG)
    assert norms[0]["bands"][0]["multiplier"] == pytest.approx(slope, rel=0.02)


def test_tune_small_box_is_unreachable(car, capsys):
    status, found, new = tune(car, GOALS[:1], "tierod_inner: z +- 15 mm")
    assert status == 0
    needed = abs(found["moves_m"]["tierod_inner z"])
    status, found, new = tune(car, GOALS[:1], f"tierod_inner: z +- {0.9e3 * needed:.6f} mm")
    assert (status, new.exists(), found["reached"], found["file"]) == (1, False, False, None)
    assert "not reached (not proved), forbidden by 'toe = 0 +- 0.02 deg'" in capsys.readouterr().out
    scan = np.linspace(-0.9 * needed, 0.9 * needed, 41)
    excess = [
        np.abs(wheel(moved([z], ["tierod_inner z"]))[0]).max() / (0.02 * DEG) - 1.0 for z in scan
    ]
    assert found["bands"][0]["excess"] == pytest.approx(min(excess), abs=1e-3)
    assert min(excess) > 0.0


def test_tune_box_ends_where_stated(car, capsys):
    status, found, _ = tune(car, GOALS[:1], "tierod_inner: z +5 -10 mm")
    assert status == 0
    move = found["moves_m"]["tierod_inner z"]
    assert found["norm"] == pytest.approx(abs(move) / 0.010)
    assert found["boxes_m"] == {"tierod_inner z": [-0.010, 0.005]}
    assert move < 0.0
    status, found, _ = tune(car, GOALS[:1], f"tierod_inner: z +15 -{0.9e3 * -move:.6f} mm")
    assert status == 1
    assert "  end of its box" in capsys.readouterr().out
    how = {"move": ["tierod_inner: z +5 -10 mm"], "supplied": kincheck.Supplied(travel="30mm:7")}
    tuned = kincheck.tune(car, goal=GOALS[:1], starts=1, **how)
    assert tuned.moves["tierod_inner z"] == pytest.approx(move, abs=1e-9)


def test_tune_keeps_points_clear(car):
    moves = "tierod_inner: y z +- 15mm", "tierod_outer: y z +- 15mm"
    middle, half = np.array([0.075, 0.575, 0.16]), np.array([0.01, 0.02, 0.05])
    box = "damper: 65:85 555:595 110:210 mm"

    def inside(found):
        points = moved([*found["moves_m"].values()], [*found["moves_m"]])
        q, center = poses(points), points["wheel_center"]
        ends = center + q[:, :3] + turned(q[:, 3:], points["tierod_outer"] - center)
        return (np.abs(ends - middle) / half).max(axis=1).min()

    status, near, _ = tune(car, GOALS[:1], *moves, more=["--starts", "1"])
    assert (status, inside(near) < 0.9) == (0, True)
    status, far, _ = tune(car, GOALS[:1], *moves, more=["--starts", "1", "--keep-clear", box])
    assert status == 0
    assert inside(far) == pytest.approx(1.0, abs=1e-6)
    assert far["norm"] > near["norm"]
    at = SAMPLE["tierod_outer"]
    around = " ".join(f"{1e3 * x - 20}:{1e3 * x + 20}" for x in at)
    words = ["--starts", "1", "--keep-clear", around]
    status, found, _ = tune(car, GOALS[:1], *moves, more=words)
    assert (status, around in found["forbidden_by"]) == (1, True)


def test_tune_disjoint_bands_are_proved_unreachable(car):
    status, found, _ = tune(car, [*GOALS, "toe at 10mm = 1 +- 0.9 deg"], "tierod_inner: y +- 1mm")
    assert (status, found["search"]) == (1, "proved")


def test_tune_axle_means_both_wheels(car):
    move, heave = "tierod_inner: y z +- 15mm", ["--axle", "heave", "--starts", "1"]
    _, one, _ = tune(car, GOALS[:1], move, more=heave[2:])
    status, both, _ = tune(car, GOALS[:1], move, more=heave)
    assert status == 0
    assert [each["output"] for each in both["bands"]] == ["left_toe", "right_toe"]
    assert both["moves_m"] == pytest.approx(one["moves_m"], abs=1e-8)


def test_tune_shims_meet_assembled_car(car):
    moves = (
        "tie_rod: length +- 9 mm",
        "uca_front, uca_rear: shim y +- 15 mm",
        "tierod_inner: shim z +- 9 mm",
        "lca_outer: z +- 40 mm",
    )
    goals = ["toe = 0.1 +- 0.05 deg", "camber at 0mm = -1 +- 0.01 deg"]
    status, found, new = tune(car, goals, *moves, more=["--starts", "1"])
    assert status == 0
    by = found["moves_m"]
    assert min(abs(by["tie_rod: length"]), abs(by["lca_outer z"])) > 1e-4
    shims = {each.replace(": shim", ""): move for each, move in by.items() if ": shim" in each}
    table = moved([by["lca_outer z"]], ["lca_outer z"])
    kept = lengths(table) + by["tie_rod: length"] * np.array([0, 0, 0, 0, 1])
    for place, offset in shims.items():
        name, axis = place.split()
        table[name]["xyz".index(axis)] += offset
    q, center = poses(table, kept=kept), table["wheel_center"]
    x, y, z = turned(q[:, 3:], np.array([0.0, 1.0, 0.0])).T
    toe, camber = np.arctan2(x, y), -np.arcsin(z)
    assert np.abs(toe / DEG - 0.1).max() == pytest.approx(0.05, abs=1e-6)
    assert camber[3] / DEG == pytest.approx(-0.99, abs=1e-6)
    written = kincheck.load(new, kincheck.Supplied(travel="30mm:7"))
    curves = kincheck.curves(written, ["tierod_inner z"], [[0.0]], ["toe", "camber"]).values
    assert curves["toe"][0] == pytest.approx(toe, abs=1e-10)
    assert curves["camber"][0] == pytest.approx(camber, abs=1e-10)
    points = {each.name: np.array(each.position) for each in written.hardpoints}
    for name in ("uca_outer", "lca_outer", "tierod_outer", "wheel_center", "wheel_contact"):
        place = center + q[3, :3] + turned(q[3, 3:], table[name] - center)
        assert points[name] == pytest.approx(place, abs=1e-11)
    assert points["uca_front"] == pytest.approx(table["uca_front"], abs=1e-11)


@pytest.mark.parametrize(
    "template",
    [
        pytest.param(name, marks=pytest.mark.nightly if name != "mcpherson" else ())
        for name in TEMPLATES
        if name != "semi_trailing_arm"
    ],
)
def test_tune_table_of_assembled_car(car, template):
    """All outputs but those that count from design."""
    head, _ = car.read_text().split("name,x,y,z")
    sample = TEMPLATES[template].sample.items()
    lines = [f"{name},{','.join(repr(float(1e3 * x)) for x in at)}" for name, at in sample]
    head = head.replace("double_wishbone", template)
    car.write_text(head + "\n".join(["name,x,y,z", *lines, ""]))
    command = SimpleNamespace(case=car, supplied=kincheck.Supplied(travel="10mm:3", axle="heave"))
    old = kincheck.load(car, command.supplied)
    parts, random = parts_of(old), np.random.default_rng(1)
    places = [f"{rod}: length" for rod in parts.rods]
    places += [f"{row}: shim {axis}" for row in {*parts.ends.values()} for axis in "xyz"]
    moves = dict(zip(places, random.uniform(-1e-3, 1e-3, len(places)).tolist(), strict=True))
    new = NewTable.of(command, old, moves).case
    kept, names = with_rods(old, places)
    assembled = kincheck.curves(kept, names, [[*moves.values()]]).values
    written = kincheck.curves(new, ["wheel_center z"], [[0.0]]).values
    off = {name: np.abs(assembled[name] - each).max() for name, each in written.items()}
    from_design = {each for each in off if each.endswith(("half_track_change", "rocker_twist"))}
    assert {name for name, each in off.items() if each > 1e-9} == from_design


@pytest.mark.parametrize(
    ("goal", "moves", "message"),
    [
        (GOALS[0], ["tie_rd: length +- 1 mm"], "did you mean 'tie_rod'?"),
        (GOALS[0], ["lca_front: shim y +- 1 mm"], "no end of a rod or bare arm 'lca_front'"),
        (
            GOALS[0],
            ["tie_rod: length +- 1 mm", "tierod_inner: y +- 1 mm"],
            "tierod_inner y: tie_rod keeps its length by another move",
        ),
        (
            "half_track_change = 0 +- 9 mm",
            ["tie_rod: length +- 1 mm"],
            "half_track_change counts from design",
        ),
    ],
)
def test_tune_unfit_rods_are_refused(car, capsys, goal, moves, message):
    words = [word for move in moves for word in ("--move", move)]
    assert main(["tune", str(car), "--goal", goal, *words]) == 2
    assert message in capsys.readouterr().err


def test_tune_rod_without_assembly_is_refused(car):
    command = SimpleNamespace(case=car, supplied=kincheck.Supplied())
    with pytest.raises(kincheck.KincheckError, match="does not come together at design"):
        NewTable.of(command, kincheck.load(car), {"tie_rod: length": 0.4})


def test_tune_search_stops_before_lock_up():
    def bands(u):
        return (1.8 - u, -np.eye(1)) if u[0] < 0.5 else None

    found = least_move(bands, np.zeros(1), np.array([-1.0]), np.array([1.0]))
    assert found.moves == pytest.approx([0.5], abs=1e-6)
    assert not found.held
    assert found.excess == pytest.approx(0.3, abs=1e-6)


def test_tune_follows_measured_curve(car):
    offset = [0.003, -0.004]
    places = ["tierod_inner y", "tierod_inner z"]
    curve = zip(TRAVEL, wheel(moved(offset, places))[0], strict=True)
    rig = car.with_name("rig.csv")
    rows = [f"{float(1e3 * z)!r},{float(toe / DEG)!r}" for z, toe in curve]
    rig.write_text("stroke [mm],toe [deg]\n" + "\n".join(rows) + "\n")
    status, found, _ = tune(car, [f"toe = {rig} +- 0.0001 deg"], "tierod_inner: y z +- 15 mm")
    assert status == 0
    assert found["norm"] <= np.linalg.norm(offset) / BOX
    assert [found["moves_m"][each] for each in places] == pytest.approx(offset, abs=2e-4)


@pytest.mark.parametrize(("goal", "move", "message"), BAD_TEXTS)
def test_tune_bad_text_is_refused(car, capsys, goal, move, message):
    assert main(["tune", str(car), "--goal", goal, "--move", move]) == 2
    assert message in capsys.readouterr().err


def test_tune_contradicted_table_is_refused(car, monkeypatch, capsys):
    pytest.importorskip("mujoco")
    honest = running.run

    def contradicting(cases, engines, **how):
        found = honest(cases, engines, **how)
        if engines[0].name == "native":
            return found
        fail = {"outcome": Outcome.FAIL, "message": "toe is off"}
        records = [msgspec.structs.replace(each, **fail) for each in found.records]
        return msgspec.structs.replace(found, records=records)

    monkeypatch.setattr(running, "run", contradicting)
    new = car.with_name("new.csv")
    words = ["--goal", GOALS[0], "--move", "tierod_inner: +- 15 mm", "--out", str(new)]
    assert main(["tune", str(car), *words]) == 2
    assert "mujoco does not confirm the new table (fail: toe is off)" in capsys.readouterr().err
    assert not new.exists()


def test_tune_locked_travel_is_refused(car, capsys):
    words = ["--goal", GOALS[0], "--move", "tierod_inner: y +- 1 mm", "--travel", "600mm:61"]
    assert main(["tune", str(car), *words]) == 2
    assert "does not reach its whole travel" in capsys.readouterr().err


def test_tune_bad_clear_box_is_refused(car, capsys):
    words = ["--goal", GOALS[0], "--move", "tierod_inner: y +- 1 mm", "--keep-clear", "1:2 3:4 mm"]
    assert main(["tune", str(car), *words]) == 2
    assert "expected the ends of a box along x, y and z" in capsys.readouterr().err


def test_tune_existing_file_stays(car, capsys):
    words = ["--goal", GOALS[0], "--move", "tierod_inner: y +- 1 mm", "--out", str(car)]
    before = car.read_text()
    assert main(["tune", str(car), *words]) == 2
    assert "the file exists and stays" in capsys.readouterr().err
    assert car.read_text() == before
