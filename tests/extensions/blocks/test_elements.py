"""The equations of a large mechanism as elements against those traced as a whole."""

import numpy as np
import pytest

pytest.importorskip("llvmlite")
from kincheck.core.case.joint_probe import probes
from kincheck.core.extensions.blocks.elements import LargeSystem
from kincheck.core.extensions.laboratory.bench.size import ring
from kincheck.core.kinematics.compiled.dense_equations import System
from kincheck.core.kinematics.compiled.programs import Tracer
from kincheck.core.kinematics.compiled.request import Request

from ...support.block_structures import chain_of_hinges, torus
from ...support.mechanisms import gears

LANES = 11
"""More than a vector has."""


def equations(system, drivers, random):
    """Return all numbers of the equations at random poses."""
    design = np.repeat(system.design, LANES, axis=1)
    sample = random.normal(size=(1 + 5 * drivers, LANES))
    rates = random.normal(size=(system.unknowns, LANES))
    state = system.stepped(design, 0.3 * rates)
    phi, nu, entries = system.evaluate(state, sample)
    dense = np.zeros((len(phi), system.unknowns, LANES))
    np.add.at(dense, (system.rows, system.columns), entries)
    outputs = system.outputs(state, sample, rates, rates)
    return [state, phi, nu, dense, system.gamma(state, sample, rates), *outputs.values()]


OWN = gears(), ring(5), torus(3, 3)[0], chain_of_hinges(3)
EVERY = [*OWN, *(case.mechanism for case in probes())]
"""The probes have joints of all types, one by one."""


@pytest.mark.by_day(3)
@pytest.mark.parametrize("mechanism", EVERY, ids=lambda each: each.name)
def test_elements_match_whole_equations(mechanism):
    drivers = tuple(each.name for each in mechanism.drivers)
    points = tuple(each.name for each in mechanism.points)
    bodies = tuple(each.name for each in mechanism.moving)
    request = Request(drivers, points, bodies)
    systems = [each(Tracer(mechanism, request)) for each in (LargeSystem, System)]
    found, expected = (equations(each, len(drivers), np.random.default_rng(4)) for each in systems)
    for a, b in zip(found, expected, strict=True):
        # fused products are rounded once: some round-offs of the terms, below 100 here
        assert np.abs(a - b).max(initial=0.0) <= 1e-12
    # single poses have lanes of their own
    at = found[0][:, :1], np.zeros((1 + 5 * len(drivers), 1))
    one, other = (each.evaluate(*at)[0] for each in systems)
    assert np.abs(one - other).max() <= 1e-12
