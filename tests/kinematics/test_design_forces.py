"""Forces of many designs: by their program, and by the motion of all bodies."""

import numpy as np
import pytest
from kincheck.cases import load
from kincheck.core.kinematics import NativeSolver
from kincheck.core.kinematics.compiled import traced_forces

PIN = "joints.crank_pin.point"
NAMES = ("crank_pin", "gudgeon", "crank")
"""Two joints and the driver; rows are redundant, and some components not determined."""


@pytest.fixture(scope="module")
def case():
    return load("planar_slider_crank")


def solved(case, *, least=None):
    """The forces of three designs, and their geometry."""
    designs = NativeSolver(order=2).prepare_designs(
        case.mechanism, case.sweep.path, [PIN], forces=NAMES
    )
    pin = np.array(case.mechanism.joint("crank_pin").point)
    geometry = pin[:, None] + np.outer([1.0, 0.5, 0.0], [-1e-3, 0.0, 2e-3])
    if least is not None:
        designs.route.model.forces.least = least
    found = designs.solve(geometry, 1e-12)
    assert found.solved.all(), found.messages
    return designs.forces(found, geometry, 1e-12)


@pytest.mark.parametrize("way", ["not traced", "singular"])
def test_design_forces_agree_in_both_ways(case, monkeypatch, way):
    right = solved(case)
    assert right.decided.all()
    if way == "not traced":
        monkeypatch.setattr(traced_forces, "can_trace", lambda mechanism: False)
        found = solved(case)
    else:  # as if every pose were nearly singular
        found = solved(case, least=2.0)
    assert not found.decided.any()
    assert sorted(found.alone) == [0, 1, 2]
    for measure in (
        lambda forces: forces.drivers["crank"],
        lambda forces: forces.joints["gudgeon"].along((1.0, 0.0, 0.0)),
        lambda forces: forces.joints["crank_pin"].along((0.0, 0.0, 1.0), moment=True),
    ):
        values, expected = found.read(measure), right.read(measure)
        scale = np.nanmax(np.abs(expected), initial=0.0) or 1.0
        np.testing.assert_allclose(values / scale, expected / scale, atol=1e-12)
