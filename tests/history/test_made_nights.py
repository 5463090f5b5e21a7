"""Histories made up by a seed: quiet ones are never red, and a planted fault is red from its first
run until its repair, in its pair only.
"""

import pytest

from ..support.history_runs import reported
from ..support.made_nights import Plan


def seeds(count, by_day):
    """The first seeds by day, and the others at night."""
    return [
        k if k <= by_day else pytest.param(k, marks=pytest.mark.nightly)
        for k in range(1, count + 1)
    ]


@pytest.mark.parametrize("seed", seeds(40, 1))
def test_quiet_history_has_no_step(path, seed):
    for night, _ in Plan.of(seed, quiet=True).nights(path):
        if night % 5 == 4:
            found = reported(path)
            assert found.regressions == []
            assert [step for step in found.steps if step.worse] == []


@pytest.mark.parametrize("seed", seeds(60, 2))
def test_planted_fault_has_its_first_run(path, seed):
    plan = Plan.of(seed, quiet=False)
    kind, (case, engine, mode), begin, repair = plan.fault
    first = None
    for night, run in plan.nights(path):
        if not begin - 2 <= night <= repair + 2:
            continue
        found = reported(path)
        about = {(each.kind, *each.pair, each.since) for each in found.regressions}
        if begin <= night < repair:
            first = first or run
            assert about == {(kind, plan.now(case, night), engine, mode, first)}, night
        else:
            assert about == set(), night
