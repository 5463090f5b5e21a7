"""The built-in cases: names, truths, and references that belong to their case files."""

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.case.case import Output, Truth
from kincheck.core.errors import CaseError

CLOSED_FORMS = ["four_bar", "rssr", "spatial_slider_crank"]
IN_HOUSE = {"mcpherson_strut", "mcpherson_steered", "mcpherson_suspension"}


IN_HOUSE |= {
    "mcpherson_strut_loaded",
    "chrono_macpherson",
    "chrono_macpherson_cylindrical",
    "chrono_double_wishbone",
    "chrono_sedan_double_wishbone",
    "chrono_multi_link",
    "chrono_multi_link_bodies",
}


def test_names_and_truths():
    """Nobody publishes curves of suspensions: what the project computed for them must never read as
    validated.
    """
    found = {name: cases.load(name).truth for name in cases.names()}
    assert {name for name, truth in found.items() if truth is Truth.IN_HOUSE_ORACLE} == IN_HOUSE
    assert {truth for name, truth in found.items() if name not in IN_HOUSE} == {Truth.CLOSED_FORM}


def test_unknown_names_get_a_suggestion():
    with pytest.raises(CaseError, match="did you mean 'four_bar'"):
        cases.load("fourbar")
    with pytest.raises(CaseError, match="not a built-in case"):
        cases.load("../cases/four_bar")


@pytest.mark.parametrize("name", cases.names())
def test_every_output_has_a_full_reference(name: str):
    case = cases.load(name)
    assert case.name == name
    assert list(case.reference) == [output.name for output in case.outputs]
    for output in case.outputs:
        series = case.reference[output.name]
        for values in (series.position, series.velocity, series.acceleration)[: output.orders]:
            assert values is not None
            assert values.shape == case.sweep.values.shape
            assert np.isfinite(values).all()


@pytest.mark.parametrize("name", cases.names())
def test_at_design_the_reference_is_the_case_file(name: str):
    case = cases.load(name)
    (design,) = np.flatnonzero(np.abs(case.sweep.change) < 1e-15)
    for output in (each for each in case.outputs if isinstance(each, Output)):
        position = (
            0.0
            if output.relative
            else np.dot(case.mechanism.point(output.point).position, output.direction)
        )
        # round-off of metres
        assert case.reference[output.name].position[design] == pytest.approx(position, abs=4e-15)


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_a_full_turn_comes_back(name: str):
    case = cases.load(name)
    assert case.sweep.change[[0, -1]].tolist() == pytest.approx([0.0, 2 * np.pi], abs=0)
    assert len(case.sweep.values) == 181
    for name in (each.name for each in case.outputs if isinstance(each, Output)):
        series = case.reference[name]
        assert series.velocity[-1] == pytest.approx(series.velocity[0], abs=1e-12)  # of 10 m/s
        assert np.ptp(series.position) > 0.02  # every output moves
