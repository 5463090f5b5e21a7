"""Curves of a rig beside a table of hardpoints: a grid of their own, shorter than the travel,
noisy, six digits; judged by the rig's tolerance, and slips named.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run

from ..support.case_texts import write
from .test_published_suspensions import solved

# Two minutes of arc: the repeatability of a rig, made up; its noise is a quarter of that.
ATOL = np.radians(2.0 / 60.0)
NAMES = ("toe", "camber")
GRID = np.linspace(-0.0437, 0.0312, 23)


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    """The text of a case with two outputs, and their true curves on the rig's grid."""
    file = tmp_path_factory.mktemp("car") / "car.csv"
    file.write_text(sample_table(TEMPLATES["mcpherson"]))
    case = load(file, Supplied(travel="0.05:21"))
    outputs = [
        replace(each, atol=ATOL, rtol=0.0, why="repeatability of the rig")
        for each in case.outputs
        if each.name in NAMES
    ]
    case = replace(case, outputs=tuple(outputs))
    fine = load(file, Supplied(travel="0.05:401"))
    found = solved(replace(fine, outputs=case.outputs))
    rows = np.array([np.interp(GRID, fine.sweep.values, found[name]) for name in NAMES])
    return case_text(case).replace("source =", 'truth = "third_party_data"\nsource =', 1), rows


def judged(folder, car, change=lambda values: values, grid=GRID, head="stroke,toe,camber"):
    text, true = car
    noise = np.random.default_rng(5).normal(scale=ATOL / 8.0, size=true.shape)
    rows = np.column_stack([grid, *change(true + noise)])
    lines = ["# signs: iso8855", head, *(",".join(f"{x:.6g}" for x in row) for row in rows)]
    write(folder, "\n".join(lines) + "\n", "rig.csv")
    given = '\n[reference]\nfile = "rig.csv"\ncitation = "a rig that was made up for this test"\n'
    case = load_case(write(folder, text + given))
    results = run([case], [Native()], tol=1e-12)
    return results.records[0], results.suspects.get(case.name)


def test_a_measured_curve_is_judged_by_its_accuracy(tmp_path, car):
    record, suspect = judged(tmp_path, car)
    assert record.outcome is Outcome.PASS
    assert record.validated
    assert suspect is None
    for part in ("printed to 6 digits", "driver values printed to", "interpolated between 23 rows"):
        assert part in record.evidence.limits["toe"]
    assert "no value at 6 of 21 samples" in record.message
    tolerance = record.errors["toe"].position.tolerance
    assert ATOL < tolerance < 2.0 * ATOL


@pytest.mark.parametrize("k", [0, 1])
def test_a_shift_of_two_tolerances_is_found(tmp_path, car, k):
    record, _ = judged(tmp_path, car)
    shift = np.zeros((2, 1))
    shift[k] = 2.0 * record.errors[NAMES[k]].position.tolerance
    record, _ = judged(tmp_path, car, lambda values: values + shift)
    assert record.outcome is Outcome.FAIL
    assert f"{NAMES[k]}: position is off by" in record.message


SLIPS = {
    "with the other sign": lambda values: -values,
    "times pi/180": np.degrees,
    "times 180/pi": np.radians,
    "times 1000": lambda values: values / 1000.0,
    "taken as that of output camber": lambda values: values[::-1],
}


@pytest.mark.parametrize("change", SLIPS)
def test_slips_are_named(tmp_path, car, change):
    record, suspect = judged(tmp_path, car, SLIPS[change])
    assert record.outcome is Outcome.FAIL
    assert f"the reference {change} fits" in suspect.message
