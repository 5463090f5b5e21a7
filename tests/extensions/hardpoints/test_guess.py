"""One question about what a table leaves open: the guess of its unit, axes, template, corner, side,
radius and names, in several languages, is the suspension of the plain table.
"""

import math
import shlex
from dataclasses import replace

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import OpenError
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

from ...support.case_texts import write
from ...support.examples import examples

RACE, ROAD, NAMES = examples(__file__, "race", "road", "names")

# A double wishbone of a race car, and a strut of a road car: x forward, y left, z up [mm].


def rows(names, form="{};{};{};{}", points=RACE, turn=lambda x, y, z: (x, y, z)):
    """The rows of a table: names in a language, or none, and turned points."""
    said = NAMES[names].split("|") if names else [""] * len(points)
    lines = [
        form.format(name, *turn(*at), n=n)
        for n, (name, at) in enumerate(zip(said, points.values(), strict=True), 1)
    ]
    return "\n".join(lines) + "\n"


def comma(text):
    return text.replace(".", ",")


def adams(x, y, z):
    return -x, -y, z


def metres(x, y, z):
    return tuple(round(each / 1000.0, 6) for each in (x, y, z))


def inches(x, y, z):
    return tuple(round(each / 25.4, 6) for each in (x, y, z))


def sae(x, y, z):
    return x, -y, 400.0 - z


def engine_room(x, y, z):
    """x to the right, y up, z rearward."""
    return -y, z, -x


# name, text, points, and what the guess has to say
FORMS = {
    "de.csv": ("Nr.;Bezeichnung;X;Y;Z\n" + comma(rows("German", "{n};{};{};{};{}")), RACE),
    "fr.csv": ("Repère;X [mm];Y [mm];Z [mm]\n" + comma(rows("French", turn=adams)), RACE),
    "it.csv": ("# Unità: m\nPunto,X,Y,Z\n" + rows("Italian", "{},{},{},{}", turn=metres), RACE),
    "es.csv": ("Nombre;Coordenada X;Coordenada Y;Coordenada Z\n" + rows("Spanish"), RACE),
    "zh.csv": (
        "# 单位：mm\n序号,硬点名称,X坐标,Y坐标,Z坐标\n" + rows("Chinese", "{n},{},{},{},{}"),
        RACE,
    ),
    "lotus.txt": (rows("Lotus", "{n} {} {} {} {}", turn=inches), RACE),
    "optimum.csv": ("Point,X,Y,Z\n" + rows("OptimumK", "{},{},{},{}", turn=sae), RACE),
    "points.csv": ("Punkt;x;y;z\n" + rows("numbers", "P{};{};{};{}", turn=engine_room), RACE),
    "bare.csv": (rows("", "{1},{2},{3}"), RACE),
    "federbein.csv": (
        "Alle Maße in mm, x nach hinten, y nach rechts, z nach oben\nBenennung;x;y;z\n"
        + comma(rows("strut, German", points=ROAD, turn=adams)),
        ROAD,
    ),
    "jambe.csv": ("Nom;x;y;z\n" + rows("strut, French", points=ROAD, turn=metres), ROAD),
    "montante.csv": ("Nome;x;y;z\n" + rows("strut, Italian", points=ROAD), ROAD),
}


def asked(file, supplied=None):
    """The case of the guess: options are typed as the question has them."""
    supplied = supplied or Supplied()
    with pytest.raises(OpenError) as found:
        load(file, supplied)
    for path, text in found.value.writes.items():
        path.write_text(text, encoding="utf-8")
    stated = found.value.stated
    assert all(
        f"--{name.replace('_', '-')} {text}" in str(found.value) for name, text in stated.items()
    )
    paths = {name: file.parent / text for name, text in stated.items() if name == "names"}
    return load(file, replace(supplied, **stated | paths)), found.value


def places(case):
    """Places of the points of a case, of the left wheel, from the wheel's centre [mm]."""
    found = {p.name: p.position for p in case.mechanism.points if not p.name.startswith("~")}
    center = found["wheel_center"]
    return {
        name: [round(1e3 * (a - b), 3) for a, b in zip(at, center, strict=True)]
        for name, at in found.items()
    }


def plain(folder, points, **more):
    text = "name;x;y;z\n" + "".join(f"{name};{x};{y};{z}\n" for name, (x, y, z) in points.items())
    said = Supplied(units="mm", axes="forward,left,up", **more)
    return load(write(folder, text, "plain.csv"), said)


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", FORMS)
def test_guess_is_the_plain_suspension(tmp_path, name):
    text, points = FORMS[name]
    case, error = asked(write(tmp_path, text, name))
    assert ("names" in error.stated) is (name in ("points.csv", "bare.csv"))
    assert places(case) == places(plain(tmp_path, points)), str(error)


WHOLE = """
French | Essieu;Côté | avant;gauche | avant;droite | arrière;gauche | AVG
Italian | Asse;Lato | ant.;sx | ant.;dx | post.;sx | ASX
Spanish | Eje;Lado | del.;izq. | del.;der. | tras.;izq. | DELANTERA IZQUIERDA
Chinese | 轴;侧 | 前;左 | 前;右 | 后;左 | 前左
"""


@pytest.mark.parametrize(
    ("names", "head", "cells"),
    [(a, b, c) for a, b, *c in (map(str.strip, w.split("|")) for w in WHOLE.strip().split("\n"))],
)
def test_guess_of_whole_car(tmp_path, names, head, cells):
    """The question chooses a corner too; each corner is read by its foreign name."""
    places_of = [(0.0, 1), (0.0, -1), (-1550.0, 1)]
    text = f"{head};Name;X;Y;Z\n" + "".join(
        rows(names, cell + ";{};{};{};{}", turn=lambda x, y, z, d=d, s=s: (x + d, s * y, z))
        for cell, (d, s) in zip(cells[:3], places_of, strict=True)
    )
    file = write(tmp_path, comma(text), "car.csv")
    case, error = asked(file)
    assert error.stated["corner"] == "FL"
    assert places(case) == places(plain(tmp_path, RACE))
    right = load(file, Supplied(corner="FR", units="mm", axes="iso"))
    mirrored = {name: [x, -y, z] for name, (x, y, z) in places(case).items()}
    assert places(right) == mirrored
    assert "right side" in right.source
    again = load(file, Supplied(corner=cells[3], units="mm", axes="iso"))
    assert places(again) == places(case)


def test_guess_of_both_sides_in_words(tmp_path):
    """The left points are read, as those of names that end in _left."""
    text = "Name;x;y;z\n" + rows("German", "{} links;{};{};{}")
    text += rows("German", "{} rechts;{};{};{}", turn=lambda x, y, z: (x, -y, z))
    case, error = asked(write(tmp_path, text, "car.csv"))
    assert error.stated["axes"] == "forward,left,up"
    assert places(case) == places(plain(tmp_path, RACE))


FACTS = """
# Einheit: mm|# Radhalbmesser: 310 mm|# Vorspur: 0,10 °|# Sturz [°]: -1,5
# units: mm|# wheel_radius: 310|# static_toe: 0.1 deg|# static_camber: -1.5 deg
# unités : mm|Rayon de roue;0,31 m|Pincement;6 arcmin|Carrossage [deg];-1,5
# unidad: mm|# radio de rueda: 310|# convergencia: 0,1|# caída: -1,5
# 单位：mm|# 轮胎半径：310|# 前束角：0.1|# 外倾角：-1.5
"""


@pytest.mark.parametrize("facts", FACTS.strip().split("\n"))
def test_static_angles_and_radius_are_used(tmp_path, facts):
    """By their definition: at design, toe and camber are the stated ones, on either side."""
    for side in (1, -1):
        body = rows("German", turn=lambda x, y, z, side=side: (x, side * y, z))
        text = "\n".join(facts.split("|")) + "\nName;x;y;z\n" + comma(body)
        case = load(write(tmp_path, text, "car.csv"), Supplied(axes="iso"))
        (vehicle,) = {each.vehicle for each in case.outputs if each.name in ("toe", "camber")}
        degrees = [math.degrees(each) for each in (vehicle.static_toe, vehicle.static_camber)]
        assert degrees == pytest.approx([0.1, -1.5])
        assert vehicle.wheel_radius == pytest.approx(0.31)


def test_question_without_terminal(tmp_path, capsys, monkeypatch):
    """Status 2 with the command line, which then runs; names of comments alone are named so."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path, FORMS["points.csv"][0], "points.csv")
    assert main(["run", "points.csv", "--engine", "native", "--travel", "20mm:3"]) == 2
    (line,) = (each for each in capsys.readouterr().err.splitlines() if "Take it: " in each)
    argv = shlex.split(line.partition("Take it: kincheck ")[2])
    assert main(argv) == 2  # nothing to compare with
    assert "1 not judged" in capsys.readouterr().out
    names = tmp_path / "points_names.toml"
    names.write_text("".join(f"# {each}\n" for each in names.read_text().splitlines()))
    assert main(argv) == 2
    assert "all lines are comments" in capsys.readouterr().err


def test_point_of_two_roles_is_named(tmp_path):
    """A slip in a file of names that solves all the same."""
    text = "".join(f"P {name},{x},{y},{z}\n" for name, (x, y, z) in RACE.items())
    names = {role: f"P {role}" for role in RACE}
    supplied = Supplied(
        names=tmp_path / "names.toml",
        units="mm",
        axes="iso",
        wheel_radius="0.2m",
        template="double_wishbone",
    )
    for given, said in ((names, False), (names | {"uca_rear": names["lca_rear"]}, True)):
        lines = "".join(f'{role} = "{name}"\n' for role, name in given.items())
        (tmp_path / "names.toml").write_text(lines)
        case = load(write(tmp_path, text, "race.csv"), supplied)
        note = "uca_rear and lca_rear are one point, 'P lca_rear'"
        assert (note in case.assembly) is said


def test_question_at_a_terminal(tmp_path, capsys, monkeypatch):
    file = write(tmp_path, FORMS["de.csv"][0], "de.csv")
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    for answer, said in (("\n", "1 not judged"), ("no\n", ""), ("", "")):
        monkeypatch.setattr("sys.stdin.readline", lambda answer=answer: answer, raising=False)
        assert main(["run", str(file), "--engine", "native", "--travel", "20mm:3"]) == 2
        assert said in capsys.readouterr().out
        assert said or not capsys.readouterr().out


def test_doubtful_guess_says_so(tmp_path):
    """A pushrod on the lower arm or on the knuckle: the same points fit both templates."""
    at = TEMPLATES["pushrod_lower_arm"].sample
    points = {f"P{k}": tuple(1000.0 * x for x in each) for k, each in enumerate(at.values())}
    text = "".join(f"{name},{x},{y},{z}\n" for name, (x, y, z) in points.items())
    with pytest.raises(OpenError, match=r"Doubtful: .*it may be a pushrod_"):
        load(write(tmp_path, text, "race.csv"), Supplied())
