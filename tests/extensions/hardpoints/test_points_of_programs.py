"""Points in TOML, in Python scripts and in suspension files of games: read as the same table, or
refused by what they are.
"""

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

from ...support.case_texts import complains, write
from ...support.examples import examples
from ...support.rods_of_templates import solved

(GAME,) = examples(__file__, "game")

SAID = Supplied("double_wishbone", "m", "forward,left,up", travel="0.03:5")
SAMPLE = {
    role.name: TEMPLATES["double_wishbone"].sample[role.name]
    for role in TEMPLATES["double_wishbone"].roles
}
OPTIMUM = {"uca": "Upp", "lca": "Low", "front": "For", "rear": "Aft", "outer": "Pnt"}


def written(role):
    return role.replace("uca", "upper").replace("lca", "lower")


def optimum(role):
    if role == "wheel_center":
        return "Wheel_Centre"
    arm, end = role.split("_")
    if arm == "tierod":
        return "CHAS_TiePnt" if end == "inner" else "UPRI_TiePnt"
    return f"{'UPRI' if end == 'outer' else 'CHAS'}_{OPTIMUM[arm]}{OPTIMUM[end]}"


def lines_of(form, name=written):
    return "\n".join(form.format(name(role), *at) for role, at in SAMPLE.items())


WHEEL = SAMPLE["wheel_center"]
INBOARD = {role: (WHEEL[1] - y, z - WHEEL[2], x - WHEEL[0]) for role, (x, y, z) in SAMPLE.items()}
ASSETTO = (
    "[BASIC]\nWHEELBASE=2.6\n[FRONT]\nTYPE=DWB\nBASEY=-0.12 ; of the centre of gravity\n"
    f"TRACK={2 * WHEEL[1]}\n"
    + "\n".join("{}={}, {}, {} ; m".format(GAME[role], *INBOARD[role]) for role in GAME)
    + "\n[REAR]\nTYPE=AXLE\nTRACK=1.5\n"
)
FORMS = {
    "toml": lines_of("{} = [{}, {}, {}]"),
    "optimum.toml": "[front]\n" + lines_of('"{}" = [{}, {}, {}]', optimum),
    "tables.toml": "# units: m\n" + lines_of("[car.{}]\nx = {}\ny = {}\nz = {}"),
    "dict.py": "import numpy as np\np = {\n"
    + lines_of('    "{}": np.array([{}, {}, {}]),')
    + "\n}\nprint(p)\nraise SystemExit(3)\n",
    "literals.py": "UNITS = 'm'\n" + lines_of("{} = ({}, {}, {})"),
    "keyed.py": "p = {}\n" + lines_of("p['{}'] = Vector({}, {}, {})"),
    "call.py": "p = dict(\n" + lines_of("    {}=[{}, {}, {}],") + "\n)",
    "m": lines_of("p.{} = [{} {} {}];"),
}


@pytest.mark.parametrize("name", FORMS)
def test_program_points_equal_table(tmp_path, name):
    table = tmp_path / "car.csv"
    table.write_text("name,x,y,z\n" + lines_of("{},{},{},{}"))
    file = tmp_path / f"car.{name}"
    file.write_text(FORMS[name])
    found, expected = solved(load(file, SAID)), solved(load(table, SAID))
    assert found.keys() == expected.keys()
    for output, values in found.items():
        np.testing.assert_array_equal(values, expected[output], err_msg=output)


@pytest.mark.parametrize("options", [{"sheet": "front"}, {"corner": "FL"}, {"corner": "FR"}, {}])
def test_assetto_corsa_points_equal_table(tmp_path, options):
    """Heights and lengths are from the wheel's centre: outputs of directions are the same."""
    table = tmp_path / "car.csv"
    table.write_text("name,x,y,z\n" + lines_of("{},{},{},{}"))
    file = tmp_path / "suspensions.ini"
    file.write_text(ASSETTO)
    case = load(file, Supplied(travel="0.03:5", **options))
    found, expected = solved(case), solved(load(table, SAID))
    for output in ("toe", "camber", "caster", "kingpin_inclination", "half_track_change"):
        np.testing.assert_allclose(found[output], expected[output], atol=1e-13, err_msg=output)
    assert "BASEY=-0.12" in case.source


def test_python_expressions_are_omitted(tmp_path):
    file = tmp_path / "car.py"
    file.write_text(
        FORMS["dict.py"].replace("\n}", ",\n 'wheel_contact': np.sqrt([0, 1, 2]) / 3,\n}", 1)
    )
    file.write_text(file.read_text().replace(",,", ","))
    assert "wheel_contact" in load(file, SAID).source.split(LEFT_OUT)[1]


BARS = "[BAR]\nposbody=body negbody=fl_spindle pos=(0.3,0.1,-1.7) neg=(0.5,0.1,-1.6)\n"
REFUSED = {
    "rFactor": ("car.pm", BARS, "rFactor ... left,up,rearward"),
    "rFactor by content": ("car.txt", BARS, "rFactor ... left,up,rearward"),
    "no suspension": ("car.ini", "[GRAPHICS]\nx=1\n", "suspensions.ini"),
    "two axles": ("car.ini", ASSETTO + "WBCAR_STEER=0,0,0\n", "FRONT, REAR ... --sheet FRONT"),
    "no track": ("car.ini", ASSETTO.replace("TRACK", "TRAK"), "FRONT ... no TRACK"),
    "a torn point": ("car.ini", ASSETTO.replace("WBTYRE_TOP=", "WBTYRE_TOP=1,"), "three numbers"),
    "twice": ("car.ini", ASSETTO.replace("BASEY", "TRACK"), "TRACK: given before"),
    "another kind": ("car.ini", ASSETTO.replace("DWB", "AXLE"), "'AXLE' ... double_wishbone"),
    "no Python": ("car.py", "p = {", "no Python script"),
    "deep": ("car.py", "p = " + "(" * 5000 + "1" + ")" * 5000, "no Python script"),
    "keys twice": ("car.py", "p = {'a': [1, 2, 3], 'a': [1, 2, 4]}", "'a' stands twice"),
    "computed": ("car.py", "p = [sqrt(0.2), 1, 2]", "found no point"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_program_point_faults(tmp_path, kind):
    name, text, fragments = REFUSED[kind]
    complains(write(tmp_path, text, name), fragments, Supplied())
