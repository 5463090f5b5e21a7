"""References of a case file: columns, grid, and files that may be opened."""

from pathlib import Path

import pytest
from kincheck.core.case.case import Truth
from kincheck.core.case.io import reference_table
from kincheck.core.case.io.case_file import load_case

from ..support.case_texts import BASE, BY_FILE, CSV, INLINE, complains, write


def test_reference_in_a_file(tmp_path: Path):
    write(tmp_path, CSV, "tip.csv")
    case = load_case(write(tmp_path, BASE + BY_FILE))
    assert case.reference["tip_x"].position.tolist() == [1.4, 1.5, 1.6]
    assert case.truth is Truth.CLOSED_FORM


def test_outputs_may_lack_a_reference(tmp_path: Path):
    more = '\n[outputs.tip_y]\npoint = "tip"\ncomponent = "y"\n'
    case = load_case(write(tmp_path, BASE + more + INLINE))
    assert [output.name for output in case.outputs] == ["tip_x", "tip_y"]
    assert list(case.reference) == ["tip_x"]


REFERENCES = [
    (
        CSV.replace("\n 0.0", "\n0.01"),
        ["tip.csv", "line 5", "0.01 m", "the nearest is 0 m", "expected 4 rows", "found 3"],
    ),
    (CSV.replace("1.5", "1_5"), ["tip.csv", "line 5", "column tip_x", "'1_5'", "correct it"]),
    (CSV.replace("1.5", "nan"), ["tip.csv", "line 5", "column tip_x", "'nan'", "finite"]),
    (
        CSV.replace("1.5", "1e308"),
        ["tip.csv", "line 5", "column tip_x", "'1e308'", "at most 1e+100"],
    ),
    (CSV.replace("1.5", ""), ["tip.csv", "line 5", "column tip_x", "expected a finite number"]),
    (CSV.replace("1.5, ", ""), ["tip.csv", "line 5", "found 2 numbers", "expected 3"]),
    (CSV.replace("tip_x,", "tip_z,"), ["tip.csv", "line 3", "'tip_z'", "did you mean 'tip_x'"]),
    (
        CSV.replace("tip_x,", "tip_x.acceleration,"),
        ["tip.csv", "'tip_x.acceleration' alone", "add the column 'tip_x'"],
    ),
    (CSV.replace("tip_x.velocity", "tip_x"), ["tip.csv", "'tip_x' twice"]),
    (
        CSV.replace("push, ", "tip_x, "),
        ["tip.csv", "'tip_x' first, the name of an output", "driver values", "name it otherwise"],
    ),
    ("push\n-0.1\n0\n0.1\n", ["tip.csv", "no column of an output"]),
    ("-0.1, 1.4\n0, 1.5\n0.1, 1.6\n", ["tip.csv", "line 1", "'1.4'", "outputs of the case"]),
    ('push, "tip_x\n', ["tip.csv", "not valid CSV"]),
    ("# nothing\n", ["tip.csv", "no samples"]),
]


@pytest.mark.parametrize(("text", "fragments"), REFERENCES)
def test_broken_reference_files(tmp_path: Path, text: str, fragments: list[str]):
    write(tmp_path, text, "tip.csv")
    complains(write(tmp_path, BASE + BY_FILE), fragments)


@pytest.mark.parametrize(
    "name",
    [
        "../tip.csv",
        "/etc/passwd",
        "sub/../../tip.csv",
        "link.csv",
        "nul\\u0000.csv",
        "down/tip.csv",
    ],
)
def test_references_outside_the_folder_are_refused(tmp_path: Path, name: str):
    folder = tmp_path / "case"
    (folder / "sub").mkdir(parents=True)
    write(tmp_path, CSV, "tip.csv")
    (folder / "link.csv").symlink_to(tmp_path / "tip.csv")
    (folder / "down").symlink_to(tmp_path)
    text = BASE + BY_FILE.replace("tip.csv", name)
    expected = "control characters" if "u0000" in name else "folder of the case file or below"
    complains(write(folder, text), ["case.toml", "reference.file", expected])


def test_absolute_names_are_refused_even_inside_the_folder(tmp_path: Path):
    name = write(tmp_path, CSV, "tip.csv").as_posix()
    complains(
        write(tmp_path, BASE + BY_FILE.replace("tip.csv", name)),
        ["reference.file", "give its name"],
    )


def test_references_below_the_folder_are_fine(tmp_path: Path):
    (tmp_path / "data").mkdir()
    write(tmp_path / "data", CSV, "tip.csv")
    assert load_case(write(tmp_path, BASE + BY_FILE.replace("tip.csv", "data/tip.csv"))).reference


def test_a_large_reference_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(reference_table, "LARGEST_FILE", 20)
    write(tmp_path, CSV, "tip.csv")
    complains(write(tmp_path, BASE + BY_FILE), ["tip.csv", "larger than 20 bytes", "thin out"])
