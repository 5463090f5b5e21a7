"""What `kincheck import` writes: a case file that reads as the same case, whatever was read."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.case.io.case_file import case_text, load_case

from ..support.case_texts import complains, refused, write
from ..support.written_again import written_again

QUANTITIES = ("position", "velocity", "acceleration")


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", cases.names())
def test_built_in_case_round_trip(name, tmp_path):
    """Their references too, whose rows are exact."""
    case = cases.load(name)
    again = written_again(case, tmp_path)
    assert again.truth is case.truth
    assert again.reference.keys() == case.reference.keys()
    for output, series in case.reference.items():
        for quantity in QUANTITIES:
            there, here = (getattr(each.reference[output], quantity) for each in (case, again))
            np.testing.assert_equal(there, here)
        assert again.reference[output].uncertainty == {} == series.uncertainty


def crank(tmp_path, *more):
    """Return the case of a file with more lines at its end."""
    return load_case(write(tmp_path, "\n".join([CRANK, *more])))


CRANK = """schema = "kincheck-case/1"
name = "crank"
source = "made up for this test"
truth = "closed_form"
[bodies.arm]
[joints.hinge]
type = "revolute"
bodies = ["ground", "arm"]
point = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[points.tip]
body = "arm"
position = [1.0, 0.0, 0.0]
[drivers.turn]
type = "joint_angle"
joint = "hinge"
[outputs.x]
point = "tip"
component = "x"
"""
ROWS = "rows = [[0.0, 1.0], [0.1, 0.9950041652780258], [0.25, 0.9689124217106447]]"
EVEN = '[sweep]\ndriver = "turn"\nstart = 0.0\nstop = 0.25\nsteps = 3\n'


def test_import_keeps_sweep_at_reference(tmp_path):
    case = crank(tmp_path, '[sweep]\ndriver = "turn"\nat = "reference"', "[reference]", ROWS)
    again = written_again(case, tmp_path)
    assert np.array_equal(again.reference["x"].position, case.reference["x"].position)
    assert 'at = "reference"' in case_text(case)
    bare = replace(case, reference={}, origin=None)
    refused(lambda: case_text(bare), "no even grid ... ; give an even one")


def test_import_omits_reference_with_uncertainties(tmp_path):
    rows = [[0.1 * k, float(f"{np.cos(0.1 * k):.6f}")] for k in range(6)]
    case = crank(tmp_path, EVEN, "[reference]", f"rows = {rows}")
    assert case.reference["x"].uncertainty
    text = case_text(case)
    assert text.startswith("# The reference is left out, because its values have uncertainties")
    assert "reference" not in tomllib.loads(text)


def test_import_keeps_closure_notes(tmp_path):
    case = crank(tmp_path, EVEN, '[closure]\nnotes = ["the start was open by 1e-7 m"]')
    assert case.assembly == ("the start was open by 1e-7 m",)
    written_again(case, tmp_path)


def test_import_cuts_too_long_texts(tmp_path):
    case, cut = crank(tmp_path, EVEN), f"{9_994 * 's'} [...]"
    for source, kept in ((10_000 * "s",) * 2, (10_001 * "s", cut), (20_000 * "s", cut)):
        text = case_text(replace(case, source=source))
        assert load_case(write(tmp_path, text)).source == kept
    file = write(tmp_path, text.replace("ss [...]", "sss [...]"))
    complains(file, "found a text of 10001 characters, expected 10000 at most")
