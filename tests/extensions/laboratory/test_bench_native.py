"""The native engine's own benchmarks: they measure what they say, and solve what they time. No time
is judged.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from kincheck import Outcome, SolveError, adapters, cases
from kincheck.core.case.case import without_forces
from kincheck.core.cli.main import main
from kincheck.core.extensions.laboratory.bench import (
    designs,
    forces,
    precision,
    processes,
    rounds,
    size,
)

from ...support.loads import loaded

TOL = 1e-12


def test_native_efforts_grow_in_precision(monkeypatch):
    # twice four predict to 3e-9
    monkeypatch.setattr("kincheck.core.extensions.llvm.compiler.vector_width", lambda: 8)
    case = cases.load("rssr")
    found = [
        each.entry for each in precision.contestants(case, adapters.engine("native").efforts(), TOL)
    ]
    errors, iterations = (
        [each.errors.position for each in found],
        [each.iterations for each in found],
    )
    assert iterations[0] == 1.0
    assert iterations == sorted(iterations)
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 1e-8
    assert errors[-1] < 1e-14
    assert len({json.dumps(dict(each.settings)) for each in found}) == len(found)


def test_levels_compute_requested_orders_only():
    case = without_forces(cases.load("rssr"))
    found = {
        each.entry.setting: each.entry
        for each in precision.contestants(case, precision.LEVELS, TOL)
    }
    assert {each.outcome for each in found.values()} == {Outcome.PASS}
    assert found["every body and point: position"].errors.velocity is None
    assert found[precision.EVERYTHING].errors.acceleration < 1e-11
    assert found[precision.NUMPY].loop == "python"


def test_force_level_needs_masses():
    case = cases.load("double_cardan")
    assert precision.levels(case) == precision.LEVELS
    case = replace(case, mechanism=loaded(case.mechanism))
    engine = precision.levels(case)[precision.FORCES]
    found = engine.solve(engine.build(case), case, TOL)
    assert [*found.forces.joints] == [joint.name for joint in case.mechanism.joints]
    assert [*found.bodies] == [body.name for body in case.mechanism.moving]


def test_loops_alone_solve_every_sample():
    pytest.importorskip("llvmlite")
    case = cases.load("mcpherson_strut")
    assert np.isfinite(precision.loops_alone(case, TOL)()).all()
    out_of_reach = replace(case, sweep=replace(case.sweep, values=np.linspace(0.0, 0.6, 61)))
    with pytest.raises(SolveError, match="of 61 samples"):
        precision.loops_alone(out_of_reach, TOL)()


def test_flops_per_sample():
    size = precision.program_size(cases.load("rssr"))
    once, twice = (precision.flops_of_sample(size, n) for n in (1.0, 2.0))
    assert twice - once == size.flops["newton"]
    assert once == sum(
        size.flops[name] for name in ("extrapolate", "newton", "outputs", "joined_gaps", "joined")
    )


def test_peak_kernel_arithmetic():
    pytest.importorskip("llvmlite")
    kernel = rounds.prepare()
    factor, term, *rest = kernel.memory.reshape(-1, kernel.width)[:, 0]
    assert (factor, term) == (0.5, 1.0)
    assert rest[0] == 1.0
    kernel()
    assert (kernel.memory[2 * kernel.width :] == 2.0).all()  # where x = 0.5 x + 1 ends
    assert kernel.flops == 2 * kernel.width * rounds.CHAINS * rounds.STEPS
    assert kernel.rate(rounds.spread([1.0, 2.0])) == kernel.flops


def test_batch_measurement_of_designs(monkeypatch):
    monkeypatch.setattr(designs, "SIZES", (1, 5))
    one, five = designs.measure_batches(cases.load("mcpherson_strut"), TOL, 1, None)
    assert (one.variants, five.variants) == (1, 5)
    assert (five.solved, five.retried, five.of_peak) == (1.0, 0, None)
    assert max(one.error, five.error) < 1e-15


def test_study_measurement_by_threads(monkeypatch):
    pytest.importorskip("llvmlite")
    monkeypatch.setattr(designs, "VARIANTS", 128)
    monkeypatch.setattr(designs.os, "cpu_count", lambda: 4)
    one, two = designs.measure_studies(cases.load("mcpherson_strut"), TOL, 3, rounds.prepare())
    assert (one.jobs, two.jobs, one.unsolved, two.unsolved) == (1, 2, 0, 0)
    assert (one.times.least, one.peak_times.median, one.us_per_sample.rounds) == (1.0, 1.0, 3)
    assert (two.times.rounds, two.peak_times.rounds) == (3, 3)
    monkeypatch.setattr(designs.os, "cpu_count", lambda: 1)
    (alone,) = designs.measure_studies(cases.load("mcpherson_strut"), TOL, 1, None)
    assert (alone.variants, alone.peak_times) == (128, None)


@pytest.mark.needs("blocks")
def test_chain_sizes_until_time_limit(monkeypatch):
    monkeypatch.setattr(size, "LOOPS", (1, 2))
    monkeypatch.setattr(size, "MANY", (3, 4))
    monkeypatch.setattr(size, "CRANKS", (4,))
    found = size.measure_sizes([adapters.engine("native")], TOL, 1)
    assert [(each.engine, each.loops, each.bodies) for each in found] == [
        ("native", 1, 3),
        ("native", 2, 5),
        ("native, by components", 3, 7),
        ("native, by components", 4, 9),
        ("native", 4, 7),
    ]
    assert all(each.outcome is Outcome.PASS and each.error < 1e-13 for each in found)
    monkeypatch.setattr(size, "LONGEST", 0.0)
    _, second, *_ = size.measure_sizes([adapters.engine("native")], TOL, 1)
    assert (second.outcome, second.us_per_sample) == (None, None)
    assert second.message.startswith("not tried: 1 took")


@pytest.mark.needs("blocks")
def test_scaling_rows_have_residual_and_error():
    rows = size.measure_scalings([3], TOL, rounds=1)
    assert [(row.mechanism, row.size, row.bodies, row.unknowns) for row in rows] == [
        ("chain", 3, 7, 42),
        ("ring", 3, 5, 30),
    ]
    assert all(row.residual <= 1e-15 for row in rows)
    assert all(row.error <= 1e-14 for row in rows)
    assert all(row.us_per_value.median > 0.0 for row in rows)


def test_motion_without_machine_code(capsys):
    assert main("bench numpy --case rssr --rounds 1 --json -".split()) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["samples"] == {"rssr": 181}
    assert found["us_per_sample"]["rssr"]["least"] > 0.0
    assert main("bench numpy --case rssr nosuch".split()) == 2
    assert "no case 'nosuch'" in capsys.readouterr().err


def test_forces_beside_motion(capsys):
    assert main("bench forces --case rssr --rounds 1 --json -".split()) == 0
    assert [*json.loads(capsys.readouterr().out)["us_per_sample"]["rssr"]] == [*forces.WAYS]


def test_cost_by_size(capsys):
    assert main("bench size --loops 1 2 --rounds 1 --json -".split()) == 0
    found = json.loads(capsys.readouterr().out)["mechanisms"]
    first, second = found["chain of four-bar loops"]
    assert (first["size"], second["size"], first["step"]) == (1, 2, None)
    assert second["step"] == pytest.approx(second["us_per_sample"] / first["us_per_sample"] / 2)
    assert found["ring of cranks"] == []


def test_growth_of_largest_sizes():
    timed = [(1, 1.0), (100, 2.0), (1000, 9.0), (10000, 200.0)]
    of = dict.fromkeys(("mechanism", "engine", "mode", "loop", "message"), "")
    sizes = [size.Size(**of, loops=n, bodies=0, us_per_sample=rounds.spread([t])) for n, t in timed]
    assert size.growth(sizes) == pytest.approx((100, 10000, 1.0))
    assert size.growth(sizes[:2]) == pytest.approx((1, 100, np.log10(2.0) / 2.0))
    assert size.growth(sizes[:1]) is None


@pytest.mark.nightly
def test_process_measurement(monkeypatch):
    name = "mcpherson_strut"
    found = processes.measure_processes(cases.load(name), name, [adapters.engine("native")], TOL, 1)
    by_name = {each.what: each for each in found}
    assert list(by_name) == [
        processes.NUMPY,
        processes.EMPTY,
        processes.CACHED,
        "kincheck run --engine native",
    ]
    assert {each.status for each in found} == {0}
    assert by_name[processes.EMPTY].beyond_numpy > 0.0
    assert by_name[processes.NUMPY].beyond_numpy is None
    monkeypatch.setattr(processes, "_IMPORT_NUMPY", "raise SystemExit(3)")
    with pytest.raises(RuntimeError, match="exit status 3"):
        processes.measure_processes(cases.load(name), name, [], TOL, 1)
