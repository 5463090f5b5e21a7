"""kincheck bisect on releases of a small simulator, offline: wheels that the tests make."""

import json
import shutil
import signal
import subprocess
import sys
import time
from math import log2
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.bisect.inside import shadow_of
from kincheck.core.extensions.bisect.probes import mujoco as probe
from kincheck.core.extensions.bisect.search import changes

from .wheels import case, engine, twelve, wheel

WOBBLE = "bisect", "wobble", "--package", "wobble-sim"


@pytest.fixture
def offline(tmp_path, monkeypatch):
    """A folder with wheels and a case; the installer finds nothing else."""
    (tmp_path / "wheels").mkdir()
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "wheels"))
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("KINCHECK_ENVIRONMENTS", str(tmp_path / "environments"))
    monkeypatch.chdir(tmp_path)
    case(tmp_path)
    return tmp_path


def found(*words):
    """Status and document of a search."""
    status = main([*WOBBLE, *words, "--json", "found.json"])
    return status, json.loads(Path("found.json").read_text())


def ends(document):
    return [(each["from"], each["to"], each["kind"], each["right"]) for each in document["changes"]]


@pytest.mark.nightly
def test_twelve_releases_name_their_changes(offline):
    twelve(offline / "wheels")
    status, document = found("crank.toml", "--from", "1.0", "--to", "12.0", "--out", "site")
    assert status == 1
    assert ends(document) == [
        ("3.0", "4.0", "interface", "unknown"),
        ("4.0", "5.0", "result", "4.0"),
        ("6.0", "7.0", "result", "6.0"),
        ("8.0", "9.0", "result", "9.0"),
    ]
    (lost,) = document["changes"][0]["cases"].values()
    assert "No module named 'wobble_sim_core'" in lost["messages"][0]
    assert len(document["tried"]) <= 4 * (log2(12) + 2)
    page = Path("site/bisect.html").read_text()
    assert all(each in page for each in ("6.0 → 7.0", "x acceleration", "closed form"))
    status, document = found("crank.toml", "--from", "9.0", "--to", "12.0", "--every")
    assert (status, ends(document), document["not_installable"]) == (0, [], ["10.0"])
    assert document["tried"] == ["9.0", "11.0", "12.0"]


@pytest.mark.nightly
def test_undone_change_is_found_by_every(offline, capsys):
    for release in range(1, 6):
        text = engine(offset=1e-6 * (release == 3))
        wheel(offline / "wheels", f"{release}.0", text)
    status, document = found("crank.toml", "--from", "1.0", "--to", "5.0", "--releases", "2.0")
    assert (status, document["tried"]) == (0, ["1.0", "5.0"])
    assert "--every" in capsys.readouterr().out
    status, document = found("crank.toml", "--from", "1.0", "--to", "5.0", "--every")
    assert (status, [each[:2] for each in ends(document)]) == (1, [("2.0", "3.0"), ("3.0", "4.0")])


@pytest.mark.nightly
def test_odd_releases_are_told(offline, capsys):
    """Pre-releases, post-releases, dependencies, a crash, a loop without end, another Python."""
    texts = {
        "1.0a1": engine(imports="import wobble_core"),
        "1.0": engine(),
        "1.0.post1": engine(deed="import os; os.abort()"),
        "1.1rc1": engine(deed="while True: pass"),
        "1.1": engine(imports="while True: pass"),
        "1.2": engine(imports="import os; os._exit(0)"),
        "1.10": engine(term=0.5),
    }
    wheel(offline / "wheels", "0.1", "", package="wobble-core", name="")
    for version, text in texts.items():
        requires = ["wobble-core>=0.1", "numpy"] if version == "1.0a1" else []
        wheel(offline / "wheels", version, text, requires=requires)
    wheel(offline / "wheels", "1.3", engine(), tag="py2")
    wheel(offline / "wheels", "1.4", engine(), requires=["nowhere-to-be-found"])
    words = "crank.toml", "--from", "1.0a1", "--to", "1.10", "--every", "--timeout", "4"
    status, document = found(*words)
    assert status == 1
    assert document["tried"] == [*texts]
    assert document["not_installable"] == ["1.3", "1.4"]
    assert [each[:3] for each in ends(document)] == [
        ("1.0", "1.0.post1", "interface"),
        ("1.2", "1.10", "interface"),
    ]
    said = capsys.readouterr().err
    assert "1.0.post1: 1 crashed" in said
    assert "1.1rc1: 1 timeout" in said
    assert "nowhere-to-be-found" in said


@pytest.mark.nightly
def test_end_that_cannot_be_installed(offline, capsys):
    """And native completes a truth without rates."""
    case(offline, "places", columns=2)
    for release in range(1, 4):
        wheel(offline / "wheels", f"{release}.0", engine(term=float(release < 2)))
    next(offline.glob("wheels/*-3.0-*")).write_bytes(b"")
    status, document = found("places.toml", "--from", "1.0", "--to", "3.0")
    assert (status, document["not_installable"]) == (2, ["3.0"])
    assert ends(document) == [("1.0", "2.0", "result", "1.0")]
    (change,) = document["changes"][0]["cases"].values()
    assert [each["against"] for each in change["curves"]] == ["native"]
    assert "--to 3.0: cannot be installed" in capsys.readouterr().err


@pytest.mark.nightly
def test_nobody_is_right_without_truth(offline):
    case(offline, "alone", "consensus_only")
    for release in (1, 2):
        wheel(offline / "wheels", f"{release}.0", engine(term=float(release)))
    status, document = found("alone.toml", "--from", "1.0", "--to", "2.0")
    assert (status, ends(document)) == (1, [("1.0", "2.0", "result", "unknown")])
    wheel(offline / "wheels", "3.0", engine(term=3.0))
    _, document = found("crank.toml", "--from", "2.0", "--to", "3.0")
    assert ends(document) == [("2.0", "3.0", "result", "neither")]


BAD = (
    (("wobble", "--from", "1", "--to", "2"), "Name the package of the engine by --package"),
    ((*WOBBLE[1:], "--from", "2.0", "--to", "1.0"), "Give the earlier first"),
    ((*WOBBLE[1:], "--from", "1.0", "--to", "9"), "--to 9: the installer finds no such release"),
    ((*WOBBLE[1:], "--from", "one", "--to", "2"), "'one' is not a version"),
    pytest.param(  # asked in an environment of the release
        ("wabble", *WOBBLE[2:], "--from", "1.0", "--to", "2.0"),
        "there is no engine 'wabble'",
        marks=pytest.mark.nightly,
    ),
)


@pytest.mark.by_day(3)
@pytest.mark.parametrize(("words", "message"), BAD)
def test_bad_input_is_refused(offline, capsys, words, message):
    for release in (1, 2):
        wheel(offline / "wheels", f"{release}.0", engine())
    first, *others = words
    assert main(["bisect", first, "crank.toml", *others, "--json", "-"]) == 2
    assert message in capsys.readouterr().err


def test_interrupted_search_goes_on(offline, capfd):
    """By SIGINT while the second release never ends; the first is not run again."""
    log = offline / "log"
    note = f"open({str(log)!r}, 'a').write('1\\n')"
    wheel(offline / "wheels", "1.0", engine(deed=note))
    wheel(offline / "wheels", "2.0", engine(deed="import time; time.sleep(1000)"))
    command = [*WOBBLE, "crank.toml", "--from", "1.0", "--to", "2.0"]
    with subprocess.Popen([sys.executable, "-m", "kincheck", *command]) as program:
        while not list(offline.glob("environments/bisect/wobble-sim-2.0-*/.used")):
            assert program.poll() is None
            time.sleep(0.1)
        program.send_signal(signal.SIGINT)
        assert program.wait(300) == 128 + signal.SIGINT
    runs = log.read_text()
    assert runs
    assert not list(offline.glob("environments/bisect/.building*"))
    found("crank.toml", "--from", "1.0", "--to", "2.0", "--timeout", "2")
    assert log.read_text() == runs
    assert "1.0: 1 pass, kept from before" in capfd.readouterr().err


@pytest.mark.nightly
def test_disk_limit_removes_longest_unused(offline):
    for release in (1, 2, 3):
        wheel(offline / "wheels", f"{release}.0", engine())
    found("crank.toml", "--from", "1.0", "--to", "3.0", "--every", "--disk", "1e-9")
    left = [each.name.split("-")[2] for each in offline.glob("environments/bisect/*")]
    assert left == ["3.0"]


def test_probe_of_mujoco_reads_its_numbers():
    """Right releases keep the inertias and limits of the probe's file to round-off."""
    pytest.importorskip("mujoco")
    for made, given, most in probe.read().values():
        assert np.abs(np.subtract(made, given)).max() <= most


def test_other_copy_of_release_is_found(tmp_path, monkeypatch):
    """A release whose module is loaded from elsewhere must not be taken for it."""
    own, other = tmp_path / "own", tmp_path / "other"
    wheel(tmp_path, "1.0", engine())
    with ZipFile(next(tmp_path.glob("*.whl"))) as file:
        file.extractall(own)
    other.mkdir()
    monkeypatch.syspath_prepend(str(own))
    assert shadow_of("wobble-sim") == ""
    shutil.copy(own / "wobble_sim.py", other)
    monkeypatch.syspath_prepend(str(other))
    assert shadow_of("wobble-sim") == str(other / "wobble_sim.py")


@pytest.mark.parametrize("states", ["aaaab", "abbbb", "aabbc", "a-ab-b", "aaaa", "-ab-", "abcde"])
def test_search_finds_steps(states):
    def state(place):
        return None if states[place] == "-" else states[place]

    steps = [*changes(len(states), state, str.__ne__)]
    assert steps == [*changes(len(states), state, str.__ne__, every=True)]
    assert all(states[i] != states[j] for i, j in steps)


@pytest.mark.parametrize("place", [1, 2, 21, 32, 43, 63])
def test_search_takes_logarithm(place):
    seen = {}
    found = [*changes(64, lambda each: seen.setdefault(each, each >= place), bool.__ne__)]
    assert found == [(place - 1, place)]
    assert len(seen) <= log2(64) + 2
