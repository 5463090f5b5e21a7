"""Bars, rockers and the steering ratio of tables of hardpoints, by closed forms."""

import numpy as np
import pytest
from kincheck.adapters import engine
from kincheck.core.case.io.case_file import case_text
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.harness.execution import Pair, attempt

from ...support.examples import examples
from ...support.rods_of_templates import arm_rate, carrier_of, solved, turn_about

(BAR,) = examples(__file__, "bar")

CLOSE = 1e-11
"""Round-off over the sine of the angle between a rod and the path of its end, 0.05 and more."""
STEP = 1e-4


def answered(case):
    """Outputs by name; those by wheel travel alone come from further solutions."""
    answer = attempt(Pair(case, engine("native"), 1e-12, timed=False)).result
    return {name: each.position for name, each in answer.outputs.items()}


def car(folder, template, points, **supplied):
    lines = [f"# template: {template}", "# units: m", "# axes: forward,left,up", "name,x,y,z"]
    lines += [",".join((name, *map(repr, place))) for name, place in points.items()]
    (folder / "car.csv").write_text("\n".join(lines) + "\n")
    return load(folder / "car.csv", Supplied(**supplied))


def turned(first, second, end, start, now):
    """Turn of a crank about an axis, whose end keeps its distance from a moving point; the
    solution near zero of a cos + b sin = c.
    """
    first, second, end, start = map(np.array, (first, second, end, start))
    axis = (second - first) / np.linalg.norm(second - first)
    r, q = end - first, now - first
    flat = r - (r @ axis) * axis
    level = (r @ axis) * axis
    a, b = q @ flat, q @ np.cross(axis, flat)
    c = 0.5 * (r @ r + q @ q - (end - start) @ (end - start)) - q @ level
    middle, half = np.arctan2(b, a), np.arccos(c / np.hypot(a, b))
    return min(((middle + s * half + np.pi) % (2 * np.pi) - np.pi for s in (1, -1)), key=abs)


def bar_twist(at, travel):
    carrier = carrier_of("double_wishbone", at).go(travel)
    place, _ = arm_rate(carrier, at, "lca", "bar_link_outer")
    return turned(*BAR.values(), place)


def test_anti_roll_bar_in_closed_form(tmp_path):
    at = {**TEMPLATES["double_wishbone"].sample, **BAR}
    case = car(tmp_path, "double_wishbone", at, travel="0.04:5")
    found = solved(case)
    for k, travel in enumerate(case.sweep.values):
        assert found["bar_twist"][k] == pytest.approx(bar_twist(at, travel), abs=CLOSE)
        slope = (bar_twist(at, travel + STEP) - bar_twist(at, travel - STEP)) / (2 * STEP)
        assert found["bar_twist.per_travel"][k] == pytest.approx(slope, abs=1e-5)
    assert abs(found["bar_twist"][0]) > 0.1


@pytest.mark.parametrize("template", ["mcpherson", "double_wishbone"])
def test_torsion_bar_twists_with_lower_arm(tmp_path, template):
    at = TEMPLATES[template].sample
    case = car(tmp_path, template, {**at, "torsion_bar": (-0.5, 0.4, 0.2)}, travel="0.04:5")
    found = solved(case)["lower_arm_twist"]
    front, rear, ball = (np.array(at[f"lca_{end}"]) for end in ("front", "rear", "outer"))
    for k, travel in enumerate(case.sweep.values):
        now = carrier_of(template, at).go(travel).at(ball)
        true = turn_about(front - rear, ball - rear, now - rear)
        assert found[k] == pytest.approx(true, abs=CLOSE)


def test_rocker_and_spring_ratios_across_axle(tmp_path):
    springs = {"heave_spring": (0.01, 0.24, 0.49)}
    springs |= {"roll_spring": (0.02, 0.24, 0.49), "roll_spring_right": (0.03, 0.27, 0.35)}
    at = {**TEMPLATES["pushrod_lower_arm"].sample, **springs}
    rocker = [at[name] for name in ("rocker_pivot", "rocker_axis", "pushrod_inner")]
    heave = car(tmp_path, "pushrod_lower_arm", at, travel="0.03:3", axle="heave")

    def angle(travel):
        carrier = carrier_of("double_wishbone", at).go(travel)
        place, _ = arm_rate(carrier, at, "lca", "pushrod_outer")
        return turned(*rocker, at["pushrod_outer"], place)

    def end(role, travel):
        """Place on the left rocker: its axis is along x."""
        x, y, z = np.subtract(at[role], at["rocker_pivot"])
        c, s = np.cos(angle(travel)), np.sin(angle(travel))
        return np.add(at["rocker_pivot"], (x, y * c - z * s, y * s + z * c))

    def width(travel):
        return 2.0 * end("heave_spring", travel)[1]

    def diagonal(left, right):
        x, y, z = end("roll_spring_right", right)
        return np.linalg.norm(end("roll_spring", left) - (x, -y, z))

    found = answered(heave)
    for k, travel in enumerate(heave.sweep.values):
        assert found["left_rocker_twist"][k] == pytest.approx(angle(travel), abs=CLOSE)
        slope = -(width(travel + STEP) - width(travel - STEP)) / (2 * STEP)
        assert found["heave_spring_ratio"][k] == pytest.approx(slope, abs=1e-5)
        near = [diagonal(travel + way * STEP, travel) for way in (1, -1)]
        slope = -(near[0] - near[1]) / (2 * STEP)
        assert found["roll_spring_ratio"][k] == pytest.approx(slope, abs=1e-5)
    roll = answered(car(tmp_path, "pushrod_lower_arm", at, travel="0.03:3", axle="roll"))
    assert roll["heave_spring_ratio"][1] == pytest.approx(found["heave_spring_ratio"][1], abs=1e-9)


def test_steering_ratio_equals_rate_quotient(tmp_path):
    at = TEMPLATES["mcpherson"].sample
    said = {"axle": "steer", "travel": "0.03:7", "rack_per_turn": "50mm", "wheelbase": "2.6"}
    case = car(tmp_path, "mcpherson", at, **said)
    found, rack = solved(case), case.sweep.values
    fine = solved(car(tmp_path, "mcpherson", at, **said | {"travel": "0.0301:7"}))
    coarse = solved(car(tmp_path, "mcpherson", at, **said | {"travel": "0.0299:7"}))
    for k in (0, 1, 5, 6):
        steer = fine["mean_steer_angle"][k] - coarse["mean_steer_angle"][k]
        slope = steer / (rack[k] / 0.03 * 2e-4)
        assert found["steering_ratio"][k] == pytest.approx(2 * np.pi / 0.05 / abs(slope), rel=1e-5)


def test_steering_ratio_in_case_file(tmp_path):
    at = TEMPLATES["mcpherson"].sample
    said = {"axle": "steer", "travel": "0.03:3", "wheelbase": "2.6"}
    text = case_text(car(tmp_path, "mcpherson", at, **said, rack_per_turn="50mm"))
    file = tmp_path / "case.toml"
    file.write_text(text)
    assert "steering_ratio" in {each.name for each in load(file).outputs}
    file.write_text(text.replace('rack = "rack"', 'rack = "rak"'))
    with pytest.raises(CaseError, match="did you mean 'rack'"):
        load(file)
    file.write_text(text.replace("rack_per_turn = 0.05", ""))
    with pytest.raises(CaseError, match=r"suspension\.rack_per_turn: missing"):
        load(file)


def test_missing_outputs_state_lacking_points(tmp_path):
    at = TEMPLATES["double_wishbone"].sample
    one = car(tmp_path, "double_wishbone", at).source
    assert "damper_ratio (add damper_lower, damper_upper)" in one
    bar = "bar_axis, bar_axis_inner, bar_link_inner, bar_link_outer"
    assert f"bar_twist (add {bar})" in one
    without = {**at, **BAR}
    del without["bar_link_outer"]
    incomplete = car(tmp_path, "double_wishbone", without)
    assert "bar_twist (add bar_link_outer)" in incomplete.source
    assert "bar" not in [body.name for body in incomplete.mechanism.bodies]
    assert "--wheelbase" not in one
    steered = car(tmp_path, "double_wishbone", {**at, **BAR}, axle="steer").source
    assert "Ackermann and turning circle (--wheelbase), steering_ratio (--rack-per-turn)" in steered
    assert "bar_twist" not in steered
