"""States over synthetic nights: what is worse stays red until it is good again or accepted, since
the right run, and quiet nights are never red.
"""

import dataclasses
import random

import pytest
from kincheck import Outcome
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.harness.provenance import case_facts
from kincheck.core.history.findings import Kind
from msgspec.structs import replace

from ..support.examples import examples
from ..support.fakes import crank
from ..support.history_runs import (
    FIRST,
    RESULTS,
    changed,
    history,
    keep,
    keep_changed,
    nights,
    records,
    report,
    reported,
    times,
    worse,
)

(WRONG,) = examples(__file__, "wrong")

NIGHTS = 30


def noisy(noise):
    """Records of a night: times about 8 % and errors about 30 % off 2.5e-14 m."""
    found = records(noise=noise)
    for each in found:
        for output in ("x", "y"):
            factor = 0.05 * 2.0 ** noise.uniform(-0.5, 0.5)
            about = {"case": each.case, "engine": each.engine}
            found = changed(found, **about, **worse(factor, output))
    return found


def circumstances(noise, upgrade):
    """Circumstances of a night: the loop's noise, and a version that may change."""
    return {
        "calibration_seconds": 0.02 * noise.uniform(0.9, 1.1),
        "numpy": "2.1.0" if upgrade else "2.0.0",
    }


PLANTED = {
    "drift": (worse(30000.0), Kind.DRIFTED),
    "time": (times(2.6), Kind.SLOWER),
    "failure": ({"outcome": Outcome.FAIL, "message": "x is off"}, Kind.FAILURE),
    "lost": ({"solved": 7}, Kind.LOST),
}


def seeds(count):
    """One seed by day, and the others at night."""
    return [1, *(pytest.param(k, marks=pytest.mark.nightly) for k in range(2, count + 1))]


@pytest.mark.parametrize("seed", seeds(40))
def test_quiet_nights_are_never_red(path, seed):
    noise = random.Random(seed)
    upgrade = noise.randrange(5, NIGHTS)
    for night in range(NIGHTS):
        if noise.random() < 0.1:
            continue  # a missing night
        keep(path, noisy(noise), **circumstances(noise, night >= upgrade))
        if night % 10 == 9 or night == NIGHTS - 1:
            found = reported(path)
            assert (found.regressions, found.steps) == ([], [])


@pytest.mark.parametrize("what", PLANTED)
@pytest.mark.parametrize("seed", seeds(8))
def test_planted_step_stays_until_repaired(path, what, seed):
    changes, kind = PLANTED[what]
    noise = random.Random(seed)
    begin = noise.randrange(7, 20)
    lasting = 3 if what == "time" else noise.randrange(2, 9)
    upgrade = noise.choice((begin, begin + 1, NIGHTS))
    first = None
    for night in range(begin + lasting + 2):
        bad = begin <= night < begin + lasting
        made = noisy(noise)
        made = changed(made, **changes) if bad else made
        run = keep(path, made, **circumstances(noise, night >= upgrade))
        first = first or (run if bad else None)
        if night < begin - 1:
            continue
        found = reported(path)
        assert found.regressed is bad
        if bad:
            about = {(each.kind, each.case, each.engine, each.since) for each in found.regressions}
            assert about == {(kind, *FIRST, first)}


def test_accepted_step_is_told_once(path, capsys):
    nights(path, 6)
    for _ in range(2):
        keep_changed(path, **worse(20.0), **times(2.6))
    assert {each.since for each in reported(path).regressions} == {7}
    assert history(path, "--accept", "first:mujoco", "--reason", "the new version") == 0
    assert "first in mujoco is accepted in run 8 by " in capsys.readouterr().out
    told = []
    for _ in range(3):
        found = reported(path)
        assert found.regressions == []
        told.append([each.reason for each in found.accepted])
        keep_changed(path, **worse(20.0), **times(2.6))
    assert told == [["the new version"], ["the new version"], []]
    keep_changed(path, **worse(400.0), **times(2.6))
    assert [(each.kind, each.since, each.against) for each in reported(path).regressions] == [
        (Kind.DRIFTED, 12, 11)
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    WRONG,
)
def test_wrong_acceptance_is_refused(path, capsys, words, said):
    nights(path, 2)
    assert history(path, *words) == 2
    assert said in capsys.readouterr().err


def test_other_machine_hides_no_slowdown(path):
    nights(path, 6)
    keep_changed(path, **times(2.6))
    keep(path, changed(records(), **times(2.6)), processor="another")
    (finding,) = reported(path).regressions
    assert (finding.kind, finding.since, finding.against) == (Kind.SLOWER, 7, 6)
    nights(path, 1)
    assert report(path) == 0


def test_other_failure_keeps_first_step(path):
    nights(path, 3)
    keep_changed(path, **worse(20.0))
    keep_changed(path, outcome=Outcome.ERROR, errors={})
    keep_changed(path, **worse(20.0))
    assert [(each.kind, each.since) for each in reported(path).regressions] == [(Kind.DRIFTED, 4)]


def test_pair_wrong_from_first_run(path):
    bad = changed(records(), outcome=Outcome.FAIL)
    for _ in range(2):
        keep(path, bad)
    assert [(each.kind, each.since) for each in reported(path).regressions] == [(Kind.FAILURE, 1)]
    keep(path, [replace(each) for each in records()])
    assert report(path) == 0


def under(name, found):
    return [replace(each, case=name) if each.case == "first" else each for each in found]


def named(*former):
    """Facts of the cases after the new name."""
    facts = dict(RESULTS.run["cases"])
    about = {"formerly": list(former)} if former else {}
    return {"cases": {"gate": facts.pop("first") | about, **facts}}


def test_renamed_case_keeps_series(path, capsys):
    nights(path, 6)
    keep_changed(path, **worse(20.0))
    for _ in range(2):
        keep(path, under("gate", changed(records(), **worse(20.0))), **named("door", "first"))
        found = reported(path)
        about = [(each.kind, each.case, each.since, each.against) for each in found.regressions]
        assert about == [(Kind.DRIFTED, "gate", 7, 6)]
        assert [(each.case, each.first) for each in found.steps] == [("gate", 7)]
        assert not {Kind.ADDED, Kind.ABSENT} & {each.kind for each in found.findings}
    assert history(path, "--case", "gate", "--engine", "mujoco") == 0
    assert capsys.readouterr().out.count("2026-11-0") >= 9
    keep(path, under("gate", records()), **named("first"))
    assert report(path) == 0


def test_new_name_is_proposed_by_content(path):
    nights(path, 3)
    keep(path, under("gate", records()), **named())
    said = {
        each.engine: each.message for each in reported(path).findings if each.kind is Kind.ADDED
    }
    assert said.keys() == {"native", "mujoco"}
    for message in said.values():
        assert 'looks like first of run 3: write formerly = ["first"]' in message
    other = changed(under("door", records()), case="door", engine="native", outputs={})
    keep(path, [each for each in other if each.engine == "native"], **named())
    assert "looks like" not in str(reported(path).findings)


def test_case_file_keeps_former_names(tmp_path):
    file = tmp_path / "crank.toml"
    renamed = dataclasses.replace(crank("gate"), formerly=("door", "flap"))
    file.write_text(case_text(renamed), "utf-8")
    case = load_case(file)
    assert case.formerly == ("door", "flap")
    assert case_facts(case)["formerly"] == ["door", "flap"]


def without_first(found):
    return [each for each in found if each.pair[:2] != FIRST]


def gone_since(path):
    """Kind and first run of what is worse."""
    return [(each.kind, each.pair[:2], each.since) for each in reported(path).regressions]


def test_vanished_failure_stays_red(path, capsys):
    nights(path, 2)
    keep_changed(path, outcome=Outcome.FAIL, message="x is off")
    for _ in range(3):
        keep(path, without_first(records()))
        assert gone_since(path) == [(Kind.LOST, FIRST, 3)]
    assert report(path) == 1
    keep_changed(path, outcome=Outcome.FAIL, message="x is off")
    assert gone_since(path) == [(Kind.FAILURE, FIRST, 3)]
    keep(path, without_first(records()))
    keep(path, records())
    assert report(path) == 0


def test_vanished_failure_is_accepted(path, capsys):
    nights(path, 2)
    keep_changed(path, outcome=Outcome.FAIL, message="x is off")
    keep(path, without_first(records()))
    assert history(path, "--accept", "first:mujoco", "--reason", "no such case any more") == 0
    for _ in range(2):
        assert gone_since(path) == []
        keep(path, without_first(records()))
    keep_changed(path, **worse(30.0))  # its baseline is still its last good run
    assert gone_since(path) == [(Kind.DRIFTED, FIRST, 7)]


def test_killed_run_forgets_no_failure(path):
    nights(path, 2)
    keep_changed(path, outcome=Outcome.FAIL, message="x is off")
    keep(path, without_first(records()), status="interrupted")
    keep(path, without_first(records()))
    assert gone_since(path) == [(Kind.LOST, FIRST, 3)]


def test_drift_is_hidden_by_no_selection(path):
    """All of its results pass, and another selection is run after it."""
    other = {"command": "kincheck run second"}
    second = [each for each in records() if each.case == "second"]
    for _ in range(2):
        keep(path, records())
        keep(path, second, **other)
    run = keep_changed(path, **worse(30000.0))
    keep(path, second, **other)
    found = reported(path)
    assert (found.run.number, found.regressed) == (run, True)
