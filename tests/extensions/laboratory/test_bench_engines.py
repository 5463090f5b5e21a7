"""The benchmark of engines: contestants in turns, its numbers in its report, and the command."""

import json
import shlex
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from kincheck import Outcome
from kincheck.adapters.floors.floors import Floor
from kincheck.core.case.case import Truth
from kincheck.core.cli import main
from kincheck.core.extensions.laboratory import command as command
from kincheck.core.extensions.laboratory.bench import engines, precision, rounds
from kincheck.core.extensions.laboratory.bench.engines import Bench
from kincheck.core.extensions.laboratory.bench.report import precision_diagram, report
from kincheck.core.extensions.laboratory.paper import formulation
from kincheck.core.extras import THREADS
from kincheck.core.report.sections import page

from ...report.page import Page
from ...support.fakes import Fake, crank, off, partial, raising, solution

TOL = 1e-12


# Rounds


def test_bench_contestants_take_turns(monkeypatch):
    monkeypatch.setattr(rounds, "TURN", 1e-12)  # one call a turn
    called = []
    found = rounds.take_turns({name: lambda name=name: called.append(name) for name in "ab"}, 3)
    assert "".join(called) == rounds.FIRST * "a" + rounds.FIRST * "b" + 3 * "ab"
    assert [each.rounds for each in found.values()] == [3, 3]


def test_quick_work_is_warmed_and_repeated(monkeypatch):
    clock = iter(range(1000))
    # every work seems to take a millisecond
    monkeypatch.setattr(rounds, "perf_counter", lambda: 1.1e-3 * next(clock))
    called = []
    found = rounds.take_turns({"a": lambda: called.append("a")}, 2)
    assert len(called) == rounds.FIRST + 2 * (1 + 2)  # a turn of 2 ms, and a call before each
    # the clock goes on once in a turn, for two calls
    assert found["a"].median == pytest.approx(0.55e-3)


def test_slow_first_calls_are_not_timed(monkeypatch):
    now, took = [0.0], iter([0.1, 0.2, *[0.001] * 200])
    monkeypatch.setattr(rounds, "perf_counter", lambda: now[0])

    def work():
        now[0] += next(took)

    assert rounds.warm_up(work) == pytest.approx(0.001)
    took = iter([0.3] * 100)
    begin = now[0]
    assert rounds.warm_up(work) == pytest.approx(0.3)
    assert now[0] - begin == pytest.approx(0.6)  # it is slow: twice is enough


def test_spread_has_quartiles():
    found = rounds.spread([4.0, 1.0, 2.0, 3.0, 100.0])
    assert (found.least, found.lower, found.median, found.upper, found.rounds) == (
        1.0,
        2.0,
        3.0,
        4.0,
        5,
    )
    assert found.times(10.0).upper == 40.0


# Work and precision


@dataclass
class Measured(Fake):
    """With efforts, off by a micrometre or not at all."""

    def efforts(self):
        return {
            "coarse": Fake(self.name, off("position", lambda p: p + 1e-6), mode=self.mode),
            "fine": Fake(self.name, mode=self.mode),
        }


def test_precision_entry_has_error():
    coarse, fine = precision.contestants(crank(), Measured().efforts(), TOL)
    assert (coarse.entry.setting, coarse.entry.outcome, fine.entry.outcome) == (
        "coarse",
        Outcome.FAIL,
        Outcome.PASS,
    )
    assert coarse.entry.errors.position == pytest.approx(1e-6)
    assert (fine.entry.errors.velocity, fine.entry.iterations, fine.entry.against) == (
        0.0,
        3.0,
        "closed_form",
    )
    entry = fine.timed(rounds.spread([9e-6]))
    assert entry.us_per_sample.median == pytest.approx(1.0)  # nine samples


@pytest.mark.parametrize(
    ("engine", "outcome"),
    [
        (Fake(installed=None), Outcome.UNAVAILABLE),
        (Fake(refusal="no cranks"), Outcome.UNSUPPORTED),
        (Fake(answer=raising(RuntimeError("broken"))), Outcome.ERROR),
        (Fake(answer=partial), Outcome.FAIL),
    ],
    ids=["missing", "unable", "broken", "partial"],
)
def test_unsolved_effort_is_untimed(engine, outcome):
    found = precision.contestants(crank(), {"one": engine}, TOL)
    assert [(each.entry.outcome, each.work) for each in found] == [(outcome, None)]
    assert found[0].entry.message
    (needed, *_) = precision.fastest_efforts([each.timed(None) for each in found])
    assert needed.us_per_sample is None
    assert needed.reason


def entries():
    """A coarse, fast effort and a fine, slow one; a third that is slower still."""
    case = crank()
    efforts = {**Measured().efforts(), "finest": Fake()}
    found = precision.contestants(case, efforts, TOL)
    return [
        each.timed(rounds.spread([seconds]))
        for each, seconds in zip(found, (9e-6, 18e-6, 27e-6), strict=True)
    ]


def test_fastest_effort_meeting_error():
    by_error = {each.required: each for each in precision.fastest_efforts(entries())}
    assert {required: each.setting for required, each in by_error.items()} == {
        1e-3: "coarse",
        1e-6: "fine",
        1e-9: "fine",
        1e-12: "fine",
    }
    assert by_error[1e-3].us_per_sample == pytest.approx(1.0)
    (none,) = [each for each in precision.fastest_efforts(entries()[:1]) if each.required == 1e-9]
    assert none.us_per_sample is None
    assert "1.0e-06 m" in none.reason


def test_bench_proves_case_without_reference():
    pytest.importorskip("flint")
    case, known = crank(reference=False), crank()
    found = precision.with_truth(case, TOL)
    assert found.truth is Truth.IN_HOUSE_ORACLE
    for name, series in known.reference.items():
        assert np.abs(found.reference[name].position - series.position).max() <= 1e-16
        assert np.abs(found.reference[name].acceleration - series.acceleration).max() <= 1e-15
    assert precision.with_truth(known, TOL) is known


# The whole


HALF = Floor(0.5, "half a microsecond", {"all": 0.5})


def measured(progress=print):
    """Of fake engines in both modes."""
    both = [
        Measured("native"),
        Measured("fake"),
        Measured("fake", mode="simulate"),
        Fake("gone", installed=None),
    ]
    floor = SimpleNamespace(load=lambda: lambda engine, case: HALF)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(precision, "offers", lambda kind: {"native": floor, "fake": floor})
        return engines.measure(
            {"crank": crank()},
            both,
            tol=TOL,
            rounds=1,
            parts=("work",),
            command="kincheck bench",
            progress=progress,
        )


def test_modes_share_neither_table_nor_diagram():
    found = measured()
    assert {(each.engine, each.mode) for each in found.entries} == {
        ("native", "projection"),
        ("fake", "projection"),
        ("fake", "simulate"),
        ("gone", "projection"),
    }
    drawn = {
        mode: precision_diagram(found, "crank", mode).figure["data"]
        for mode in ("projection", "simulate")
    }
    assert {trace["meta"] for trace in drawn["projection"]} == {
        "native",
        "fake",
        "native: floor",
        "fake: floor",
    }
    captions = {mode: precision_diagram(found, "crank", mode).plot.caption for mode in drawn}
    assert {
        mode for mode, caption in captions.items() if "A cross is a simulator's floor" in caption
    } == {"projection"}
    assert {trace["meta"] for trace in drawn["simulate"]} == {"fake · simulate"}
    tables = {section.title: section.rows for section in report(found).sections}
    assert {row[0] for row in tables["crank, simulate: work and precision"]} == {"fake"}
    assert {row[0] for row in tables["crank, projection: time at a required error"]} == {
        "native",
        "fake",
        "gone",
    }
    assert "none" in tables["crank, projection: time at a required error"][-1]


def test_bench_rows_have_loop_and_error():
    for entry in measured().entries:
        assert entry.loop
        assert entry.message if entry.us_per_sample is None else entry.errors.position is not None


def test_bench_results_are_read_back(tmp_path):
    found = measured()
    file = tmp_path / "bench.json"
    file.write_bytes(msgspec.json.encode(found))
    efforts = engines.efforts_in(file)
    assert [(each.engine, each.mode) for each in efforts["crank"]][2:] == [
        ("fake", "projection")
    ] * 2 + [("fake · simulate", "simulate")] * 2
    html = page(report(found))
    assert 'data-figure="crank-simulate"' in html
    assert "https:" not in html.partition("<script")[0]


def test_effort_residual_is_no_failure():
    def answer(case):
        return replace(solution(case), residual=1e-6)

    (effort,) = precision.contestants(crank(), {"one step": Fake(answer=answer)}, TOL)
    assert (effort.entry.outcome, effort.entry.residual) == (Outcome.PASS, 1e-6)


def test_loop_times_are_ratios_to_base(monkeypatch):
    """A made-up clock: every call of an engine takes its own time."""
    now = [0.0]
    monkeypatch.setattr(rounds, "perf_counter", lambda: now[0])

    def taking(seconds):
        def answer(case):
            now[0] += seconds * (1.0 if case.name == "short" else 3.0)
            return solution(case)

        return answer

    two = [crank("short"), crank("long")]
    found = precision.measure_loops(
        two,
        [
            Fake("slow", answer=taking(0.4)),
            Fake("pinocchio", answer=taking(0.1)),
            Fake("unable", refusal="no"),
            Fake("missing", installed=None),
        ],
        TOL,
        2,
        lambda what: None,
    )
    slow, base = found
    assert (slow.engine, base.engine) == ("slow", "pinocchio")
    assert (slow.base, slow.cases) == ("pinocchio", 2)
    assert [slow.lower, slow.ratio, slow.upper, base.ratio] == pytest.approx([4.0] * 3 + [1.0])
    samples = len(two[0].sweep.values)
    assert base.us_per_sample == pytest.approx(1e6 * 0.2 / samples)


# Tables of costs of the engine benchmark: bench.json has results and the tables of their report


@pytest.fixture(scope="module")
def costs():
    return json.loads(Path(__file__).with_name("bench.json").read_text("utf-8"))


def test_tables_of_costs_equal_file(costs):
    sections = report(msgspec.convert(costs["results"], Bench)).sections
    for section, table in zip(sections, costs["tables"], strict=True):
        shown = json.loads(msgspec.json.encode(section))
        shown["diagrams"] = [each["plot"]["figure"] for each in shown["diagrams"]]
        assert {name: shown[name] for name in table} == table


def test_cost_diagrams_equal_json(costs):
    found = costs["results"]
    html = Page(page(report(msgspec.convert(found, Bench))))
    figures = html.data["figures"]
    for key, rows, x in (("batch", "batches", "variants"), ("chain-of-loops", "sizes", "loops")):
        (curve,) = figures[key]["data"]
        some = [each for each in found[rows] if each["us_per_sample"]]
        assert curve["x"] == [each[x] for each in some]
        assert curve["y"] == [each["us_per_sample"]["median"] for each in some]
    for bar in figures["stages"]["data"]:
        assert bar["x"] == [found["processes"][1]["stages"][bar["name"]]["median"]]
        assert bar["y"] == ["empty cache"]


# The command bench: its files, its exit statuses, and its place in reports


@pytest.fixture
def one_thread(monkeypatch):
    monkeypatch.setenv(THREADS[0], "1")


@pytest.mark.usefixtures("one_thread")
def test_bench_engines_command_and_report(tmp_path, capsys):
    asked = "bench engines --rounds 1 --engine native --cases rssr --parts work".split()
    assert main.main([*asked, "--json", "-", "--out", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "kincheck-bench/1"
    assert {each["case"] for each in found["entries"]} == {"rssr"}
    assert json.loads((tmp_path / "bench.json").read_text("utf-8")) == found
    run = f"run rssr --engine native --out {tmp_path}".split()
    assert main.main(run) == 0
    assert "Work and precision" not in (tmp_path / "report.html").read_text("utf-8")
    assert main.main([*run, "--bench", str(tmp_path / "bench.json")]) == 0
    assert "Work and precision" in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.usefixtures("one_thread")
def test_bench_missing_engine_has_status_2(monkeypatch, capsys):
    found = measured()  # of an engine "gone" too
    there = [each for each in found.entries if each.engine != "gone"]
    for name, status in (("gone", 2), ("native", 0)):
        result = found if status else msgspec.structs.replace(found, entries=there)
        monkeypatch.setattr(engines, "measure", lambda *given, found=result, **options: found)
        monkeypatch.setattr(
            "kincheck.core.cli.registry.Registry.find_engines", lambda registry, names, *rest: []
        )
        assert main.main(["bench", "engines", "--engine", name, "--cases", "rssr"]) == status
        assert ("'gone' is requested, but missing" in capsys.readouterr().err) is (status == 2)


def test_run_refuses_invalid_benchmark_file(tmp_path, capsys):
    (tmp_path / "bench.json").write_text("{}")
    bad = str(tmp_path / "bench.json")
    assert main.main(["run", "rssr", "--engine", "native", "--bench", bad]) == 2
    assert "Give --out" in capsys.readouterr().err
    assert (
        main.main(["run", "rssr", "--engine", "native", "--bench", bad, "--out", str(tmp_path)])
        == 2
    )
    assert "written by kincheck bench" in capsys.readouterr().err


@pytest.mark.usefixtures("one_thread")
def test_bench_without_arguments_measures_everything(monkeypatch, tmp_path):
    asked = {}
    found = measured()
    monkeypatch.setattr(
        engines,
        "measure",
        lambda cases, engines, **options: asked.update(options, cases=cases) or found,
    )
    monkeypatch.setattr(formulation, "STATES", 1)
    assert main.main(["bench", "--out", str(tmp_path)]) == 0
    assert (tuple(asked["cases"]), asked["parts"]) == (command.CASES, engines.PARTS)
    found = json.loads((tmp_path / "bench.json").read_text("utf-8"))
    assert found["formulation"]["case"] == "mcpherson_strut"


def test_bench_restarts_with_one_thread(monkeypatch):
    for name in THREADS:
        monkeypatch.delenv(name, raising=False)
    started = []
    monkeypatch.setattr(
        subprocess,
        "run",
        lambda arguments, env, check: (
            started.append((arguments, env)) or subprocess.CompletedProcess([], 5)
        ),
    )
    assert main.main(shlex.split("bench engines --rounds 2")) == 5
    ((arguments, env),) = started
    assert arguments[-4:] == "bench engines --rounds 2".split()
    assert {env[name] for name in THREADS} == {"1"}


@pytest.mark.usefixtures("one_thread")
def test_bench_refuses_bad_options(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for options, said in (
        (["--cases", "rsr"], "'rssr'"),
        (["--engine", "natve"], "'native'"),
        (["--rounds", "0"], "not a whole number of 1 or more"),
        (["--out", str(tmp_path / "file")], "cannot be made a folder"),
    ):
        assert main.main(["bench", "engines", *options]) == 2
        assert said in capsys.readouterr().err
