"""What the native engine computes for a case is printed, and what it leaves out is named."""

import re
from dataclasses import replace

import numpy as np
from kincheck import cases
from kincheck.core import Distance, Point, Revolute
from kincheck.core.case.io.case_file import case_text
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.harness.native_engine import explain
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.results_file import read_results


def totals(lines):
    """Operations with one iteration, by order."""
    return [
        int(re.search(r": (\d+) with one iteration", line)[1])
        for line in lines
        if "iteration" in line
    ]


def test_program_account_names_uncomputed_parts():
    case = cases.load("mcpherson_strut")
    mechanism = replace(
        case.mechanism, points=[*case.mechanism.points, Point("unread", "lca", (1.0, 0.5, 0.0))]
    )
    lines = explain(replace(case, mechanism=mechanism))
    assert lines[0] == "mcpherson_strut: 18 unknowns for lca, knuckle, strut"
    assert "  fixed, in no program: chassis, rack" in lines
    assert "  rows solved: 18; redundant rows, only checked: none" in lines
    assert "  points computed: wheel_center; read by no output, not computed: unread" in lines
    positions, velocities, accelerations = totals(lines)
    assert positions < velocities < accelerations
    # the unread point cost nothing
    assert totals(explain(case)) == [positions, velocities, accelerations]


def test_redundant_rows_and_held_drivers_are_named():
    (line,) = (line for line in explain(cases.load("four_bar")) if "redundant" in line)
    assert line.count(":") == 5  # three rows, each JOINT: PRIMITIVE
    assert "none" not in line


def test_run_explain_prints_program_account(capsys):
    assert main("run rssr --engine native --explain".split()) == 0
    assert "rssr: 12 unknowns for crank, rocker" in capsys.readouterr().out
    assert main("run rssr --engine native --explain --json -".split()) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("{")
    assert "12 unknowns" in captured.err


def test_joints_between_fixed_bodies_are_skipped(tmp_path, capsys):
    """As a CAD export has them. What is written is read as the same case."""
    case = cases.load("mcpherson_strut")
    case = replace(
        case, sweep=replace(case.sweep, values=np.linspace(-0.05, 0.05, 3)), reference={}
    )
    bolts = [
        Revolute("bolt", "chassis", "rack", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        Distance("stay", "ground", "chassis", ((0, 0, 0), (0, 0, 1))),
    ]
    file = tmp_path / "strut.toml"
    bolted = replace(case.mechanism, joints=[*bolts, *case.mechanism.joints])
    file.write_text(case_text(replace(case, mechanism=bolted)))
    assert load(file).mechanism == bolted
    assert main(f"run {file} --explain --jobs 0 --json {tmp_path / 'out.json'}".split()) == 0
    assert (
        "  joints between fixed bodies, satisfied at design, left out: bolt, stay"
        in capsys.readouterr().out.splitlines()
    )
    for record in read_results(tmp_path / "out.json").records:
        assert record.outcome in (Outcome.PASS, Outcome.UNJUDGED, Outcome.UNAVAILABLE), (
            record.message
        )
