"""kincheck stress on the command line: its files, the reduction of bad cases, and written cases."""

import json
import re
from dataclasses import replace

import kincheck.adapters
import numpy as np
import pytest
from kincheck import CaseError, KincheckError, PointMotion, cases, solve
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.joint_probe import probes
from kincheck.core.cli import main
from kincheck.core.extensions.laboratory.stress.families.base import as_case
from kincheck.core.extensions.laboratory.stress.families.linkages import (
    any_plane,
    crank_rocker,
    four_bar,
)
from kincheck.core.extensions.laboratory.stress.reduction import (
    fewer_samples,
    reduce_case,
    round_geometry,
)
from kincheck.core.extensions.laboratory.stress.report import headline, markdown, report
from kincheck.core.extensions.laboratory.stress.run import Cell, Finding, Stress
from kincheck.core.extensions.laboratory.stress.verdicts import Verdict

from ...support.fakes import Fake, crank, native_but, swept
from ...support.written_again import written_again


def shift(found, case):
    """Be off by a micrometre beyond 2 rad."""
    far = (np.abs(case.sweep.change) > 2.0)[:, None]
    points = {
        name: replace(m, position=m.position + 1e-6 * far) for name, m in found.points.items()
    }
    return replace(found, points=points)


@pytest.fixture
def shifted(monkeypatch):
    engine = native_but(shift)
    monkeypatch.setattr(kincheck.adapters, "engine", lambda name, mode="projection": engine)
    monkeypatch.setattr(
        "kincheck.core.extensions.laboratory.stress.run.suitable_engine",
        lambda engine, case, number: engine,
    )


def test_stress_writes_tables_and_data(tmp_path, capsys):
    new = tmp_path / "new"
    options = f"--family units degenerate --samples 40 --out {new} --json -"
    assert main.main(["stress", *options.split()]) == 0
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert found["schema"] == "kincheck-stress/1"
    assert [cell["family"] for cell in found["cells"]] == ["units", "degenerate"]
    assert sum(found["cells"][0]["samples"].values()) >= 20
    assert found["findings"] == []
    assert "None of" in err
    assert {file.name for file in new.iterdir()} == {"stress.json", "stress.html", "stress.md"}
    assert "| units | native projection |" in (new / "stress.md").read_text("utf-8")
    assert "silently wrong" in (new / "stress.html").read_text("utf-8")


def test_silent_error_is_reduced_and_replayed(tmp_path, capsys, shifted):
    assert (
        main.main(f"stress --family units --samples 30 --out {tmp_path} --no-proofs".split()) == 1
    )
    capsys.readouterr()
    (file,) = tmp_path.glob("*.toml")
    (finding,) = json.loads((tmp_path / "stress.json").read_text("utf-8"))["findings"]
    assert (finding["file"], finding["verdict"]) == (file.name, "silently wrong")
    assert len(load_case(file).sweep.values) == 1
    assert main.main(["stress", "--replay", str(file)]) == 1
    assert "silently wrong first at turn = " in capsys.readouterr().out


def test_stress_replay_of_sound_case(tmp_path, capsys):
    file = tmp_path / "rssr.toml"
    file.write_text(case_text(cases.load("rssr")), "utf-8")
    assert main.main(["stress", "--replay", str(file)]) == 0
    assert "right 181" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("engine", "why"),
    [
        (
            Fake("native", refusal="no joint of that kind"),
            "choose other families or another engine",
        ),
        (Fake("native", installed=None, refusal="not there"), "it is not installed"),
    ],
    ids=["unable", "missing"],
)
def test_stress_without_samples_has_status_2(tmp_path, capsys, monkeypatch, engine, why):
    monkeypatch.setattr(kincheck.adapters, "engine", lambda name, mode="projection": engine)
    assert main.main("stress --family units --samples 20 --no-proofs".split()) == 2
    out, err = capsys.readouterr()
    count = re.search(r"^No sample was judged, (\d+) unsupported$", out, re.MULTILINE)
    assert count, out
    assert (
        f"kincheck: native projection: no sample was judged, {count[1]} unsupported: {why}\n" in err
    )
    file = tmp_path / "rssr.toml"
    file.write_text(case_text(cases.load("rssr")), "utf-8")
    assert main.main(["stress", "--replay", str(file)]) == 2
    out, err = capsys.readouterr()
    assert "unsupported 181" in out
    assert "kincheck: no sample of native was judged. Give another engine or other files.\n" in err


def cell(name="one", **samples):
    counts = dict.fromkeys(map(str, Verdict), 0) | samples
    of = {"family": name, "engine": name, "mode": "projection", "version": "1", "settings": {}}
    of |= {"specimens": 1, "elsewhere": 0, "worst": [None] * 4, "bad": 0, "seconds": 0.0}
    return Cell(samples=counts, **of)


def test_unjudged_samples_are_counted():
    refused, unjudged = {"refused, right reason": 2}, {"not judged": 3, "unsupported": 4}
    found = cell(right=5, **refused, **unjudged)
    assert headline([found]) == "None of 7 samples silently wrong, 3 not judged, 4 unsupported"
    wrong = cell(right=5, **refused, **{"silently wrong": 1})
    assert headline([found, wrong]) == "1 of 15 samples silently wrong, 3 not judged, 4 unsupported"


def test_stress_list_prints_families(capsys):
    assert main.main(["stress", "--list"]) == 0
    out = capsys.readouterr().out
    assert "units" in out
    assert "1e7 m" in out


def test_stress_page_escapes_file_text():
    """Names and messages come from files and simulators."""
    evil = "<script>|*x*`"
    others = ("refused, right reason", "refused, wrong reason", "silently wrong", "not judged")
    counts = dict.fromkeys(("right", *others, "unsupported"), 1)
    finding = dict.fromkeys(("family", "engine", "mode", "specimen", "message"), evil)
    finding |= {"verdict": "silently wrong", "worst": [2.0, None, None], "tol": 1e-12}
    found = Stress(
        kincheck="1",
        command="",
        seed=0,
        samples=6,
        abouts={evil: evil},
        cells=[cell(evil, **counts)],
        findings=[Finding(**finding, number=0, sample=0, value=0.0)],
        seconds={},
    )
    text = markdown(report(found))
    assert "<script>" not in text
    assert "\\|" in text
    assert "1 (20 %)" in text  # of the five that are supported


# Case files, written


@pytest.mark.parametrize("name", sorted(set(cases.names()) - {"mcpherson_suspension"}))
def test_written_built_in_cases_read_back(name, tmp_path):
    written_again(cases.load(name), tmp_path)


@pytest.mark.parametrize("case", probes(), ids=lambda case: case.name)
def test_written_joint_types_read_back(case, tmp_path):
    written_again(case, tmp_path)


def test_unwritable_cases_are_refused():
    case = cases.load("rssr")
    uneven = swept(case, [0.0, 1.0, 1.5])
    with pytest.raises(CaseError, match="no even grid"):
        case_text(uneven)
    strut = cases.load("mcpherson_suspension")
    first, *others = strut.outputs
    wider = replace(first, vehicle=replace(first.vehicle, wheel_radius=0.4))
    with pytest.raises(CaseError, match="of several axles"):
        case_text(replace(strut, outputs=(wider, *others)))


def test_written_names_are_quoted(tmp_path):
    case, odd = crank(), 'ti "p"\\1'
    points = [replace(point, name=odd) for point in case.mechanism.points]
    outputs = tuple(replace(each, point=odd) for each in case.outputs)
    mechanism = replace(case.mechanism, points=points)
    written_again(replace(case, mechanism=mechanism, outputs=outputs, reference={}), tmp_path)


def test_stress_replay_refuses_output_files(tmp_path, capsys):
    file = tmp_path / "case.toml"
    assert main.main(f"stress --replay {file} --json {tmp_path / 'found.json'}".split()) == 2
    assert "--replay only prints its findings. Leave out --out and" in capsys.readouterr().err


# Reduction of bad cases to small ones


def four_bar_case(way, samples):
    rng = np.random.default_rng(8)
    mechanism, _ = four_bar(any_plane(rng), *crank_rocker(rng), way)
    return as_case(mechanism, "turn", np.linspace(-1.0, 1.0, samples))


@pytest.fixture(scope="module")
def case():
    return four_bar_case("rod", 5)


def test_reduction_removes_unneeded_parts():
    """Bad is whatever has a crank longer than 0.1 m that is turned by more than 0.3 rad."""
    case = four_bar_case("revolutes", 41)

    def bad(case):
        pivot = case.mechanism.joint("pivot").point
        pins = [
            joint
            for joint in case.mechanism.joints
            if "crank" in joint.bodies and joint.name != "pivot"
        ]
        long = any(
            np.linalg.norm(np.subtract(getattr(pin, "point", pivot), pivot)) > 0.1 for pin in pins
        )
        return long and np.abs(case.sweep.values).max() > 0.3

    few = fewer_samples(case, 3, bad)
    assert len(few.sweep.values) == 1
    small, words = reduce_case(few, bad)
    assert bad(small)
    assert words
    assert len(small.mechanism.points) == 1
    assert len(str(small.mechanism.joint("pivot").point[0])) < 8


def test_unjudgeable_case_is_not_reduced(case):
    def bad(other):
        if other is not case:
            raise KincheckError("cannot be judged")
        return True

    assert fewer_samples(case, 0, bad) is case
    assert reduce_case(case, bad) == (case, [])


def test_rounding_keeps_names_and_shapes(case):
    short = round_geometry(case, 2)
    assert short is not None
    assert [j.name for j in short.mechanism.joints] == [j.name for j in case.mechanism.joints]
    assert short.mechanism != case.mechanism
    assert isinstance(solve(short.mechanism, "turn", [0.1]).points["C"], PointMotion)
