"""The report holds the numbers of its records, escapes what comes from files, and needs no
network.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from kincheck import Results
from kincheck.core.report import sections
from kincheck.core.report.report import headline
from kincheck.core.report.sections import split_message
from msgspec.structs import replace

from ..support.strut_results import GRID, record, results, series
from .page import report

HOSTILE = "<script>alert('x')</script><a href='https://example.org'>&amp;</a>"


def test_page_starts_with_outcomes(tmp_path):
    words = report(results(), tmp_path).words
    head = words[: words.index("Overview")]
    assert "1 of 2 comparisons is outside tolerance" in head
    assert "✗ fail one on strut: half_track_change: too far off" in head
    for text in ("○ unavailable two on strut: two is not installed", "iterations 20", "a book"):
        assert text in words


def test_page_names_worst_case(tmp_path):
    cases = [("good", 1e-11), ("bad", 5e-9), ("better", 1e-15)]
    records = [record(case, "closed_form", "one", error, GRID) for case, error in cases]
    assert (
        "Worst: engine one on case bad" in report(Results(run={}, records=records), tmp_path).words
    )


@pytest.mark.parametrize(
    ("truth", "said"),
    [("closed_form", 1), ("third_party_data", 1), ("in_house_oracle", 0), ("consensus_only", 0)],
)
def test_page_says_validated_for_foreign_truth(tmp_path, truth, said):
    page = report(results(truth), tmp_path)
    assert len(re.findall("validated", page.text)) == said
    assert ("our own oracle is not validation" in page.text) == (truth == "in_house_oracle")


def test_page_escapes_text_of_files(tmp_path):
    run = results(case=HOSTILE)
    strange = replace(
        run.records[1],
        engine=HOSTILE,
        message=HOSTILE,
        settings={HOSTILE: HOSTILE},
        version=HOSTILE,
    )
    named = replace(strange, outputs={HOSTILE: series(GRID)}, errors={})
    page = report(
        Results(
            run={**run.run, HOSTILE: HOSTILE},
            records=[run.records[0], strange, named],
            references=run.references,
        ),
        tmp_path,
    )
    assert page.names == ["curves", "report-data", "script 2"]
    assert not any("alert" in page.scripts[name] for name in page.names)
    assert not [
        attrs
        for tag, attrs in page.tags
        if tag == "a" and not (attrs["href"] or "").startswith("#")
    ]
    assert page.text.count("<script>alert('x')</script>") > 5
    shown = [
        trace.get("name", "")
        for figure in page.data["figures"].values()
        for trace in figure["data"]
    ]
    shown += [
        figure["layout"][axis]["title"]["text"]
        for figure in page.data["figures"].values()
        for axis in ("xaxis", "yaxis")
    ]
    assert HOSTILE in shown  # as text, which the script puts into text nodes


def test_page_fetches_nothing(tmp_path):
    page = report(results(), tmp_path)
    assert not [
        tag for tag, _ in page.tags if tag in ("link", "img", "iframe", "object", "embed", "base")
    ]
    assert not [attrs for tag, attrs in page.tags if tag == "script" and "src" in attrs]
    policy = [
        attrs["content"]
        for tag, attrs in page.tags
        if attrs.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy
    assert str(policy[0]).startswith("default-src 'none'")
    assert "http" not in str(policy[0])


def test_page_scripts_are_stripped_and_valid(tmp_path):
    folder = Path(sections.__file__).parent
    assert sorted(sections.SCRIPTS) == sorted(path.name for path in folder.glob("*.js"))
    script = sections.figure_parts({})["script"]
    assert not re.search(r"^\s", script, re.MULTILINE)
    assert not re.search(r"^//", script, re.MULTILINE)
    (file := tmp_path / "page.js").write_text(script, "utf-8")
    if node := shutil.which("node"):
        subprocess.run([node, "--check", file], check=True)


def test_page_order_of_sections(tmp_path):
    run = {
        **results().run,
        "unread": {"gone.toml": "gone.toml: schema: found 'x'"},
        "processor": "an abacus",
    }
    text = report(replace(results(), run=run), tmp_path).text
    places = [
        text.index(words)
        for words in (
            "not read",
            "gone.toml: schema",
            "Overview",
            "Largest deviations",
            "an abacus",
        )
    ]
    assert places == sorted(places)


def test_page_of_empty_run(tmp_path):
    empty = Results(run={}, records=[])
    assert headline(empty) == "Nothing was compared"
    assert "Nothing was compared" in report(empty, tmp_path).text


@pytest.mark.parametrize(
    ("message", "head"),
    [
        ("short", "short"),
        (f"{'a ' * 140}first. {'b ' * 100}", f"{'a ' * 140}first. "),
        (f"one line\n\n{'b' * 400}", "one line\n\n"),
        ("x" * 500, "x" * 500),  # no place to part it
    ],
    ids=["short", "sentences", "lines", "word"],
)
def test_page_folds_long_messages(message, head, tmp_path):
    shown, rest = split_message(message)
    assert (shown, shown + rest) == (head, message)
    run = results()
    failed = replace(run.records[1], message=message)
    text = report(Results(run=run.run, records=[failed]), tmp_path).text
    assert head.strip() in text
    assert rest.strip() in text
    assert "…" not in text[: text.index("Overview")].replace("0…20", "")


def test_page_ends_with_reading(tmp_path):
    """How a file was read comes last; the top names the file."""
    run = results()
    facts = run.run["cases"]["strut"] | {"source": "CSV of a.csv, y left; left out: column c"}
    page = report(replace(run, run=run.run | {"cases": {"strut": facts}}), tmp_path)
    head, _, end = page.words.partition("How files were read")
    assert "CSV of a.csv, y left · 21 samples" in head
    assert "column c" not in head + "Reference of strut"
    assert "CSV of a.csv, y left; left out: column c." in end
    assert 64 * "a" in end
