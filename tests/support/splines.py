"""Splines of OpenSim by the truth of the stress study: slopes at the points, in fractions."""

import numpy as np
import pytest
from kincheck import Spline


def through(points):
    """The function x -> value, slope, second derivative of the spline of Forsythe, Malcolm and
    Moler; straight beyond its ends.
    """
    Function = pytest.importorskip("kincheck.core.extensions.laboratory.truth.curves").Function
    law = Function.of(Spline("spline", ("driven", "driving"), points))
    return lambda x: tuple(float(each[0]) for each in law.at(np.array([x])))
