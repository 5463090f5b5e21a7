"""Sizes that are improbable for their unit get a note that names the number, the unit and what it
may be; never an error.
"""

from functools import reduce

import pytest
from kincheck import cases
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.notes import notes
from kincheck.core.cli import main

from ...support.case_texts import write
from ...support.examples import examples

TEXT, IMPROBABLE, PROBABLE = examples(__file__, "text", "improbable", "probable")


def said(tmp_path, length="mm", angle="deg", size="500", driver="push", way="80"):
    values = {"LENGTH": length, "ANGLE": angle, "SIZE": size, "DRIVER": driver, "WAY": way}
    text = reduce(lambda text, key: text.replace(key, values[key]), values, TEXT)
    return notes(load_case(write(tmp_path, text)))


@pytest.mark.parametrize(
    "given",
    PROBABLE,
    ids=str,
)
def test_probable_size_has_no_note(tmp_path, given):
    assert said(tmp_path, **given) == []


@pytest.mark.parametrize(
    ("given", "words"),
    IMPROBABLE,
    ids=str,
)
def test_improbable_size_is_noted(tmp_path, given, words):
    """In the units of the file."""
    (note,) = said(tmp_path, **given)
    assert [each for each in words.split(" ... ") if each not in note] == []


def test_built_in_cases_have_no_notes():
    assert {name: found for name in cases.names() if (found := notes(cases.load(name)))} == {}


@pytest.mark.needs("explain")
def test_size_note_in_run_and_explain(tmp_path, capsys):
    said(tmp_path, way="0.08")
    file = str(tmp_path / "case.toml")
    note = "driver 'push' goes from -0.08 mm to 0.08 mm"
    options = "--jobs 0 --engine native mujoco --out".split()
    assert main.main(["run", file, *options, str(tmp_path / "out")]) == 0
    assert note in capsys.readouterr().out
    assert note.replace("'", "&#39;")[8:] in (tmp_path / "out" / "report.html").read_text()
    main.main(["explain", file])
    assert note in " ".join(capsys.readouterr().out.split())
