"""Forces in the stress run: what is right, and every kind of mistake found."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.forces import Forces
from kincheck.core.harness.execution import Pair
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.joints.base import AxialJoint, unit
from kincheck.core.studies.stress.families import FAMILIES
from kincheck.core.studies.stress.reduction import judge, rounded
from kincheck.core.studies.stress.run import specimen
from kincheck.core.studies.stress.solving import interpreted, once
from kincheck.core.studies.stress.verdicts import Verdict, judged
from kincheck.core.studies.truth.forces import known_forces

demand = importlib.import_module("kincheck.core.kinematics.forces.equations")
FORCES = FAMILIES["forces"]
# Numbers of specimens: a hinge twice, a four-bar of four hinges, a fast arm, a driven slide.
TWICE, FOUR_BAR, SPINNING, SLIDING = 21, 4, 5, 12
NATIVE = interpreted(NativeEngine())


@pytest.fixture(scope="module")
def made():
    """Two specimens with redundant rows, and the native answers."""
    found = {}
    for number in (TWICE, FOUR_BAR):
        one = specimen(FORCES, 0, number, 3)
        found[number] = one, NATIVE.solve(NATIVE.build(one.case), one.case, 1e-12)
    return found


class Changed:
    """The native answer with other forces."""

    def __init__(self, trajectory, change):
        self.trajectory, self.change = trajectory, change

    def __getattr__(self, name):
        return getattr(NATIVE, name)

    def solve(self, model, case, tol):
        return replace_forces(self.trajectory, self.change(self.trajectory.forces))


def replace_forces(trajectory, forces):
    found = object.__new__(type(trajectory))
    found.__dict__.update(trajectory.__dict__, forces=forces)
    return found


def verdicts(made, number, change=lambda forces: forces):
    one, trajectory = made[number]
    answer = once(Pair(one.case, Changed(trajectory, change), 1e-12))
    return judged(one.specimen, one.case, one.truth, answer)


def joints(forces: Forces, change) -> Forces:
    return replace(forces, joints={name: change(each) for name, each in forces.joints.items()})


@pytest.mark.parametrize("number", [TWICE, FOUR_BAR])
def test_right_forces_are_right(made, number):
    found = verdicts(made, number)
    assert found.counts[Verdict.RIGHT] == len(found.verdicts)
    assert 0.0 < found.worst[3] < 0.1


def test_some_are_determined_and_some_are_not(made):
    for one, _ in made.values():
        known = known_forces(one.case, one.truth).values()
        assert any(each.determined.all() for each in known)
        assert any(each.undetermined.all() for each in known)
        assert not any((each.determined & each.undetermined).any() for each in known)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        (
            lambda f: replace(f, drivers={name: 1.001 * x for name, x in f.drivers.items()}),
            Verdict.WRONG_FORCE,
        ),
        (
            lambda f: joints(f, lambda each: replace(each, moment=each.moment + 1e-3)),
            Verdict.WRONG_FORCE,
        ),
        (
            lambda f: joints(f, lambda each: replace(each, free=0.0 * each.free)),
            Verdict.UNDETERMINED_FORCE,
        ),
        (
            lambda f: replace(f, drivers={name: np.nan * x for name, x in f.drivers.items()}),
            Verdict.MISSING_FORCE,
        ),
    ],
)
def test_mistakes_are_named(made, change, verdict):
    found = verdicts(made, FOUR_BAR, change)
    assert found.counts[verdict] == len(found.verdicts)


def test_missing_gyroscopic_moment_is_found(monkeypatch):
    """No gyroscopic moment."""
    monkeypatch.setattr(
        demand,
        "spin_change",
        lambda body, at: at.poses[body.name].turn(
            demand.inertia_of(body) @ demand.spin_of(body, at)[1]
        ),
    )
    one = specimen(FORCES, 0, SPINNING, 3)
    found = judged(one.specimen, one.case, one.truth, once(Pair(one.case, NATIVE, 1e-12)))
    assert found.counts[Verdict.WRONG_FORCE] > 0


def test_a_slide_driven_beside_its_axis_is_found(monkeypatch):
    """Its force acts at the internal origin of the second body."""
    right = AxialJoint.measured

    def wrong(self, freedom, i, j):
        P, h = vec(self.point), unit(self.axis)
        if freedom == "rotation":
            return right(self, freedom, i, j)
        return p.Dot20(h, ZERO, ZERO, i.arm(P) - j.arm(P))

    monkeypatch.setattr(AxialJoint, "measured", wrong)
    one = specimen(FORCES, 0, SLIDING, 3)
    found = judged(one.specimen, one.case, one.truth, once(Pair(one.case, NATIVE, 1e-12)))
    assert found.counts[Verdict.WRONG_FORCE] == 3


def test_an_engine_without_forces_is_not_judged(made):
    found = verdicts(made, FOUR_BAR, lambda forces: None)
    assert found.counts[Verdict.UNSUPPORTED] == len(found.verdicts)


def test_a_case_with_forces_is_judged_again_and_rounded(made):
    one, trajectory = made[FOUR_BAR]
    engine = Changed(
        trajectory, lambda f: joints(f, lambda each: replace(each, force=2.0 * each.force))
    )
    assert judge(one.case, engine, 1e-12).counts[Verdict.WRONG_FORCE] == len(one.case.sweep.values)
    short = rounded(one.case, 9)
    assert short is not None
    assert short.forces == one.case.forces
