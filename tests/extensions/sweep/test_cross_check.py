"""kincheck sweep --check: deviations, contradictions, and rows that an engine does not give."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters
from kincheck.cases import load
from kincheck.core.cli.main import main
from kincheck.core.errors import KincheckError
from kincheck.core.extensions.sweep.cross_check import Check, choose_variants, judge_variant
from kincheck.core.extensions.sweep.study import Study
from kincheck.core.extensions.sweep.sweep import sweep_designs
from kincheck.core.harness.execution import Pair, solve_in_process
from kincheck.core.harness.record import Outcome
from kincheck.core.trajectory import QUANTITIES

from ...support.fakes import Fake, crank, native_but, swept
from ...support.variations import vary, vary_file
from .test_sweep_command import POINTS
from .test_sweep_study import PIVOT, TIP


def deviating(variant, point, sample, name):
    """The native engine but for one variant, of which a point is a micrometre off at a sample."""

    def change(found, case):
        if f"variant {variant} " in case.name:
            found.points[point].position[sample, 1] += 1e-6
        return found

    return native_but(change, name)


@pytest.fixture
def instead(monkeypatch):
    """Has an engine stand in for the one of its name."""
    known = adapters.engine

    def put(engine):
        monkeypatch.setattr(
            adapters,
            "engine",
            lambda name, *mode: engine if name == engine.name else known(name, *mode),
        )

    return put


def test_sweep_check_finds_deviating_variant(tmp_path):
    case = crank()
    variation = vary(tmp_path, case, tip=TIP, pivot=PIVOT)
    (some,) = choose_variants(600, 1 / 600, 4)
    picked = choose_variants(600, 0.05, 4)
    assert len(picked) == 30
    assert choose_variants(600, 1e-9, 4) == {some}
    at = sorted(picked)[7]
    found = sweep_designs(
        case,
        variation,
        samples=600,
        seed=4,
        check=Check(deviating(at, "tip", 4, "off"), 0.05, solve_in_process, 1e-12),
    )
    assert [each.variant for each in found.checked] == sorted(picked)
    (bad,) = found.deviating
    assert (bad.variant, bad.outcome, bad.row) == (at, Outcome.FAIL, "y")
    assert bad.max_abs == pytest.approx(1e-6, rel=1e-3)
    assert "y: position is off by 1e-06 m at sample 4" in bad.message
    assert max(each.ratio for each in found.checked if each is not bad) < 1e-4


def test_impossible_sweep_check_is_refused(tmp_path):
    case = crank()
    variation = vary(tmp_path, case, tip=TIP)
    for engine, message in (
        (Fake("gone", installed=None), "--check gone: unavailable: gone is not installed"),
        (Fake("poor", refusal="has no hinge"), "--check poor: unsupported: has no hinge"),
    ):
        with pytest.raises(KincheckError, match=message):
            sweep_designs(
                case, variation, samples=10, check=Check(engine, 1.0, solve_in_process, 1e-12)
            )


def test_sweep_check_deviation_can_be_replayed(tmp_path, capsys, monkeypatch, instead):
    file = vary_file(tmp_path, POINTS)
    instead(deviating(4, "wheel_center", 7, "native"))
    command = f"sweep mcpherson_strut --vary {file} --seed 8 --check native:1.0".split()
    assert main([*command, "--samples", "6"]) == 1
    told = capsys.readouterr().out
    assert "6 checked with native, 1 deviate" in told
    assert (
        "fail: variant 4 (--seed 8 --replay 4): half_track_change: position is off by 1e-06 m at"
        " sample 7 (stroke = -0.073)" in told
    )
    monkeypatch.undo()
    out = tmp_path / "again"
    assert main([*command[:-2], "--replay", "4", "--out", str(out)]) == 0
    (record,) = json.loads((out / "results.json").read_text())["records"]
    assert (record["case"], record["engine"], record["outcome"]) == (
        "mcpherson_strut variant 4 of seed 8",
        "native",
        "unjudged",
    )
    assert (out / "report.html").exists()


def test_sweep_check_contradicts_unsolved_variants(tmp_path, capsys, monkeypatch, instead):
    """An engine with values where the motion ends, and one that has not converged."""
    path = vary_file(tmp_path, {"rod": {"at": "joints.rod.length", "half_width": 3500.0}})
    command = f"sweep rssr --vary {path} --samples 12 --check mujoco:1.0".split()

    monkeypatch.setattr(
        "kincheck.core.extensions.sweep.command.checking_solver",
        lambda options, engine: solve_in_process,
    )

    def checked(change):
        instead(native_but(change, "mujoco"))
        assert main(command) == 1
        return capsys.readouterr().out

    def everywhere(found, case):
        kept = {
            name: {each: np.nan_to_num(getattr(m, each)) for each in QUANTITIES}
            for name, m in found.points.items()
        }
        points = {name: replace(m, **kept[name]) for name, m in found.points.items()}
        return replace(
            found,
            points=points,
            solved=np.ones_like(found.solved),
            residual=np.nan_to_num(found.residual),
        )

    assert "fail: variant" not in (told := checked(lambda found, case: found)), told
    told = checked(everywhere)
    ends = (
        r"values at 132 of 181 samples that native cannot reach; native: cannot be followed beyond"
        r" crank = 1\.6998182"
    )
    assert re.search(r"fail: variant 11 \(.*\): " + ends, told), told
    told = checked(lambda found, case: replace(found, residual=1e-3))
    assert "the residual of samples that the engine calls solved is 0.001" in told


def nominal(tmp_path, case):
    """A study of a point's offset, the native record of its nominal design, and its rows."""
    end = {"at": case.mechanism.points[0].name, "values": [1.0]}
    study = Study(case, vary(tmp_path, case, "one_at_a_time", end=end), 2, 0, 2, 1e-12)
    pair = Pair(study.of_variant(0), adapters.engine("native"), 1e-12, timed=False)
    (_, found), *_ = solve_in_process([pair])
    values = [
        getattr(found.result.outputs[row.output.name], QUANTITIES[row.derivative])
        for row in study.rows
    ]
    return study, found, np.array(values)


def test_sweep_check_of_variant_solved_alone(tmp_path):
    """Many variants at once do not pass a singular pose that one alone does: the engine has values
    there, and native too.
    """
    case = load("iftomm_n_four_bar")
    study, found, rows = nominal(tmp_path, swept(case, np.deg2rad([0.0, 60.0, 90.0, 110.0])))
    assert found.result.solved == 4
    rows[:, 2:] = np.nan  # as many at once leave them
    record = judge_variant(study, 0, found, rows)
    assert (record.outcome, record.message) == ("pass", "")


def test_sweep_check_names_rows_without_values(tmp_path):
    """An engine with positions only passes by them; the message names the rows not judged."""
    study, found, values = nominal(tmp_path, load("rssr"))
    bare = {
        key: replace(each, velocity=None, acceleration=None)
        for key, each in found.result.outputs.items()
    }
    found = replace(found, result=replace(found.result, outputs=bare))
    derived = [row.name for row in study.rows if row.derivative]
    record = judge_variant(study, 0, found, values)
    assert record.outcome == "pass"
    assert derived
    assert record.message.startswith(f"not judged: {', '.join(derived[:3])}")
    assert record.message.endswith(": the engine gives none")
