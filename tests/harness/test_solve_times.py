"""The time of a solve is that of a warm one, undisturbed by what happens once."""

from itertools import accumulate, chain

import pytest
from kincheck import Outcome
from kincheck.core.harness import execution

from ..support.fakes import SAMPLES, Fake, off, record_of, solution

TOL = 1e-12
WARM_SOLVES = execution.WARM_SOLVES


@pytest.fixture(autouse=True)
def as_users_solve(monkeypatch):
    monkeypatch.setattr(execution, "WARM_SOLVES", WARM_SOLVES)


def timed(monkeypatch, build, *solves, waits=()):
    """A record of solves that take so long, of which others have the processor for a part."""
    lengths = chain.from_iterable((0.0, length) for length in (build, *solves, *[0.0] * 9))
    monkeypatch.setattr(execution, "perf_counter", accumulate(lengths).__next__)
    waiting = chain.from_iterable((0.0, length) for length in (*waits, *[0.0] * (20 - len(waits))))
    monkeypatch.setattr(execution, "waiting_seconds", accumulate(waiting).__next__)
    engine = Fake()
    return engine, record_of(engine)


def test_times_are_of_warm_solves():
    engine = Fake()
    record = record_of(engine)
    assert engine.solves == 6  # one cold, five warm: they take no time
    assert record.us_per_step == pytest.approx(1e6 * record.seconds.own / SAMPLES)
    assert record.seconds.build is not None
    stale = Fake()
    stale.answer = lambda case: (
        solution if stale.solves == 1 else off("position", lambda p: p + 1.0)
    )(case)
    assert record_of(stale).outcome is Outcome.FAIL


def test_interruption_changes_no_time(monkeypatch):
    engine, record = timed(monkeypatch, 0.5, 0.25, 0.001, 0.009, 0.002, 0.002, 0.002)
    assert engine.solves == 6
    seconds = record.seconds
    assert (seconds.build, seconds.first) == (0.5, 0.25)
    assert seconds.warm == pytest.approx(0.002)


def test_waiting_time_is_reported(monkeypatch):
    _, record = timed(monkeypatch, 0.5, *[0.003] * 6, waits=[0.002] * 6)
    assert record.seconds.warm == pytest.approx(0.003)
    assert record.seconds.waited == pytest.approx(0.002)
    assert record.us_per_step == pytest.approx(1000.0 / SAMPLES)


@pytest.mark.parametrize(
    "solves",
    [(0.25, 0.001), (0.001, 0.25), (0.001, 0.7), (0.7, 0.001)],
    ids=["first", "second", "second and slow", "first and slow"],
)
def test_compilation_is_not_timed(solves, monkeypatch):
    """It has come to work in one of the warm solves."""
    _, record = timed(monkeypatch, 0.1, 0.002, *solves, *[0.001] * 4)
    assert record.seconds.warm == pytest.approx(0.001)


@pytest.mark.parametrize("first", [10.0, 30.0])
def test_slow_engines_are_solved_twice(first, monkeypatch):
    engine, record = timed(monkeypatch, 10.0, first, 10.0)
    assert engine.solves == 2
    seconds = record.seconds
    assert (seconds.build, seconds.first, seconds.warm) == (10.0, first, 10.0)
