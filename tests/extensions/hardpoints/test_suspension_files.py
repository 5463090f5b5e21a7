"""[suspension] of a case file, points of its wheel, and reports of its outputs."""

import json
import re
from copy import deepcopy
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.case.io.catalogue import output_catalogue
from kincheck.core.cli import main
from kincheck.core.extensions.hardpoints.suspension import SuspensionOutput
from kincheck.core.extensions.hardpoints.suspension.base import Attitude
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run
from kincheck.core.report.junit import to_junit
from kincheck.core.report.table import to_markdown

from ...support.case_texts import refused
from ...support.examples import examples
from ...support.rods_of_templates import solved
from ...support.suspension_files import (
    STRUT,
    TABLE,
    TOE,
    changed,
    loaded,
    strut_of_table,
    unreferenced,
)
from ...support.variations import HEAD
from ...support.written_again import written_again

FAULTS, WRONG = examples(__file__, "faults", "wrong")

POINTS = STRUT["points"] | {"top": {"body": "chassis", "position": [1.0, 0.55, 0.6]}}
ON_CHASSIS = changed(wheel_center="top") | {"points": POINTS}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_suspension_is_refused(name):
    given, said, *table = WRONG[name]
    keys = {key: None if value == "none" else value for key, value in given.items()}
    refused(lambda: loaded(unreferenced(changed(*table, **keys))), f"case.json ... {said}")


def test_suspension_without_moving_wheel_refused():
    for data, said in (
        (ON_CHASSIS, "suspension.wheel_center ... a body that moves"),
        (
            {key: each for key, each in STRUT.items() if key != "suspension"},
            "suspension: missing ... Add [suspension]",
        ),
    ):
        refused(lambda data=data: loaded(unreferenced(data)), f"case.json ... {said}")


def test_motion_ratio_needs_travel_driver():
    guide = {"type": "translational", "bodies": ["chassis", "rack"], "axis": [0, 1, 0]}
    steering = {"type": "joint_displacement", "joint": "guide"}
    stroke = STRUT["drivers"]["stroke"]
    data = changed("bodies", unreferenced(STRUT), rack=STRUT["bodies"]["rack"] | {"fixed": False})
    data = changed("joints", data, guide=guide | {"point": [1.14, 0, 0.1455]})
    steering |= {"motion": {"type": "ramp", "rate": 0.5}}
    data = changed("drivers", data, steering=steering)
    # other drivers are held; values only, because rates along the sweep are others
    orders = {output.name: output.orders for output in loaded(data).outputs}
    assert (orders["toe"], orders["toe.per_travel"], orders["motion_ratio"]) == (3, 1, 1)
    data = changed("drivers", data, stroke=stroke | {"point": "strut_foot"})
    refused(
        lambda: loaded(data),
        "outputs.motion_ratio.type: found 'motion_ratio' while stroke, steering move, ..."
        " by suspension.travel",
    )
    # along the path of both drivers a slope has a meaning
    case = loaded(data | TOE)
    assert [output.orders for output in case.outputs] == [3, 2]
    case = loaded(changed("suspension", data, travel="stroke"))
    assert case.outputs[0].vehicle.travel == ("stroke",)
    data = changed("suspension", data, travel="strike")
    refused(lambda: loaded(data), "suspension.travel: found 'strike', ... 'stroke'")


def test_reference_signs_must_match():
    data = changed(convention="sae_j670")
    refused(lambda: loaded(data), "signs: found 'iso8855' of signs, expected 'sae_j670'")
    table = TABLE.replace("# signs: iso8855\n", "")
    told = 'found no convention of signs, expected ... write "# signs: iso8855"'
    refused(lambda: loaded(STRUT, table), told)
    height = {"point": "wheel_center", "component": "z", "atol": 1e-6, "why": "of no side"}
    mixed = re.sub(r"(?m)^(?!#)(.+)$", r"\1,0.1", TABLE).replace(",0.1\n", ",height\n", 1)
    data = changed("outputs", data, height=height)
    refused(lambda: loaded(data, mixed), "found 'iso8855' of signs, expected 'sae_j670'")


def test_per_travel_false_omits_slopes():
    case = loaded(unreferenced(changed(per_travel=False)) | TOE)
    assert [output.name for output in case.outputs] == ["toe"]
    assert {*case.points} == {"wheel_center", "~wheel_center.spin"}  # and nothing else is computed


def test_own_suspension_output_type(capsys):
    @dataclass(frozen=True)
    class Lead(Attitude):
        type = "lead_of_test_suspension"
        measure = "m"
        positive = "ahead of the middle"

        def value(self, corner):
            return corner.center.x

    try:
        assert main.main(["list", "--outputs"]) == 0
        printed = capsys.readouterr().out
        assert printed.splitlines() == list(output_catalogue())
        for name, cls in SuspensionOutput.registry.items():
            assert f"  {name} " in printed
            assert cls.positive in printed
        case = loaded(
            unreferenced(STRUT | {"outputs": {"lead": {"type": Lead.type, "relative": True}}})
        )
        assert [output.name for output in case.outputs] == ["lead", "lead.per_travel"]
    finally:
        del SuspensionOutput.registry[Lead.type]


SIGNS = (
    "ISO 8855 (x forward, y left, z up); front right wheel; forward is [-1, 0, 0] and up [0, 0, 1]"
    " in the case's axes"
)


@dataclass(frozen=True)
class Bent:
    """The native engine with a wheel that is twisted by a micrometre at its axis."""

    native: Native = field(default_factory=Native)
    name: str = "bent"
    mode: str = "projection"
    loop: str = "python"

    def __getattr__(self, name):
        return getattr(self.native, name)

    def solve(self, model, case, tol):
        found = self.native.solve(model, case, tol)
        spin = found.points["~wheel_center.spin"]
        twisted = replace(spin, position=spin.position + np.array([1e-6, 0.0, 0.0]))
        return replace(found, points={**found.points, "~wheel_center.spin": twisted})


@pytest.fixture(scope="module")
def results():
    return run([loaded(STRUT)], [Native(), Bent()], tol=1e-12)


def test_twisted_wheel_fails_in_radians(results):
    native, bent = results.records
    assert (native.outcome, bent.outcome) == (Outcome.PASS, Outcome.FAIL)
    error = bent.errors["toe"].position
    assert error.max_abs == pytest.approx(1e-6 / 0.25, rel=0.02)
    assert " rad at sample" in bent.message or " rad/m at sample" in bent.message
    assert 'message="toe: position is off by 4e-06 rad at sample' in to_junit(results).decode()


def test_signs_in_command_tables(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    parquet = pytest.importorskip("pyarrow.parquet")
    file = tmp_path / "strut.json"
    file.write_text(json.dumps(unreferenced(changed("sweep", steps=3)) | TOE))
    varied = {"ball": {"at": "ball", "sigma": 1.0}}
    (tmp_path / "vary.json").write_text(
        json.dumps({**HEAD, "mode": "monte_carlo", "hardpoints": varied})
    )
    sweep = "sweep --samples 2 --out . --store all.parquet --vary vary.json"
    for command, first in (
        ("explain", "output "),
        ("reference", "native error"),
        (sweep, "output"),
    ):
        assert main.main([*command.split(), str(file)]) == 0
        lines = capsys.readouterr().out.splitlines()
        tables = [k for k, line in enumerate(lines) if line.strip().startswith(first)]
        assert tables
        assert all(any(SIGNS in line for line in lines[k - 3 : k]) for k in tables), command
    assert SIGNS in (tmp_path / "sweep.html").read_text().replace("&#39;", "'")
    assert (
        json.loads(parquet.read_schema(tmp_path / "all.parquet").metadata[b"kincheck"])["signs"]
        == SIGNS
    )


def test_markdown_separates_lengths_and_angles(results):
    """Lengths are shown where there are any; errors in other units have theirs beside them."""
    assert "[" not in cells(results)[1]
    native, bent = cells(run([loaded(unreferenced(STRUT | TOE))], [Native(), Bent()], tol=1e-12))
    # no truth, and nothing else to be compared with
    assert native.startswith("not judged, residual")
    assert bent.startswith("fail: 4e-06 [rad] · ")


def cells(results):
    row = next(
        line
        for line in to_markdown(results).splitlines()
        if line.startswith("| `mcpherson_suspension`")
    )
    return [cell.strip() for cell in row.split("|")[2:-1]]


CENTER = np.array(STRUT["points"]["wheel_center"]["position"])
STATIC_TOE, STATIC_CAMBER = 0.01, -0.02


def pointed(**changes):
    """The strut's wheel, a right one with x rearward, with points for its radius and axis."""
    data = deepcopy(unreferenced(STRUT))
    spin = [
        -np.cos(STATIC_CAMBER) * np.sin(STATIC_TOE),
        np.cos(STATIC_CAMBER) * np.cos(STATIC_TOE),
        -np.sin(STATIC_CAMBER),
    ]
    for name, place in {
        "hub": CENTER + 0.1 * np.array(spin),
        "road": CENTER - [0.0, 0.0, 0.3],
        "inboard": CENTER - [0.0, 0.1, 0.0],
    }.items():
        data["points"][name] = {"body": "knuckle", "position": place.tolist()}
    del data["suspension"]["wheel_radius"]
    data["suspension"] |= {"wheel_axis": "hub", "wheel_contact": "road"} | changes
    return data


def test_wheel_points_equal_wheel_numbers():
    data = deepcopy(unreferenced(STRUT))
    data["suspension"] |= {"static_toe": STATIC_TOE, "static_camber": STATIC_CAMBER}
    expected = solved(loaded(data))
    case = loaded(pointed())
    for name, values in solved(case).items():
        np.testing.assert_allclose(values, expected[name], rtol=1e-12, atol=1e-12, err_msg=name)
    hub, center = (
        np.array(case.mechanism.point(name).position) for name in ("hub", "wheel_center")
    )
    spin = [*case.outputs[0].vehicle.spin(case.mechanism)]
    np.testing.assert_allclose(spin, (hub - center) / 0.1, atol=1e-12)


@pytest.mark.parametrize(("changes", "key", "words"), FAULTS, ids=str)
def test_wrong_wheel_point_is_refused(changes, key, words):
    refused(lambda: loaded(pointed(**changes)), f"{key} ... {words}")


@pytest.mark.parametrize("axle", [None, "roll"])
def test_import_keeps_wheel_points(tmp_path, axle):
    case = strut_of_table(tmp_path, "0.04:3", "wheel_axis,1,790,309,\n", axle=axle)
    vehicle = written_again(case, tmp_path).outputs[0].vehicle
    side = "left_" if axle else ""
    assert vehicle.wheel_axis == f"{side}wheel_axis"
    assert vehicle.wheel_contact == f"{side}wheel_contact"
    assert vehicle.wheel_radius == pytest.approx(0.31)
