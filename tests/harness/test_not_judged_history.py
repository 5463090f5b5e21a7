"""Unjudged pairs in histories and results, of earlier versions too, and in regression reports."""

import json
import sqlite3
import zlib
from contextlib import closing
from xml.etree import ElementTree as ET

import msgspec
from kincheck.core.cli import main
from kincheck.core.harness.record import Outcome, from_json, to_json
from kincheck.core.harness.results_file import read_results
from kincheck.core.history.findings import Kind
from kincheck.core.history.queries import faultless, read
from kincheck.core.history.store import Store
from kincheck.core.report.junit import to_regression_junit
from kincheck.core.report.regressions import to_markdown

from ..support.nights import changed, keep, records, reported
from .test_not_judged import WHY, unjudged


def as_of_before(results):
    """Results as older versions wrote them: a pass, compared with nothing."""
    passed = [
        msgspec.structs.replace(each, outcome=Outcome.PASS) if each.outcome == "unjudged" else each
        for each in results.records
    ]
    return msgspec.structs.replace(results, records=passed)


def test_old_results_are_read_as_unjudged(tmp_path):
    file = tmp_path / "old.json"
    file.write_bytes(to_json(as_of_before(unjudged())))
    assert [each.outcome for each in read_results(file).records] == ["unjudged", "pass"]
    assert [each.outcome for each in from_json(file.read_bytes()).records] == ["unjudged", "pass"]


def bare(all_records, engine="mujoco", *, outcome=Outcome.UNJUDGED):
    """The records with a pair that nothing is compared with."""
    nothing = {"position": None, "velocity": None, "acceleration": None, "reason": WHY}

    def emptied(errors):
        return {name: msgspec.structs.replace(each, **nothing) for name, each in errors.items()}

    return changed(all_records, engine=engine, outcome=outcome, message=WHY, errors=emptied)


def test_old_history_is_read_as_unjudged(path, capsys):
    keep(
        path,
        [
            each
            for each in bare(records(), outcome=Outcome.PASS)
            if (each.case, each.engine) == ("first", "mujoco")
        ],
    )
    with closing(sqlite3.connect(path)) as raw:  # it is as the older version left it
        ((outcome, record),) = raw.execute("SELECT outcome, record FROM records")
    assert (outcome, json.loads(zlib.decompress(record))["outcome"]) == ("pass", "pass")
    with Store(path) as store:
        assert [each.outcome for each in store.records(1)] == ["unjudged"]
        assert [entry.outcome for entries in read(store).pairs.values() for entry in entries] == [
            "unjudged"
        ]
        assert faultless(store) == set()
    assert main.main(["history", "--history", str(path)]) == 0
    assert "1 not judged" in capsys.readouterr().out
    assert main.main(f"history --history {path} --case first".split()) == 0
    assert "not judged" in capsys.readouterr().out


def test_names_that_look_like_deviations_are_none(path):
    nothing = {"position": None, "velocity": None, "acceleration": None}
    odd = msgspec.structs.replace(
        next(iter(records()[0].errors.values())), **nothing, reason='"max_abs":1'
    )
    keep(
        path, changed(records(), outcome=Outcome.PASS, errors={'"max_abs":1': odd, "max_abs": odd})
    )
    with Store(path) as store:
        outcomes = {pair[:2]: entries[0].outcome for pair, entries in read(store).pairs.items()}
    assert outcomes["first", "mujoco"] == "unjudged"
    assert outcomes["first", "native"] == "pass"


def test_runs_of_unjudged_pairs_alone_are_not_green(path):
    all_bare = bare(records(), "native")
    keep(path, [each for each in all_bare if each.outcome is Outcome.UNJUDGED])
    with Store(path) as store:
        assert faultless(store) == set()
    keep(path, all_bare)
    with Store(path) as store:
        assert faultless(store) == {2}


# Reports


def test_a_pair_that_is_no_longer_judged_is_a_regression(path):
    keep(path, records())
    keep(path, bare(records()))
    found = reported(path)
    assert [(each.kind, each.case, each.engine, each.message) for each in found.findings] == [
        (Kind.UNJUDGED, "first", "mujoco", f"pass → not judged: {WHY}")
    ]
    assert found.regressed
    assert found.unjudged == [("first", "mujoco", "projection")]
    assert "1 no longer judged" in to_markdown(found)
    with Store(path) as store:
        suite = ET.fromstring(to_regression_junit(store.results(2), found))
    assert [failure.get("message") for failure in suite.iter("failure")] == [
        f"no longer judged: pass → not judged: {WHY}"
    ]
    # as long as it is so, it is told: the run that compared most is the one to compare with
    keep(path, bare(records()))
    assert [each.kind for each in reported(path).findings] == [Kind.UNJUDGED]


def test_a_failure_that_is_no_longer_judged_is_not_fixed(path):
    keep(path, changed(records(), outcome=Outcome.FAIL, message="off"))
    keep(path, bare(records()))
    found = reported(path, against="1")
    assert [each.kind for each in found.findings] == [Kind.UNJUDGED]
    assert not found.steps or all(step.quantity != "outcome" or step.worse for step in found.steps)


def test_judged_again_is_no_regression(path):
    keep(path, bare(records()))
    keep(path, records())
    found = reported(path, against="1")
    assert [(each.kind, each.message) for each in found.findings] == [
        (Kind.JUDGED, "not judged → pass")
    ]
    assert not found.regressed
    assert "1 judged again" in to_markdown(found)
    keep(path, changed(records(), outcome=Outcome.FAIL, message="off"))
    assert [each.message for each in reported(path, against="1").findings] == [
        "not judged → fail: off"
    ]


def test_an_upgrade_is_no_regression(path):
    """The native pair was a pass in the older version, and is not judged today."""
    keep(path, bare(records(), outcome=Outcome.PASS))
    keep(path, bare(records()))
    assert (reported(path).findings, reported(path).regressed) == ([], False)


def test_a_first_report_counts_only_what_was_judged(path, capsys):
    keep(path, bare(records()))
    assert main.main(["report", "--history", str(path)]) == 0
    assert "all 3 right, 1 not judged; nothing to compare with" in capsys.readouterr().out
