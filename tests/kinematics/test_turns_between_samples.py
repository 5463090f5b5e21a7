"""A driver that stands at two neighbouring samples and makes whole turns between them, in every
style, as one program, a sparse system, and in every engine.

Where it stands says nothing of the turns, but a wheel that is geared to it does.
"""

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.case.case import Case, Output, Series, Sweep, Truth
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run
from kincheck.core.kinematics.formulation.styles import styles

from ..support.mechanisms import X, Y, indexed, indexing, solve_all


def test_engines_count_turns_between_samples():
    angle, still = -1.5 * np.pi * np.array([0.0, 1.0]), np.zeros(2)
    outputs = [
        Output(name, "rim", along, False, 1e-12, 0.0, "round-off")
        for name, along in (("x", X), ("y", Y))
    ]
    reference = {
        "x": Series(1.0 + 0.2 * np.cos(angle), still, still),
        "y": Series(0.2 * np.sin(angle), still, still),
    }
    sweep = Sweep("clock", np.array([0.0, 0.1]), 0.1, motions={"turn": indexed(-3)})
    case = Case(
        "indexing", "closed form", Truth.CLOSED_FORM, indexing(), sweep, tuple(outputs), reference
    )
    engines = [
        each for each in map(adapters.engine, adapters.ENGINES) if each.version() is not None
    ]
    for record in run([case], engines, tol=1e-12).records:
        assert record.outcome is Outcome.PASS, record


@pytest.mark.parametrize("style", styles())
@pytest.mark.parametrize("turns", [1, 2, 3, -1, -4])
def test_styles_count_turns_between_samples(turns, style):
    motions = {"turn": indexed(turns)}
    found = solve_all(indexing(), "clock", [0.0, 0.01], rate=0.01, motions=motions, style=style)
    angle = 0.5 * np.pi * turns * np.array([0.0, 1.0])
    expected = np.stack([1.0 + 0.2 * np.cos(angle), 0.2 * np.sin(angle), 0.0 * angle], axis=1)
    assert np.abs(found.points["rim"].position - expected).max() < 1e-12
