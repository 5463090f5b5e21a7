"""Shims against the carrier's pose with links of given lengths, solved by Newton's method."""

import json
import math

import numpy as np
import pytest
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.shims import shims
from kincheck.core.extensions.hardpoints.suspension import Convention, Side, Vehicle
from kincheck.core.extensions.hardpoints.templates import TEMPLATES

from ...oracles.rods import rotation
from ...support.rods_of_templates import RODS


@pytest.mark.parametrize("name", [name for name, rods in RODS.items() if len(rods) == 5])
def test_tie_rod_moves_equal_rod_formula(name):
    """(l . v) / v_i of the inner end, v being the outer end's velocity at toe rate zero, found by
    differences of the carrier on the other four rods.
    """
    at = {role: np.array(place) for role, place in TEMPLATES[name].sample.items()}
    center, (*rods, (inner, outer)) = at["wheel_center"], RODS[name]
    place = dict(TEMPLATES[name].sample)

    def misfit(pose, height):
        turn, s = rotation(pose[3:]), rotation(pose[3:]) @ np.array([0.0, 1.0, 0.0])
        gaps = [
            np.linalg.norm(center + pose[:3] + turn @ (at[b] - center) - at[a])
            - np.linalg.norm(at[b] - at[a])
            for a, b in rods
        ]
        return np.array([*gaps, pose[2] - height, np.arctan2(s[0], s[1])])

    def outer_end(height):
        pose = np.zeros(6)
        for _ in range(8):
            steps = 1e-6 * np.eye(6)
            slopes = [(misfit(pose + d, height) - misfit(pose - d, height)) / 2e-6 for d in steps]
            pose = pose - np.linalg.solve(np.transpose(slopes), misfit(pose, height))
        return center + pose[:3] + rotation(pose[3:]) @ (at[outer] - center)

    v = (outer_end(1e-4) - outer_end(-1e-4)) / 2e-4
    wheel = Vehicle(
        convention=Convention.ISO_8855,
        side=Side.LEFT,
        forward=(1.0, 0.0, 0.0),
        up=(0.0, 0.0, 1.0),
        wheel_center="wheel_center",
        kingpin=TEMPLATES[name].kingpin,
    )
    _, found = shims(TEMPLATES[name], place, wheel)
    # differences over 0.2 mm have an error of 1e-8 of the curvature
    assert found[inner] == pytest.approx((at[outer] - at[inner]) @ v / v, rel=1e-5)


@pytest.mark.needs("explain")
def test_explain_prints_shims_in_degrees(tmp_path, capsys):
    main(["templates", "double_wishbone"])
    (tmp_path / "car.csv").write_text(capsys.readouterr().out)
    assert (
        main(
            [
                "explain",
                str(tmp_path / "car.csv"),
                "--samples",
                "2",
                f"--json={tmp_path / 'told.json'}",
            ]
        )
        == 0
    )
    printed = capsys.readouterr().out
    assert "shims of 1 mm at design" in printed
    ends = {each.name: each.no_bump_steer for each in load(tmp_path / "car.csv").hardpoints}
    rows = [line for line in printed.splitlines() if "deg/m" in line]
    assert "(-8.7 deg/m now)" in rows[0]
    for name, row in zip(("tierod_inner", "tierod_outer"), rows[1:], strict=False):
        assert row.startswith(name)
        for x in ends[name]:
            assert f"{1e3 * x:+.1f}" in row
        assert row.count("none in reach (") == sum(abs(x) > 0.05 for x in ends[name]) == 2
    told = json.loads((tmp_path / "told.json").read_text())
    assert told["bump_steer"] == pytest.approx(math.radians(-8.7037), rel=1e-4)
    for name, left in told["bump_steer_left"].items():
        assert [x is None for x in left] == [abs(x) > 0.05 for x in told["no_bump_steer"][name]]
        assert all(abs(x) < 1e-9 for x in left if x is not None)
    (row,) = [line for line in printed.splitlines() if line.startswith("uca_outer  ")]
    degrees = math.degrees(1e-3 * load(tmp_path / "car.csv").hardpoints[2].shim[1][1])
    assert f"{degrees:+.4f}" in row.split()
