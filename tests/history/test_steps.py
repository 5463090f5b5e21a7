"""Steps in a history: the first bad run, and what else changed there; not what is noise, and not a
single slow night.
"""

import math
import random

import numpy as np
import pytest
from kincheck import Outcome
from kincheck.core.history.queries import read
from kincheck.core.history.steps import change_points, standing_steps, steps
from kincheck.core.history.store import Store
from msgspec.structs import replace

from ..support.history_runs import (
    changed,
    history,
    keep,
    keep_changed,
    nights,
    records,
    report,
    times,
    worse,
)


def found(path, standing=False):
    with Store(path) as store:
        every = steps(read(store))
    return standing_steps(every) if standing else every


def slow_nights(path, factors, seed=3):
    """Nights whose time in the first case is so many times as long."""
    noise = random.Random(seed)
    for factor in factors:
        keep(path, changed(records(noise=noise), **times(factor)))


def noisy(levels, spread=0.05, seed=3):
    noise = random.Random(seed)
    return np.array([level + noise.gauss(0.0, spread) for level in levels])


def test_slow_drift_is_no_step():
    drift = np.linspace(0.0, math.log(4.0), 60)
    for seed in range(20):
        assert change_points(noisy(drift, seed=seed), least=math.log(1.5), lasting=3) == []


def test_alternating_values_are_no_steps():
    """As errors on two kinds of hosted processors are."""
    for seed in range(20):
        chance = random.Random(seed)
        values = np.array([math.log(30.0) * (chance.random() < 0.5) for _ in range(60)])
        assert change_points(values, least=math.log(10.0), lasting=1) == []


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        ([0.0] * 20, []),
        ([0.0] * 12 + [0.7] * 8, [12]),
        ([0.0] * 12 + [0.7] * 8 + [-0.8] * 9, [12, 20]),
        ([0.0] * 17 + [0.7] * 3, [17]),
        ([0.0] * 18 + [0.7] * 2, []),
        ([0.0] * 10 + [3.0] + [0.0] * 10, []),
        ([0.0] * 12 + [0.3] * 8, []),
    ],
    ids=["quiet", "step", "two", "at the end", "too short", "outlier", "too small"],
)
def test_change_points_of_levels(levels, expected):
    for seed in range(5):
        assert change_points(noisy(levels, seed=seed), least=math.log(1.5), lasting=3) == expected


def test_noise_has_no_steps():
    """Nights of which one in ten is slow by up to a factor of three."""
    noise = random.Random(7)
    for _ in range(200):
        values = np.array(
            [
                noise.gauss(0.0, 0.1) + (noise.random() < 0.1) * noise.uniform(0.0, 1.1)
                for _ in range(40)
            ]
        )
        assert change_points(values, least=math.log(1.5), lasting=3) == []


def test_time_step_names_changed_versions(path):
    noise = random.Random(5)
    for _ in range(8):
        keep(path, records(noise=noise))
    for _ in range(4):
        keep(path, changed(records(noise=noise), **times(2.0)), python="3.13.0")
    (step,) = found(path)
    assert (step.case, step.engine, step.quantity, step.first, step.last) == (
        "first",
        "mujoco",
        "time",
        9,
        8,
    )
    assert step.started == "2026-11-09T03:00:00+00:00"
    assert step.worse
    assert step.now / step.before == pytest.approx(2.0, rel=0.1)
    assert [str(each) for each in step.changes] == [
        "python 3.12.3 → 3.13.0",
        "commit 0808080808 → 0909090909",
    ]


def test_error_step_names_worst_output(path):
    nights(path, 3)
    both = changed(changed(records(), **worse(20.0, "x")), **worse(200.0, "y"))
    keep(
        path, [replace(each, version="4.1.0") if each.engine == "mujoco" else each for each in both]
    )
    (step,) = found(path)
    assert (step.quantity, step.output, step.first) == ("position", "y", 4)
    assert step.now / step.before == pytest.approx(200.0, rel=1e-3)
    assert str(step.changes[0]) == "mujoco 4.0.0 → 4.1.0"


def test_outcome_step_ends_with_repair(path):
    nights(path, 2)
    for _ in range(2):
        keep_changed(path, outcome=Outcome.CRASHED, message="signal 11")
    assert [(each.quantity, each.first, each.worse) for each in found(path, standing=True)] == [
        ("outcome", 3, True)
    ]
    nights(path, 1)
    assert found(path, standing=True) == []
    assert [(each.first, each.worse) for each in found(path)] == [(5, False), (3, True)]


def test_slow_nights_are_no_step(path):
    slow_nights(path, [3.0 if night in (5, 10, 11) else 1.0 for night in range(12)], seed=5)
    assert found(path) == []


def test_time_below_zero_is_left_out(path):
    slow_nights(path, [-1.0 if night == 5 else 1.0 for night in range(12)])
    assert found(path) == []


def test_repeated_slow_stretches_are_separate(path, capsys):
    slow_nights(path, 2 * ([1.0] * 8 + [2.0] * 8))
    assert [(each.first, each.worse, each.repaired) for each in found(path)] == [
        (25, True, None),
        (17, False, None),
        (9, True, 17),
    ]
    assert [(each.first, each.last) for each in found(path, standing=True)] == [(25, 24)]
    assert report(path, "--against", "20") == 1
    said = capsys.readouterr().out
    assert " · since run 25 |" in said
    assert "ms a sweep since run 25 (" in said
    assert "steps that came and went" in said.lower()
    assert "since run 9 (2026-11-09 03:00), repaired in run 17; after run 8: " in said
    assert history(path, "--case", "first", "--engine", "mujoco", "--last", "0") == 0
    said = capsys.readouterr().out
    assert "since run 9 (2026-11-09 03:00), repaired in run 17; after run 8: " in said


def test_partly_repaired_step_stands(path):
    slow_nights(path, [1.0] * 8 + [8.0] * 8 + [3.0] * 8)
    assert [(each.first, each.worse, each.repaired) for each in found(path)] == [
        (17, False, None),
        (9, True, None),
    ]
    assert [each.first for each in found(path, standing=True)] == [9]


def test_one_bad_night_is_repaired_step(path):
    for night in range(12):
        keep_changed(path, **worse(100.0 if night == 5 else 1.0))
    assert [(each.first, each.repaired) for each in found(path) if each.worse] == [(6, 7)]
    assert found(path, standing=True) == []


def test_successive_error_steps_both_stand(path):
    nights(path, 4)
    for _ in range(4):
        keep_changed(path, **worse(100.0, "x"))
    for _ in range(4):
        keep(path, changed(changed(records(), **worse(100.0, "x")), **worse(50.0, "y")))
    assert [(each.output, each.first) for each in found(path, standing=True)] == [
        ("y", 9),
        ("x", 5),
    ]


def test_missing_engine_repairs_nothing(path):
    nights(path, 2)
    keep_changed(path, outcome=Outcome.FAIL)
    for _ in range(2):
        keep_changed(path, outcome=Outcome.UNAVAILABLE, seconds=None, errors={})
    assert [(each.first, each.repaired) for each in found(path, standing=True)] == [(3, None)]
    nights(path, 1)
    assert [(each.first, each.worse, each.repaired) for each in found(path)] == [
        (6, False, None),
        (3, True, 6),
    ]
