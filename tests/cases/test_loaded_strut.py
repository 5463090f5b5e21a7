"""The strut with masses: its forces in the file are those of an independent solution."""

import csv

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import solve

from ..oracles import newton_euler

COMPONENTS = {
    "tie_rod_force_y": ("tie_rod", 1),
    "ball_force_y": ("ball", 1),
    "strut_top_force_z": ("strut_top", 2),
    "pivot_moment_z": ("lca_pivot", 5),
    "slide_moment_x": ("strut_slide", 3),
}


def forces(case, motion, k):
    """All force outputs at a sample: spring by hand, the rest by Newton and Euler."""
    mechanism, (spring,) = case.mechanism, case.mechanism.forces
    bodies = {body.name: body for body in mechanism.bodies}
    ends = [
        newton_euler.carried(bodies[body], motion.bodies[body], k, point)
        for body, point in zip(spring.bodies, spring.points, strict=True)
    ]
    speeds = [motion.points[name].velocity[k] for name in ("spring_0", "spring_1")]
    way = ends[1] - ends[0]
    length = np.linalg.norm(way)
    along = way / length
    tension = spring.stiffness * (length - spring.free_length)
    tension += spring.damping * (speeds[1] - speeds[0]) @ along
    pull, none = tension * along, np.zeros(3)
    pushes = {spring.i: [(pull, ends[0], none)], spring.j: [(-pull, ends[1], none)]}
    found, load = newton_euler.reactions(mechanism, motion.bodies, k, pushes)
    values = {name: found[joint][axis] for name, (joint, axis) in COMPONENTS.items()}
    return {"wheel_load": load, "spring_force": tension, **values}


def solved():
    from dataclasses import replace

    from kincheck.core import Point

    case = cases.load("mcpherson_strut_loaded")
    mechanism, (spring,) = case.mechanism, case.mechanism.forces
    points = [
        Point(f"spring_{n}", body, at)
        for n, (body, at) in enumerate(zip(spring.bodies, spring.points, strict=True))
    ]
    mechanism = replace(mechanism, points=[*mechanism.points, *points])
    names = [body.name for body in mechanism.moving]
    return case, solve(mechanism, "stroke", case.sweep.values, bodies=names)


@pytest.fixture(scope="module")
def strut():
    return solved()


def test_the_file_has_the_forces_of_newton_and_euler(strut):
    case, motion = strut
    for k in range(0, 161, 8):
        for name, value in forces(case, motion, k).items():
            printed = case.reference[name].position
            assert abs(printed[k] - value) <= 1e-12 * np.abs(printed).max()


def test_its_motion_is_that_of_the_strut():
    def rows(name):
        lines = (cases.FOLDER / f"{name}.csv").read_text().splitlines()
        return [*csv.DictReader(line for line in lines if not line.startswith("#"))]

    for plain, loaded in zip(rows("mcpherson_strut"), rows("mcpherson_strut_loaded"), strict=True):
        assert plain.items() <= loaded.items()
