"""Floors of engines: the time of a simulator's compiled code alone."""

import pytest
from kincheck import adapters, cases
from kincheck.core.doors import offers
from kincheck.core.extensions.laboratory.bench.precision import floors

from ...support.engine_motion import installed


@pytest.mark.parametrize("name", sorted(offers("floors")))
def test_floor_sums_counted_calls(name):
    engine, case = installed(name), cases.load("mcpherson_strut")
    floor = offers("floors")[name].load()(engine, case)
    assert floor.us_per_sample == pytest.approx(sum(floor.parts.values()))
    assert floor.us_per_sample > 0.0
    assert all(part in floor.counted for part in floor.parts)


def test_engines_that_simulate_have_no_floor():
    case = cases.load("mcpherson_strut")
    assert floors(case, [adapters.engine("mujoco", "simulate")]) == []
