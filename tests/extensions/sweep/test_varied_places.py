"""Rows of a hardpoint table in studies and in explain: as if each were moved in the table."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import CaseError
from kincheck.core.case.case import HELD_BUT
from kincheck.core.case.io.case_file import case_text
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.explain.diagnose import diagnose
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.sweep.study import Ready, Study
from kincheck.core.extensions.sweep.variation_file import read_variation
from kincheck.core.extensions.sweep.varied_places import Geometry
from kincheck.core.kinematics import placed

from ...support.examples import examples
from ...support.rods_of_templates import solved
from ...support.variations import moved, vary, vary_file

(FAULTS,) = examples(__file__, "faults")

CAR = {"cg_height": "0.5", "wheelbase": "2.6", "brake_share": "0.6", "position": "front"}
CORNER = Supplied(travel="0.04:3", **CAR)
# Round-off of a Newton step and of products of metre-sized numbers; quotients by the travel lose a
# digit, and those of small steer angles two.
CLOSE = 1e-13
# Round-off of a difference over a step of 2e-4 of a metre, over the largest derivative.
ACCURATE = 1e-8
STEP = 2e-4
"""Step of differences [m or rad]."""
AXIS = ["wheel_axis", "0.4", "860", "308"]
"""A wheel with toe and camber at design: a point of its axis of rotation [mm]."""


def rows_of(name, *, wheel=True):
    """The rows of the sample table, with all optional points, or without those of the wheel."""
    text = "".join(
        line for line in io.StringIO(sample_table(TEMPLATES[name])) if not line.startswith("#")
    )
    _, *rows = csv.reader(io.StringIO(text))
    found = [row[:4] for row in rows] + [AXIS]
    return [row for row in found if wheel or row[0] not in ("wheel_axis", "wheel_contact")]


def table(folder, name, rows, axes="forward,left,up"):
    file = folder / f"{name}.csv"
    head = f"# template: {name}\n# units: mm\n# axes: {axes}\nname,x,y,z\n"
    file.write_text(head + "\n".join(map(",".join, rows)) + "\n")
    return file


def mcpherson(folder):
    return load(table(folder, "mcpherson", rows_of("mcpherson")), CORNER)


def case_of(file, supplied):
    """The case of a table, with the outputs that studies reduce."""
    case = load(file, supplied)
    few = tuple(output for output in case.outputs if HELD_BUT not in output.facts)
    return replace(case, outputs=few)


def study_of(folder, case):
    """A study in which all that varies by itself varies."""
    names = [each.name for each in Geometry(case).variables if each.moves]
    points = {name: {"at": name, "sigma": 1.0} for name in names}
    path = vary_file(folder, points)
    return Ready.of(Study(case, read_variation(path, case), 1, 0))


def tables(name):
    """Rows and options: a wheel with its points, and an axle with wheels of a given radius."""
    axle = "steer" if TEMPLATES[name].steered else "heave"
    yield rows_of(name), CORNER
    yield rows_of(name, wheel=False), replace(CORNER, axle=axle, wheel_radius="0.3")


RIGHT = [[name, x, f"-{y}", z] for name, x, y, z in rows_of("mcpherson")]
CASES = {
    f"{name} {what}": (name, *each)
    for name in TEMPLATES
    for what, each in zip(("corner", "axle"), tables(name), strict=True)
} | {"mcpherson right": ("mcpherson", RIGHT, CORNER)}


@pytest.mark.by_day(9)
@pytest.mark.parametrize("key", CASES)
def test_variant_of_row_equals_moved_table(tmp_path, key):
    """Every row of every template, moved by a millimetre and more along the axes of the table."""
    name, rows, supplied = CASES[key]
    move = (1.0, -1.3, 0.7)
    ready = study_of(tmp_path, case_of(table(tmp_path, name, rows), supplied))
    names = [each.name for each in ready.study.variation.coordinates]
    moved_rows = [row for row in rows if f"{row[0]}.x" in names]
    assert {row[0] for row in rows} - {row[0] for row in moved_rows} <= {"damper_lower"}
    offsets = [
        [1e-3 * move["xyz".index(axis)] * (row[0] == owner) for row in moved_rows]
        for owner, axis in (each.split(".") for each in names)
    ]
    values, reached, _, _ = ready.values(np.array(offsets))
    assert reached.all()
    for k, row in enumerate(moved_rows):
        there = [row[0], *(repr(float(x) + dx) for x, dx in zip(row[1:], move, strict=True))]
        changed = [there if each is row else each for each in rows]
        again = solved(case_of(table(tmp_path, name, changed), supplied))
        for own, (output, expected) in zip(values[:, :, k], again.items(), strict=True):
            np.testing.assert_allclose(own, expected, rtol=CLOSE, atol=CLOSE, err_msg=output)


def differences(ready):
    """Richardson's differences of the variants of a study, shape (coordinates, rows, n)."""
    count = len(ready.study.variation.coordinates)
    steps = [np.eye(count) * STEP * share for share in (1.0, -1.0, 0.5, -0.5)]
    plus, minus, half_plus, half_minus = np.split(
        ready.values(np.concatenate(steps, axis=1))[0], 4, axis=2
    )
    found = (8.0 * (half_plus - half_minus) - plus + minus) / (6.0 * STEP)
    return np.moveaxis(found, -1, 0)


def compared(ready):
    """The sensitivities of explain against differences of variants, over the largest."""
    study = ready.study
    found = diagnose(study.case, samples=3, tol=1e-12)
    values = study.case.sweep.values
    samples = [int(np.abs(values - each.value).argmin()) for each in found.samples]
    known = {(each.output, each.number): each.by_sample for each in found.sensitivities}
    whole = differences(ready)
    along = whole[:, :, samples]
    names = [each.name for each in study.variation.coordinates]
    for r, row in enumerate(study.rows):
        if row.output.forces:
            continue
        largest = np.nanmax(np.abs(whole[:, r]))
        for k, name in enumerate(names):
            number = name if name.endswith(".length") else " ".join(name.rsplit(".", 1))
            without = np.where(np.isnan(along[k, r]), np.nan, 0.0)
            theirs = np.array(known.pop((row.name, number), without), dtype=float)
            unlike = np.isnan(along[k, r]) != np.isnan(theirs)
            off = np.where(unlike, np.inf, np.nan_to_num(np.abs(along[k, r] - theirs)))
            yield row.name, number, off.max() / (largest or 1.0)
    assert not known


@pytest.mark.by_day(9)
@pytest.mark.parametrize("key", CASES)
def test_explain_of_table_equals_gradients(tmp_path, key):
    name, rows, supplied = CASES[key]
    case = case_of(table(tmp_path, name, rows), supplied)
    assert [each for each in compared(study_of(tmp_path, case)) if each[2] > ACCURATE] == []


SUSPENSIONS = [name for name in cases.names() if name.startswith(("mcpherson", "chrono"))]


@pytest.mark.by_day(6)
@pytest.mark.parametrize("name", SUSPENSIONS)
def test_explain_of_suspension_equals_gradients(tmp_path, name):
    """Positions at one point move together in both, with the markers of the wheel."""
    case = cases.load(name)
    assert [each for each in compared(study_of(tmp_path, case)) if each[2] > ACCURATE] == []


def test_row_moves_follow_table_axes(tmp_path):
    """With x to the right, y up and z rearward."""
    rows = [
        [name, *(repr(sign * float(at[k])) for k, sign in ((1, -1.0), (2, 1.0), (0, -1.0)))]
        for name, *at in rows_of("mcpherson")
    ]
    case = load(table(tmp_path, "mcpherson", rows, "right,up,rearward"), CORNER)
    variation = vary(tmp_path, case, ball={"at": "lca_outer", "sigma": 1.0})
    place, move = "joints.lower_ball.point", np.array([1e-3, 2e-3, 3e-3])
    found = moved(variation, ball__x=move[0], ball__y=move[1], ball__z=move[2])
    assert [*found[place]] == pytest.approx([-3e-3, -1e-3, 2e-3], abs=1e-15)
    (there,) = case.geometry({"lca_outer": [move]})[place]
    np.testing.assert_allclose(
        there, np.add(case.mechanism.joint("lower_ball").point, found[place])
    )
    iso = mcpherson(tmp_path)
    by_number = [
        {
            each.number: each.by_sample
            for each in diagnose(one, samples=3, tol=1e-12).sensitivities
            if each.output == "toe"
        }
        for one in (case, iso)
    ]
    assert by_number[0]["lca_outer x"] == pytest.approx([-x for x in by_number[1]["lca_outer y"]])
    assert by_number[0]["lca_outer y"] == pytest.approx(by_number[1]["lca_outer z"])


@pytest.mark.parametrize("at", ["lca_outer", "lower_ball", "joints.lower_ball.point", "Kugel"])
def test_row_by_role_joint_or_place(tmp_path, at):
    """The user's own name of the row, its role, and the names of places as before."""
    rows = [
        ["Kugel" if row[0] == "lca_outer" else row[0], *row[1:]] for row in rows_of("mcpherson")
    ]
    names = tmp_path / "names.toml"
    names.write_text('lca_outer = "Kugel"\n')
    case = load(table(tmp_path, "mcpherson", rows), replace(CORNER, names=names))
    found = vary(tmp_path, case, ball={"at": at, "sigma": [1.0, 0, 0]})
    assert set(found.places) == {"joints.lower_ball.point", "points.lca_outer.position"}
    numbers = {each.number for each in diagnose(case, samples=1, tol=1e-12).sensitivities}
    assert {"Kugel x", "lca_front z"} <= numbers
    assert not any("." in number for number in numbers)


@pytest.mark.parametrize(("points", "message"), FAULTS)
def test_invalid_row_is_refused(tmp_path, points, message):
    rows = [*rows_of("double_wishbone"), ["damper_lower", "0", "450", "130"]]
    case = load(table(tmp_path, "double_wishbone", rows), CORNER)
    with pytest.raises(CaseError) as caught:
        vary(tmp_path, case, **points)
    assert message in str(caught.value)


def test_sensitivities_of_table_name_rows(tmp_path, capsys):
    """Toe by the wheel centre was 1000 times too large: the wheel's axis stayed behind."""
    text = sample_table(TEMPLATES["mcpherson"])
    file, out = tmp_path / "car.csv", tmp_path / "found.json"
    file.write_text(text)
    assert main(f"explain {file} --samples 5 --json {out}".split()) == 0
    found = json.loads(out.read_text())
    by_number = {
        (each["output"], each["number"]): each
        for each in found["sensitivities"]
        if each["output"] in ("toe", "caster")
    }
    by_center = by_number["toe", "wheel_center x"]
    assert by_center["unit"] == "rad/m"
    assert len(by_center["by_sample"]) == 5
    assert max(map(abs, by_center["by_sample"])) == pytest.approx(0.004, abs=2e-3)
    assert max(map(abs, by_number["caster", "lca_outer x"]["by_sample"])) == pytest.approx(
        1.557, abs=1e-3
    )
    assert found["moves"]["lca_front"] == ["joints.lca_pivot.axis"]
    assert "lca_outer x" in capsys.readouterr().out


def test_explain_names_coincident_places(capsys):
    assert main("explain mcpherson_suspension --samples 1".split()) == 0
    told = capsys.readouterr().out
    assert "moved together: joints.ball.point = points.lower_ball.position, " in told


def test_case_file_of_table_keeps_wheel(tmp_path):
    """The radius and the axis of rotation follow their points in a case file too."""
    case = mcpherson(tmp_path)
    file = tmp_path / "case.toml"
    file.write_text(case_text(case))
    again = load(file)
    assert (again.mechanism, again.outputs) == (case.mechanism, case.outputs)
    lower = {"points.wheel_contact.position": (0.0, 0.75, -0.01)}
    values = [
        solved(replace(each, mechanism=placed(each.mechanism, lower))) for each in (case, again)
    ]
    assert values[0] == {name: pytest.approx(each) for name, each in values[1].items()}
    assert values[0]["scrub_radius"] != pytest.approx(solved(case)["scrub_radius"])
