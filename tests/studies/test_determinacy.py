"""Determinacy in explain: what redundant rows leave undetermined, without masses too."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.case.case import without_forces
from kincheck.core.kinematics import NativeSolver
from kincheck.core.mechanism.body import Body
from kincheck.core.report.terminal import console
from kincheck.core.studies.diagnosis.diagnose import determinacy
from kincheck.core.studies.diagnosis.text import _directions, _forces


def found(name, *, massless=False, asked=False):
    """The determinacy of a built-in case, by a few samples."""
    case = cases.load(name)
    case = case if asked else without_forces(case)
    mechanism = case.mechanism
    if massless:
        bare = [Body(b.name, b.origin, b.euler_parameters, b.fixed) for b in mechanism.bodies]
        mechanism = replace(mechanism, bodies=bare, forces=())
    sweep = replace(case.sweep, values=case.sweep.values[[1, 20]])
    case = replace(case, mechanism=mechanism, sweep=sweep)
    names = tuple(body.name for body in mechanism.moving)
    return determinacy(case, NativeSolver().prepare(mechanism, sweep.path, bodies=names)(1e-12))


@pytest.mark.parametrize(
    ("name", "expected"), [("four_bar", (2, 1, 3)), ("bennett", (0, 1, 3)), ("bricard", (2, 2, 5))]
)
def test_directions_are_counted_by_joint(name, expected):
    """The numbers are those of forces.md of the study."""
    made = found(name, massless=True)
    assert made.joints == len(made.partly) > 3
    assert {(each.force, each.moment, each.wrench) for each in made.partly} == {expected}
    assert made.efforts == []
    assert "4 of 4" in str(made) or name == "bricard"


def test_without_redundant_rows_all_is_determined():
    made = found("rssr", massless=True)
    assert made.partly == []
    assert str(made) == "all reactions and efforts are determined"


def test_determinacy_covers_joints_of_outputs():
    whole, asked = found("four_bar"), found("four_bar", asked=True)
    (pin,) = asked.partly
    assert asked.joints == 1
    assert pin in whole.partly


def test_the_directions_are_those_of_the_plane():
    (pin, *_) = found("four_bar").partly
    normal = np.array(cases.load("four_bar").mechanism.joint(pin.joint).axis)
    normal /= np.linalg.norm(normal)
    assert np.abs(np.array(pin.force_along) @ normal).max() < 1e-12
    assert abs(abs(np.array(pin.moment_along[0]) @ normal) - 1.0) < 1e-12


def test_the_table_names_directions(capsys):
    import sys

    page = console(sys.stdout)
    for each in _forces(found("four_bar")):
        page.print(each)
    out = capsys.readouterr().out
    assert "redundant rows leave 4 of 4 reactions not wholly determined" in out
    assert "2 of 3" in out
    assert "all across [" in out
    assert _directions([]) == "none"
    assert _directions(np.eye(3).tolist()) == "all"
    assert _directions([[0.0, 0.0, -1.0]]) == "[0, 0, 1]"
    assert _directions([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) == "all across [0, 0, 1]"
