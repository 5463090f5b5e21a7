"""Joints with one mistake each, and the check that must name it."""

import dataclasses
import importlib
import math
from dataclasses import dataclass, replace

import pytest
from kincheck import (
    ConstantVelocity,
    Cylindrical,
    InPlane,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
    check_joint,
)
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, cross, vec
from kincheck.core.case.joint_probe import AXIS, probe
from kincheck.core.cli.joint_loading import load_joint
from kincheck.core.joints.base import triad, unit
from kincheck.core.primitives import Row
from kincheck.core.studies.checks.findings import Verdict
from kincheck.core.studies.checks.joint_loops import (
    loops,
    reactions,
    solve_probe,
    with_loads,
    with_own_drivers,
)

from ..support.driven_chains import at_origins
from ..support.engine_faults import changed
from ..support.fakes import native_but

pytestmark = pytest.mark.usefixtures("own_joint_types")
checking = importlib.import_module("kincheck.core.studies.checks.check_joint")


def mistaken(base, primitive=None, **changes):
    """A joint type like the base, its primitives of one type with methods or fields changed."""

    def primitives(self, i, j):
        composed = base.primitives(self, i, j)
        return [
            _retyped(each, primitive, changes) if type(each) is primitive else each
            for each in composed
        ]

    body = (
        {"type": "mistaken", "primitives": primitives}
        if primitive
        else {"type": "mistaken", **changes}
    )
    return dataclass(frozen=True)(type("Mistaken", (base,), body))


def _retyped(native, primitive, changes):
    fields = {each.name: getattr(native, each.name) for each in dataclasses.fields(native)}
    return type(f"Mistaken{primitive.__name__}", (primitive,), changes)(**fields)


def negative_gamma(self, i, j, vi, vj):
    return tuple(-x for x in super(type(self), self).gamma(i, j, vi, vj))


def doubled_rows(self, i, j):
    return tuple(Row(*(2.0 * a for a in row)) for row in super(type(self), self).rows(i, j))


def rows_without_arm(self, i, j):
    """The force acts at the origin of body j."""
    return tuple(row._replace(pj=ZERO) for row in super(type(self), self).rows(i, j))


def steady(self, i, j):
    return (0.1,) * self.n


def negative_branch(self, i, j):
    return tuple(-x for x in super(type(self), self).branch(i, j))


def no_branch(self, i, j):
    return ()


def rough(self, i, j):
    return tuple(abs_of(x) for x in super(type(self), self).phi(i, j))


def abs_of(x):
    from kincheck.core.program import absolute

    return absolute(x)


def cancelling(self, i, j):
    # a difference of numbers ten million times larger than what it is of
    x = i.u.x + j.u.x
    return tuple((each + 1e7 * x) - 1e7 * x for each in super(type(self), self).phi(i, j))


class Root(p.Spherical):
    """Its equations cannot be traced."""

    def phi(self, i, j):
        return tuple(math.sqrt(x) for x in super().phi(i, j))


def composed(base, primitives):
    """A joint type like the base of primitives made of its two arms, its axes f, g and h, and its
    axis as it is given.
    """

    def own(self, i, j):
        P = vec(self.point)
        axis = getattr(self, "axis", (0.0, 0.0, 1.0))
        return primitives((i.arm(P), j.arm(P)), *triad(axis), vec(axis))

    return mistaken(base, primitives=own)


def global_arm(self, i, j):
    return (p.Spherical(vec(self.point), vec(self.point)),)


def measured_backwards(self, freedom, i, j):
    P, h = vec(self.point), unit(self.axis)
    if freedom == "rotation":
        return p.DrivenAngle(h)
    return p.Dot20(-h, i.arm(P), j.arm(P), ZERO)


def driving(**methods):
    """A cylindrical joint whose drivers have the methods changed."""

    def measured(self, freedom, i, j):
        right = Cylindrical.measured(self, freedom, i, j)
        return _retyped(right, type(right), methods)

    return mistaken(Cylindrical, measured=measured)


def without_own_acceleration(self, i, j, vi, vj):
    return tuple(x - self.drive.c_tt for x in super(type(self), self).gamma(i, j, vi, vj))


def without_bending(self, i, j, vi, vj):
    return (self.drive.c_tt,) * self.n


def slow(self, i, j):
    return tuple(0.999 * x for x in super(type(self), self).nu(i, j))


def short(self, i, j):
    return tuple(x + 1e-3 * self.drive.c for x in super(type(self), self).phi(i, j))


def beside_the_axis(self, i, j):
    """Both forces act a little beside the axis, and do the same work."""
    rows = super(type(self), self).rows(i, j)
    aside = i.turn(vec((0.01, 0.02, -0.01)))
    return tuple(
        row._replace(pi=row.pi + cross(aside, row.ri), pj=row.pj + cross(aside, row.rj))
        for row in rows
    )


def near_design(self, i, j):
    """What does not know the drive's value."""
    return ((i.q.conjugate() * j.q).e0,)


def on_one_body(self, i, j):
    return tuple(row._replace(ri=ZERO, pi=ZERO) for row in super(type(self), self).rows(i, j))


def no_rows(self, i, j):
    return ()


def one_short(self, i, j, vi, vj):
    return super(type(self), self).gamma(i, j, vi, vj)[1:]


MISTAKES = {
    "sign of gamma": ("gamma", lambda: mistaken(Revolute, p.Dot11, gamma=negative_gamma)),
    "gamma of a line": ("gamma", lambda: mistaken(Translational, p.Dot21, gamma=negative_gamma)),
    "gamma one short": ("equations", lambda: mistaken(Spherical, p.Spherical, gamma=one_short)),
    "no rows": ("equations", lambda: mistaken(InPlane, primitives=no_rows)),
    "rows without an arm": ("rows", lambda: mistaken(InPlane, p.Dot20, rows=rows_without_arm)),
    "rows too long": ("newton", lambda: mistaken(Spherical, p.Spherical, rows=doubled_rows)),
    "axes swapped": (
        "newton",
        lambda: composed(
            Revolute, lambda arms, f, g, h, axis: (p.Spherical(*arms), p.Dot11(g, f, h))
        ),
    ),
    "axis not unit": (
        "axis lengths",
        lambda: composed(
            Revolute, lambda arms, f, g, h, axis: (p.Spherical(*arms), p.Dot11(f, g, axis))
        ),
    ),
    "a row as long as the axis": (
        "axis lengths",
        lambda: composed(InPlane, lambda arms, f, g, h, axis: (p.Dot20(axis, *arms, ZERO),)),
    ),
    "a row missing": (
        "freedoms",
        lambda: composed(Revolute, lambda arms, f, g, h, axis: (p.Spherical(*arms), p.Dot10(f, h))),
    ),
    "a row twice": (
        "rank",
        lambda: composed(
            Revolute, lambda arms, f, g, h, axis: (p.Spherical(*arms), p.Dot10(f, h), p.Dot10(h, f))
        ),
    ),
    "a freedom too many": (
        "freedoms",
        lambda: mistaken(Universal, freedoms=("rotation i", "rotation j", "slide")),
    ),
    "rows miscounted": ("freedoms", lambda: mistaken(Universal, rows=property(lambda self: 5))),
    "nu": ("nu", lambda: mistaken(Spherical, p.Spherical, nu=steady)),
    "sign of a branch test": (
        "branch tests",
        lambda: mistaken(Revolute, p.Dot11, branch=negative_branch),
    ),
    "no branch test": (
        "spurious branches",
        lambda: mistaken(ConstantVelocity, p.ConstantVelocity, branch=no_branch),
    ),
    "arm of the wrong body": (
        "rigid motion",
        lambda: composed(Spherical, lambda arms, *axes: (p.Spherical(arms[1], arms[1]),)),
    ),
    "global arms": ("place", lambda: mistaken(Spherical, primitives=global_arm)),
    "not closed at design": (
        "design",
        lambda: composed(
            Revolute,
            lambda arms, f, g, h, axis: (p.Spherical(*arms, d0=0.01 * f), p.Dot11(f, g, h)),
        ),
    ),
    "a length that is none": (
        "size",
        lambda: composed(
            InPlane, lambda arms, *axes: [p.Distance(*arms, 0.05 * a, 0.05, 0.05) for a in axes[:2]]
        ),
    ),
    "called symmetric": ("exchange", lambda: mistaken(InPlane, symmetric=True)),
    "not smooth": ("newton", lambda: mistaken(Revolute, p.Dot11, phi=rough)),
    "cancellation": ("round-off", lambda: mistaken(Spherical, p.Spherical, phi=cancelling)),
    "math.sqrt": ("equations", lambda: composed(Spherical, lambda arms, *axes: (Root(*arms),))),
    "other coordinates": (
        "mixed style",
        lambda: mistaken(Revolute, freedoms=("rotation", "translation")),
    ),
}
MISTAKES_OF_DRIVERS = {
    "a driver that pulls backwards": lambda: mistaken(Cylindrical, measured=measured_backwards),
    "a driver about the opposite axis": lambda: mistaken(
        Revolute, measured=lambda self, *_: p.DrivenAngle(-unit(self.axis))
    ),
    "a drive without its acceleration": lambda: driving(gamma=without_own_acceleration),
    "a drive along a straight axis": lambda: driving(gamma=without_bending),
    "a drive a thousandth slow": lambda: driving(nu=slow),
    "a drive a thousandth short": lambda: driving(phi=short),
    "a drive at the origin": lambda: driving(rows=rows_without_arm),
    "a drive beside the axis": lambda: driving(rows=beside_the_axis),
    "a drive on one body": lambda: driving(rows=on_one_body),
    "a drive of twice the force": lambda: driving(rows=doubled_rows),
    "a drive that loses a turn": lambda: driving(branch=no_branch),
    "a drive refused": lambda: driving(branch=negative_branch),
    "a drive refused half a turn away": lambda: driving(branch=near_design),
    "a drive about another axis": lambda: mistaken(
        Revolute, measured=lambda self, *_: p.DrivenAngle(triad(self.axis)[0])
    ),
}
MISTAKES |= {name: ("driver", make) for name, make in MISTAKES_OF_DRIVERS.items()}


@pytest.mark.by_day(2)
@pytest.mark.parametrize("mistake", MISTAKES)
def test_check_joint_finds_joint_mistakes(mistake, few, monkeypatch):
    """Few poses find them; the two dear checks run where they must find one."""
    check, make = MISTAKES[mistake]
    monkeypatch.setattr(checking, "loops", lambda tested, engines, failing=(): [])
    if check != "spurious branches":
        monkeypatch.setattr(checking, "branches", lambda one, starts: [])
    report = check_joint(make(), samples=8)
    assert check in report.failures, report
    found = report[check]
    assert found.limit is None or found.figure > found.limit
    assert found.message


def test_joint_without_rows_is_reported():
    assert (
        "has 0 rows, expected one or more. Return its primitives"
        in check_joint(MISTAKES["no rows"][1]())["equations"].message
    )


def test_check_joint_passes_unmistaken_base(few):
    """The machinery of these tests makes no mistakes by itself."""
    assert check_joint(mistaken(Revolute, p.Dot11), samples=8).passed
    assert check_joint(mistaken(ConstantVelocity, p.ConstantVelocity), samples=8).passed


def test_check_joint_finds_wrong_equivalent(few, in_folder):
    right = load_joint("pin_in_slot:PinInSlot")

    def equivalent(self):
        return [], [Spherical(f"{self.name}_ball", self.i, self.j, self.point)]

    report = check_joint(mistaken(right, equivalent=equivalent), samples=8)
    assert report.failures == ("loop: native, equivalent",), report
    assert "2 degrees of freedom" in report["loop: native, equivalent"].message


def test_equivalent_with_fixed_names_is_found(few):
    """The second joint of a mechanism would have parts of the same names."""

    def equivalent(self):
        return [], [Revolute("pin", self.i, self.j, self.point, self.axis)]

    report = check_joint(mistaken(Revolute, equivalent=equivalent), samples=8)
    assert report.failures == ("loop: native, equivalent",), report
    message = report["loop: native, equivalent"].message
    assert "names a part 'pin', whatever the joint's name is" in message


# Reactions: each check finds its mistake

equations = importlib.import_module("kincheck.core.kinematics.forces.equations")


def failing(joint_type, case_of=with_loads):
    """The failing checks of reactions of a joint type, loaded or driven in its own coordinates."""
    found = reactions(solve_probe(case_of(probe(joint_type))))
    return [each.check.removeprefix("reaction: ") for each in found if each.verdict is Verdict.FAIL]


@pytest.mark.parametrize("base", [Translational, Screw])
def test_slide_reaction_mistake_is_found(base):
    assert "acts and reacts" in failing(mistaken(base, measured=at_origins), with_own_drivers)


@pytest.fixture
def traced_anew(monkeypatch):
    """Programs are traced with the mistake of the test, not taken from the cache on disk."""
    monkeypatch.setattr(
        "kincheck.core.kinematics.compiled.compiled_model.load_or_make",
        lambda content, make, read: read(make()),
    )


def plant(monkeypatch, change):
    """Change force and moment of a joint by its place in the mechanism."""
    right = equations.ForceEquations.reaction

    def wrong(self, joint, multipliers):
        found = right(self, joint, multipliers)
        return change(joint.name, self.mechanism.joints.index(joint), *found)

    monkeypatch.setattr(equations.ForceEquations, "reaction", wrong)


def test_moment_about_free_axis_is_found(monkeypatch, traced_anew):
    """That of a hinge: the reaction works as it turns."""
    axis = unit(AXIS)
    plant(
        monkeypatch,
        lambda name, k, force, moment: (force, moment + (name == "tested") * (force @ axis) * axis),
    )
    assert {"no work", "acts and reacts"} <= {*failing(Revolute)}


def test_unbalanced_reaction_is_found(monkeypatch, traced_anew):
    """It does no work on a ball's freedoms, but is too small."""
    plant(
        monkeypatch,
        lambda name, k, force, moment: ((0.99 if name == "tested" else 1.0) * force, moment),
    )
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
    plant(monkeypatch, lambda name, k, *found: tuple((1.0 + 1e-6 * k) * each for each in found))
    assert "acts and reacts" in failing(Spherical)


def test_gravity_sign_mistake_is_found(monkeypatch, traced_anew):
    right = equations.inertial
    monkeypatch.setattr(equations, "inertial", lambda body, at, g: right(body, at, -g))
    assert "power" in failing(Spherical)


@pytest.mark.parametrize(("factor", "verdict"), [(1.0, Verdict.PASS), (1.001, Verdict.FAIL)])
def test_engine_with_other_reactions_is_found(factor, verdict):
    def change(found, case):
        joints = found.forces.joints
        joints = {k: replace(each, force=factor * each.force) for k, each in joints.items()}
        return changed(found, forces=replace(found.forces, joints=joints))

    findings = loops(Spherical, [native_but(change, "wrong")])
    (found,) = (each for each in findings if each.check.startswith("reaction: wrong"))
    assert found.verdict is verdict
    assert ("force_" in found.message) == (verdict is Verdict.FAIL)


def test_forces_skipped_if_equations_fail():
    report = check_joint(mistaken(Revolute, p.Dot11, gamma=negative_gamma), samples=4)
    (waiting,) = (each for each in report.findings if each.check == "reaction")
    assert waiting.verdict is Verdict.SKIP
    assert "first repair" in waiting.message
