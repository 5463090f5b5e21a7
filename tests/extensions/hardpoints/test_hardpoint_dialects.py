"""Hardpoint tables as spreadsheets, people, Adams, OptimumK, Lotus and public projects write them:
decimal commas, titles, further columns, UTF-16, own names. What is damaged or has two meanings is
refused with one clear message.
"""

import io
import zipfile

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError

from ...support.case_texts import complains, rows, write
from ...support.examples import examples

POINTS, EDITS, FORMS, ADAMS, LOTUS = examples(
    __file__, "points", "edits", "forms", "adams", "lotus"
)

SAID = Supplied("double_wishbone", "mm", "rearward,right,up")


def table(head="name;x;y;z", row="{};{};{};{}", points=POINTS):
    return "\n".join([head, *(row.format(name, *at) for name, at in points.items())]) + "\n"


def comma(text):
    return text.replace(".", ",")


def read(folder, text, supplied=SAID, encoding="utf-8"):
    text = text if isinstance(text, bytes) else text.encode(encoding)
    return load(write(folder, text, "car.csv"), supplied)


@pytest.fixture
def plain(tmp_path):
    return read(tmp_path, table().replace(";", ",")).mechanism


OPTIMUM = dict(
    zip(
        POINTS,
        "CHAS_UppFor CHAS_UppAft UPRI_UppPnt CHAS_LowFor CHAS_LowAft UPRI_LowPnt "
        "CHAS_TiePnt UPRI_TiePnt Wheel_Centre".split(),
        strict=True,
    )
)
RIGHT = {f"{name}_right": (x, -y, z) for name, (x, y, z) in POINTS.items()}
LEFT = {f"{name}_left": at for name, at in POINTS.items()}


def renamed(names):
    return {names[name]: at for name, at in POINTS.items()}


def columns(head=("name", "x", "y", "z")):
    """The table with a column a point."""
    rows = [head, *((name, *map(str, at)) for name, at in POINTS.items())]
    return "\n".join(";".join(each) for each in zip(*rows, strict=True)) + "\n"


@pytest.mark.parametrize(("head", "row"), rows(FORMS))
def test_hardpoint_table_forms_read_alike(tmp_path, plain, head, row):
    assert read(tmp_path, table(head, row)).mechanism == plain


DIALECTS = {
    "decimal comma": comma(table()),
    "decimal comma, tabs": comma(table()).replace(";", "\t"),
    "quoted decimal comma": comma(table(row='{};"{}";"{}";"{}"')).replace(";", ","),
    "sep line": "sep=;\n" + comma(table()),
    "sep bar": "\ufeffSEP=|\r\n" + table().replace(";", "|").replace("\n", "\r\n"),
    "exponents": comma(table()).replace("228,25", "2,2825e2"),
    "grouped by nothing": comma(table()).replace("228,25", "228,250"),
    "OptimumK": table("Point Name;X (mm);Y (mm);Z (mm)", points=renamed(OPTIMUM)),
    "Lotus": table(",x,y,z", "{},{},{},{}", renamed(LOTUS)),
    "corners": table(points={f"{name} FL": at for name, at in renamed(LOTUS).items()}),
    "corners before": table(points={f"FL_{name}": at for name, at in POINTS.items()}),
    "both sides": table(points=LEFT | RIGHT),
    "one side of a few": table(points=POINTS | {"spring_right": (1.5, 2.5, 3.5)}),
    "columns of points": columns(),
    "columns, German": comma(columns()),
    "configuration below": table() + "Steering rack;XXXX;;\nWheelbase;1550;;\n",
    "notes below": table() + ";;;\nAll points from CAD, rev 3\n* not to scale;;;\n",
    "headings between": table().replace("lca_front", "Lower arm;;;\nlca_front"),
    "sign of typography": table().replace("-", "\u2212"),
    "plus signs": table().replace(";110.25", ";+110.25"),
    "lines of Windows": table().replace("\n", "\r\n"),
    "lines of an old Mac": table().replace("\n", "\r"),
    "Windows-1252": ("Radaufhängung, außen\n" + table()).encode("cp1252"),
}


@pytest.mark.parametrize("kind", DIALECTS)
def test_hardpoint_table_dialects_read_alike(tmp_path, plain, kind):
    assert read(tmp_path, DIALECTS[kind]).mechanism == plain


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])
def test_hardpoint_table_encodings(tmp_path, plain, encoding):
    """Excel's Unicode text, with its mark."""
    mark = "\ufeff" if encoding in ("utf-16-le", "utf-16-be") else ""
    assert read(tmp_path, mark + comma(table()), encoding=encoding).mechanism == plain


def test_omitted_rows_and_columns_are_listed(tmp_path):
    text = "Front suspension\n" + table("Name;X;Y;Z;Mass;", "{};{};{};{};3;")
    source = read(tmp_path, text).source
    assert source.endswith(f"{LEFT_OUT}line 1 (Front suspension), column Mass")


def test_row_without_remark_is_read(tmp_path):
    """A point that is added below a table with remarks: a split number has one field more."""
    whole = table("name,x,y,z,meaning", "{},{},{},{},a remark")
    found = read(tmp_path, whole.removesuffix(",a remark\n"))
    assert found.mechanism == read(tmp_path, whole).mechanism


@pytest.mark.parametrize(("old", "new", "message"), rows(EDITS))
def test_hardpoint_table_edit_faults(tmp_path, old, new, message):
    assert table().count(old) == 1
    complains(write(tmp_path, table().replace(old, new), "car.csv"), message, SAID)


WHOLE_NUMBERS = table(points={name: tuple(map(int, at)) for name, at in POINTS.items()})
WITH_MASS = table("name,x,y,z,mass", "{},{},{},{},3")
THOUSANDS = WHOLE_NUMBERS.replace("-611", "-1.611")
AXLES = {f"{name}_{side}": at for name, at in POINTS.items() for side in ("FL", "RL")}
METRES = {name: [x / 1000 for x in at] for name, at in POINTS.items()}
FAULTS = {
    "line 10 ... '-611.75' ... above": comma(table()).replace("-611,75", "-611.75"),
    "'-1.611' ... is -1.611 or -1611 ... write -1.6110 or -1611": THOUSANDS,
    "'-1,611' ... is -1.611 or -1611": comma(THOUSANDS),
    "found '-1,611' ... is -1.611 or -1611": (
        WHOLE_NUMBERS.replace(";", ",").replace("-611", '"-1,611"')
    ),
    "line 2 ... found 7 fields, expected 4 ... decimal comma needs semicolons": (
        comma(table()).replace(";", ",")
    ),
    "line 4 ... decimal comma needs semicolons": (
        WITH_MASS.replace("15.25,-539.75,312.25,3", "15,25,-539,312,")
    ),
    "line 4 ... Complete the row": WITH_MASS.replace("15.25,-539.75,312.25,3", "15,-539,312"),
    "line 1 ... 'x' twice": table("name;x [mm];y [mm];z [mm];x [m]", "{};{};{};{};1"),
    "is not UTF-16": table().encode("utf-16")[:-1],
    "line 10 ... separators of thousands": table().replace("-611.75", "-1\u202f611.75"),
    "'\u2013611.75' ... as a hyphen": table().replace("-611.75", "\u2013611.75"),
    "uca_front ... 'uca_front_FL' (line 2) and 'uca_front_RL' (line 3) ... expected one": (
        table(points=AXLES)
    ),
    "span ... metres declared as mm?": table(points=METRES),
    "line 1 ... expected the head": table(row="{};1;{};{};{}").partition("\n")[2],
    "a second head ... Keep one": table() + "\n" + table(),
    "expected the head name,x,y,z": "name;x;y\nwheel;1;2\n",
    "line 1 ... expected the head name,x,y,z": "x\n1\n",
    "expected the head": '{"wheel_center": [0, 1, 2]}',
    "a binary file, expected text": table().encode() + b"\x00\x01\xff",
}


@pytest.mark.parametrize(("message", "text"), FAULTS.items(), ids=FAULTS)
def test_hardpoint_table_dialect_faults(tmp_path, message, text):
    complains(write(tmp_path, text, "car.csv"), message, SAID)


@pytest.mark.parametrize("unit", ["inch", "in", "inches"])
def test_hardpoint_table_in_inches(tmp_path, unit):
    """In the head, or said; a unit of one's own is not taken for another."""
    inches = {name: tuple(x / 25.4 for x in at) for name, at in POINTS.items()}
    said = Supplied("double_wishbone", unit, "adams")
    for case in (
        read(tmp_path, table(points=inches), said),
        read(tmp_path, table(f"name;x [{unit}];y [{unit}];z [{unit}]", points=inches), said),
    ):
        assert case.mechanism.point("wheel_center").position == pytest.approx(
            (-0.00025, 0.61175, 0.22825), abs=1e-15
        )


OWN = {name: f"P{k}" for k, name in enumerate(POINTS, 1)}


def named(folder, text):
    file = folder / "names.toml"
    file.write_text(text)
    return Supplied("double_wishbone", "mm", "adams", names=file)


def test_hardpoint_names_file(tmp_path, plain):
    own = {OWN[name]: at for name, at in POINTS.items()}
    said = named(tmp_path, "\n".join(f'{role} = "{name}"' for role, name in OWN.items()))
    assert read(tmp_path, table(points=own), said).mechanism == plain


def test_names_file_precedes_known_names(tmp_path):
    """One of two points that are called alike; roles without a line keep their names."""
    text = table(points=POINTS | {"wheel": (0.25, -600.0, 228.25)})
    case = read(tmp_path, text, named(tmp_path, 'wheel_center = "wheel"'))
    assert case.mechanism.point("wheel_center").position[1] == 0.6


@pytest.mark.parametrize(
    ("line", "fragments"),
    rows(
        """
lca_inner = "lca_front" | names.toml: line 1: lca_inner ... expected a role ... lca_outer
lca_front = "lca_fornt" | names.toml: line 1: lca_front ... 'lca_fornt' ... 'lca_front'
lca_front = 3 | names.toml: line 1: lca_front ... found 3 ... quotes
lca_front | names.toml ... not valid TOML
""",
        named=False,
    ),
)
def test_names_file_faults(tmp_path, line, fragments):
    complains(write(tmp_path, table(), "car.csv"), fragments, named(tmp_path, line))


def test_missing_points_advise_names_option(tmp_path, capsys):
    file = tmp_path / "car.csv"
    file.write_text(table(points={OWN[name]: at for name, at in POINTS.items()}))
    options = ["--template", "double_wishbone", "--units", "mm", "--axes", "adams"]
    assert main(["run", str(file), "--engine", "native", *options]) == 2
    assert f"--names {tmp_path / 'car_names.toml'}" in capsys.readouterr().err
    names = tmp_path / "car_names.toml"
    assert all(f'{role} = "{name}"' in names.read_text() for role, name in OWN.items())
    options += ["--names", str(names)]
    assert main(["run", str(file), "--engine", "native", *options]) == 2
    assert "left out: nothing" in capsys.readouterr().err


def test_adams_hardpoint_variants_are_omitted(tmp_path, plain):
    file = tmp_path / "car.sub"
    rows = [f"'{name}' 'left/right' {x} {y} {z}" for name, (x, y, z) in POINTS.items()]
    file.write_text(ADAMS.format("\n".join(rows)))
    case = load(file, Supplied("double_wishbone"))
    assert case.mechanism == plain
    assert "(VARIANTS): lca_outer in line 16, spare in line 17" in case.source
    assert "[PARAMETER] (1 rows)" in case.source


def zipped(name):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(name, "made up")
    return stream.getvalue()


OFFICE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500)
OTHERS = {
    "car.xls": (OFFICE, "found an Excel file before 2007 (.xls)"),
    "car.xlsx": (OFFICE, "or one with a password, expected a workbook (.xlsx)"),
    "car.pdf": (b"%PDF-1.7\n\xff", "found a PDF document, expected text; export the numbers"),
    "car.png": (b"\x89PNG\r\n\x1a\n", "found a PNG image, expected text; type the numbers"),
    "car.jpg": (b"\xff\xd8\xff\xe0", "found a JPEG image"),
    "car.ods": (zipped("content.xml"), "found an OpenDocument file (.ods, .odt)"),
    "car.docx": (zipped("word/document.xml"), "found a Word document"),
    "car.xlsb": (zipped("xl/workbook.bin"), "found a binary Excel workbook (.xlsb)"),
    "table.xlsx": (zipped("word/document.xml"), "found a Word document, expected a workbook"),
    "car.zip": (zipped("car.csv"), "found a zip archive, expected text; unpack it"),
    "page.csv": (b"<!DOCTYPE html><html>", "found a web page (HTML)"),
    "book.csv": (zipped("xl/workbook.xml"), "found an Excel workbook, expected text; name it"),
    "text.xlsx": (table().encode(), "found a text, expected a workbook (.xlsx)"),
    "noise.xlsx": (bytes(range(256)), "found another binary file, expected a workbook (.xlsx)"),
    "noise.csv": (bytes(range(256)), "found a binary file, expected text"),
    "empty.csv": (b"", "is empty, expected a table of hardpoints"),
    "empty.xlsx": (b"", "is empty, expected a workbook"),
    "car.parquet": (b"PAR1\x15", "found a Parquet file, expected text; export the table"),
    "car.mat": (b"MATLAB 5.0 MAT-file, \x00", "found a MATLAB file, expected text; write the"),
    "car.gz": (b"\x1f\x8b\x08\x00", "found a gzip archive, expected text; unpack it"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_foreign_file_formats_are_refused(tmp_path, name):
    data, fragment = OTHERS[name]
    file = write(tmp_path, data, name)
    complains(file, f"{file}: ... {fragment}", SAID)


@pytest.mark.needs("explain")
def test_folder_as_case_is_refused(tmp_path, capsys):
    (tmp_path / "car.csv").mkdir()
    assert main(["explain", str(tmp_path / "car.csv")]) == 2
    assert "car.csv: a folder, not a regular file; give the path" in capsys.readouterr().err


MISSPELT = {"uca_front": "UCA_Frnt", "lca_outer": "LCA outr", "wheel_center": "WheelCentr"}


def test_misspelt_names_are_taken_with_note(tmp_path, plain):
    text = table(points={MISSPELT.get(name, name): at for name, at in POINTS.items()})
    case = read(tmp_path, text)
    assert case.mechanism == plain
    (note,) = case.assembly
    assert all(f"{role} is {name!r}" in note for role, name in MISSPELT.items())
    with pytest.raises(CaseError, match=r"missing uca_front.*is it 'UCA_Frnt'"):
        read(tmp_path, text, Supplied(*("double_wishbone", "mm", "adams"), ask_names=True))


@pytest.mark.parametrize(
    ("role", "name"),
    rows(
        """
uca_front | lca_front2
uca_rear | uca_front_2
tierod_outer | tierod_inner_2
wheel_center | wheel_cont
wheel_center | hub
""",
        named=False,
    ),
)
def test_names_of_other_points_are_refused(tmp_path, role, name):
    """Places may tell such a point: the user is asked."""
    with pytest.raises(CaseError, match=f"missing {role}|{role} is {name}"):
        read(
            tmp_path,
            table(points={name if each == role else each: POINTS[each] for each in POINTS}),
        )


def test_misspelt_name_serves_one_role(tmp_path):
    points = {each: at for each, at in POINTS.items() if each not in ("uca_front", "lca_front")}
    with pytest.raises(CaseError, match="missing uca_front"):
        read(tmp_path, table(points={**points, "xca_front": POINTS["uca_front"]}))


def test_names_file_is_written_when_missing(tmp_path, plain):
    text = table(points={MISSPELT.get(name, name): at for name, at in POINTS.items()})
    names = tmp_path / "names.toml"
    said = Supplied(*("double_wishbone", "mm", "adams"), names=names)
    assert read(tmp_path, text, said).mechanism == plain
    assert 'uca_front = "UCA_Frnt"' in names.read_text()
    again = read(tmp_path, text, said)
    assert again.mechanism == plain
    assert not again.assembly
    names.unlink()
    own = {OWN[name]: (0.0, 0.0, 0.0) for name in POINTS}  # no suspension
    with pytest.raises(CaseError, match=r"fill in .*names\.toml"):
        read(tmp_path, table(points=own), said)
    assert '# uca_front = ""' in names.read_text()
