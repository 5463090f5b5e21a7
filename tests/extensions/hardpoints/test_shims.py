"""Shims against the carrier's pose with links of given lengths, solved by Newton's method."""

import math

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

from ...oracles.rods import rotation
from ...support.rods_of_templates import RODS, solved

STEP = 1e-5
"""Half a difference [m]: its square, and round-off over it, are below the tolerance."""
BALLS = {"mcpherson": (), "three_link": ("arm_pivot",), "semi_trailing_arm": ("arm_inner",)}


def angles_of(name, role, shift, spin):
    """Toe, camber and caster with the joint of a role shifted: inner ends on the chassis, outer
    ones on the carrier.
    """
    at = {each: np.array(place) for each, place in TEMPLATES[name].sample.items()}
    rods, center = RODS.get(name, ()), at["wheel_center"]
    on_body, on_carrier = dict(at), dict(at)
    outer = {end for _, end in rods}
    (on_carrier if role in outer else on_body)[role] = at[role] + shift

    def moved(pose):
        return {
            each: center + pose[:3] + rotation(pose[3:]) @ (place - center)
            for each, place in on_carrier.items()
        }

    def misfit(pose):
        now = moved(pose)
        found = [pose[2]]
        for a, b in rods:
            found.append(np.linalg.norm(now[b] - on_body[a]) - np.linalg.norm(at[b] - at[a]))
        if name == "mcpherson":
            axis = rotation(pose[3:]) @ (at["strut_upper"] - at["strut_lower"])
            away = on_body["strut_upper"] - now["strut_lower"]
            found += np.cross(axis / np.linalg.norm(axis), away).tolist()
        for ball in BALLS.get(name, ()):
            found += (now[ball] - on_body[ball]).tolist()
        if name == "semi_trailing_arm":
            axis = on_body["arm_outer"] - on_body["arm_inner"]
            away = now["arm_outer"] - on_body["arm_outer"]
            found += np.cross(axis / np.linalg.norm(axis), away).tolist()
        return np.array(found)

    pose = np.zeros(6)
    for _ in range(6):
        jacobian = [(misfit(pose + d) - misfit(pose - d)) / 2e-6 for d in 1e-6 * np.eye(6)]
        pose = pose - np.linalg.lstsq(np.transpose(jacobian), misfit(pose), rcond=None)[0]
    s = rotation(pose[3:]) @ spin
    angles = [np.arctan2(s[0], s[1]), -np.arcsin(s[2])]
    if (ends := TEMPLATES[name].kingpin) and isinstance(ends[0], str):
        low, high = ((moved(pose) if end in outer else on_body)[end] for end in ends)
        angles.append(np.arctan2(low[0] - high[0], high[2] - low[2]))
    return np.array(angles)


def write_table(folder, name, toe, camber, moved):
    """Write the sample table of a template, x rearward and y right; return the wheel's axis."""
    spin = np.array(
        [math.sin(toe) * math.cos(camber), math.cos(toe) * math.cos(camber), -math.sin(camber)]
    )
    sample = dict(TEMPLATES[name].sample)
    sample["wheel_axis"] = tuple((np.array(sample["wheel_center"]) + 0.2 * spin).tolist())
    for role, shift in moved.items():
        sample[role] = tuple((np.array(sample[role]) + shift).tolist())
    lines = ["# units: m", "# axes: rearward,right,up", f"# template: {name}", "name,x,y,z"]
    lines += [f"{role},{-x!r},{-y!r},{z!r}" for role, (x, y, z) in sample.items()]
    (folder / "car.csv").write_text("\n".join(lines) + "\n")
    return spin


@pytest.mark.parametrize("name", [*RODS])
@pytest.mark.parametrize("angles", [(0.0, 0.0), (0.3, -2.0)])
def test_template_shims_equal_differences(tmp_path, name, angles):
    toe, camber = map(math.radians, angles)
    spin = write_table(tmp_path, name, toe, camber, {})
    found = {each.roles[0]: each.shim for each in load(tmp_path / "car.csv", Supplied()).hardpoints}
    checked = [role for role, shim in found.items() if shim is not None]
    ends = {end for rod in RODS[name] for end in rod}
    assert ends <= {*checked}
    for role in checked:
        for k, sign in enumerate((-1.0, -1.0, 1.0)):
            shift = STEP * sign * np.eye(3)[k]
            up, down = (angles_of(name, role, way * shift, spin) for way in (1, -1))
            assert found[role][:, k] == pytest.approx((up - down) / (2 * STEP), abs=1e-6), (role, k)


@pytest.mark.parametrize("name", [name for name, rods in RODS.items() if len(rods) > 2])
def test_tie_rod_moves_cancel_bump_steer(tmp_path, name):
    def bump_steer(moved):
        write_table(tmp_path, name, 0.01, -0.03, moved)
        return solved(load(tmp_path / "car.csv", Supplied(travel="0.01:3")))["toe.per_travel"][1]

    write_table(tmp_path, name, 0.01, -0.03, {})
    ends = {each.roles[0]: each for each in load(tmp_path / "car.csv", Supplied()).hardpoints}
    found = {
        role: each.no_bump_steer for role, each in ends.items() if each.no_bump_steer is not None
    }
    assert found.keys() == {*RODS[name][-1]}
    for role, moves in found.items():
        for k, sign in enumerate((-1.0, -1.0, 1.0)):
            up, down = (bump_steer({role: way * STEP * np.eye(3)[k]}) for way in (1, -1))
            slope = sign * (up - down) / (2.0 * STEP)
            assert moves[k] * slope == pytest.approx(-bump_steer({}), rel=1e-6), (role, k)


def test_explain_prints_shims_in_degrees(tmp_path, capsys):
    main(["templates", "double_wishbone"])
    (tmp_path / "car.csv").write_text(capsys.readouterr().out)
    assert main(["explain", str(tmp_path / "car.csv"), "--samples", "2"]) == 0
    printed = capsys.readouterr().out
    assert "shims of 1 mm at design" in printed
    ends = {each.name: each.no_bump_steer for each in load(tmp_path / "car.csv").hardpoints}
    for name in ("tierod_inner", "tierod_outer"):
        rows = [line.split() for line in printed.splitlines() if line.startswith(f"{name} ")]
        assert [name, *(f"{1e3 * x:+.1f}" for x in ends[name]), "mm"] in rows
    (row,) = [line for line in printed.splitlines() if line.startswith("uca_outer  ")]
    degrees = math.degrees(1e-3 * load(tmp_path / "car.csv").hardpoints[2].shim[1][1])
    assert f"{degrees:+.4f}" in row.split()
