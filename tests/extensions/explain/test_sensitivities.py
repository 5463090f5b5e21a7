"""Sensitivities and the budget of the closure, against mechanisms solved anew."""

import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck import Point, cases
from kincheck.core.extensions.designs.prepared import prepare_designs
from kincheck.core.extensions.explain.diagnose import diagnose
from kincheck.core.kinematics import NativeSolver, places

from ...support.fakes import swept
from ...support.mechanisms import ORIGIN, four_bar, mcpherson
from .test_explain import case


@pytest.mark.parametrize(
    ("name", "value"), [("mcpherson_strut", -0.08), ("rssr", 2.0), ("spatial_slider_crank", 0.7)]
)
def test_sensitivities_equal_central_differences(name, value):
    """Against central differences of 1e-5 m: they are off by the third derivative, 1e-10, and
    round-off, 1e-15 / 1e-5. Positions at one point are one hardpoint, named by the first.
    """
    loaded = cases.load(name)
    case, mechanism = (swept(loaded, [value]), loaded.mechanism)
    numbers = [
        (place, k, x) for place, design in places(mechanism).items() for k, x in enumerate(design)
    ]
    h = 1e-5 * np.eye(len(numbers))
    designs = np.array([x for _, _, x in numbers])[:, None] + np.concatenate([h, -h], axis=1)
    ready = prepare_designs(
        NativeSolver(order=0), mechanism, case.sweep.path, tuple(places(mechanism)), case.points
    )
    solved = ready.solve(designs, 1e-13)
    assert solved.solved.all()
    known = {
        (each.output, each.number): each.by_sample[0]
        for each in diagnose(case, samples=1, tol=1e-12).sensitivities
    }
    checked = 0
    for output in case.outputs:
        if output.forces:
            continue
        own = [place for place, _, _ in numbers].index(f"points.{output.point}.position")
        designed = designs[own : own + 3] if output.relative else 0.0
        found = np.array(output.direction) @ (
            ready.motion(solved, output.point)[0][:, 0] - designed
        )
        differences = (found[: len(numbers)] - found[len(numbers) :]) / 2e-5
        together: dict[str, float] = {}
        for (place, k, _), difference in zip(numbers, differences, strict=True):
            vector = places(mechanism)[place]
            name = place if len(vector) == 1 or ".ax" in place else hardpoint(mechanism, vector)
            number = name if len(vector) == 1 else f"{name} {'xyz'[k]}"
            scale = np.linalg.norm(vector) if ".ax" in place else 1.0  # of directions, by the angle
            together[number] = together.get(number, 0.0) + scale * difference
        for number, derivative in together.items():
            assert known.pop((output.name, number), 0.0) == pytest.approx(derivative, abs=2e-8), (
                output.name,
                number,
            )
            checked += abs(derivative) > 1e-3
    assert not known
    assert checked >= 20


def hardpoint(mechanism, position):
    """The first of the positions at this point."""
    return next(
        place
        for place, value in places(mechanism).items()
        if ".ax" not in place and np.allclose(value, position, rtol=0.0, atol=1e-9)
    )


@pytest.mark.parametrize("name", ["mcpherson_strut", "rssr", "chrono_multi_link"])
def test_closure_budget_equals_case_tolerances(name):
    loaded = cases.load(name)
    found = diagnose(loaded, samples=41, tol=1e-12)
    stated = float(re.search(r"at most ([\d.e+-]+) m", loaded.outputs[0].why)[1])
    # its two or three digits, and what the samples that are not looked at may add
    assert max(each.shift for each in found.budgets) == pytest.approx(stated, rel=0.02)
    assert all(
        99.999 * each.shift <= each.suggested <= 111.0 * each.shift for each in found.budgets
    )
    assert all(each.round_off < 1e-3 * each.shift for each in found.budgets)


def test_binding_axis_is_flagged():
    found = diagnose(case(four_bar(), [0.0, 0.4, 0.8], "C"), samples=3, tol=1e-12)
    assert "joints.C.axis x" in found.binding  # out of parallel
    assert "joints.C.point x" not in found.binding  # another link length


def test_fixed_point_depends_on_itself():
    mechanism = replace(mcpherson(), points=[*mcpherson().points, Point("bolt", "chassis", ORIGIN)])
    found = diagnose(case(mechanism, [0.01], "bolt"), samples=1, tol=1e-12)
    assert {each.number for each in found.sensitivities} == {
        f"points.bolt.position {axis}" for axis in "xyz"
    }
    assert {each.shift for each in found.budgets} == {0.0}
