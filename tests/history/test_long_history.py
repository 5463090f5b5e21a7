"""Reports on a long history cost as much as on a short one: they read what changed."""

import pytest

from .long_history import MEGABYTES, cost, make

SHORT = 60


@pytest.mark.parametrize(
    ("runs", "times"), [(600, 1.25), pytest.param(10_000, 5.0, marks=pytest.mark.nightly)]
)
def test_long_history_is_cheap(tmp_path, runs, times):
    """A walk over all runs would make 10 and 167 times as many calls."""
    for count in (SHORT, runs):
        make(tmp_path / f"{count}.sqlite", count)
    for words in ("report", "history", "history --case rssr"):
        _, few, _, _ = cost(*words.split(), "--history", tmp_path / f"{SHORT}.sqlite")
        status, calls, megabytes, said = cost(
            *words.split(), "--history", tmp_path / f"{runs}.sqlite"
        )
        assert (status, megabytes < MEGABYTES) == (0, True), said
        assert few < calls < times * few, words
    assert str(runs) in said
