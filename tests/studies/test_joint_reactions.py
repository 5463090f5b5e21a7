"""Reactions in check-joint: sound joints pass, and each check finds its mistake."""

import importlib
from dataclasses import replace

import pytest
from kincheck.core import Revolute, Screw, Spherical, Translational, check_joint
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.case.joint_probe import AXIS, probe
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.joints.base import unit
from kincheck.core.studies.checks.findings import Verdict
from kincheck.core.studies.checks.joint_loops import driven, loaded, loops, reactions, solved
from kincheck.core.studies.stress.verdicts import interpreted

from ..support.engine_faults import changed
from .test_check_joint_mistakes import mistaken, negative_gamma

pytestmark = pytest.mark.usefixtures("own_joint_types")
equations = importlib.import_module("kincheck.core.kinematics.forces.equations")
CHECKS = ["power", "no work", "acts and reacts"]


def found(joint_type):
    """The verdicts of a joint type by check."""
    case = loaded(probe(joint_type))
    every = reactions(solved(case))
    return {each.check.removeprefix("reaction: "): each.verdict for each in every}


def driven_checks(joint_type):
    """The same with drivers of the joint's own coordinates."""
    case = driven(probe(joint_type))
    return {each.check: each.verdict for each in reactions(solved(case))}


def at_origins(self, freedom, i, j):
    """Slides between the internal origins of the bodies, not at the joint's point."""
    P, h = vec(self.point), unit(self.axis)
    between = p.Dot20(h, ZERO, ZERO, i.arm(P) - j.arm(P))
    return between if freedom == "translation" else p.DrivenAngle(h)


@pytest.mark.parametrize("base", [Translational, Screw])
def test_slide_reaction_mistake_is_found(base):
    found = driven_checks(mistaken(base, measured=at_origins))
    assert found["reaction: acts and reacts"] is Verdict.FAIL


def failing(joint_type):
    return [name for name, verdict in found(joint_type).items() if verdict is Verdict.FAIL]


@pytest.fixture
def traced_anew(monkeypatch):
    """Programs are traced with the mistake of the test, not taken from the cache on disk."""
    monkeypatch.setattr(
        "kincheck.core.kinematics.compiled.compiled_model.load_or_make",
        lambda content, make, read: read(make()),
    )


def planted(monkeypatch, change):
    """Change force and moment of the joint under test."""
    right = equations.ForceEquations.reaction

    def wrong(self, joint, multipliers):
        found = right(self, joint, multipliers)
        return change(*found) if joint.name == "tested" else found

    monkeypatch.setattr(equations.ForceEquations, "reaction", wrong)


def test_moment_about_free_axis_is_found(monkeypatch, traced_anew):
    """That of a hinge: the reaction works as it turns."""
    axis = unit(AXIS)
    planted(monkeypatch, lambda force, moment: (force, moment + (force @ axis) * axis))
    assert {"no work", "acts and reacts"} <= {*failing(Revolute)}


def test_unbalanced_reaction_is_found(monkeypatch, traced_anew):
    """It does no work on a ball's freedoms, but is too small."""
    planted(monkeypatch, lambda force, moment: (0.99 * force, moment))
    assert failing(Spherical) == ["acts and reacts"]


def by_metres(self, factor):
    """A point a centimetre off, whatever the unit."""
    x, y, z = self.point
    return replace(self, point=(factor * x + 0.01, factor * y, factor * z))


def by_place(self, factor):
    """A point that is off by more, the farther it is from the global origin."""
    x, y, z = self.point
    return replace(self, point=(factor * (x + 1e-3 * x * x), factor * y, factor * z))


@pytest.mark.parametrize("scaled", [by_metres, by_place])
def test_reaction_scaling_mistake_is_found(scaled):
    assert "size" in check_joint(mistaken(Spherical, scaled=scaled), samples=8).failures


def test_order_dependent_reactions_are_found(monkeypatch, traced_anew):
    right = equations.ForceEquations.reaction

    def by_number(self, joint, multipliers):
        part = 1.0 + 1e-6 * self.mechanism.joints.index(joint)
        return tuple(part * each for each in right(self, joint, multipliers))

    monkeypatch.setattr(equations.ForceEquations, "reaction", by_number)
    assert "acts and reacts" in failing(Spherical)


def test_gravity_sign_mistake_is_found(monkeypatch, traced_anew):
    right = equations.inertial
    monkeypatch.setattr(equations, "inertial", lambda body, at, g: right(body, at, -g))
    assert "power" in failing(Spherical)


class Wrong:
    """An engine whose forces are off by a thousandth."""

    name = "wrong"

    def __getattr__(self, name):
        return getattr(NATIVE, name)

    def solve(self, model, case, tol):
        found = NATIVE.solve(model, case, tol)
        forces = found.forces
        joints = {k: replace(each, force=1.001 * each.force) for k, each in forces.joints.items()}
        return changed(found, forces=replace(forces, joints=joints))


class Right(Wrong):
    """The same with right forces."""

    def solve(self, model, case, tol):
        return NATIVE.solve(model, case, tol)


NATIVE = interpreted(NativeEngine())


def test_engine_with_other_reactions_is_found():
    right, wrong = (
        [each for each in loops(Spherical, [engine]) if each.check.startswith("reaction: wrong")]
        for engine in (Right(), Wrong())
    )
    assert [each.verdict for each in right] == [Verdict.PASS]
    assert [each.verdict for each in wrong] == [Verdict.FAIL]
    assert "force_" in wrong[0].message


def test_forces_skipped_if_equations_fail():
    report = check_joint(mistaken(Revolute, p.Dot11, gamma=negative_gamma), samples=4)
    (waiting,) = (each for each in report.findings if each.check == "reaction")
    assert waiting.verdict is Verdict.SKIP
    assert "first repair" in waiting.message
