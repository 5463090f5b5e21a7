"""Sweeps checked by an engine."""

import pytest
from kincheck import adapters
from kincheck.cases import load
from kincheck.core.errors import KincheckError
from kincheck.core.harness.execution import here
from kincheck.core.harness.record import Outcome
from kincheck.core.studies.tolerance.cross_check import Check, chosen
from kincheck.core.studies.tolerance.sweep import sweep_designs

from ..support.fakes import Fake, crank
from .test_sweep_study import PIVOT, STRUT, TIP
from .test_vary import vary


def deviating(at):
    """The native engine but for one variant, whose tip is a micrometre off, and for another, which
    it refuses.
    """
    native = adapters.engine("native")

    def answer(case):
        found = native.solve(native.build(case), case, 1e-12)
        if f"variant {at} " in case.name:
            found.points["tip"].position[4, 1] += 1e-6
        return found

    return Fake("off", answer=answer)


def test_a_cross_check_finds_the_variant_that_deviates(tmp_path):
    case = crank()
    variation = vary(tmp_path, case, tip=TIP, pivot=PIVOT)
    (some,) = chosen(600, 1 / 600, 4)
    picked = chosen(600, 0.05, 4)
    assert len(picked) == 30
    assert chosen(600, 1e-9, 4) == {some}
    at = sorted(picked)[7]
    found = sweep_designs(
        case, variation, samples=600, seed=4, check=Check(deviating(at), 0.05, here, 1e-12)
    )
    assert [each.variant for each in found.checked] == sorted(picked)
    (bad,) = found.deviating
    assert (bad.variant, bad.outcome, bad.row) == (at, Outcome.FAIL, "y")
    assert bad.max_abs == pytest.approx(1e-6, rel=1e-3)
    assert "y: position is off by 1e-06 m at sample 4" in bad.message
    assert max(each.ratio for each in found.checked if each is not bad) < 1e-4


def test_impossible_check_is_refused_first(tmp_path):
    case = crank()
    variation = vary(tmp_path, case, tip=TIP)
    for engine, message in (
        (Fake("gone", installed=None), "--check gone: unavailable: gone is not installed"),
        (Fake("poor", refusal="has no hinge"), "--check poor: unsupported: has no hinge"),
    ):
        with pytest.raises(KincheckError, match=message):
            sweep_designs(case, variation, samples=10, check=Check(engine, 1.0, here, 1e-12))


def test_a_check_with_a_simulator_agrees(tmp_path):
    mujoco = adapters.engine("mujoco")
    if mujoco.version() is None:
        pytest.skip("mujoco is not installed")
    case = load("mcpherson_suspension")
    found = sweep_designs(
        case,
        vary(tmp_path, case, **STRUT),
        samples=200,
        seed=6,
        check=Check(mujoco, 0.02, here, 1e-12),
    )
    assert len(found.checked) == 4
    assert found.deviating == []
