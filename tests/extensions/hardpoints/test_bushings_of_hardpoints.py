"""Bushings of hardpoint tables by role, and of Project Chrono's files, by the command and files."""

import json
import re
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError, KincheckError
from kincheck.core.extensions.compliance.study import compliance
from kincheck.core.extensions.hardpoints.rubber import with_bushings
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.mechanism.loads import SpringDamper

from ...support.case_texts import BASE, INLINE, rows, write
from ...support.examples import examples
from ...support.sources import ROOT

(FAULTS,) = examples(__file__, "faults")

AXLE = json.loads((ROOT / "tests/data/elastokinematics/8_hmmwv_axle.json").read_text())
P = AXLE["points"]


def chrono_file(tmp_path, **spring):
    """Return the axle of the data as a file of Chrono, with its upright's centre in two parts."""
    rubber = {"Stiffness Linear": 7e7, "Damping Linear": 3.5e4, "Stiffness Rotational": 1e5}
    rubber |= {"Damping Rotational": 500.0, "DOF": {"Stiffness Rotational": 0}}

    def arm(key, mass, center, moments):
        ends = {"Upright": "u", "Chassis Front": "f", "Chassis Back": "b"}
        places = {f"Location {end}": P[f"{key}_{k}"] for end, k in ends.items()}
        facts = {"Mass": mass, "COM": center, "Moments of Inertia": moments}
        return {**facts, **places, "Bushing Data": rubber}

    upright = (34.155 * 0.82 - 14.705 * 0.91) / 19.45
    tables = {
        "Type": "Suspension",
        "Template": "DoubleWishbone",
        "Spindle": {"Mass": 14.705, "COM": P["wc"]},
        "Upright": {"Mass": 19.45, "COM": [-0.04, upright, -0.026]},
        "Upper Control Arm": arm("uca", 5.813, [-0.106, 0.589, 0.218], [0.03, 0.03, 0.06276]),
        "Lower Control Arm": arm("lca", 23.965, [0.0, 0.547, -0.059], [0.4, 0.4, 0.3]),
        "Tierod": {"Location Chassis": P["tie_c"], "Location Upright": P["tie_u"]},
        "Spring": {"Location Chassis": P["spr_c"], "Location Arm": P["spr_a"]}
        | {"Spring Coefficient": 181496.15, "Free Length": 0.339, **spring},
    }
    file = tmp_path / "hmmwv.json"
    file.write_text(json.dumps(tables))
    return file


AXLE_OPTIONS = Supplied(axle="heave", wheel_radius="0.47")


def test_chrono_bushings_wheel_load_and_rate(tmp_path):
    case = load(chrono_file(tmp_path), AXLE_OPTIONS)
    notes = "; ".join(case.assembly)
    assert "the inertia of 'Upper Control Arm' is left out: no body has it" in notes
    assert "inertias of Lower Control Arm are left out" in notes
    found = compliance(case, [0.0]).travel
    rows = AXLE["rows"]
    assert found.wheel_load[0] == pytest.approx(rows["static_wheel_load"], rel=1e-9)
    rate = found.outputs["wheel_rate"].values[0]
    assert rate == pytest.approx(rows["wheel_rate_parallel"], rel=1e-9)


def test_chrono_spring_curve_equals_linear_spring(tmp_path):
    """A straight curve is the spring of the same rate."""
    straight = {"Spring Coefficient": 0.0, "Curve Data": [[-0.2, -36299.23], [0.2, 36299.23]]}
    loads = [
        compliance(load(chrono_file(tmp_path, **more), AXLE_OPTIONS), [0.0]).travel.wheel_load[0]
        for more in ({}, straight)
    ]
    assert loads[1] == pytest.approx(loads[0], rel=1e-12)


def sample(tmp_path, capsys, template, *options):
    assert main(["templates", template, *options]) == 0
    file = tmp_path / f"{template}{'.toml' if options else '.csv'}"
    file.write_text(capsys.readouterr().out)
    return file


def test_templates_bushings_option_prints_sample(tmp_path, capsys):
    table = sample(tmp_path, capsys, "mcpherson")
    rubber = sample(tmp_path, capsys, "mcpherson", "--bushings")
    assert list(tomllib.loads(rubber.read_text())["bushings"]) == [
        *("lca_front", "lca_rear", "strut_upper"),
    ]
    assert main(["kc", str(table), f"--bushings={rubber}", "--travel=0:10mm:2"]) == 0
    case = load(table, Supplied(bushings=rubber))
    front, _, top = case.mechanism.bushings
    hinge = np.array(case.mechanism.joint("lca_pivot").axis)
    assert front.triad[2] == pytest.approx(hinge / np.linalg.norm(hinge))
    assert front.turning_stiffness == (100.0, 100.0, 0.0)
    assert (top.joint, top.axes) == ("strut_top", ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))


@pytest.mark.parametrize("template", TEMPLATES)
def test_sample_bushings_match_template_roles(tmp_path, capsys, template):
    rubber = sample(tmp_path, capsys, template, "--bushings")
    case = load(sample(tmp_path, capsys, template), Supplied(bushings=rubber))
    roles = tomllib.loads(rubber.read_text())["bushings"]
    assert len(case.mechanism.bushings) == len(roles) > 0


def test_rods_in_rubber_equal_springs(tmp_path, capsys):
    """Bushings of both ends, along all axes alike, against springs in place of the rods."""
    table = sample(tmp_path, capsys, "five_link")
    rubber = tmp_path / "rubber.toml"
    ends = {"upper_front_inner": 4e6, "upper_front_outer": 6e6, "lower_rear_outer": 3e5}
    rubber.write_text("".join(f"[bushings.{x}]\nstiffness = {k}\n" for x, k in ends.items()))
    case = load(table, Supplied(bushings=rubber))
    rods = {"upper_front": 4e6 * 6e6 / 10e6, "lower_rear": 3e5}
    springs = [
        SpringDamper(name, "ground", "knuckle", case.mechanism.joint(name).points, k)
        for name, k in rods.items()
    ]
    joints = [joint for joint in case.mechanism.joints if joint.name not in rods]
    sprung = replace(case.mechanism, joints=joints, forces=springs, bushings=())
    loads = {"lateral": 3000.0, "braking": 2000.0}
    found, expected = (
        compliance(each, [-0.04, 0.05], loads).travel
        for each in (case, replace(case, mechanism=sprung))
    )
    assert found.wheel_center == pytest.approx(expected.wheel_center, abs=1e-14)
    assert found.wheel_load == pytest.approx(expected.wheel_load, abs=1e-8)
    largest = np.abs(expected.compliance).max()
    assert found.compliance == pytest.approx(expected.compliance, abs=1e-13 * largest)


def test_rod_with_end_bushing_is_axial(tmp_path, capsys):
    """A ball at its other end: soft across and stiff along is a stiff rod, until it tilts."""
    table = sample(tmp_path, capsys, "five_link")
    rubber = tmp_path / "rubber.toml"
    C = dict[str, Any]()
    for name, stiffness in (("along", [1.0, 4e6, 1.0]), ("all", 4e6)):
        rubber.write_text(f"[bushings.tierod_inner]\nstiffness = {stiffness}\n")
        text = table.read_text().replace("tierod_outer,-150,690,250", "tierod_outer,-180,690,260")
        table.write_text(text)
        C[name] = compliance(load(table, Supplied(bushings=rubber)), [0.0]).travel.compliance[0]
    assert C["along"] == pytest.approx(C["all"], abs=1e-12 * np.abs(C["all"]).max())


def test_axle_bushings_are_mirrored(tmp_path, capsys):
    table = sample(tmp_path, capsys, "double_wishbone")
    rubber = tmp_path / "rubber.toml"
    keys = "stiffness = [1e6, 5e6, 2e5]\nturning_stiffness = [90, 30, 5]\npreload = [900, 0, 70]\n"
    roles = ("uca_front", "uca_rear", "lca_front", "lca_rear")
    rubber.write_text("".join(f"[bushings.{role}]\n{keys}" for role in roles))
    case = load(table, Supplied(axle="heave", bushings=rubber))
    C = compliance(case, [0.02]).travel.compliance[0]
    mirror = np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    assert C[:6, :6] == pytest.approx(mirror @ C[6:, 6:] @ mirror, abs=1e-13 * np.abs(C).max())


@pytest.mark.parametrize(("text", "message"), rows(FAULTS))
def test_bushings_contradicting_table_are_refused(tmp_path, capsys, text, message):
    table = sample(tmp_path, capsys, "double_wishbone")
    said = Supplied(bushings=write(tmp_path, text, "rubber.toml"))
    with pytest.raises(KincheckError, match=re.escape(message)):
        load(table, said)


def test_kc_lists_slopes_without_value(tmp_path, capsys):
    table = sample(tmp_path, capsys, "double_wishbone")
    files = [f"--{kind}={tmp_path / kind}" for kind in ("json", "csv", "out")]
    assert main(["kc", str(table), "--travel=-10mm:10mm", *files]) == 0
    said = capsys.readouterr()
    assert "–" not in said.out
    assert "not computed: roll_center_height.per_travel, jacking_coefficient.per_travel" in said.out
    found = json.loads((tmp_path / "json").read_text())
    assert len(found["travel"]) == 25
    assert not {"spring_ratio.per_travel"} & {*found["outputs"], *found["rigid"]}
    assert all(None not in each["position"] for each in found["outputs"].values())


def test_bushings_of_case_have_no_roles(tmp_path):
    case = load(write(tmp_path, BASE + INLINE))
    file = write(tmp_path, "[bushings.guide]\nstiffness = 1\n", "b.toml")
    with pytest.raises(CaseError, match="bushings: unknown key, expected joints"):
        with_bushings(case, file)
