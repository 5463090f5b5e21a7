"""What writers refuse, and the command that exports."""

from dataclasses import replace

import pytest
from kincheck import adapters
from kincheck.core import (
    Gear,
    KincheckError,
    Point,
    SolveError,
    Spherical,
)
from kincheck.core.case.io.model_writer import way_to
from kincheck.core.cli import main
from kincheck.core.cli.files import FORMATS

from ..support.exported import read
from ..support.mechanisms import mcpherson, slider_crank
from ..support.written_mechanisms import CASES, assert_read, coupled_loop, way


@pytest.mark.parametrize("to", adapters.WRITERS)
def test_a_joint_without_counterpart_is_named(to):
    class Mine(Spherical):
        pass

    mechanism = mcpherson()
    mine = replace(
        mechanism,
        joints=[
            Mine(*vars(each).values()) if each.name == "ball" else each for each in mechanism.joints
        ],
    )
    with pytest.raises(KincheckError, match=r"joint 'ball' \(spherical\) has no counterpart in"):
        adapters.writer(to)(mine, way("mcpherson", False), {})


def test_names_that_a_format_keeps_or_needs_twice_are_refused():
    mechanism, path = slider_crank(), dict(way("slider_crank", False))
    world = replace(
        mechanism,
        bodies=[
            replace(body, name=body.name.replace("crank", "world")) for body in mechanism.bodies
        ],
        joints=[
            replace(each, i=each.i.replace("crank", "world"), j=each.j.replace("crank", "world"))
            for each in mechanism.joints
        ],
        points=[
            replace(each, body=each.body.replace("crank", "world")) for each in mechanism.points
        ],
    )
    with pytest.raises(KincheckError, match="'world' is taken"):
        adapters.writer("mjcf")(world, path | {"world": path["crank"]}, {})
    twice = replace(
        mechanism, points=[*mechanism.points, Point("rod.first", "crank", (0.0, 0.0, 0.0))]
    )
    with pytest.raises(KincheckError, match=r"'rod\.first' is taken"):
        adapters.writer("mjcf")(twice, path, {})


def test_names_with_blanks_are_read_by_simulators_that_have_none(tmp_path):
    """OpenSim ends the process at a name with a blank."""
    one = slider_crank()
    names = {"crank": "left crank", "rod": "rod/2"}
    other = replace(
        one,
        bodies=[replace(body, name=names.get(body.name, body.name)) for body in one.bodies],
        joints=[
            replace(each, i=names.get(each.i, each.i), j=names.get(each.j, each.j))
            for each in one.joints
        ],
        points=[replace(each, body=names.get(each.body, each.body)) for each in one.points],
    )
    path = {names.get(name, name): motion for name, motion in way("slider_crank", True).items()}
    for to in ("osim", "sdf"):
        found = read(to, adapters.writer(to)(other, path, {}), other, tmp_path)
        assert_read(found, other, path, True)


def test_a_joint_of_sdf_that_would_mimic_two_others_is_refused():
    mechanism = coupled_loop()
    third = Gear("third", ("A", "A2"), 1.0)
    fourth = Gear("fourth", ("A", "A2"), 1.0)
    mechanism = replace(mechanism, couplers=[*mechanism.couplers, third, fourth])
    with pytest.raises(KincheckError, match="mimics one other"):
        adapters.writer("sdf")(mechanism, way("coupled_loop", False), {})


def test_a_start_that_cannot_be_reached_says_how_far_it_goes():
    with pytest.raises(
        SolveError, match=r"no way from the design to stroke = 0\.5: .*beyond stroke = 0\.29"
    ):
        way_to(CASES["mcpherson"], 0.5)


# The command


@pytest.mark.parametrize(
    ("to", "endings"),
    [
        ("mjcf", [".xml"]),
        ("exudyn", [".py"]),
        ("urdf", [".urdf", ".constraints.json"]),
        ("sdf", [".sdf"]),
        ("osim", [".osim"]),
    ],
)
def test_export_writes_what_the_writer_writes(to, endings, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main.main(["export", "mcpherson_strut", "--to", to, "--at", "30mm"]) == 0
    names = [f"mcpherson_strut{ending}" for ending in endings]
    assert capsys.readouterr().out.split() == names
    texts = {
        ending: (tmp_path / name).read_text() for ending, name in zip(endings, names, strict=True)
    }
    assert "0.03" in texts[endings[-1]]
    found = read(to, texts, replace(mcpherson(), points=(), drivers=()), tmp_path)
    assert found.bodies["knuckle"][0][2] == pytest.approx(0.131, abs=1e-15)


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["--to", "mjfc"], "there is no format 'mjfc'; did you mean 'mjcf'?"),
        (["--to", "mjcf"], "mcpherson_strut.xml exists already"),
        (["--to", "mjcf", "--at", "nan"], "'nan' is not a number"),
        (["--to", "mjcf", "--at", "3deg"], "'3deg' is not a number with one of the units m, mm"),
        (
            ["--to", "mjcf", "--out", "nowhere/strut.xml"],
            "--out nowhere/strut.xml: cannot be written; give a file in a folder that exists",
        ),
    ],
)
def test_what_cannot_be_exported_is_said(argv, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mcpherson_strut.xml").write_text("mine")
    assert main.main(["export", "mcpherson_strut", *argv]) == 2
    assert said in capsys.readouterr().err
    assert (tmp_path / "mcpherson_strut.xml").read_text() == "mine"


def test_help_names_the_formats_that_there_are(capsys):
    assert tuple(FORMATS) == adapters.WRITERS
    for command in ("export", "assemblies"):
        assert main.main([command, "--help"]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert "mjcf (MuJoCo), exudyn (a Python script), urdf (Pinocchio), sdf (Drake) or" in said
