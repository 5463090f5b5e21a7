"""Cases by the simulators' own solvers, and their errors."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.core.case.case import Truth
from kincheck.core.harness.run import run


def simulation(name):
    found = adapters.engine(name, "simulate")
    if found.version() is None:
        pytest.skip(f"{name} is not installed")
    return found


def record(case, engine):
    (found,) = run([case], [engine], tol=1e-12, baseline=adapters.engine("native")).records
    return found


def worst(found):
    """Largest position, velocity and acceleration error; None where there is none."""
    by_quantity = {"position": [], "velocity": [], "acceleration": []}
    for deviations in found.errors.values():
        for quantity, deviation in deviations.items():
            by_quantity[quantity].append(deviation.max_abs)
    return [max(values, default=None) for values in by_quantity.values()]


@cache
def strut(samples=41):
    case = cases.load("mcpherson_strut")
    return replace(
        case,
        sweep=replace(case.sweep, values=np.linspace(-0.08, 0.08, samples)),
        reference={},
        truth=Truth.CONSENSUS_ONLY,
    )
