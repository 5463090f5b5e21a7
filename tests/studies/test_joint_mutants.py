"""One-term mutants of joint types with equations of their own, and check-joint that finds them.

Of all 354, 317 are found; `HARMLESS` names the others. A run examines a seeded choice.
"""

import random
import sys
import types
import warnings
from pathlib import Path

import pytest
from kincheck.core import check_joint

from ..support.joint_mutants import mutants

SOURCE = (Path(__file__).parents[1] / "user_joints" / "telescope.py").read_text()
EVERY = dict(mutants(SOURCE))
CHOSEN, SEED = 16, 5
SAME_AXIS = "the same wherever both bodies have one axis"
HARMLESS = {
    "Across.phi 20: i.turn(a) @ d -> 1.001": "the same zeros",
    "Aligned.phi 2: i.turn(a) @ j.turn(self.h) -> 1.001": "the same zeros",
    "Turn.phi 9: 2.0 * (": "the same zeros",
    "Aligned.branch 1: i.turn(self.h) @ j.turn(self.h) -> 1.001": "the same signs",
    "Turn.branch 10: ": "the same signs at both zeros",
    "Turn.branch 11: ": "the same signs at both zeros",
    "Turn.branch 15: self.h @ rho.e -> 1.001": "the same signs at both zeros",
    "Turn.branch 9: self.drive.half_cos * rho.e0 + self.drive.half_sin * (self.h @ rho.e)"
    " -> self.drive.half_cos * rho.e0": "the same signs at both zeros, but for half a turn",
    "Across.gamma 83: vi -> vj": SAME_AXIS,
    "Aligned.rows 4: j -> i": SAME_AXIS,
    "Aligned.gamma 11: j -> i": SAME_AXIS,
    "Aligned.gamma 13: vj -> vi": SAME_AXIS,
    "Aligned.gamma 16: j -> i": SAME_AXIS,
    "Aligned.gamma 53: vi -> vj": SAME_AXIS,
    "Slide.phi 14: j -> i": SAME_AXIS,
    "Slide.phi 16: i -> j": SAME_AXIS,
    "Slide.rows 14: i -> j": SAME_AXIS,
    "Slide.rows 46: cross(a, d) -> cross(d, a)": "zero along the axis",
    "Slide.gamma 14: i -> j": SAME_AXIS,
    "Slide.gamma 63: vi -> vj": SAME_AXIS,
    "Slide.gamma 85: vi -> vj": SAME_AXIS,
    "Turn.rows 14: i -> j": SAME_AXIS,
    "Turn.gamma 1: self.drive.c_tt - cross(vi.w, i.turn(self.h)) @ (vj.w - vi.w)"
    " -> self.drive.c_tt": "the term is zero: the relative spin is along the axis",
    "Turn.gamma 3: ": "the same term",
    "Turn.gamma 5: ": "the same term",
    "Turn.gamma 6: ": "the same term",
    "Turn.gamma 13: vi -> vj": "the same term",
    "Turn.gamma 16: vj -> vi": "the same term",
    "Turn.gamma 17: vi -> vj": "the same term",
    "Turn.gamma 18: i -> j": "the same term",
    "Threaded.relations 3: ": "another lead, which only the joint itself can know",
    "Threaded.relations 5: ": "another lead",
    "Threaded.relations 6: ": "another lead",
    "Threaded.relations 8: ": "another lead",
}
"""Beginnings of the names of mutants that are no mistakes, with the reason."""

HARMFUL = sorted(name for name in EVERY if not name.startswith(tuple(HARMLESS)))


@pytest.mark.parametrize("mutant", random.Random(SEED).sample(HARMFUL, CHOSEN))
def test_a_mutant_of_one_term_is_found(mutant, own_joint_types, monkeypatch):
    module = types.ModuleType("mutant")
    monkeypatch.setitem(sys.modules, "mutant", module)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec(compile(EVERY[mutant], "mutant", "exec"), module.__dict__)
        reports = (check_joint(each, samples=8) for each in (module.Telescope, module.Threaded))
        assert any(not report.passed for report in reports)


def test_the_joints_without_a_mutation_pass(own_joint_types, in_folder):
    from telescope import Telescope, Threaded

    assert check_joint(Telescope, samples=8).passed
    assert check_joint(Threaded, samples=8).passed
