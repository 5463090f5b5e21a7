"""Forces of random mechanisms with slides, screws, racks and polynomials, in every engine."""

from functools import cache

import numpy as np
import pytest
from kincheck import adapters

from ..support.engine_forces import Beside, values
from ..support.random_mechanisms import random_case

# Of the largest force: round-off over a smallest singular value of a hundredth. Exudyn has no
# acceleration: it is a difference of Jacobians.
AGREE = dict.fromkeys(["mujoco", "pinocchio", "dart", "drake", "simbody"], 1e-11)
AGREE["exudyn"] = 1e-9
# Arms and loops; racks in 1, 21 and 37, polynomials in 9, 27, 45 and 63, a gear in 45.
SEEDS = (0, 1, 9, 21, 24, 27, 32, 37, 45, 63)


@cache
def native(seed):
    case = random_case(seed)
    return case, values(case, "native")[0]


@pytest.mark.parametrize("engine", AGREE)
@pytest.mark.parametrize("seed", SEEDS)
def test_forces_are_those_of_the_native_engine(seed, engine):
    if adapters.engine(engine).version() is None:
        pytest.skip(f"{engine} is not installed")
    case, expected = native(seed)
    compared = Beside(expected, values(case, engine)[0])
    assert np.isfinite(expected).all()
    assert compared.same_missing
    assert compared.worst < AGREE[engine]
