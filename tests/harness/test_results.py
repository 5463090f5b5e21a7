"""Results as JSON, JUnit XML and a table."""

import json
import struct
import sys
import xml.etree.ElementTree as ET

import msgspec
import pytest
from kincheck.core.cli import main
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.report.junit import to_junit
from kincheck.core.report.table import print_table

from ..support.fakes import Fake, crank, exact, off, partial, raising

TOL = 1e-12


def test_json_has_the_keys_of_the_schema_and_every_digit():
    p = exact(crank())[0]
    results = run(
        [crank()],
        [Fake(), Fake("partial", answer=partial), Fake("missing", installed=None)],
        tol=TOL,
        command="kincheck run",
    )
    text = to_json(results)
    read = json.loads(text)
    assert list(read) == ["schema", "run", "records", "references", "scenes", "suspects"]
    assert read["schema"] == "kincheck-results/1"
    assert read["run"]["engines"] == {"fake": "1.2", "partial": "1.2", "missing": None}
    first = read["records"][0]
    bits = [struct.pack("d", value) for value in first["outputs"]["y"]["position"]]
    assert bits == [struct.pack("d", value) for value in p[:, 1]]
    assert (
        read["references"]["crank"]["x"]["acceleration"]
        == crank().reference["x"].acceleration.tolist()
    )
    assert read["run"]["cases"]["crank"]["driver"]["type"] == "joint_angle"
    assert from_json(text) == results


def test_json_keeps_lists_on_lines():
    message = 'list [1,2,\t3] of "quoted, [4,5]" numbers'
    results = run([crank()], [Fake(answer=raising(ValueError(message)))], tol=TOL)
    text = to_json(results)
    assert from_json(text).records[0].message == f"ValueError: {message}"
    assert b'"angle": [' not in text
    lines = to_json(run([crank()], [Fake()], tol=TOL)).decode().splitlines()
    assert any(line.strip().startswith('"angle": [-1.0, ') and line.endswith("]") for line in lines)


def test_foreign_results_are_refused():
    with pytest.raises(msgspec.ValidationError, match=r"kincheck-results/2"):
        from_json(b'{"schema": "kincheck-results/2", "run": {}, "records": []}')


def test_undecodable_messages_still_give_json_and_xml():
    results = run(
        [crank()],
        [Fake(answer=raising(ValueError("bad \udcff and \x00")))],
        tol=TOL,
        command="kincheck \udcff",
    )
    assert from_json(to_json(results)) == results
    ET.fromstring(to_junit(results))


def test_junit_has_a_test_case_per_case_engine_and_output():
    engines = [
        Fake("right"),
        Fake("wrong", answer=off("position", lambda p: p * [1.0, -1.0, 1.0])),
        Fake("partial", answer=partial),
        Fake("broken", answer=raising(ValueError("no"))),
        Fake("missing", installed=None),
        Fake("unable", refusal="no such joint"),
    ]
    root = ET.fromstring(to_junit(run([crank("a"), crank("b")], engines, tol=TOL)))
    tests = root.findall(".//testcase")
    assert len(tests) == 2 * 6 * 2
    assert root.find("testsuite").attrib == {
        "name": "a",
        "tests": "12",
        "failures": "3",
        "errors": "2",
        "skipped": "4",
    }
    found = {
        (test.get("classname"), test.get("name")): [
            (child.tag, child.get("message")) for child in test
        ]
        for test in tests
    }
    assert found["a.right.projection", "x"] == []
    assert found["a.wrong.projection", "x"] == []  # only y is wrong
    assert found["a.wrong.projection", "y"][0][0] == "failure"
    assert "y: position is off by" in found["a.wrong.projection", "y"][0][1]
    assert found["a.partial.projection", "x"] == [
        (
            "failure",
            (
                "7 of 9 samples solved: cannot be followed beyond 0.5; closed form has values at 2"
                " of the others"
            ),
        )
    ]
    assert found["b.broken.projection", "y"] == [("error", "error: ValueError: no")]
    assert found["b.missing.projection", "y"] == [
        (
            "skipped",
            (
                "unavailable: missing is not installed, or cannot be imported: kincheck doctor says"
                " which"
            ),
        )
    ]
    assert found["b.unable.projection", "y"] == [("skipped", "unsupported: no such joint")]


def test_a_long_message_is_not_broken_into_lines(capsys):
    message = "row " * 200
    print_table(run([crank()], [Fake(answer=raising(ValueError(message)))], tol=1e-12), sys.stdout)
    assert message.strip() in capsys.readouterr().out


def test_missing_engines_have_a_row_each_and_one_message(capsys):
    engines = [Fake("one"), Fake("two", installed=None), Fake("three", installed=None)]
    found = run([crank(), crank("other")], engines, tol=TOL)
    print_table(found, sys.stdout)
    said = capsys.readouterr().out
    assert "unavailable: two, three: not installed, or cannot be imported" in said
    assert [said.count(name) for name in ("two", "three")] == [3, 3]


def test_the_table_names_modes_where_there_are_several(capsys):
    print_table(run([crank()], [Fake("one"), Fake("two")], tol=TOL), sys.stdout)
    assert "projection" not in capsys.readouterr().out
    print_table(run([crank()], [Fake("one"), Fake("two", mode="simulate")], tol=TOL), sys.stdout)
    assert "two · simulate" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"run": {"a": ' + "[" * 100_000, "recursion"),
        ("{}", "expected results"),
        ('{"schema": "other"}', "expected results"),
    ],
    ids=["nested", "empty", "another schema"],
)
def test_report_refuses_file_without_results(tmp_path, capsys, text, said):
    file = tmp_path / "results.json"
    file.write_text(text)
    assert main.main(["report", str(file)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"kincheck: {file}: found ")
    assert said in line
    assert line.endswith("write the file again with kincheck run --json")
