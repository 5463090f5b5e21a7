"""Components, many designs, simulators and proofs start as a sweep does."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters.exudyn.statics import static
from kincheck.core import (
    Point,
    solve,
)
from kincheck.core import solve_designs as designs
from kincheck.core.case.io.model_writer import way_to
from kincheck.core.mechanism.motions import Path, Ramp, Sine
from kincheck.core.studies.tolerance.sweep import sweep_designs
from kincheck.core.studies.variation.variation_file import read_variation
from kincheck.core.studies.verified_reference import prove_case

from ..support.block_structures import solve_components
from ..support.mechanisms import chain, errors
from .test_start import RADIUS, TIMES, arm, case_of, circling, phases_of, six, turned_arm


def test_components_start_at_typed_phase():
    for phase in (math.pi, six(math.pi)):
        path = Path({"turn": Sine(-1.2, 0.2, phase)}, TIMES)
        found = solve_components(chain(3), path, ("end",))
        expected = 3.0 + np.sin(0.3 - path.motions["turn"].at(TIMES)[0])
        assert found.solved.all(), found.message
        assert found.points["end"].position[:, 0] == pytest.approx(expected, abs=1e-12)
        assert found.details["start"]["time"] == 0.0


def test_designs_start_at_typed_phase():
    mechanism = turned_arm()
    values, tips = np.linspace(-1.0, 1.0, 5), np.array([(1.0, 0.1, 0.0), (0.9, 0.2, 0.0)])
    for phase in (math.pi, six(math.pi), 1.0):
        motions = {"v": Sine(0.5, 0.3, phase)}
        found = designs(mechanism, "u", values, {"points.tip.position": tips}, motions=motions)
        for k, tip in enumerate(tips.tolist()):
            one = replace(mechanism, points=[Point("tip", "b", tuple(tip))])
            alone = solve(one, "u", values, motions=motions).points["tip"]
            assert errors(alone, [found.points["tip"].position[k]])[0] <= 1e-12


def test_designs_note_assumed_start():
    tips = {"points.tip.position": np.array([(1.0, 0.1, 0.0)])}
    near, far = (
        designs(turned_arm(), "u", TIMES, tips, motions={"v": Sine(0.5, 0.3, phase)}).notes
        for phase in (six(math.pi), 1.0)
    )
    assert [*near] == []
    assert "the design position is not on the path: all drivers go straight" in "; ".join(far)


@pytest.mark.parametrize(("phase", "said"), [(six(math.pi), False), (1.0, True)])
def test_study_notes_assumed_start(phase, said, tmp_path):
    mechanism = turned_arm()
    file = tmp_path / "vary.toml"
    what = '[units]\nlength = "m"\n[hardpoints.tip]\nat = "points.tip.position"\nsigma = 0.001\n'
    file.write_text(f'schema = "kincheck-vary/1"\nmode = "monte_carlo"\n{what}')
    case = case_of(mechanism, {"u": Sine(0.5, 0.3, phase), "v": Ramp(0.1)})
    found = sweep_designs(case, read_variation(file, case), samples=8)
    assert any("go straight" in note for note in found.run["cases"]["case"]["notes"]) == said


def test_simulator_starts_at_typed_phase():
    """Turns of a coupled joint are counted from the design, where a typed phase begins as well as
    an exact one.
    """
    if static().version() is None:
        pytest.skip("not installed")
    mechanism = turned_arm(60.0)
    near, far = (
        case_of(mechanism, {"u": Sine(1.0, 0.3, phase), "v": Ramp(0.1)})
        for phase in (six(math.pi), 1.0)
    )
    assert static().unsupported(near) is None
    assert "count from the design" in str(static().unsupported(far))
    found = static().solve(static().build(near), near, 1e-12)
    assert found.points["r"].position[:, 0] == pytest.approx(
        RADIUS * near.sweep.motions["u"].at(TIMES)[0], abs=1e-9
    )


def test_written_start_is_reached():
    """The way begins at the design, also where the motion does not, so that turns are counted."""
    mechanism = turned_arm(60.0)
    case = case_of(mechanism, {"u": Sine(9.0, 0.1, 1.5), "v": Ramp(0.1)})
    way = way_to(case, 0.5)
    assert way["rack"].r[0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-15)
    assert way["a"].p[0] == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-15)
    assert way["rack"].r[-1, 0] == pytest.approx(
        RADIUS * case.sweep.motions["u"].at(np.array([0.5]))[0][0], abs=1e-12
    )


def test_typed_digits_are_proved():
    mechanism = arm(60.0)
    case = case_of(mechanism, circling(mechanism, map(six, phases_of(60.0))))
    made, _ = prove_case(case, digits=20, numbers="double", tol=1e-12)
    assert all(each.proved for each in made.samples)
