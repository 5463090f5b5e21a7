"""A driver that stands at two neighbouring samples and makes whole turns between them, in every
style, as one program, a sparse system, and in every engine.

Where it stands says nothing of the turns, but a wheel that is geared to it does.
"""

import numpy as np
import pytest
from kincheck.core.kinematics import styles

from ..support.mechanisms import indexed, indexing, solve_all


@pytest.mark.parametrize("style", styles())
@pytest.mark.parametrize("turns", [1, 2, 3, -1, -4])
def test_styles_count_turns_between_samples(turns, style):
    motions = {"turn": indexed(turns)}
    found = solve_all(indexing(), "clock", [0.0, 0.01], rate=0.01, motions=motions, style=style)
    angle = 0.5 * np.pi * turns * np.array([0.0, 1.0])
    expected = np.stack([1.0 + 0.2 * np.cos(angle), 0.2 * np.sin(angle), 0.0 * angle], axis=1)
    assert np.abs(found.points["rim"].position - expected).max() < 1e-12
