"""Numbers with derivatives."""

import numpy as np
from kincheck.core.extensions.slopes.slopes import Slope


def test_power_has_its_slope():
    slope = Slope(3.0, np.array([1.0])) ** 3
    assert (slope.x, *slope.d) == (27.0, 27.0)
