"""The check of joint types: sound joints pass, and every kind of mistake is caught by the check that is there for it."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import pytest
from kincheck import adapters
from kincheck.core import Body, ConstantVelocity, InPlane, Joint, Revolute, Spherical, Translational, Universal
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.errors import KincheckError
from kincheck.core.harness import check_joint
from kincheck.core.harness.cli import main
from kincheck.core.harness.joint_check.check_joint import load_joint
from kincheck.core.harness.joint_check.findings import Verdict
from kincheck.core.joints import AxialJoint
from kincheck.core.joints.base import triad, unit
from kincheck.core.primitives import Row

BUILT_IN = sorted(name for name, joint in Joint.registry.items() if joint.__module__.startswith("kincheck."))
USERS = {"pin_in_slot": "PinInSlot", "rzeppa": "Rzeppa", "point_on_parabola": "PointOnParabola"}
FOLDER = Path(__file__).parent / "user_joints"


@pytest.fixture(autouse=True)
def types_of_these_tests_are_forgotten(monkeypatch):
    monkeypatch.setattr(Joint, "registry", dict(Joint.registry))


@pytest.fixture
def in_folder(monkeypatch):
    monkeypatch.chdir(FOLDER)
    monkeypatch.setattr("sys.path", ["", *__import__("sys").path])


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_joints_pass(name):
    report = check_joint(Joint.registry[name])
    assert report.passed, report
    assert len({each.check for each in report.findings}) == len(report.findings)


@pytest.mark.parametrize("module", USERS)
def test_joints_of_users_pass(in_folder, module):
    engines = [adapters.engine(name) for name in adapters.ENGINES]
    report = check_joint(load_joint(f"{module}:{USERS[module]}"), engines=engines)
    assert report.passed, report
    verdicts = {engine.name: report[f"loop: {engine.name}"] for engine in engines if engine.name != "native"}
    if module == "point_on_parabola":
        assert all("no equivalent() to solve" in each.message or "not installed" in each.message for each in verdicts.values())
        assert {each.verdict for each in verdicts.values()} == {Verdict.SKIP}
    else:
        assert report["loop: native, equivalent"].verdict is Verdict.PASS
        assert all(each.message in ("on the equivalent", "not installed") for each in verdicts.values())


# Mutations: a joint with one mistake, and the check that must name it


def mistaken(base, primitive=None, **changes):
    """A joint type like the base, its primitives of one type with methods or fields changed."""

    def primitives(self, i, j):
        composed = base.primitives(self, i, j)
        return [_retyped(each, primitive, changes) if type(each) is primitive else each for each in composed]

    body = {"type": "mistaken", "primitives": primitives} if primitive else {"type": "mistaken", **changes}
    return dataclass(frozen=True)(type("Mistaken", (base,), body))


def _retyped(native, primitive, changes):
    fields = {each.name: getattr(native, each.name) for each in dataclasses.fields(native)}
    methods = {name: change for name, change in changes.items() if name not in fields}
    kind = type(f"Mistaken{primitive.__name__}", (primitive,), methods)
    return kind(**fields | {name: change(fields[name]) for name, change in changes.items() if name in fields})


def negative_gamma(self, i, j, vi, vj):
    return tuple(-x for x in super(type(self), self).gamma(i, j, vi, vj))


def doubled_rows(self, i, j):
    return tuple(Row(*(2.0 * a for a in row)) for row in super(type(self), self).rows(i, j))


def rows_without_arm(self, i, j):
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


def left_handed(self, i, j):
    f, g, h = triad(self.axis)
    P = vec(self.point)
    return p.Spherical(i.arm(P), j.arm(P)), p.Dot11(g, f, h)


def long_axis(self, i, j):
    f, g, _ = triad(self.axis)
    P = vec(self.point)
    return p.Spherical(i.arm(P), j.arm(P)), p.Dot11(f, g, vec(self.axis))


def missing_row(self, i, j):
    f, _, h = triad(self.axis)
    P = vec(self.point)
    return p.Spherical(i.arm(P), j.arm(P)), p.Dot10(f, h)


def repeated_row(self, i, j):
    f, _, h = triad(self.axis)
    P = vec(self.point)
    return p.Spherical(i.arm(P), j.arm(P)), p.Dot10(f, h), p.Dot10(h, f)


def wrong_body(self, i, j):
    P = vec(self.point)
    return (p.Spherical(j.arm(P), j.arm(P)),)


def global_arm(self, i, j):
    return (p.Spherical(vec(self.point), vec(self.point)),)


def open_at_design(self, i, j):
    P, (f, g, _) = vec(self.point), triad(self.axis)
    arms = i.arm(P), j.arm(P)
    return p.Spherical(*arms, d0=0.01 * f), p.Dot11(f, g, unit(self.axis))


def untraceable(self, i, j):
    class Root(p.Spherical):
        def phi(self, i, j):
            return tuple(math.sqrt(x) for x in super().phi(i, j))

    P = vec(self.point)
    return (Root(i.arm(P), j.arm(P)),)


def unscaled(self, i, j):
    P, (f, g, _) = vec(self.point), triad(self.axis)
    arms = i.arm(P), j.arm(P)
    return tuple(p.Distance(*arms, 0.05 * a, 0.05, 0.05) for a in (f, g))


def one_short(self, i, j, vi, vj):
    return super(type(self), self).gamma(i, j, vi, vj)[1:]


MISTAKES = {
    "sign of gamma": ("gamma", lambda: mistaken(Revolute, p.Dot11, gamma=negative_gamma)),
    "gamma of a line": ("gamma", lambda: mistaken(Translational, p.Dot21, gamma=negative_gamma)),
    "gamma one short": ("equations", lambda: mistaken(Spherical, p.Spherical, gamma=one_short)),
    "rows without an arm": ("rows", lambda: mistaken(InPlane, p.Dot20, rows=rows_without_arm)),
    "rows too long": ("newton", lambda: mistaken(Spherical, p.Spherical, rows=doubled_rows)),
    "axes swapped": ("newton", lambda: mistaken(Revolute, primitives=left_handed)),
    "axis not unit": ("axis lengths", lambda: mistaken(Revolute, primitives=long_axis)),
    "a row missing": ("freedoms", lambda: mistaken(Revolute, primitives=missing_row)),
    "a row twice": ("rank", lambda: mistaken(Revolute, primitives=repeated_row)),
    "a freedom too many": ("freedoms", lambda: mistaken(Universal, freedoms=("rotation i", "rotation j", "slide"))),
    "rows miscounted": ("freedoms", lambda: mistaken(Universal, rows=property(lambda self: 5))),
    "nu": ("nu", lambda: mistaken(Spherical, p.Spherical, nu=steady)),
    "sign of a branch test": ("branch tests", lambda: mistaken(Revolute, p.Dot11, branch=negative_branch)),
    "no branch test": ("spurious branches", lambda: mistaken(ConstantVelocity, p.ConstantVelocity, branch=no_branch)),
    "arm of the wrong body": ("rigid motion", lambda: mistaken(Spherical, primitives=wrong_body)),
    "global arms": ("place", lambda: mistaken(Spherical, primitives=global_arm)),
    "not closed at design": ("design", lambda: mistaken(Revolute, primitives=open_at_design)),
    "a length that is none": ("size", lambda: mistaken(InPlane, primitives=unscaled)),
    "called symmetric": ("exchange", lambda: mistaken(InPlane, symmetric=True)),
    "not smooth": ("differences", lambda: mistaken(InPlane, p.Dot20, phi=rough)),
    "cancellation": ("round-off", lambda: mistaken(Spherical, p.Spherical, phi=cancelling)),
    "math.sqrt": ("equations", lambda: mistaken(Spherical, primitives=untraceable)),
    "other coordinates": ("mixed style", lambda: mistaken(Revolute, freedoms=("rotation", "translation"))),
    "loop": ("loop: acceleration", lambda: mistaken(Revolute, p.Dot11, gamma=negative_gamma)),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_caught(mistake):
    check, make = MISTAKES[mistake]
    report = check_joint(make())
    assert check in report.failures, report
    found = report[check]
    assert found.limit is None or found.figure > found.limit
    assert found.message


def test_the_base_of_a_mistake_is_sound():
    """The machinery of these tests makes no mistakes by itself."""
    assert check_joint(mistaken(Revolute, p.Dot11)).passed
    assert check_joint(mistaken(ConstantVelocity, p.ConstantVelocity)).passed


def test_a_wrong_equivalent_is_caught(in_folder):
    right = load_joint("pin_in_slot:PinInSlot")

    def equivalent(self):
        return [], [Spherical(f"{self.name}_ball", self.i, self.j, self.point)]

    report = check_joint(mistaken(right, equivalent=equivalent))
    assert report.failures == ("loop: native, equivalent",), report
    assert "2 degrees of freedom" in report["loop: native, equivalent"].message


# Specimens


def test_specimens_given_or_offered():
    one = Universal("u", "a", "ground", (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    given = check_joint(Universal, specimens=[one])
    assert given.passed, given
    assert given.specimens == (repr(one),)
    values = [getattr(one, each.name) for each in dataclasses.fields(one)]
    offered = check_joint(mistaken(Universal, specimens=classmethod(lambda cls: [cls(*values)])))
    assert offered.passed, offered
    assert len(offered.specimens) == 1


def test_the_seed_reproduces():
    first, again, other = (check_joint(Revolute, seed=seed) for seed in (3, 3, 4))
    assert first == again
    assert first.findings != other.findings


def test_no_specimen():
    @dataclass(frozen=True)
    class Odd(AxialJoint):
        type = "odd"
        freedoms = ()
        teeth: int

        def primitives(self, i, j):
            return (p.Dot12(),)

    with pytest.raises(KincheckError, match=r"field 'teeth' has no kind; declare it by .* or offer some by a classmethod"):
        check_joint(Odd)
    with pytest.raises(KincheckError, match="no specimens were offered"):
        check_joint(Revolute, specimens=[])


# The command


def test_command(in_folder, capsys):
    assert main(["check-joint", "pin_in_slot:PinInSlot", "--seed", "1"]) == 0
    said = capsys.readouterr().out
    assert "spurious branches" in said
    assert "(seed 1)" in said


def test_command_tells_of_a_failure(monkeypatch, capsys, tmp_path):
    text = (FOLDER / "pin_in_slot.py").read_text(encoding="utf-8").replace('("slide", "turn")', '("slide",)')
    (tmp_path / "faulty_joint.py").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["check-joint", "faulty_joint:PinInSlot"]) == 1
    said = capsys.readouterr().out
    assert "freedoms: leaves 2, names 1: slide; name each freedom that is left, or add the missing row" in said


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("no_such_module:Joint", "no module 'no_such_module'"),
        ("rzeppa", "write MODULE:CLASS"),
        ("rzeppa:Rzepa", "did you mean 'Rzeppa'"),
        ("rzeppa:np", "is no joint type"),
    ],
)
def test_command_that_cannot_do_its_work(in_folder, capsys, where, message):
    assert main(["check-joint", where]) == 2
    assert message in capsys.readouterr().err


def test_report_names_what_was_not_checked():
    report = check_joint(InPlane)
    skipped = {each.check: each.message for each in report.findings if each.verdict is Verdict.SKIP}
    assert set(skipped) == {"exchange", "mixed style", "loop: simulators"}
    assert all(skipped.values())
    text = str(report)
    assert all(f"{check}: {message}" in text for check, message in skipped.items())
    assert str(Body("x")) not in text
