"""Progress of long work."""

from kincheck.core.extensions.sweep.meter import Meter


def test_progress_states_remaining_time(capsys, monkeypatch):
    now = iter([0.0, 0.0, 90.0, 100.0])
    monkeypatch.setattr("kincheck.core.extensions.sweep.meter.perf_counter", lambda: next(now))
    with Meter("stress", every=5.0) as meter:
        meter("arms", 0.0)
        meter("folds", 0.25)
        meter("hidden", 0.3)
    found = ["stress: arms (0 %)", "stress: folds (25 %, about 4 min 30 s left)"]
    assert capsys.readouterr().err.splitlines()[:2] == found


def test_quiet_progress_is_silent(capsys):
    with Meter("stress", quiet=True) as meter:
        meter("arms", 0.5)
    assert capsys.readouterr() == ("", "")
