"""Reports on a long history take as long as on a short one: they read what changed."""

import pytest

from .long_history import MEGABYTES, SECONDS, cost, make


@pytest.mark.parametrize("runs", [60, pytest.param(10_000, marks=pytest.mark.nightly)])
def test_long_history_is_cheap(tmp_path, runs):
    file = tmp_path / "history.sqlite"
    make(file, runs)
    for words in ("report", "history", "history --case rssr"):
        status, seconds, megabytes, said = cost(*words.split(), "--history", file)
        assert (status, seconds < SECONDS, megabytes < MEGABYTES) == (0, True, True), said
    assert str(runs) in said
