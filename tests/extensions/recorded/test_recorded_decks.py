"""Recordings of datasets of Adams: motions followed, joints and loads judged."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from kincheck.adapters import engine

from ..adams.decks import BODY, DECKS, mechanism_of, results

DATA = Path(__file__).parents[2] / "data" / "recordings"
NATIVE = engine("native")
RATES = "vx vy vz wx wy wz ax ay az bx by bz"
HEADS = ("time x y z e0 e1 e2 e3 " + RATES).split()
POSE = (
    f"{BODY}=x y z, quaternion wxyz e0 e1 e2 e3, velocity vx vy vz, omega wx wy wz,"
    " acceleration ax ay az, alpha bx by bz, frame "
)
REACTIONS = [f"JOINT_1.{each}" for each in ("FX", "FY", "FZ", "TX", "TY", "TZ")]
# Measured of ADAMS' integrator, see decks.py of adams; of the rates of one body alone.
ACCURACY = ["--accuracy", "velocity=4e-5", "--accuracy", "acceleration=4e-4"]


@pytest.fixture
def run(kincheck_main, tmp_path, capsys):
    """Returns status, last record and messages of a deck with its recording."""

    def judge(deck, *options):
        out = tmp_path / "out.json"
        status = kincheck_main("run", deck, *options, "--json", out, engines=[NATIVE])
        records = json.loads(out.read_text())["records"] if out.exists() else [None]
        return status, records, "".join(capsys.readouterr())

    return judge


@pytest.fixture
def fourbar(tmp_path):
    """Returns the deck of the four-bar with a changed text."""

    def write(old="", new=""):
        text = (DATA / "fourbar.adm").read_text()
        assert old in text
        file = tmp_path / "fourbar.adm"
        file.write_text(text.replace(old, new))
        return file

    return write


MOTION = "MOTION/1, ROTATION, JOINT = 1, FUNCTION = 360D * TIME"
RES = ("--recorded", DATA / "fourbar.res")


@pytest.mark.parametrize(
    ("new", "words"),
    [
        (MOTION, "drivers at the recorded times"),
        ("", "driver JOINT_1 follows the recorded poses"),
        (MOTION.replace("360D * TIME", "IF(TIME: 0, 0, 360D)"), "driver MOTION_1 follows"),
    ],
)
def test_recorded_deck_passes(run, fourbar, new, words):
    status, (native, record), _ = run(fourbar(MOTION, new), *RES)
    assert (status, record["outcome"], record["mode"]) == (0, "pass", "recorded")
    assert native["mode"] == "projection"
    assert record["details"]["rows"]["position"] < 1e-15
    assert max(record["details"]["forces"].values()) < 1e-12
    assert words in record["message"]


def test_recorded_deck_with_wrong_motion_fails(run, fourbar):
    status, (_, record), _ = run(fourbar("JOINT = 1, FUNCTION = 360D", "JOINT=1, FUN = 361D"), *RES)
    assert (status, record["outcome"]) == (1, "fail")


def test_deck_without_motion_is_refused(run, fourbar):
    status, _, err = run(fourbar(MOTION, ""))
    assert status == 2
    assert "1 freedom left without a motion, of the joints JOINT_1" in err
    assert "--recorded FILE" in err


def table(tmp_path, name, scale=None):
    """A recording of a deck of Project Chrono, with its reactions if it has any."""
    rows = results(name)
    heads = HEADS + (REACTIONS if np.abs(rows[:, 20:]).any() else [])
    if scale:
        rows[:, heads.index(scale[0])] *= scale[1]
    file = tmp_path / "recorded.csv"
    with file.open("w", newline="") as stream:
        csv.writer(stream).writerows([heads, *(row[: len(heads)].tolist() for row in rows)])
    (body,) = mechanism_of(DECKS[name]).bodies
    scaled = (2.0 * e for e in body.euler_parameters)  # of any length, as typed with few digits
    place = " ".join(map(repr, map(float, (*body.origin, *scaled))))
    return ["--recorded", file, "--map", POSE + place, *ACCURACY]


HELD = ["Revolute_Case01", "Cylindrical_Case02", "Prismatic_Case02"]
FREE = ["Spherical_Case02", "Universal_Case03"]


@pytest.mark.parametrize("name", HELD + FREE)
def test_adams_motion_and_reactions_pass(run, tmp_path, name):
    status, records, told = run(DECKS[name], *table(tmp_path, name))
    record = records[-1]
    assert (status, record["outcome"]) == (0, "pass")
    assert {*REACTIONS, BODY} <= record["details"]["forces"].keys()
    alone = "of no joint that could be driven" in told
    assert alone == (name in FREE) == (len(records) == 1)


@pytest.mark.parametrize("name", ["RotSpring_Case01", "TranSpring_Case01"])
def test_missing_spring_fails_by_force(run, tmp_path, name):
    status, records, _ = run(DECKS[name], *table(tmp_path, name))
    assert status == 1
    assert "for no joint or driver to carry" in records[-1]["message"]


def test_wrong_recorded_reaction_is_named(run, tmp_path):
    options = table(tmp_path, "Revolute_Case01", ("JOINT_1.FZ", 1.01))
    status, records, _ = run(DECKS["Revolute_Case01"], *options)
    assert status == 1
    assert "the recorded JOINT_1.FZ is off by 0.2" in records[-1]["message"]


def test_wrong_mass_fails_by_reaction(run, tmp_path):
    text = DECKS["Prismatic_Case02"].read_text()
    deck = tmp_path / "heavy.adm"
    deck.write_text(text.replace("MASS = 1\n", "MASS = 1.001\n"))
    status, records, _ = run(deck, *table(tmp_path, "Prismatic_Case02"))
    assert status == 1
    assert "the recorded JOINT_1." in records[-1]["message"]
