"""Suspension outputs in case files, reference tables, results and reports: units, signs in every
header, and clear refusals.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from kincheck.core.case.io.catalogue import output_catalogue
from kincheck.core.case.suspension import SuspensionOutput
from kincheck.core.case.suspension.base import Attitude
from kincheck.core.cli import main
from kincheck.core.errors import CaseError

from ..support.suspension_changes import TOE, changed
from ..support.suspension_files import STRUT, TABLE, loaded, unreferenced

POINTS = STRUT["points"] | {"top": {"body": "chassis", "position": [1.0, 0.55, 0.6]}}
ON_CHASSIS = changed("suspension", wheel_center="top") | {"points": POINTS}
WRONG = {
    "mirrored hardpoints": (
        changed("suspension", side="left"),
        ["suspension.side", "'left'", "0.715 m on the other side", "correct side"],
    ),
    "another convention": (
        changed("suspension", convention="din"),
        ["suspension.convention", "'din'", "iso8855, sae_j670"],
    ),
    "no convention": (changed("suspension", convention=None), ["suspension.convention", "missing"]),
    "no forward": (changed("suspension", forward=None), ["suspension.forward", "missing"]),
    "zero forward": (
        changed("suspension", forward=[0, 0, 0]),
        ["suspension.forward", "found zero"],
    ),
    "leaning up": (
        changed("suspension", up=[0.1, 0, 1]),
        ["suspension.up", "right angles to forward", "correct one"],
    ),
    "no such wheel": (
        changed("suspension", wheel_center="wheel"),
        ["suspension.wheel_center", "'wheel', expected a point; known: lower_ball"],
    ),
    "no such kingpin": (
        changed("suspension", kingpin=["lower_ball", "strut"]),
        ["suspension.kingpin", "did you mean 'strut_top'"],
    ),
    "kingpin upside down": (
        changed("suspension", kingpin=["strut_top", "lower_ball"]),
        ["suspension.kingpin", "the lower point, then"],
    ),
    "wheel of the chassis": (ON_CHASSIS, ["suspension.wheel_center", "a body that moves"]),
    "negative radius": (
        changed("suspension", wheel_radius=-0.3),
        ["suspension.wheel_radius", "-0.3", "a positive length"],
    ),
    "share in percent": (
        changed("suspension", brake_share=70),
        ["suspension.brake_share", "70", "0 to 1"],
    ),
    "no radius": (
        changed("suspension", wheel_radius=None),
        ["outputs.half_track_change", "wheel_radius", 'at = "wheel_center"'],
    ),
    "no kingpin": (
        changed("suspension", kingpin=None),
        ["suspension.kingpin", "missing", "outputs.caster of type 'caster'"],
    ),
    "no axle": (
        changed("suspension", axle=None),
        ["suspension.axle", "missing", "outputs.wheelbase_change"],
    ),
    "dive of the rear": (
        changed("suspension", axle="rear"),
        ["outputs.anti_dive", "rear axle, expected a front one"],
    ),
    "no table": (
        {key: value for key, value in STRUT.items() if key != "suspension"},
        ["suspension: missing", "add [suspension]"],
    ),
    "unknown type": (
        STRUT | {"outputs": {"toe": {"type": "tow"}}},
        ["outputs.toe.type", "'tow'", "did you mean 'toe'"],
    ),
    "key of another type": (
        changed("outputs", toe={"type": "toe", "at": "contact"}),
        ["outputs.toe.at", "unknown key"],
    ),
    "another place": (
        changed("outputs", half_track_change={"type": "half_track_change", "at": "hub"}),
        ["'hub'", "wheel_center, contact"],
    ),
    "spring of nothing": (
        changed("outputs", motion_ratio={"type": "motion_ratio", "between": ["strut_foot", "top"]}),
        ["outputs.motion_ratio.between", "'top', expected a point; known: lower_ball"],
    ),
    "tolerance without reason": (
        changed("outputs", toe={"type": "toe", "atol": 1e-6}),
        ["outputs.toe.why", "missing"],
    ),
    "name of a slope": (
        changed("outputs", **{"toe.per_travel": {"type": "toe"}}),
        ["outputs.toe.per_travel", "another name"],
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_refusals(name):
    data, said = WRONG[name]
    with pytest.raises(CaseError) as error:
        loaded(unreferenced(data))
    for part in ("case.json", *said):
        assert part in str(error.value)


def test_quotients_of_velocities_want_a_driver_of_travel():
    rack = {**STRUT["bodies"]["rack"], "fixed": False}
    steered = STRUT | {
        "bodies": STRUT["bodies"] | {"rack": rack},
        "joints": (
            STRUT["joints"]
            | {
                "guide": {
                    "type": "translational",
                    "bodies": ["chassis", "rack"],
                    "point": [1.14, 0, 0.1455],
                    "axis": [0, 1, 0],
                }
            }
        ),
        "drivers": (
            STRUT["drivers"]
            | {
                "steering": {
                    "type": "joint_displacement",
                    "joint": "guide",
                    "motion": {"type": "ramp", "rate": 0.5},
                }
            }
        ),
    }
    # other drivers are held; values only, because rates along the sweep are others
    orders = {output.name: output.orders for output in loaded(unreferenced(steered)).outputs}
    assert (orders["toe"], orders["toe.per_travel"], orders["motion_ratio"]) == (3, 1, 1)
    of_knuckle = steered["drivers"]["stroke"] | {"point": "strut_foot"}
    steered["drivers"]["stroke"] = of_knuckle
    with pytest.raises(
        CaseError,
        match=r"outputs\.motion_ratio\.type: found 'motion_ratio' while stroke, steering move,"
        r" .* by suspension\.travel",
    ):
        loaded(unreferenced(steered))
    # along the path of both drivers a slope has a meaning
    case = loaded(unreferenced(steered | TOE))
    assert [output.orders for output in case.outputs] == [3, 2]
    named = steered | {"suspension": STRUT["suspension"] | {"travel": "stroke"}}
    assert loaded(unreferenced(named)).outputs[0].vehicle.travel == ("stroke",)
    named["suspension"]["travel"] = "strike"
    with pytest.raises(CaseError, match=r"suspension\.travel: found 'strike', .*'stroke'"):
        loaded(unreferenced(named))


def test_one_steering_axis():
    rods = [["strut_top", "strut_foot"]] * 4
    with pytest.raises(CaseError, match=r"kingpin_links: found beside kingpin, .* remove"):
        loaded(changed("suspension", kingpin_links=rods))
    rods = [["strut_top", "strut_foot"]] * 3 + [["strut_tip", "strut_foot"]]
    with pytest.raises(CaseError, match=r"kingpin_links: found 'strut_tip', .*'strut_top'"):
        loaded(changed("suspension", kingpin_links=rods, kingpin=None))


def test_signs_of_a_reference_table_must_be_those_of_the_case():
    with pytest.raises(CaseError, match=r"signs: found 'iso8855' of signs, expected 'sae_j670'"):
        loaded(changed("suspension", convention="sae_j670"))
    with pytest.raises(
        CaseError, match=r'found no convention of signs, expected .* write "# signs: iso8855"'
    ):
        loaded(STRUT, TABLE.replace("# signs: iso8855\n", ""))


def test_millimetres_and_degrees():
    """All numbers of the file in mm and degrees: tolerances, references and outputs in SI are the
    same.
    """

    def scaled(value):
        return [scaled(each) for each in value] if isinstance(value, list) else 1000.0 * value

    lengths = {
        "origin",
        "point",
        "points",
        "position",
        "start",
        "stop",
        "rate",
        "wheel_radius",
        "wheelbase",
        "cg_height",
    }

    def table(data):
        return {
            key: (
                table(each)
                if isinstance(each, dict)
                else scaled(each)
                if key in lengths and not isinstance(each, str)
                else each
            )
            for key, each in data.items()
        }

    angle = {"static_camber": -0.02, "center_plane": [0.0, 0.01, 0.0]}
    metres = changed("suspension", **angle) | {
        "outputs": changed("outputs", toe={"type": "toe", "atol": 0.5, "why": "test"})["outputs"]
    }
    reference = {"reference": {"columns": ["stroke", "toe", "camber.per_travel"]}}
    rows = [[k / 1000, 0.25, 3.0] for k in range(-80, 81, 5)]
    other = {
        key: table(value) if isinstance(value, dict) and key != "drivers" else value
        for key, value in metres.items()
    }
    other["points"] = table(STRUT["points"])
    other["joints"] = {name: table(joint) for name, joint in STRUT["joints"].items()}
    other["drivers"] = {"stroke": STRUT["drivers"]["stroke"]}
    other["suspension"] |= {"static_camber": np.degrees(-0.02), "center_plane": [0.0, 10.0, 0.0]}
    other["outputs"] |= {"toe": {"type": "toe", "atol": np.degrees(0.5), "why": "test"}}
    other["units"] = {"length": "mm", "angle": "deg"}
    other["reference"] = reference["reference"] | {
        "rows": [[1000 * s, np.degrees(t), np.degrees(c) / 1000] for s, t, c in rows]
    }
    a, b = loaded(metres | {"reference": reference["reference"] | {"rows": rows}}), loaded(other)
    for one, two in zip(a.outputs, b.outputs, strict=True):
        assert (one.name, one.atol) == (two.name, pytest.approx(two.atol))
    for name in ("toe", "camber.per_travel"):
        assert b.reference[name].position == pytest.approx(a.reference[name].position, rel=1e-14)
    assert b.outputs[0].vehicle.static_camber == pytest.approx(-0.02, rel=1e-14)
    for one, two in zip(a.mechanism.points, b.mechanism.points, strict=True):
        assert (one.name, one.body) == (two.name, two.body)
        assert two.position == pytest.approx(one.position, abs=1e-15)


def test_slopes_can_be_left_out():
    case = loaded(
        changed("suspension", per_travel=False)
        | TOE
        | {"reference": {"rows": [[k / 1000, 0.0] for k in range(-80, 81, 5)]}}
    )
    assert [output.name for output in case.outputs] == ["toe"]
    assert case.points == ("wheel_center", "~wheel_center.spin")  # and nothing else is computed


def test_a_new_type_is_a_short_class(capsys):
    @dataclass(frozen=True)
    class Lead(Attitude):
        type = "lead_of_test_suspension"
        measure = "m"
        positive = "ahead of the middle"
        reads = ("wheel_center",)

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
