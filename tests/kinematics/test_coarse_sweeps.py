"""Coarse sweeps are gone in parts of their steps: to the samples of a closed form, by whichever
parts are small enough.
"""

from functools import cache

import numpy as np
import pytest
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.continuation.sweep import sweep
from kincheck.core.kinematics.continuation.walk import FINER, ROOM, SideWalk
from kincheck.core.mechanism.motions import Path, Ramp

from ..support.mechanisms import errors, slider_crank, slider_crank_motion

COARSE = {
    "a turn in six": np.linspace(0.0, 2.0 * np.pi, 7),
    "turns of three radians": np.linspace(-12.0, 12.0, 9),
    "one step of six turns": np.array([12.0 * np.pi]),
    "a step in parts of more than a radian": np.array([1.2 * FINER[1]]),
    "in no order, and twice the same": np.array([5.0, -4.0, 0.0, 2.5, 5.0, -1.0]),
    "small steps, then large": np.concatenate(
        [np.linspace(0.0, 0.1, 40), np.linspace(2.0, 9.0, 5)]
    ),
}
"""Angles of the crank, measured from the design position."""


@cache
def model(compiled):
    return compile_model(slider_crank(), Request(("turn",), ("end",), compiled=compiled))


def swept(values, *, compiled=True):
    """Along a route of its own: what is made ready for one that was solved before is kept with
    it.
    """
    return sweep(model(compiled), Path({"turn": Ramp(1.0)}, np.asarray(values)), 1e-12)


def assert_right(found, values):
    """Every sample is there, with position, velocity and acceleration of the closed form."""
    assert found.solved.all()
    assert not found.message
    assert found.residual <= 1e-15
    x = slider_crank_motion(values)
    expected = [np.column_stack([each, 0.0 * x.x, 0.0 * x.x]) for each in (x.x, x.v, x.a)]
    assert (errors(found.points["end"], expected) <= 1e-14).all()


@pytest.fixture
def divided(monkeypatch):
    """The steps of which parts were looked for one by one."""
    aims, divide = list[float](), SideWalk._divided
    monkeypatch.setattr(
        SideWalk,
        "_divided",
        lambda self, anchor, aim: aims.append(aim) or divide(self, anchor, aim),
    )
    return aims


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("values", COARSE.values(), ids=COARSE)
def test_coarse_sweep_in_equal_parts(values, compiled, divided):
    assert_right(swept(values, compiled=compiled), values)
    assert not divided


@pytest.mark.parametrize("values", COARSE.values(), ids=COARSE)
def test_coarse_sweep_in_searched_parts(values, divided):
    """After so many samples that equal parts of all of them are not kept ready."""
    values = np.append(np.linspace(0.0, 1e-3, 1 + ROOM // FINER[0]), values)
    assert_right(swept(values), values)
    assert divided


def test_worst_sigma_is_of_samples():
    """Not of the poses between, which are nearer to singular."""
    whole, least = 2.0 * np.pi, "smallest_singular_value"
    assert swept(np.linspace(0.0, whole, 41)).details[least] < 0.97
    assert swept([0.0, whole]).details[least] == pytest.approx(1.0, abs=1e-12)
    assert swept([0.0, 2.5 * np.pi]).details[least] < 0.97
