"""Studies of forces: against runs of single variants, by both ways; masses and loads vary."""

import numpy as np
import pytest
from kincheck import adapters
from kincheck.cases import load
from kincheck.core import CaseError
from kincheck.core.cli.main import main
from kincheck.core.harness.compare import output_series
from kincheck.core.harness.execution import here
from kincheck.core.kinematics import NativeSolver
from kincheck.core.studies.tolerance.cross_check import Check
from kincheck.core.studies.tolerance.study import Ready, Study
from kincheck.core.studies.tolerance.sweep import sweep_designs
from kincheck.core.studies.variation.variation_file import read_variation

from .test_vary import vary, vary_file

COUNT = 4
SLIDER_CRANK = {
    "pin": {"at": "joints.crank_pin.point", "half_width": [0.5, 0.5, 0.0]},
    "mass": {"at": "bodies.slider.mass", "half_width": 0.1},
}


def ready(tmp_path, name, **hardpoints):
    case = load(name)
    return Ready.of(Study(case, vary(tmp_path, case, **hardpoints), COUNT, 3))


def values_of(made):
    study = made.study
    values, solved, _, messages = made.values(study.variation.offsets(study.seed, 0, COUNT))
    assert solved.all(), messages
    return values


def alone(study, index):
    """The rows of one variant, solved as a case of its own."""
    case = study.of_variant(index)
    solver = NativeSolver().prepare(case.mechanism, case.sweep.path, case.points, (), case.forces)
    found = solver(1e-12)
    return np.array([output_series(case, row.output, found).position for row in study.rows])


@pytest.fixture(scope="module")
def slider_crank(tmp_path_factory):
    """Its rows are redundant: some components are not determined."""
    return ready(tmp_path_factory.mktemp("forces"), "planar_slider_crank", **SLIDER_CRANK)


def test_forces_are_those_of_single_variants(slider_crank):
    found = values_of(slider_crank)
    assert any(row.output.forces for row in slider_crank.study.rows)
    for index in (0, 3):
        right = alone(slider_crank.study, index)
        scale = np.nanmax(np.abs(right), axis=1, keepdims=True)
        np.testing.assert_allclose(found[:, :, index] / scale, right / scale, atol=1e-13)
    assert not np.allclose(found[:, :, 0], found[:, :, 1], equal_nan=True)


def test_a_spring_moves_with_its_hardpoint_and_its_rate_varies(tmp_path):
    made = ready(
        tmp_path,
        "mcpherson_strut_loaded",
        rate={"at": "forces.spring.stiffness", "half_width": 2.0},
        mass={"at": "bodies.knuckle.mass", "half_width": 3.0},
        ball={"at": "ball", "sigma": 1.0},
    )
    units = {each.name: each.unit for each in made.study.variation.coordinates}
    assert (units["rate"], units["mass"]) == ("N/m", "kg")
    assert made.study.variation.coordinates[0].scale == pytest.approx(2000.0)  # of N/mm
    found, right = values_of(made)[:, :, 2], alone(made.study, 2)
    scale = np.abs(right).max(axis=1, keepdims=True)
    np.testing.assert_allclose(found / scale, right / scale, atol=1e-12)
    spring = [row.name for row in made.study.rows].index("spring_force")
    changed = made.study.of_variant(2).mechanism.force("spring").stiffness
    nominal = load("mcpherson_strut_loaded").mechanism.force("spring").stiffness
    assert abs(changed - nominal) > 1.0
    assert not np.allclose(found[spring], made.nominal[spring], rtol=1e-6)


def test_a_mass_that_may_become_negative_is_refused(tmp_path):
    case = load("planar_slider_crank")
    mass = case.mechanism.body("slider").mass
    with pytest.raises(CaseError, match=r"found offsets down to .+ expected zero or more"):
        vary(tmp_path, case, mass={"at": "bodies.slider.mass", "sigma": mass / 5.0})
    with pytest.raises(CaseError, match="vary it less"):
        vary(tmp_path, case, mass={"at": "bodies.slider.mass", "half_width": 2.0 * mass})


def test_force_study_is_linear_in_mass(tmp_path):
    """A force is linear in a mass: mean, extremes and gradient follow from two runs."""
    case = load("planar_slider_crank")
    mass = {"mass": {"at": "bodies.slider.mass", "half_width": 0.1}}
    found = sweep_designs(
        case,
        vary(tmp_path, case, **mass),
        samples=20,
        seed=1,
        check=Check(adapters.engine("native"), 0.05, here, 1e-12),
    )
    assert [each.outcome.value for each in found.checked] == ["pass"]
    torque = found.outputs["crank_torque"]
    assert torque.unit == "N m"
    (slope,) = [each for each in found.gradients if each.output == "crank_torque"]
    assert slope.unit == "(N m)/kg"
    assert slope.accurate
    assert abs(slope.largest) > 1e-3  # the torque carries the mass
    offsets = vary(tmp_path, case, **mass).offsets(1, 0, 20)[0]
    ends = np.array(torque.nominal) + np.outer([offsets.min(), offsets.max()], slope.along)
    size = np.abs(torque.nominal).max()
    np.testing.assert_allclose(torque.min, ends.min(axis=0), atol=1e-9 * size)
    np.testing.assert_allclose(torque.max, ends.max(axis=0), atol=1e-9 * size)


def test_force_study_prints_file_units(tmp_path, capsys):
    hardpoints = {"mass": {"at": "bodies.slider.mass", "half_width": 0.1}}
    path = vary_file(tmp_path, hardpoints, limits={"crank_torque": {"high": 1e9}})
    case = load("planar_slider_crank")
    (limit,) = read_variation(path, case).limits
    assert limit.high == pytest.approx(1e6)  # N mm in the file
    assert main(f"sweep planar_slider_crank --vary {path} --samples 8".split()) == 0
    output = capsys.readouterr()
    assert "crank_torque" in output.out
    assert "N mm" in output.out
    assert "left out" not in output.err
