"""Reactions of joints: directions that redundant rows leave open."""

import numpy as np
import pytest
from kincheck.core.forces import Reaction


@pytest.mark.parametrize("direction", range(6))
def test_reaction_counts_determined_directions(direction):
    """One row leaves one component of force or moment open."""
    free, zero = np.zeros((2, 6, 1)), np.zeros((2, 3))
    free[:, direction] = 1.0
    found = Reaction(zero, zero, free).determined()
    assert found == (3 - (direction < 3), 3 - (direction > 2), 5)
