"""Measured curves given with a case on the command line: a rig's own names, units, columns and
grid, judged as the reference of a case file is.
"""

import math
from dataclasses import replace

import kincheck
import kincheck.adapters
import kincheck.core
import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.case.io.reference_samples import read_table, samples_of
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.measured.reference_curve import CurveOptions, with_curve
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run

from ...support.case_texts import refused, write
from ...support.examples import examples
from ...support.rods_of_templates import solved
from ...support.suspension_files import strut_of_table

FAULTS, FORMS = examples(__file__, "faults", "forms")

# Two minutes of arc: the repeatability of a rig, made up; its noise is an eighth of that.
ATOL = 2.0 / 60.0
GRID = np.linspace(-0.0437, 0.0312, 23)
ACCURACY = (f"toe={ATOL} deg", "camber=2 arcmin")


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    """A case of hardpoints, and toe and camber on the rig's grid [deg]."""
    folder = tmp_path_factory.mktemp("car")
    case, fine = (strut_of_table(folder, f"0.05:{count}") for count in (21, 401))
    wanted = tuple(each for each in fine.outputs if each.name in ("toe", "camber"))
    found = solved(replace(fine, outputs=wanted))
    noise = np.random.default_rng(5).normal(scale=ATOL / 8.0, size=(2, len(GRID)))
    rows = [
        np.degrees(np.interp(GRID, fine.sweep.values, found[name])) for name in ("toe", "camber")
    ]
    return case, np.array(rows) + noise


def rig(folder, rows, head="Travel [mm],toe [deg],camber [deg]", form="{},{},{}", name="rig.csv"):
    table = zip(
        (f"{1e3 * x:.6g}" for x in GRID),
        *([f"{y:.6g}" for y in each] for each in rows),
        strict=False,
    )
    file = folder / name
    file.write_text("\n".join([head, *(form.format(*row) for row in table)]) + "\n")
    return file


def judged(car, file, **options):
    case, notes = with_curve(car[0], file, CurveOptions(accuracy=ACCURACY, **options))
    results = run([case], [Native()], tol=1e-12)
    return results.records[0], notes, results.suspects.get(case.name)


@pytest.mark.parametrize("kind", FORMS)
def test_measured_curve_is_judged(tmp_path, car, kind):
    record, notes, suspect = judged(car, rig(tmp_path, car[1], **FORMS[kind]), citation="made up")
    assert record.outcome is Outcome.PASS
    assert suspect is None
    assert "no value at 6 of 21 samples" in record.message
    assert record.evidence.sound
    assert {record.errors[name].position.against for name in ("toe", "camber")} == {record.truth}
    assert ATOL < np.degrees(record.errors["toe"].position.tolerance) < 2.0 * ATOL
    for part in ("printed to 6 digits", "driver values printed to", "interpolated between 23 rows"):
        assert part in record.evidence.limits["toe"]
    assert record.evidence.units["stroke"] == "mm"
    assert record.evidence.units["toe"].startswith(("deg", "°"))
    assert record.evidence.signs == "iso8855 (assumed: the file names none)"
    assert any("left out" in note for note in notes) == (
        kind in ("further columns", "below the heads") or "exact" in kind
    )


def test_curve_with_map_and_signs(tmp_path, car):
    """Columns of other names, one with the opposite sign and without a unit; signs; the samples."""
    toe, camber = car[1]
    file = rig(tmp_path, (-toe, camber), "z [mm],Spur,Neigung [deg]")
    columns = ("z=stroke", "Spur=-toe [deg]", "Neigung=camber")
    record, *_ = judged(car, file, columns=columns, signs="iso8855", own_samples=True)
    assert record.outcome is Outcome.PASS
    assert not record.evidence.sound  # no citation
    assert len(record.driver["stroke"]) == len(GRID)
    assert record.evidence.units["toe"] == "deg, column 'Spur [deg]', with the opposite sign"
    assert record.evidence.signs == "iso8855"
    assert "interpolated" not in record.evidence.limits["toe"]


@pytest.mark.parametrize("k", [0, 1])
def test_shifted_curve_fails(tmp_path, car, k):
    record, *_ = judged(car, rig(tmp_path, car[1]))
    name = ("toe", "camber")[k]
    shift = np.zeros((2, 1))
    shift[k] = np.degrees(2.0 * record.errors[name].position.tolerance)
    record, *_ = judged(car, rig(tmp_path, car[1] + shift))
    assert record.outcome is Outcome.FAIL
    assert f"{name}: position is off by" in record.message


SLIPS = {
    "with the other sign": lambda values: -values,
    "times pi/180": np.degrees,
    "times 180/pi": np.radians,
    "times 1000": lambda values: values / 1000.0,
    "taken as that of output camber": lambda values: values[::-1],
}


@pytest.mark.parametrize("change", SLIPS)
def test_slip_of_curve_is_named(tmp_path, car, change):
    record, _, suspect = judged(car, rig(tmp_path, SLIPS[change](car[1])))
    assert record.outcome is Outcome.FAIL
    assert f"the reference {change} fits" in suspect.message


@pytest.mark.parametrize("kind", FAULTS)
def test_faulty_curve_is_refused(tmp_path, car, kind):
    form, options, fragments = FAULTS[kind]
    file = rig(tmp_path, car[1], **form)
    message = refused(lambda: with_curve(car[0], file, CurveOptions(**options)), fragments)
    assert message.startswith(str(tmp_path))


def test_run_with_measured_curve(tmp_path, car, capsys):
    strut_of_table(tmp_path, "0.05:21")
    table = tmp_path / "car.csv"
    toe, camber = car[1]
    file = rig(tmp_path, (-toe, camber), "z [mm],Spur,Neigung [deg]")
    stated = ["--map", "z=stroke", "--map", "Spur=-toe [deg]", "--map", "Neigung=camber"]
    stated += [part for each in ACCURACY for part in ("--accuracy", each)]
    command = ["run", str(table), "--engine", "native"]
    assert main([*command, "--reference", str(file), *stated, "--citation", "rig"]) == 0
    said = capsys.readouterr().err
    assert "read stroke [mm], toe [deg, column 'Spur [deg]', with the opposite sign]" in said
    assert "iso8855 is assumed" in said
    assert main([*command, "--reference", str(file), *stated[:2]]) == 2
    assert "--map" in capsys.readouterr().err
    assert main([*command, "--citation", "rig"]) == 2
    assert "--citation: for a measured curve" in capsys.readouterr().err
    assert main([*command, "mcpherson_strut", "--reference", str(file)]) == 2
    assert "one by one" in capsys.readouterr().err


@pytest.mark.parametrize("accuracy", ["0.02", "toe=0.02", "toe=0.02deg", "toe=0.02 deg"])
def test_bare_accuracy_has_column_unit(tmp_path, car, accuracy):
    """Without an output it holds for all columns."""
    case, rows = car
    file = rig(tmp_path, rows, "Travel [mm],toe [deg],camber [rad]")
    case, _ = with_curve(case, file, CurveOptions(accuracy=(accuracy,)))
    found = {output.name: output.atol for output in case.outputs}
    assert found["toe"] == pytest.approx(math.radians(0.02), rel=1e-14)
    assert (found["camber"] == 0.02) == (accuracy == "0.02")


@pytest.mark.parametrize(
    ("rows", "travel"),
    [
        # a lone number below the head is a sample without the other columns, and never a title
        ("-50,\n-40,\n0,0.1\n50,0.2\n", [-50.0, -40.0, 0.0, 50.0]),
        ("-50,0.3\n,,\n50,0.2\n", [-50.0, 50.0]),
    ],
    ids=["gaps", "blank row"],
)
def test_first_column_of_curve(tmp_path, rows, travel):
    file = write(tmp_path, f"Travel [mm],toe [deg]\n{rows}", "rig.csv")
    samples = samples_of(read_table(file, None, "--sheet"), [0, 1], remarks=True, gaps=True)
    assert samples.numbers[:, 0].tolist() == travel


def test_remark_in_case_reference_is_refused(tmp_path):
    """Only curves and recordings may hold remarks: their readers tell what is left out."""
    file = write(tmp_path, "push,tip_x\n0,1\nsensor changed\n1,2\n", "reference.csv")
    table = read_table(file, None, "--sheet")
    assert samples_of(table, remarks=True).left_out == ["line 3 (sensor changed)"]
    refused(lambda: samples_of(table), "line 3")


def test_run_against_measured_curve(tmp_path):
    """That of the case itself, rounded."""
    table, curve = tmp_path / "car.csv", tmp_path / "rig.csv"
    table.write_text(sample_table(TEMPLATES["mcpherson"]))
    case = kincheck.load(table, kincheck.Supplied(travel="0.05:11"))
    (record,) = kincheck.run(case, "native").records
    toe = record.outputs["toe"].position
    rows = zip(case.sweep.values, toe, strict=True)
    lines = [f"{1e3 * x:.0f},{math.degrees(y):.3f}" for x, y in rows]
    curve.write_text("\n".join(["travel [mm],toe [deg]", *lines]) + "\n")
    results = kincheck.run(case, "native", reference=curve)
    assert results.records[0].outcome == "pass"
    with pytest.raises(kincheck.KincheckError, match="found 2 cases"):
        kincheck.run([case, "rssr"], "native", reference=curve)
    kincheck.report(results, tmp_path / "report.html")
    assert "toe" in (tmp_path / "report.html").read_text()
