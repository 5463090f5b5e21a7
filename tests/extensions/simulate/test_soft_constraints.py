"""MuJoCo's own constraint forces: what its tendon leaves out, and messages."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import CaseError, cases
from kincheck.adapters.simulate.soft_constraints import main, report_lines, rod_forces

pytest.importorskip("mujoco")


STRUT = cases.load("mcpherson_strut_loaded")


def thinned(rate):
    sweep = replace(STRUT.sweep, values=STRUT.sweep.values[::40], rate=rate)
    return replace(STRUT, sweep=sweep)


def test_tendon_force_lacks_velocity_term():
    """At rest nothing is missing; the part without Jdot v grows with the square of the rate."""
    slow, fast = (rod_forces(thinned(rate), "tie_rod") for rate in (1e-3, 1.0))
    largest = np.abs(fast.rigid).max()
    np.testing.assert_allclose(slow.without_bias, slow.rigid, rtol=0, atol=1e-5 * largest)
    missing = fast.rigid - fast.without_bias
    assert 4.0 < np.abs(missing).max() < 8.0
    # nearly rigid equalities give what rigid rows without Jdot v give
    off = fast.forward["stiff"] - fast.rigid
    assert np.abs(off + missing).max() < 0.1 * np.abs(missing).max()
    assert "off by up to" in report_lines(fast, "tie_rod")


def test_soft_constraints_bad_input_is_refused():
    with pytest.raises(CaseError, match="expected one of: tie_rod"):
        rod_forces(STRUT, "strut_top")
    with pytest.raises(CaseError, match="no output reads a force"):
        rod_forces(cases.load("mcpherson_strut"), "tie_rod")
    light = replace(STRUT.mechanism.body("strut"), mass=0.0, inertia=None)
    others = [each for each in STRUT.mechanism.bodies if each.name != "strut"]
    massless = replace(STRUT, mechanism=replace(STRUT.mechanism, bodies=[*others, light]))
    with pytest.raises(CaseError, match="give every body mass and inertia"):
        rod_forces(massless, "tie_rod")


def test_soft_constraints_command_refuses_bad_arguments(tmp_path, capsys):
    assert main([]) == 2
    assert main([str(tmp_path / "none.toml")]) == 2
    assert "error: " in capsys.readouterr().err
