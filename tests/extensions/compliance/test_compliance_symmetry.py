"""Axles in K&C: mirror symmetry and exchange of sides for all outputs, and rates by hand."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.compliance.section import Rig
from kincheck.core.extensions.compliance.study import compliance
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.mechanism.loads import SpringDamper
from kincheck.core.mechanism.mechanism import GROUND

ODD = (
    "roll_angle",
    "mean_steer_angle",
    "axle_roll_center_offset",
    "rack_travel",
    ".y",
)
"""Ends of the names of outputs that the mirror image turns round."""
STOP = ((-0.1, 0.0), (0.0, 0.0), (0.01, 400.0), (0.03, 4000.0))


def exchanged(name):
    return name.replace("left", "@").replace("right", "left").replace("@", "right")


def axle_of(folder, template, capsys, motion):
    """Return an axle on bushings, with bump stops, tires, and springs across in place of a bar."""
    files = folder / "car.csv", folder / "rubber.toml"
    for file, more in zip(files, ([], ["--bushings"]), strict=True):
        assert main(["templates", template, *more]) == 0
        file.write_text(capsys.readouterr().out)
    case = load(files[0], Supplied(axle=motion, bushings=files[1], wheelbase="2.6"))
    mechanism = case.mechanism
    ends = [mechanism.point(f"{side}_wheel_center") for side in ("left", "right")]
    springs = [
        SpringDamper(
            f"{end.name} spring",
            end.body,
            GROUND,
            (end.position, tuple(np.add(end.position, (0.02, 0.0, 0.5)).tolist())),
            2e4,
            curve=tuple((-x, -force) for x, force in STOP[::-1]),
        )
        for end in ends
    ]
    # each spring from the centre of a wheel to below the other: a bushing has axes of one body
    below = [tuple(np.add(end.position, (0.0, 0.0, -0.1)).tolist()) for end in ends]
    springs += [
        SpringDamper(
            f"bar {k}", ends[k].body, ends[1 - k].body, (ends[k].position, below[1 - k]), 4e4
        )
        for k in range(2)
    ]
    mechanism = replace(mechanism, forces=(*mechanism.forces, *springs))
    return replace(case, mechanism=mechanism, tables={"compliance": Rig(tire_stiffness=2e5)})


DAILY = {("mcpherson", "steer"), ("five_link", "roll"), ("semi_trailing_arm", "heave")}
"""Axles that are solved by day: with a strut, with rods and with an arm."""
MOTIONS = [
    pytest.param(name, motion, marks=() if (name, motion) in DAILY else pytest.mark.nightly)
    for name, template in TEMPLATES.items()
    for motion in ("heave", "roll", "steer")
    if motion != "steer" or template.steered
]


@pytest.mark.parametrize(("template", "motion"), MOTIONS)
def test_symmetric_axle_outputs_are_symmetric(template, motion, tmp_path, capsys):
    case = axle_of(tmp_path, template, capsys, motion)
    curves = compliance(case, np.array([-0.02, -0.01, 0.0, 0.01, 0.02]), axle=motion).travel
    assert not curves.failures
    outputs = curves.outputs
    asked = {output.name for output in case.outputs}
    assert asked == {name for name in asked if name in outputs} | {*curves.not_computed}
    turned = slice(None, None, 1 if motion == "heave" else -1)
    for name, curve in outputs.items():
        mirrored = outputs[exchanged(name)].values[turned]
        # bushings of 1e7 N/m leave 1e-9 of it in rates, and less in all that is smaller
        size = max(float(np.nanmax(np.abs(curve.values), initial=0.0)), 1e-3)
        off = [np.abs(curve.values - sign * mirrored) / size for sign in (1.0, -1.0)]
        even, odd = (float(np.nanmax(x, initial=0.0)) for x in off)
        assert (np.isfinite(curve.values) == np.isfinite(mirrored)).all(), name
        if motion == "heave" or "_force" in name or "_torque" in name:
            # a load has the opposite sense on the other wheel, and its slope may be odd
            assert min(even, odd) < 1e-6, name
        elif name.partition(".per_travel")[0].endswith(ODD):
            assert odd < 1e-6, name
        else:
            assert even < 1e-6, (name, curve.values)
    for name in ("roll_stiffness", "roll_rate", "ride_rate", "anti_roll_share"):
        assert np.ptp(outputs[name].values) > 0.0


# Trailing arms about y, with their own bump stops and a bar, by hand


VECTORS = ("position", "point", "axis", "direction", "forward", "up", "turning_stiffness")


def turned(keys):
    """Return the keys of a case with x in place of y, y of z and z of x."""
    found = dict(keys)
    for key, value in keys.items():
        if isinstance(value, dict):
            found[key] = turned(value)
        elif key in VECTORS:
            found[key] = value if isinstance(value, str) else [value[2], value[0], value[1]]
        elif key == "component":
            found[key] = {"x": "y", "y": "z", "z": "x"}[value]
    return found


def arm_case(folder, name="axle", *, mirrored=False, seen_from="left", down=(), odd=False, more=()):
    """Write trailing arms, the left one with the stiffer stop; mirrored, the right one."""
    stops = {
        "left": [[-0.3, -20.0], [0.0, 0.0], [0.05, 20.0], [0.2, 900.0]],
        "right": [[-0.3, -20.0], [0.0, 0.0], [0.1, 60.0], [0.2, 300.0]],
    }
    case = {
        "schema": "kincheck-case/1",
        "name": name,
        "source": "made for this test",
        "bodies": {},
        "joints": {},
        "points": {},
        "drivers": {},
        "forces": {},
        "compliance": {"tire_stiffness": 150000.0},
        "sweep": {"driver": "travel_left", "start": 0, "stop": 0, "steps": 1},
    }
    for side, y in (("left", 0.7), ("right", -0.6)):
        of = exchanged(side) if mirrored else side
        y = -y if mirrored else y
        case["bodies"][f"arm_{of}"] = {}
        case["joints"][f"pivot_{of}"] = {
            "type": "revolute",
            "bodies": ["ground", f"arm_{of}"],
            "point": [0, 0.5 * y, 0.3],
            "axis": [0, 1, 0],
        }
        for what, z in (("center", 0.3), ("contact", 0.0)):
            case["points"][f"{what}_{of}"] = {"body": f"arm_{of}", "position": [-0.4, y, z]}
        case["drivers"][f"travel_{of}"] = {
            "type": "point_coordinate",
            "point": f"center_{of}",
            "direction": [0, 0, -1 if side in down else 1],
        }
        case["forces"][f"spring_{of}"] = {
            "type": "torsion_spring_damper",
            "joint": f"pivot_{of}",
            "stiffness": 500.0 if side == "left" else 700.0,
            "curve": stops[side],
        }
    case["forces"]["bar"] = {
        "type": "bushing",
        "bodies": ["arm_left", "arm_right"],
        "point": [0, 0, 0.3],
        "turning_stiffness": [0, 300.0, 0],
    }
    other = exchanged(seen_from)
    case["suspension"] = {
        "convention": "iso8855",
        "side": seen_from,
        "forward": [1, 0, 0],
        "up": [0, 0, 1],
        "wheel_center": f"center_{seen_from}",
        "wheel_contact": f"contact_{seen_from}",
        "center_plane": [0, 0, 0],
        "axle": "rear",
        "travel": f"travel_{seen_from}",
        "other": {
            "wheel_center": f"center_{other}",
            "wheel_contact": f"contact_{other}",
            "travel": f"travel_{other}",
        },
    }
    case["outputs"] = {
        "bar_torque": {"type": "element_force", "force": "bar"},
        "spring": {"type": "element_force", "force": "spring_left"},
        "pivot": {"type": "joint_force", "joint": "pivot_left", "component": "z"},
        "effort": {"type": "driver_effort", "driver": "travel_right"},
        "left_toe": {"type": "toe", "side": "left"},
        "right_toe": {"type": "toe", "side": "right"},
        "roll_angle": {"type": "roll_angle"},
    } | dict(more)
    case = turned(case) if odd else case
    (file := folder / f"{name}.json").write_text(json.dumps(case))
    return file


TRAVEL = np.array([-0.04, -0.02, 0.0, 0.02, 0.04])


def curves_of(file, motion):
    found = compliance(load_case(file), TRAVEL, axle=motion).travel
    assert not found.not_computed
    return {name: each.values for name, each in found.outputs.items()}


@pytest.mark.parametrize("motion", ["heave", "roll"])
def test_unlike_axle_follows_exchange_of_sides(motion, tmp_path):
    """By its mirror image, the order of the file, drivers that count downwards, and other axes."""
    given = curves_of(arm_case(tmp_path), motion)
    turned = slice(None, None, 1 if motion == "heave" else -1)
    image = curves_of(arm_case(tmp_path, "image", mirrored=True), motion)
    for name in given.keys() - {"spring", "pivot", "effort"}:
        sign = -1.0 if name.startswith("roll_angle") else 1.0
        wanted = sign * given[exchanged(name)][turned]
        assert image[name] == pytest.approx(wanted, rel=1e-9, abs=1e-9), name
    for options in (
        {"seen_from": "right"},
        {"down": ("left",)},
        {"down": ("left", "right")},
        {"odd": True},
    ):
        again = curves_of(arm_case(tmp_path, "again", **options), motion)
        assert again.keys() == given.keys()
        for name in given.keys() - {"effort"}:
            assert again[name] == pytest.approx(given[name], rel=1e-9, abs=1e-9), (name, options)


@pytest.mark.parametrize("motion", ["heave", "roll"])
def test_axle_rates_equal_closed_form(motion, tmp_path):
    """An arm of 0.4 m turns by asin(z / 0.4); its torque T holds the wheel by T / (0.4 cos)."""
    from scipy.interpolate import PchipInterpolator

    found, other = curves_of(arm_case(tmp_path), motion), 1.0 if motion == "heave" else -1.0
    stops = {
        "left": (500.0, PchipInterpolator([-0.3, 0.0, 0.05, 0.2], [-20.0, 0.0, 20.0, 900.0])),
        "right": (700.0, PchipInterpolator([-0.3, 0.0, 0.1, 0.2], [-20.0, 0.0, 60.0, 300.0])),
    }

    for k, z in enumerate(map(float, TRAVEL)):
        turn = {"left": math.asin(z / 0.4), "right": math.asin(other * z / 0.4)}
        twist = turn["left"] - turn["right"]
        at, matrix = [], np.zeros((2, 2))
        for row, (side, (stiffness, stop)) in enumerate(stops.items()):
            sign, angle = (1.0, -1.0)[row], turn[side]
            arm = {each: 0.4 * math.cos(x) for each, x in turn.items()}
            torque = stiffness * angle + float(stop(angle)) + sign * 300.0 * math.sin(twist)
            bar = 300.0 * math.cos(twist)
            at.append(torque / arm[side])
            matrix[row] = -bar / (arm["left"] * arm["right"])
            slope = stiffness + float(stop(angle, 1)) + bar + torque * math.tan(angle)
            matrix[row, row] = slope / arm[side] ** 2
        alike, against = np.ones(2), np.array([1.0, -1.0])
        tires = np.linalg.inv(np.linalg.inv(matrix) + np.eye(2) / 150000.0)
        opposite = against @ matrix @ against / 2.0
        moved = np.array([1.0, other])
        left, right = moved * (matrix @ moved)
        across = 1.3**2 / 2.0
        wanted = {
            "wheel_load_left": at[0],
            "wheel_load_right": at[1],
            "effort": at[1],
            "wheel_rate": alike @ matrix @ alike / 2.0,
            "wheel_rate_left": left,
            "wheel_rate_right": right,
            "wheel_rate_opposite": opposite,
            "anti_roll_share": -(matrix[0, 1] + matrix[1, 0]) / opposite,
            "roll_stiffness": across * opposite,
            "ride_rate": alike @ tires @ alike / 2.0,
            "roll_rate": across * (against @ tires @ against) / 2.0,
            "spring": -(500.0 * math.asin(z / 0.4) + float(stops["left"][1](math.asin(z / 0.4)))),
            "bar_torque": abs(300.0 * math.sin(math.asin(z / 0.4) - math.asin(other * z / 0.4))),
            "pivot": -at[0],
        }
        for name, value in wanted.items():
            assert found[name][k] == pytest.approx(value, rel=1e-11, abs=1e-9), (name, z)


ASKED = {
    "swing": {"type": "joint_moment", "joint": "pivot_left", "component": "x"},
    "at_pivot": {"type": "driver_effort", "driver": "travel_left", "at": "pivot_left"},
    "gone": {"type": "joint_force", "joint": "pivot_right", "component": "z"},
    "rise.of_roll": {"type": "axle_roll_center_height"},
}
MISSING = {
    "at_pivot": "an effort at another joint",
    "gone": "joint 'pivot_right' gives way to its bushings",
}


def test_asked_output_never_vanishes(tmp_path, capsys):
    """Each is in terminal, table, JSON and page, or named in all of them with the reason."""
    more = {name.replace(".", "_"): each for name, each in ASKED.items()}
    case = json.loads(arm_case(tmp_path, more=more).read_text())
    case["joints"]["pivot_right"]["bushings"] = {
        "rubber": {"stiffness": 1e6, "turning_stiffness": [1e4, 100.0, 1e4]}
    }
    del case["forces"]["spring_right"]
    (file := tmp_path / "asked.json").write_text(json.dumps(case))
    files = [f"--{kind}={tmp_path / kind}" for kind in ("json", "csv", "out")]
    assert main(["kc", str(file), "--travel=10mm:3", "--axle=roll", *files]) == 0
    printed, _ = capsys.readouterr()
    found = json.loads((tmp_path / "json").read_text())
    comment, heads = (tmp_path / "csv").read_text().splitlines()[:2]
    page = (tmp_path / "out" / "kc.html").read_text()
    for output in load_case(file).outputs:
        name = output.name
        if name in MISSING:
            assert MISSING[name] in found["not_computed"][name]
            for said in (printed, comment, page):
                assert f"not computed: {name}: " in said
        else:
            assert f"  {name}" in printed
            assert f"{name} [" in heads or f",{name}," in heads
            assert name in found["outputs"]
            assert name in page


def test_output_named_as_result_is_refused(tmp_path, capsys):
    file = arm_case(tmp_path, more={"wheel_rate_left": {"type": "toe", "side": "left"}})
    assert main(["kc", str(file), "--travel=10mm:3"]) == 2
    assert "output 'wheel_rate_left' has the name of a result" in capsys.readouterr().err
