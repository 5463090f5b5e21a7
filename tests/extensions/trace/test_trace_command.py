"""kincheck trace: what it prints, and its file."""

import json
from pathlib import Path

import pytest
from kincheck.core.cli.main import main

LOWER_LIMIT = -0.316737084187394147
"""The strut's lower limit of travel [m]; tests/kinematics/test_trace.py says whence."""


def test_trace_command(tmp_path, capsys):
    file = tmp_path / "curve.json"
    assert main(["trace", "mcpherson_strut", "--length", "2.5", "--json", str(file)]) == 0
    assert "limit point at stroke = -0.316737084 m" in capsys.readouterr().out
    found = json.loads(file.read_text())
    assert found["schema"] == "kincheck-trace/1"
    (event,) = found["curves"][1]["events"]
    assert event["value"] == pytest.approx(LOWER_LIMIT, abs=1e-14)
    assert event["nearest_pose"]["kind"] == "lock-up"
    assert main(["trace", "mcpherson_strut", "--driver", "strok"]) == 2
    assert "did you mean 'stroke'" in capsys.readouterr().err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_full_disk_still_prints_curve(capsys):
    assert main("trace five_bar --length 0.1 --json /dev/full".split()) == 2
    captured = capsys.readouterr()
    assert "five_bar: left first growing" in captured.out
    assert captured.err.startswith("kincheck: --json /dev/full: cannot be written (No space left")
