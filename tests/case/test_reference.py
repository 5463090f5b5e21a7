"""References of a case file: columns, grid, and files that may be opened."""

from pathlib import Path

import pytest
from kincheck.core.case.case import Truth
from kincheck.core.case.io import reference_samples
from kincheck.core.case.io.case_file import load_case

from ..support.case_texts import BASE, BY_FILE, CSV, INLINE, complains, edited, write


def test_reference_in_a_file(tmp_path: Path):
    write(tmp_path, CSV, "tip.csv")
    case = load_case(write(tmp_path, BASE + BY_FILE))
    assert case.reference["tip_x"].position.tolist() == [1.4, 1.5, 1.6]
    assert case.truth is Truth.CLOSED_FORM


GERMAN = "push;tip_x;tip_x.velocity\n-0,1;1,4;2,0\n0,0;1,5;2,0\n0,1;1,6;2,0\n"
DIALECTS = {
    "semicolons": GERMAN.replace(",", "."),
    "decimal commas": GERMAN,
    "tabs": GERMAN.replace(";", "\t"),
    "trailing separators": GERMAN.replace("\n", ";;\n"),
    "a line sep=": "sep=;\r\n" + GERMAN.replace("\n", "\r\n"),
    "a title": "Rig 3, left;;\n\n" + GERMAN,
    "Windows-1252": ("# geprüft\n" + GERMAN).encode("cp1252"),
    "UTF-16": ("Prüfstand\n" + GERMAN).encode("utf-16"),
    "quotes": GERMAN.replace("tip_x;", '"tip_x";').replace("1,4", '"1,4"'),
}


@pytest.mark.parametrize("kind", DIALECTS)
def test_dialects_of_spreadsheets(tmp_path: Path, kind: str):
    text = DIALECTS[kind]
    write(tmp_path, text, "tip.csv")
    series = load_case(write(tmp_path, BASE + BY_FILE)).reference["tip_x"]
    assert series.position.tolist() == [1.4, 1.5, 1.6]
    assert series.velocity is not None
    assert series.velocity.tolist() == [2.0, 2.0, 2.0]


def test_outputs_may_lack_a_reference(tmp_path: Path):
    more = '\n[outputs.tip_y]\npoint = "tip"\ncomponent = "y"\n'
    case = load_case(write(tmp_path, BASE + more + INLINE))
    assert [output.name for output in case.outputs] == ["tip_x", "tip_y"]
    assert list(case.reference) == ["tip_x"]


REFERENCES = [
    (GERMAN.replace("1,5", "1.5"), ["tip.csv", "line 3", "'1.5'", "'-0,1' above", "one decimal"]),
    (GERMAN.replace("1,5", "=B2"), ["tip.csv", "line 3, column tip_x", "'=B2'", "correct it"]),
    ("%PDF-1.7", ["tip.csv", "found a PDF document, expected text"]),
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
    monkeypatch.setattr(reference_samples, "LARGEST_FILE", 20)
    write(tmp_path, CSV, "tip.csv")
    complains(write(tmp_path, BASE + BY_FILE), ["tip.csv", "larger than 20 bytes", "thin out"])


UNITS = {
    "in brackets": "push [mm], tip_x [mm], tip_x.velocity [mm/s]",
    "in parentheses": "push (mm), tip_x (mm), tip_x.velocity (mm/s)",
    "as last words": "push_mm, tip_x mm, tip_x.velocity mm/s",
    "below": "push, tip_x, tip_x.velocity\nmm, mm, mm/s",
    "twice alike": "push_mm [mm], tip_x (mm), tip_x.velocity [mm/s]\n, mm, mm/s",
}


@pytest.mark.parametrize("at", ["", 'at = "reference"'])
@pytest.mark.parametrize("kind", UNITS)
def test_units_of_columns(tmp_path: Path, kind: str, at: str):
    """They go before those of the case file, also for samples taken from the reference."""
    rows = "-100, 1400, 2000\n0, 1500, 2000\n100, 1600, 2000\n"
    write(tmp_path, f"{UNITS[kind]}\n{rows}", "tip.csv")
    base = edited(("start = -0.1\nstop = 0.1\nsteps = 3", at)) if at else BASE
    case = load_case(write(tmp_path, base + BY_FILE))
    assert case.sweep.values.tolist() == [-0.1, 0.0, 0.1]
    assert case.reference["tip_x"].position.tolist() == [1.4, 1.5, 1.6]
    velocity = case.reference["tip_x"].velocity
    assert velocity is not None
    assert velocity.tolist() == [2.0, 2.0, 2.0]
    assert case.origin
    assert case.origin.units == {"push": "mm", "tip_x": "mm"}


def test_units_of_rows_in_the_case_file(tmp_path: Path):
    text = INLINE.replace('"push", "tip_x"', '"push [cm]", "tip_x [m]"').replace(
        "0.1, 1.", "10, 1."
    )
    case = load_case(write(tmp_path, BASE + text))
    assert case.reference["tip_x"].position.tolist() == [1.4, 1.5, 1.6]


@pytest.mark.parametrize(
    ("head", "fragments"),
    [
        ("push [deg], tip_x", ["line 1", "'deg' of column 'push [deg]'", "a length: m, mm"]),
        ("push, tip_x [parsec]", ["line 1", "'parsec'", "a length"]),
        ("push, tip_x [mm/s]", ["line 1", "'mm/s'", "a length"]),
        ("push, tip_x_mm [m]", ["line 1", "in 'mm' and 'm'", "one unit"]),
        ("push, tip_y [mm]", ["line 1", "column 'tip_y [mm]'", "tip_x"]),
    ],
)
def test_wrong_units_of_columns(tmp_path: Path, head: str, fragments: list[str]):
    write(tmp_path, f"{head}\n-0.1, 1.4\n0, 1.5\n0.1, 1.6\n", "tip.csv")
    complains(write(tmp_path, BASE + BY_FILE), ["tip.csv", *fragments])
