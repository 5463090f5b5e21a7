"""Hardpoint files that were cut, mistyped or left without their unit: one message each, of file,
key, found value and remedy.
"""

from pathlib import Path

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError

DATA = Path(__file__).parents[1] / "data" / "hardpoints"
STRUT, MULTI_LINK = DATA / "chrono_macpherson_strut.json", DATA / "chrono_multi_link.json"
ADAMS = DATA / "adams_front_suspension.sub"
WISHBONE = "double_wishbone"
TABLE = """name,x,y,z
lca_front,67,-400,180
lca_outer,267,-750,130
lca_rear,467,-450,185
tierod_inner,467,-400,330
tierod_outer,417,-750,330
uca_front,367,-450,555
uca_outer,307,-675,555
uca_rear,517,-490,560
wheel_center,267,-760,330
"""
WHOLE = Supplied(WISHBONE, "mm", "rearward,right,up")


def complains(file, supplied, *fragments):
    """Exactly a CaseError, on one line, that begins with the file and contains all the
    fragments.
    """
    with pytest.raises(CaseError) as caught:
        load(file, supplied)
    message = str(caught.value)
    assert message.startswith(f"{file}: ")
    assert "\n" not in message
    assert [fragment for fragment in fragments if fragment not in message] == [], message


def edited(tmp_path, source, *edits):
    text, name = (
        (source, "car.csv") if isinstance(source, str) else (source.read_text(), source.name)
    )
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    file = tmp_path / name
    file.write_text(text)
    return file


CHRONO_FAULTS = {
    "cut": (("Location Chassis Front", "Loc"), ["not valid JSON"]),
    "misspelt": (
        ('"Location Upright": [-0.02', '"Location Uprihgt": [-0.02'),
        ["lca_outer", "Control Arm/Location Uprihgt"],
    ),
    "no list": (
        ("[0.22, 0.52, -0.156]", "0.22"),
        ["Control Arm/Location Chassis Front", "0.22", "three numbers"],
    ),
    "two numbers": (
        ("[0.22, 0.52, -0.156]", "[0.22, 0.52]"),
        ["Control Arm/Location Chassis Front", "three numbers"],
    ),
    "text": (
        ("[0.22, 0.52, -0.156]", '[0.22, 0.52, "low"]'),
        ["Control Arm/Location Chassis Front", "'low'", "coordinate"],
    ),
    "no suspension": (
        ('"Type": "Suspension"', '"Type": "Steering"'),
        ["Type", "Steering", "Suspension"],
    ),
    "other template": (
        ('"MacPhersonStrut"', '"SolidAxle"'),
        ["Template", "SolidAxle", "mcpherson, double_wishbone, ", "five_link, three_link"],
    ),
    "template no text": (('"MacPhersonStrut"', "7"), ["Template", "7", "name"]),
    "millimetres": (("0.22, 0.52, -0.156", "220.0, 520.0, -156.0"), ["span", "another unit"]),
}


@pytest.mark.parametrize("kind", CHRONO_FAULTS)
def test_chrono(tmp_path, kind):
    edit, fragments = CHRONO_FAULTS[kind]
    file = edited(tmp_path, STRUT, edit)
    if kind == "cut":
        file.write_text(file.read_text()[:600])
    complains(file, Supplied(), *fragments)


ADAMS_FAULTS = {
    "no units": (
        (" LENGTH  =  'mm'\n", ""),
        ["does not say in which unit", "--units mm or --units m"],
    ),
    "unknown unit": (("'mm'", "'furlong'"), ["unit", "furlong", "mm"]),
    "cut row": (("-750.0      130.0", "-750.0"), ["line 17", "found 4 fields", "expected 5"]),
    "no number": (
        ("-750.0      130.0", "-750.0      13O.0"),
        ["line 17", "lca_outer", "z_value", "'13O.0'"],
    ),
    "digit separators": (
        ("-750.0      130.0", "-750.0      1_30.0"),
        ["line 17", "lca_outer", "z_value", "'1_30.0'"],
    ),
    "unknown side": (
        ("'left/right  '    267.0", "'lift/right  '    267.0"),
        ["line 17", "lca_outer", "'lift/right'", "'left/right'"],
    ),
    "twice": (("'lca_rear ", "'lca_front"), ["line 18", "lca_front", "line 16", "expected once"]),
    "misspelt": (("'uca_rear ", "'uca_raer "), ["uca_rear", "'uca_raer'", "line 23", "is it"]),
    "no block": (("[HARDPOINT]", "[HARDPIONT]"), ["no row in a block [HARDPOINT]"]),
    "other columns": (("x_value    y_value", "x_value    r_value"), ["line 15", "r_value"]),
}


@pytest.mark.parametrize("kind", ADAMS_FAULTS)
def test_adams(tmp_path, kind):
    edit, fragments = ADAMS_FAULTS[kind]
    complains(edited(tmp_path, ADAMS, edit), Supplied(WISHBONE), *fragments)


def test_adams_cut_short(tmp_path):
    file = tmp_path / ADAMS.name
    file.write_text(ADAMS.read_text().split(" 'uca_rear")[0])
    complains(
        file,
        Supplied(WISHBONE),
        "missing uca_rear, the upper arm's rear pivot",
        "wheel_center, the wheel's centre",
    )


TABLE_FAULTS = {
    "no unit": ((), Supplied(WISHBONE, None, "adams"), ["--units mm or --units m"]),
    "no axes": ((), Supplied(WISHBONE, "mm"), ["where x, y and z point", "--axes forward,left,up"]),
    "no template": (
        (),
        Supplied(None, "mm", "adams"),
        ["--template", "mcpherson, double_wishbone, ", "five_link, three_link"],
    ),
    "misspelt template": (
        (),
        Supplied("duoble_wishbone", "mm", "adams"),
        ["--template", "'duoble_wishbone'", "'double_wishbone'"],
    ),
    "wrong template": (
        (),
        Supplied("mcpherson", "mm", "adams"),
        ["template mcpherson: missing strut_lower", "uca_front"],
    ),
    "misspelt unit": ((), Supplied(WISHBONE, "milimetre", "adams"), ["--units", "'milimetre'"]),
    "wrong unit": ((), Supplied(WISHBONE, "m", "adams"), ["span", "expected a suspension"]),
    "misspelt axes": (
        (),
        Supplied(WISHBONE, "mm", "rearward,rihgt,up"),
        ["--axes", "rihgt", "left or right"],
    ),
    "axes twice": ((), Supplied(WISHBONE, "mm", "left,right,up"), ["--axes", "one each"]),
    "mirrored": (
        (),
        Supplied(WISHBONE, "mm", "rearward,left,up"),
        ["wheel_center", "y = -760", "expected the left side", "--axes"],
    ),
    "backwards": (
        (),
        Supplied(WISHBONE, "mm", "forward,right,up"),
        ["uca_front", "uca_rear", "in front of that", "--axes"],
    ),
    "upside down": (
        (),
        Supplied(WISHBONE, "mm", "rearward,right,down"),
        ["uca_outer", "lca_outer", "expected it above"],
    ),
    "travel": ((), Supplied(WISHBONE, "mm", "adams", "5cm"), ["--travel", "'5cm'", "METRES"]),
    "separated travel": (
        (),
        Supplied(WISHBONE, "mm", "adams", "0.0_5"),
        ["--travel", "'0.0_5'", "METRES"],
    ),
    "many samples": (
        (),
        Supplied(WISHBONE, "mm", "adams", "0.05:1000000000"),
        ["METRES:SAMPLES, 2 to 1000000 of them"],
    ),
    "one sample": (
        (),
        Supplied(WISHBONE, "mm", "adams", "0.05:1"),
        ["METRES:SAMPLES, 2 to 1000000 of them"],
    ),
    "no travel": ((), Supplied(WISHBONE, "mm", "adams", "0"), ["--travel", "'0'", "METRES"]),
    "drive": (
        (),
        Supplied(WISHBONE, "mm", "adams", drive=("a:0:1",)),
        ["--drive", "hardpoint table"],
    ),
    "cut row": (("417,-750,330", "417,-750"), WHOLE, ["line 6", "found 3 fields", "expected 4"]),
    "no number": (
        ("417,-750,330", "417,-75O,330"),
        WHOLE,
        ["line 6", "tierod_outer", "y", "'-75O'"],
    ),
    "digit separators": (
        ("417,-750,330", "417,-7_50,330"),
        WHOLE,
        ["line 6", "tierod_outer", "y", "'-7_50'", "correct"],
    ),
    "other digits": (
        ("417,-750,330", "417,-７５０,330"),
        WHOLE,
        ["line 6", "tierod_outer", "y", "'-７５０'"],
    ),
    "not finite": (("417,-750,330", "417,nan,330"), WHOLE, ["line 6", "tierod_outer", "'nan'"]),
    "twice": (("lca_rear", "lca_front"), WHOLE, ["line 4", "lca_front", "line 2"]),
    "two for one": (
        ("lca_rear", "wheel"),
        WHOLE,
        ["wheel_center", "'wheel' (line 4)", "'wheel_center' (line 10)"],
    ),
    "misspelt": (
        ("lca_rear", "lca_raer"),
        WHOLE,
        ["lca_rear, the lower arm's rear pivot", "is it 'lca_raer', line 4?"],
    ),
    "no head": (("name,x,y,z\n", "1,2,3,4,5\n"), WHOLE, ["line 1", "expected the head name,x,y,z"]),
    "two units": (("name,x,y,z", "name,x [mm],y [mm],z [m]"), WHOLE, ["line 1", "one unit"]),
    "unit contradicts": (
        ("name,x,y,z", "name,x [m],y [m],z [m]"),
        WHOLE,
        ["--units", "found mm", "in m"],
    ),
    "remark contradicts": (
        ("name,x,y,z", "# units: m\nname,x [mm],y [mm],z [mm]"),
        WHOLE,
        ["line 2", "in mm, and m"],
    ),
    "no name": (("lca_rear", ""), WHOLE, ["line 4", "name the point"]),
}


@pytest.mark.parametrize("kind", TABLE_FAULTS)
def test_table(tmp_path, kind):
    edit, supplied, fragments = TABLE_FAULTS[kind]
    complains(edited(tmp_path, TABLE, *([edit] if edit else [])), supplied, *fragments)


@pytest.mark.parametrize(
    ("text", "fragment"),
    [("", "is empty"), ("name,x,y,z\n", "no row"), ("# nothing\n", "is empty")],
)
def test_empty_tables(tmp_path, text, fragment):
    file = tmp_path / "car.csv"
    file.write_text(text)
    complains(file, WHOLE, fragment)


def test_the_template_must_not_contradict_the_file():
    complains(
        MULTI_LINK,
        Supplied("mcpherson"),
        "--template",
        "found mcpherson",
        "MultiLink",
        "expected five_link",
    )


def test_units_of_chrono_are_known():
    complains(STRUT, Supplied(units="mm"), "--units", "found mm", "in m")
    complains(STRUT, Supplied(axes="adams"), "--axes", "forward,left,up")


def test_the_command_line_reads_hardpoints(tmp_path, capsys):
    file = edited(tmp_path, TABLE)
    options = [
        "--engine",
        "native",
        "mujoco",
        "--template",
        WISHBONE,
        "--axes",
        "rearward,right,up",
    ]
    assert main(["run", str(file), *options]) == 2
    assert "--units mm" in capsys.readouterr().err
    assert main(["run", str(file), *options, "--units", "mm"]) == 0
    assert "left out: nothing" in capsys.readouterr().err
    assert main(["run", "mcpherson_strut", *options]) == 2
    assert "built-in case" in capsys.readouterr().err
