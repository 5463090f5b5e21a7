"""kincheck fit, against tables that are known: rigs with noise, planted slips and offsets."""

import json
from dataclasses import replace
from pathlib import Path

import kincheck
import numpy as np
import pytest
from kincheck.core.case.io.reader_options import CurveOptions
from kincheck.core.cli.main import main, registry
from kincheck.core.extensions.compliance.study import compliance
from kincheck.core.extensions.design import rubber
from kincheck.core.extensions.design.fit import NORMAL, fit_rig, predictions
from kincheck.core.extensions.design.likely import most_likely
from kincheck.core.extensions.design.rig import read_rig
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

from ...support.examples import examples

BAD_OPTIONS, RUBBER, SLIDES = examples(__file__, "bad_options", "rubber", "slides")

DEG = np.pi / 180.0
NOISE = {"toe": 0.005 * DEG, "camber": 0.01 * DEG, "half_track_change": 5e-5}
SIZES = {"toe": ("deg", DEG), "camber": ("deg", DEG), "half_track_change": ("mm", 1e-3)}
ACCURACY = ["toe=0.005 deg", "camber=0.01 deg", "half_track_change=0.05 mm"]
TRAVEL = np.linspace(-0.05, 0.05, 21)
DRAWING = 2e-3
WHEEL = ("wheel_", "spring_", "damper_")


def table(folder, template):
    file = folder / f"{template}.csv"
    rows = TEMPLATES[template].sample.items()
    lines = [f"{name},{','.join(repr(float(1e3 * x)) for x in at)}" for name, at in rows]
    head = f"# template: {template}\n# units: mm\n# axes: forward,left,up\nname,x,y,z\n"
    file.write_text(head + "\n".join(lines) + "\n")
    return file


def measured(case, moves, random, travel=TRAVEL):
    """Return the outputs of a table with moves at the travels, with noise [SI]."""
    case = replace(case, sweep=replace(case.sweep, values=travel))
    found = kincheck.curves(case, [*moves], [[*moves.values()]], [*NOISE])
    return {
        name: found.values[name][0] + random.normal(size=len(travel)) * noise
        for name, noise in NOISE.items()
    }


def rig_file(path, values, travel=TRAVEL, decimals=5):
    heads = ",".join(f"{name} [{SIZES[name][0]}]" for name in values)
    columns = [1e3 * travel, *(each / SIZES[name][1] for name, each in values.items())]
    rows = [",".join(f"{x:.{decimals}f}" for x in row) for row in np.column_stack(columns)]
    path.write_text(f"# signs: iso8855\nstroke [mm],{heads}\n" + "\n".join(rows) + "\n")
    return path


def guiding(case):
    """Return the coordinates of the points that guide the wheel."""
    names = [each.name for each in case.hardpoints if not each.name.startswith(WHEEL)]
    return [f"{name} {axis}" for name in names for axis in "xyz"]


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Return a table, the moves of another, and what a rig measured of that."""
    folder = tmp_path_factory.mktemp("bench")
    file, random = table(folder, "double_wishbone"), np.random.default_rng(4)
    case = kincheck.load(file)
    moves = {place: DRAWING * random.normal() for place in guiding(case)}
    values = measured(case, moves, random)
    rig = read_rig(case, rig_file(folder / "rig.csv", values), CurveOptions(accuracy=ACCURACY))
    return file, moves, values, rig


def planted(rig, change):
    """Return a rig with other numbers: change(output, travel, numbers)."""
    goals = [
        replace(goal, middle=change(goal.output, rig.case.sweep.values[goal.at], goal.middle))
        for goal in rig.goals
    ]
    return replace(rig, goals=goals)


def names(found):
    return [each.name for each in found]


def test_fit_intervals_hold_known_table(bench):
    _, moves, _, rig = bench
    found = fit_rig(rig, dict.fromkeys(moves, DRAWING))
    assert found.verdict == "fits, others too"
    off = [
        abs(found.moves[place] - move) / found.deviations[place] for place, move in moves.items()
    ]
    assert np.mean(np.array(off) < NORMAL) > 0.8
    assert {"toe negated"} <= {*names(found.slips)}
    assert {"camber scale"} <= {*names(found.loose)}
    roll = found.predictions["roll_center_height"]
    assert roll.source == "from the rig"
    assert (roll.spread < 0.1 * roll.drawing).all()
    assert found.predictions["caster"].source == "from the drawing"
    assert max(found.deviations.values()) <= DRAWING


@pytest.mark.parametrize(
    ("name", "change", "size"),
    [
        ("toe zero", lambda o, t, x: x + 0.05 * DEG * (o == "toe"), 0.05 * DEG),
        pytest.param(
            "camber at 25 mm",
            lambda o, t, x: x - 0.1 * DEG * (o == "camber") * (t == 0.025),
            None,
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_fit_planted_offset_is_named(bench, name, change, size):
    _, moves, _, rig = bench
    found = fit_rig(planted(rig, change), dict.fromkeys(moves, DRAWING))
    assert found.verdict == "does not fit"
    (shift,) = found.found
    assert shift.name == name
    assert shift.size == pytest.approx(size or -0.1 * DEG, abs=4.0 * shift.deviation)
    assert found.estimate.probability > 0.01
    if size:
        assert fit_rig(planted(rig, change), found.boxes, [name]).verdict == "fits, others too"


def test_fit_planted_travel_zero_is_named(bench):
    file, moves, _, rig = bench
    values = measured(kincheck.load(file), moves, np.random.default_rng(5), TRAVEL - 1e-3)
    found = fit_rig(planted(rig, lambda o, t, x: values[o]), dict.fromkeys(moves, DRAWING))
    assert names(found.found) == ["travel zero"]
    assert found.found[0].size == pytest.approx(1e-3, abs=3e-4)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("half_track_change times 25.4", lambda o, x: x / 25.4 if o[0] == "h" else x),
        pytest.param(
            "camber negated", lambda o, x: -x if o == "camber" else x, marks=pytest.mark.nightly
        ),
        pytest.param("travel negated", lambda o, x: x[::-1], marks=pytest.mark.nightly),
    ],
)
def test_fit_planted_slip_is_named(bench, name, change):
    _, moves, _, rig = bench
    found = fit_rig(planted(rig, lambda o, t, x: change(o, x)), dict.fromkeys(moves, DRAWING))
    assert found.verdict == "does not fit"
    assert found.slips[0].name == name


def test_fit_absorbed_slip_is_named(bench):
    _, moves, _, rig = bench
    change = lambda o, t, x: -x if o == "toe" else x  # noqa: E731
    found = fit_rig(planted(rig, change), dict.fromkeys(moves, DRAWING))
    assert found.verdict == "fits, others too"
    assert "toe negated" in names(found.slips)


def test_fit_few_moves_leave_no_slip(bench):
    file, _, _, rig = bench
    moves, drawing = {"tierod_inner y": 1e-4, "uca_outer z": -2e-4}, 2e-4
    values = measured(kincheck.load(file), moves, np.random.default_rng(6))
    found = fit_rig(planted(rig, lambda o, t, x: values[o]), dict.fromkeys(moves, drawing))
    assert (found.verdict, found.slips, found.null) == ("fits", [], [])
    for place, move in moves.items():
        assert found.moves[place] == pytest.approx(move, abs=3.0 * found.deviations[place])
    assert found.combinations[0].source == "from the rig"


@pytest.mark.by_day(5)
@pytest.mark.parametrize("template", SLIDES)
def test_fit_null_directions_are_exact(tmp_path, template):
    case = kincheck.load(table(tmp_path, template))
    random = np.random.default_rng(7)
    moves = {place: 1e-3 * random.normal() for place in guiding(case)}
    file = rig_file(tmp_path / "rig.csv", measured(case, moves, random))
    rig = read_rig(case, file, CurveOptions(accuracy=ACCURACY))
    free = [*SLIDES[template]]
    assert fit_rig(rig, dict.fromkeys(moves, 1e-3)).null == free
    # with the wheel's centre the whole may move, but along x, where travel and camber are the same
    whole = moves | dict.fromkeys([f"wheel_center {axis}" for axis in "xyz"], 0.0)
    whole |= dict.fromkeys([f"wheel_contact {axis}" for axis in "xyz"], 0.0)
    null = fit_rig(rig, dict.fromkeys(whole, 1e-3)).null
    assert {*free} < {*null}
    assert {f"all points together along {axis}" for axis in "xyz"} < {*null}


@pytest.mark.parametrize("count", [pytest.param(12), pytest.param(200, marks=pytest.mark.nightly)])
def test_fit_intervals_hold_their_share(bench, count):
    _, moves, _, rig = bench
    random, places = np.random.default_rng(count), [*moves]
    held, told, alarms = [], [], 0
    for _ in range(count):
        truth = dict(zip(places, DRAWING * random.normal(size=len(places)), strict=True))
        values = measured(rig.case, truth, random)
        one = planted(rig, lambda o, t, x, values=values: values[o])
        model = one.model(dict.fromkeys(places, DRAWING))
        found = most_likely(model, np.zeros(len(places)), np.empty((one.count, 0)))
        spread = DRAWING * np.sqrt(np.diag(found.covariance))
        held.append(np.abs(DRAWING * found.u - [*truth.values()]) < NORMAL * spread)
        alarms += found.probability < 0.01
        predicted = predictions(model, found)
        right = kincheck.curves(rig.case, places, [[*truth.values()]], [*predicted]).values
        told += [
            np.abs(each.values - right[name][0]) < NORMAL * each.spread
            for name, each in predicted.items()
        ]
    shares = np.mean(held), np.mean(np.concatenate(told))
    low, high = (0.93, 0.97) if count == 200 else (0.9, 1.0)
    assert low < shares[0] < high
    assert low < shares[1] < high
    assert alarms <= max(1, 0.03 * count)


def test_fit_command_writes_table(bench, tmp_path, capsys):
    file, _, values, _ = bench
    rig = rig_file(tmp_path / "rig.csv", values)
    new, answer, page = (tmp_path / name for name in ("new.csv", "fit.json", "fit.html"))
    words = ["fit", str(file), "--measured", str(rig), "--move", "tierod_inner, uca_outer: y z"]
    words += ["--move", "lca_outer: z +- 1 mm", "--drawing", "+- 2 mm", "--free", "toe zero"]
    for each in ACCURACY:
        words += ["--accuracy", each]
    status = main([*words, "--out", str(new), "--json", str(answer), "--page", str(page)])
    found = json.loads(answer.read_text())
    shown = capsys.readouterr().out
    assert status == (1 if found["verdict"] == "does not fit" else 0)
    assert new.exists() == (status == 0)
    assert len(found["directions"]) == len(found["coordinates"]) == 5
    assert found["coordinates"]["lca_outer z"]["drawing"] == pytest.approx(1e-3)
    assert found["null"] == 0
    assert "roll_center_height" in found["predictions"]
    assert found["verdict"].split(",")[0] in shown
    assert 'data-scene="moves"' in page.read_text()


def test_fit_written_table_gives_curves(bench, tmp_path, capsys):
    file, moves, values, _ = bench
    rig = rig_file(tmp_path / "rig.csv", values, decimals=3)
    new = tmp_path / "new.csv"
    points = ", ".join(dict.fromkeys(place.split()[0] for place in moves))
    words = ["--measured", str(rig), "--move", f"{points}:", "--out", str(new)]
    assert main(["fit", str(file), *words]) == 0  # the noise of the samples is not stated
    assert "scatter of its samples" in capsys.readouterr().out
    case = kincheck.load(new)
    case = replace(case, sweep=replace(case.sweep, values=TRAVEL))
    found = kincheck.curves(case, ["tierod_inner y"], [[0.0]], [*NOISE]).values
    for name, noise in NOISE.items():
        assert np.sqrt(np.mean((found[name][0] - values[name]) ** 2)) < 1.5 * noise


@pytest.mark.nightly
def test_fit_right_wheel_is_mirrored(bench, tmp_path):
    file, _, values, _ = bench
    rig = rig_file(tmp_path / "rig.csv", values)
    lines = file.read_text().replace("# units", "# side: right\n# units").splitlines()
    cells = [line.split(",") for line in lines]
    rows = [c if len(c) != 4 or c[0] == "name" else [*c[:2], f"-{c[2]}", c[3]] for c in cells]
    right = tmp_path / "right.csv"
    right.write_text("\n".join(map(",".join, rows)) + "\n")
    how = {"measured": rig, "move": ["tierod_inner, uca_outer: y z"]}
    left, other = (kincheck.fit(each, **how).moves for each in (file, right))
    for place, move in left.items():
        assert other[place] == pytest.approx(-move if place.endswith("y") else move, abs=1e-6)


def test_fit_reads_german_rig(tmp_path, capsys):
    file = table(tmp_path, "double_wishbone")
    rig = tmp_path / "pruefstand.csv"
    rows = "\n".join(f"{z:.1f};{-0.008 * z:.3f};{-0.03 * z:.3f};4000,0" for z in range(-40, 45, 10))
    head = "Pruefstand K&C;Lauf 17\n\nEinfederung [mm];Vorspur [°];Sturz [°];Radlast [N]\n"
    rig.write_bytes((head + rows.replace(".", ",") + "\n").encode("cp1252"))
    words = ["--measured", str(rig), "--move", "tierod_inner, uca_outer: y z"]
    assert main(["fit", str(file), *words]) in (0, 1)
    out = capsys.readouterr().out
    assert "left out the columns 'Radlast [N]'" in out
    assert "18 numbers of toe, camber" in out


@pytest.mark.parametrize(("words", "message"), BAD_OPTIONS)
def test_fit_bad_option_is_refused(bench, capsys, words, message):
    file = bench[0]
    rig = file.with_name("rig.csv")
    assert main(["fit", str(file), "--measured", str(rig), *words]) == 2
    assert message in capsys.readouterr().err


def test_fit_travel_beyond_lock_is_refused(bench, tmp_path, capsys):
    values = {"toe": np.zeros(3)}
    rig = rig_file(tmp_path / "far.csv", values, np.array([-0.5, 0.0, 0.5]))
    assert main(["fit", str(bench[0]), "--measured", str(rig)]) == 2
    assert "leave out the rows of the rig beyond it" in capsys.readouterr().err
    assert main(["fit", str(bench[0]), "--measured", str(Path("no.csv"))]) == 2


RATES = {"uca_rear x": 0.2, "lca_front y": -0.3}
COMPLIANCE = {"toe": "lateral", "camber": "lateral", "wheel_center.y": "braking"}


def on_bushings(table, file, text, count):
    """Return a table on bushings, with few samples."""
    file.write_text(text)
    supplied = kincheck.Supplied(travel=f"30mm:{count}", bushings=file)
    return registry().find_case(table, supplied, driven=False)


def test_rates_equal_written_bushings(tmp_path):
    car, file = table(tmp_path, "double_wishbone"), tmp_path / "rubber.toml"
    case = rubber.on_rubber(on_bushings(car, file, RUBBER, 2))
    names = [f"{name}.per_{load}_force" for name, load in COMPLIANCE.items()]
    curves = rubber.rubber_curves(case, [*RATES], [[*RATES.values()]], names)
    assert curves.solved.all()  # without a spring, too
    found = curves.values
    new = on_bushings(car, tmp_path / "new.toml", rubber.new_bushings(file, case, RATES), 2)
    assert [each.stiffness for each in new.mechanism.bushings[:2]] == [
        pytest.approx((1e6 * np.exp(0.2), 2e6, 1e6)),
        pytest.approx((3e6, 3e6 * np.exp(-0.3), 3e6)),
    ]
    right = compliance(new, new.sweep.change).travel.outputs
    for name in names:
        assert found[name][0] == pytest.approx(right[name].values, rel=1e-9)


@pytest.mark.nightly
def test_fit_finds_rates_of_bushings(tmp_path, capsys):
    car, file = table(tmp_path, "double_wishbone"), tmp_path / "rubber.toml"
    case, random = on_bushings(car, file, RUBBER, 9), np.random.default_rng(8)
    text = rubber.new_bushings(file, case, RATES)
    true = on_bushings(car, tmp_path / "true.toml", text, 9)
    outputs, columns = compliance(true, true.sweep.change).travel.outputs, []
    words, heads = ["--move", "uca_rear: x", "--move", "lca_front: y +- 40 %"], ["stroke [mm]"]
    for name, load in COMPLIANCE.items():
        output, unit = f"{name}.per_{load}_force", "mm/kN" if "center" in name else "deg/kN"
        size = 1e-6 if "center" in name else DEG * 1e-3
        values = outputs[output].values / size
        noise = 1e-3 * np.abs(values).max()
        columns.append(values + noise * random.normal(size=len(values)))
        heads.append(f"{output} [{unit}]")
        words += ["--accuracy", f"{output}={noise} {unit}"]
    rows = np.column_stack([1e3 * case.sweep.change, *columns]).tolist()
    lines = [",".join(f"{x:.7f}" for x in row) for row in rows]
    rig, new, answer = (tmp_path / name for name in ("rig.csv", "new.toml", "fit.json"))
    rig.write_text("# signs: iso8855\n" + "\n".join([",".join(heads), *lines]) + "\n")
    words += ["--travel", "30mm:9", "--bushings", str(file), "--measured", str(rig)]
    assert main(["fit", str(car), *words, "--out", str(new), "--json", str(answer)]) == 0
    found = json.loads(answer.read_text())["coordinates"]
    for place, rate in RATES.items():
        assert found[place]["value"] == pytest.approx(rate, abs=3.0 * found[place]["deviation"])
        assert found[place]["deviation"] < 0.1 * found[place]["drawing"]
    assert "uca_rear" in new.read_text()
