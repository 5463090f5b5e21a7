"""The command diagnose: what it says, and its exit statuses."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from kincheck import cases
from kincheck.core import (
    Distance,
)
from kincheck.core.cli.main import main
from kincheck.core.studies.diagnosis import diagnose


@pytest.mark.parametrize(
    ("edit", "status", "said"),
    [
        (lambda text: text, 0, "suggested"),
        (
            lambda text: text.replace("stop = 0.08", "stop = 0.4"),
            1,
            "finding: cannot be followed beyond stroke = 0.29333",
        ),
        (
            lambda text: text.replace('type = "distance"', 'type = "spherical"').replace(TWO, ONE),
            1,
            "cannot move what it drives",
        ),
        (
            lambda text: text[: text.index("[joints.tie_rod]")] + text[text.index("[points.") :],
            1,
            "1 motion is left free",
        ),
        (lambda text: text.replace("[1.0, 0.55, 0.6]", "[1.0, 0.55]"), 2, "bodies.strut.origin"),
    ],
)
def test_explain_status_follows_findings(edit, status, said, tmp_path, capsys):
    text = (Path(cases.__file__).parent / "mcpherson_strut.toml").read_text(encoding="utf-8")
    file = tmp_path / "strut.toml"
    file.write_text(edit(text[: text.index("[reference]")]), encoding="utf-8")
    assert main(f"explain {file} --samples 5 --json {tmp_path / 'found.json'}".split()) == status
    captured = capsys.readouterr()
    assert said in captured.out + captured.err
    if status < 2:
        found = json.loads((tmp_path / "found.json").read_text())
        assert found["schema"] == "kincheck-explain/1"
        assert bool(found["findings"]) == bool(status)


TWO = "points = [[1.115, 0.665, 0.118], [1.14, 0.355, 0.1455]]"
ONE = "point = [1.115, 0.665, 0.118]"


def test_every_case_of_the_library_is_found_sound(capsys):
    for name in ("four_bar", "bricard", "delta_robot", "mcpherson_suspension"):
        assert main(["explain", name, "--samples", "3"]) == 0
        out = capsys.readouterr().out
        assert "finding" not in out
        assert f"{name}: " in out  # what the native engine computes


def test_over_constraint_names_freeing_joints(capsys):
    rssr = cases.load("rssr")
    tip = (2.0, 4.9257889538274894, 2.2330703487241702)
    brace = Distance("brace", "ground", "rocker", points=((1.0, 3.0, 0.0), tip))
    mechanism = replace(rssr.mechanism, joints=[*rssr.mechanism.joints, brace])
    found = diagnose(replace(rssr, mechanism=mechanism), samples=1, tol=1e-12)
    assert found.freeing == ["rod", "brace"]
    assert found.verdict == (
        "over-constrained, a driver cannot move: 0 degrees of freedom, 1 driver; it moves without"
        " 'rod' or 'brace'"
    )
    assert "take out 'rod' or 'brace'" in found.findings[0]
    assert main(["explain", "-q", "rssr"]) == 0
    (verdict,) = capsys.readouterr().out.splitlines()
    assert verdict.startswith("rssr: it can be solved: 1 degree of freedom, 1 driver, 0 redundant")
