"""Proved references as files and as truth: what is written can be read, and cases are judged by
it.
"""

import json
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import kincheck.cases
import msgspec
import numpy as np
import pytest
from kincheck import Case, KincheckError
from kincheck.core.case.case import ORDERS, Sweep, Truth
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.outputs import with_all_coordinates
from kincheck.core.case.io.reference_file import read, series, with_proved_references
from kincheck.core.extensions.proofs import ball_executor
from kincheck.core.extensions.proofs.verified_reference import prove_case
from kincheck.core.jet import arctan2

from ...support.case_texts import refused
from ...support.examples import examples
from ...support.fakes import RADIUS, crank
from ...support.mechanisms import BRANCH, chain

(MISMATCHES,) = examples(__file__, "mismatches")

flint = pytest.importorskip("flint")
TOL = 1e-12


@pytest.fixture(scope="module")
def made():
    """A crank's reference to 40 digits, and the native errors."""
    return prove_case(crank(), digits=40, numbers="double", tol=TOL)


@pytest.fixture
def file(made, tmp_path):
    """The reference as a file."""
    path = tmp_path / "crank.reference.json"
    path.write_bytes(msgspec.json.encode(made[0]))
    return path


def test_proved_digits_are_closed_form(made):
    case, (found, _) = crank(), made
    with flint.ctx.workprec(300):
        for k, angle in enumerate(map(flint.arb, case.sweep.values.tolist())):
            x = RADIUS * (angle.cos() - 1)
            assert abs(x - flint.arb(found.outputs["x"].position[k])) < 1e-40
            y_tt = -RADIUS * flint.arb(case.sweep.rate) ** 2 * angle.sin()
            assert abs(y_tt - flint.arb(found.outputs["y"].acceleration[k])) < 1e-40
    assert all(radius < 1e-40 for each in found.outputs.values() for radius in each.radius)
    assert found.proved == len(case.sweep.values)


def test_proof_changes_rows_at_sample():
    """The Bennett loop at quarter turns; at the second and the fourth they depend on each other.
    One solution, its rows said.
    """
    case = kincheck.cases.load("bennett")
    case = replace(
        case, sweep=replace(case.sweep, values=np.radians([0.0, 90.0, 180.0, 270.0])), reference={}
    )
    found, errors = prove_case(case, digits=30, numbers="double", tol=TOL)
    assert found.proved == 4
    assert [sample.left_out is None for sample in found.samples] == [True, False, True, False]
    assert all(
        len(sample.left_out) == len(found.redundant) for sample in found.samples if sample.left_out
    )
    assert found.samples[1].left_out != found.redundant
    assert max(error.largest[0] for error in errors if error.unit == "m") < 1e-14
    assert max(error.ulps[0] for error in errors) < 100.0


def test_native_errors_are_round_off(made):
    for error in made[1]:
        assert all(0.0 <= each < 1e-15 for each in error.largest)
        assert all(0.0 <= each < 8.0 for each in error.ulps)


def test_proved_file_gives_nearest_doubles(made, file):
    (judged,) = with_proved_references([crank(reference=False)], [file])
    assert judged.truth is Truth.IN_HOUSE_ORACLE
    for name, truth in crank().reference.items():
        for quantity in ("position", "velocity", "acceleration"):
            found, expected = (getattr(x, quantity) for x in (judged.reference[name], truth))
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-15)
    assert read(file) == made[0]


def test_unproved_sample_is_nan(made):
    case, (found, _) = crank(), made
    x = found.outputs["x"]
    gap = msgspec.structs.replace(x, position=[None, *x.position[1:]])
    broken = msgspec.structs.replace(found, outputs={**found.outputs, "x": gap})
    position = series("file", broken, case.sweep.values, case.outputs)["x"].position
    assert np.isnan(position[0])
    assert np.isfinite(position[1:]).all()


@pytest.mark.parametrize(
    ("changes", "problem"),
    MISMATCHES,
    ids=str,
)
def test_proved_reference_mismatch_is_refused(file, changes, problem):
    file.write_text(json.dumps(json.loads(file.read_text()) | changes))
    refused(
        lambda: with_proved_references([crank()], [file]), f"crank.reference.json:  ... {problem}"
    )


def test_proved_reference_of_other_unit(file):
    file.write_text(file.read_text().replace('"unit":"m"', '"unit":"rad"', 1))
    told = "outputs.x: found another unit or convention of signs"
    refused(lambda: with_proved_references([crank()], [file]), told)


def test_proof_with_decimal_numbers():
    """A sweep of tenths: its doubles are not tenths, its decimals are, however they were rounded on
    the way.
    """
    case = crank()
    tenths = replace(case, sweep=replace(case.sweep, values=np.linspace(-0.3, 0.3, 7)))
    for numbers, is_tenth in (("decimal", True), ("double", False)):
        found, _ = prove_case(tenths, digits=30, numbers=numbers, tol=TOL)
        with flint.ctx.workprec(200):
            y = flint.arb(found.outputs["y"].position[5])
            assert (abs(y - RADIUS * (flint.arb(1) / 5).sin()) < 1e-30) is is_tenth


def formula(name, unit, of):
    """An output that is a formula of the tip."""
    return SimpleNamespace(
        name=name,
        points=("tip",),
        unit=unit,
        signs="",
        orders=ORDERS,
        period=0.0,
        facts={},
        forces=(),
        of=lambda at, design: of(at["tip"]),
        terms=lambda at, design: (of(at["tip"]),),
        resting=lambda at: None,
    )


def test_proof_of_formula_output():
    """Roots and angles of jets."""
    output = formula("angle", "rad", lambda tip: arctan2(tip.y, tip.x))
    case = replace(crank(), outputs=(output,))
    found, _ = prove_case(case, digits=30, numbers="double", tol=TOL)
    angle = found.outputs["angle"]
    assert angle.reason is None
    rates = [case.sweep.rate] * len(angle.velocity)
    for texts, values in ((angle.position, case.sweep.values.tolist()), (angle.velocity, rates)):
        for text, value in zip(texts, values, strict=True):
            assert abs(Fraction(text) - Fraction(value)) < Fraction(1, 10**30)


def test_proof_of_unsupported_formula():
    odd = formula("odd", "m", lambda tip: np.arccosh(tip.x.x))
    case = replace(crank(), outputs=(odd,))
    found, errors = prove_case(case, digits=30, numbers="double", tol=TOL)
    assert "what balls cannot" in found.outputs["odd"].reason
    assert errors == []


def test_reference_command_writes_usable_reference(kincheck_main, tmp_path, capsys):
    assert kincheck_main("reference", "crank", "--digits", 25, "--out", tmp_path) == 0
    assert "crank: 9 of 9 samples proved to 1e-25" in capsys.readouterr().out
    written = tmp_path / "crank.reference.json"
    options = "--engine", "native", "--json", tmp_path / "out.json", "--reference", written
    assert kincheck_main("run", "crank", *options) == 0
    (record,) = json.loads((tmp_path / "out.json").read_text())["records"]
    assert record["errors"]["x"]["position"]["against"] == "in_house_oracle"


def test_reference_of_unreadable_case(kincheck_main, tmp_path, capsys, made, file):
    stray = tmp_path / "gone.json"
    stray.write_bytes(msgspec.json.encode(msgspec.structs.replace(made[0], case="gone")))
    (tmp_path / "gone.toml").write_text('schema = "kincheck-case/9"\n')
    told = (
        f"kincheck: {stray}: line 1: case: found 'gone', expected one of the cases to be run: crank"
    )
    options = "--engine", "native", "--json", tmp_path / "out.json", "--reference", file, stray
    assert kincheck_main("run", "crank", tmp_path / "gone.toml", *options) == 2
    assert told in capsys.readouterr().err
    (record,) = json.loads((tmp_path / "out.json").read_text())["records"]
    assert record["errors"]["x"]["position"]["against"] == "in_house_oracle"
    (tmp_path / "out.json").unlink()
    assert kincheck_main("run", "crank", *options) == 2  # here it can only be a mistake
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out.json").exists()


def test_unproved_samples_have_status_1(kincheck_main, capsys):
    """At the pose in the middle all links are in line."""
    mechanism = chain(1)
    sweep = Sweep(mechanism.drivers[0].name, np.array([0.0, BRANCH, 3.0]))
    case = Case("chain", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    assert kincheck_main("reference", "chain", cases={"chain": with_all_coordinates(case)}) == 1
    out = capsys.readouterr().out
    assert "chain: 2 of 3 samples proved" in out
    assert f"sample 1 ({sweep.driver} = {BRANCH:.9g}) not proved: singular pose" in out


def test_senseless_digits_have_status_2(kincheck_main, capsys):
    assert kincheck_main("reference", "crank", "--digits", "16") == 2
    assert "not a whole number from 17 to 1000" in capsys.readouterr().err


def test_missing_flint_is_one_message(kincheck_main, monkeypatch, capsys):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr("importlib.import_module", missing)
    with pytest.raises(KincheckError, match="pip install 'python-flint>="):
        ball_executor.flint()


def test_case_file_with_proved_reference(tmp_path):
    """In degrees: the reference is in SI units, whatever those of the case file are."""
    text = (kincheck.cases.FOLDER / "rssr.toml").read_text().replace("steps = 181", "steps = 5")
    bare, file = tmp_path / "bare.toml", tmp_path / "case.toml"
    bare.write_text(text)
    file.write_text(text + '\n[reference]\nfile = "proved.json"\n')
    found, _ = prove_case(load_case(bare), digits=17, numbers="double", tol=TOL)
    (tmp_path / "proved.json").write_bytes(msgspec.json.encode(found))
    loaded = load_case(file)
    forces = {each.name for each in load_case(bare).outputs if each.forces}
    assert len(forces) == 3
    assert loaded.reference.keys() == found.outputs.keys()
    for name, each in loaded.reference.items():
        assert each.position.tolist() == [float(x) for x in found.outputs[name].position]
        if name in forces:
            assert each.acceleration is None
            continue
        assert each.acceleration.tolist() == [float(x) for x in found.outputs[name].acceleration]
