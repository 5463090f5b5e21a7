"""Splines of OpenSim by the truth of the stress study: slopes at the points, in fractions."""

import numpy as np
from kincheck.core import Spline
from kincheck.core.extensions.laboratory.truth.curves import Function


def through(points):
    """The function x -> value, slope, second derivative of the spline of Forsythe, Malcolm and
    Moler; straight beyond its ends.
    """
    law = Function.of(Spline("spline", ("driven", "driving"), points))
    return lambda x: tuple(float(each[0]) for each in law.at(np.array([x])))
