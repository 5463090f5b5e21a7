"""A chain of N four-bar loops (IFToMM A02: parallel unit cranks): right at any length, and its cost
grows by the loop.
"""

import numpy as np
import pytest
from kincheck.core import solve
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request

from ..support.mechanisms import LEAN, chain


@pytest.mark.parametrize("loops", [1, 5])
def test_chain_through_change_points(loops):
    # through the change points, where the loops could fold over
    turn = np.linspace(-np.pi, np.pi, 37)
    found = solve(chain(loops), "turn", turn)
    assert found.solved.all(), found.message
    expected = np.column_stack([loops + np.sin(LEAN - turn), np.cos(LEAN - turn), 0.0 * turn])
    # round-off grows with the length of the chain, and by the condition near the change points,
    # sampled no nearer than 0.1 rad
    assert np.abs(found.points["end"].position - expected).max() <= 1e-13 * loops


def test_chain_cost_grows_linearly():
    flops = []
    for loops in (4, 8, 12):
        sizes = compile_model(chain(loops), Request(("turn",), (), compiled=False)).sizes
        flops.append([sizes[name]["flops"] for name in ("newton", "outputs")])
    assert np.diff(flops, axis=0)[0].tolist() == np.diff(flops, axis=0)[1].tolist()
