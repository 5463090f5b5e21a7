"""The check of joint types: sound joints pass, and every kind of mistake is caught by the check
that is there for it.
"""

import dataclasses
from dataclasses import dataclass

import pytest
from kincheck import adapters
from kincheck.core import Body, Gear, InPlane, Joint, Revolute, Spherical, Universal, check_joint
from kincheck.core import primitives as p
from kincheck.core.cli.joint_loading import load_joint
from kincheck.core.errors import KincheckError, MechanismError
from kincheck.core.joints import AxialJoint
from kincheck.core.studies.checks.findings import Verdict

from ..support.fakes import Fake
from .test_check_joint_mistakes import mistaken

BUILT_IN = sorted(
    name for name, joint in Joint.registry.items() if joint.__module__.startswith("kincheck.")
)
USERS = {
    "bowl": "Bowl",
    "pin_in_slot": "PinInSlot",
    "rzeppa": "Rzeppa",
    "point_on_parabola": "PointOnParabola",
    "line_no_twist": "LineNoTwist",
}
WITHOUT_EQUIVALENT = ("bowl", "point_on_parabola", "line_no_twist")


pytestmark = pytest.mark.usefixtures("own_joint_types")


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_joints_pass(few, name):
    report = check_joint(Joint.registry[name], samples=8)
    assert report.passed, report
    assert len({each.check for each in report.findings}) == len(report.findings)


@pytest.mark.parametrize("module", USERS)
def test_joints_of_users_pass(few, in_folder, module):
    engines = [adapters.engine(name) for name in adapters.ENGINES]
    report = check_joint(load_joint(f"{module}:{USERS[module]}"), samples=8, engines=engines)
    assert report.passed, report
    verdicts = {
        engine.name: report[f"loop: {engine.name}"] for engine in engines if engine.name != "native"
    }
    if module in WITHOUT_EQUIVALENT:
        assert all(
            "no equivalent() to solve" in each.message or "not installed" in each.message
            for each in verdicts.values()
        )
        assert {each.verdict for each in verdicts.values()} == {Verdict.SKIP}
    else:
        assert report["loop: native, equivalent"].verdict is Verdict.PASS
        assert all(
            each.message in ("on the equivalent", "not installed") for each in verdicts.values()
        )


def test_loop_with_large_residual_fails(loops_only):
    native = adapters.engine("native")

    def answer(case):
        return dataclasses.replace(native.solve(native.build(case), case, 1e-12), residual=1e-3)

    found = check_joint(Revolute, engines=[Fake("loose", answer=answer)])["loop: loose"]
    assert found.verdict is Verdict.FAIL
    assert (
        "the residual of samples that the engine calls solved is 0.001, tolerance 1e-12"
        in found.message
    )


def test_loop_without_derivatives_passes_with_note(loops_only):
    native = adapters.engine("native")

    def answer(case):
        found = native.solve(native.build(case), case, 1e-12)
        bare = {
            name: dataclasses.replace(each, velocity=None, acceleration=None)
            for name, each in found.points.items()
        }
        return dataclasses.replace(found, points=bare)

    found = check_joint(Revolute, engines=[Fake("bare", answer=answer)])["loop: bare"]
    assert found.verdict is Verdict.PASS
    assert "not judged: velocity: the engine gives none" in found.message


# Specimens


def test_specimens_given_or_offered(loops_only):
    one = Universal("u", "a", "ground", (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    given = check_joint(Universal, specimens=[one])
    assert given.passed, given
    assert given.specimens == (repr(one),)
    values = [getattr(one, each.name) for each in dataclasses.fields(one)]
    offered = check_joint(mistaken(Universal, specimens=classmethod(lambda cls: [cls(*values)])))
    assert offered.passed, offered
    assert len(offered.specimens) == 1


def test_the_seed_reproduces(few):
    first, again, other = (check_joint(Spherical, seed=seed, samples=4) for seed in (3, 3, 4))
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

    with pytest.raises(
        KincheckError,
        match=r"field 'teeth' has no kind; declare it by .* or offer some by a classmethod",
    ):
        check_joint(Odd)
    with pytest.raises(KincheckError, match="no specimens were offered"):
        check_joint(Revolute, specimens=[])


def test_failing_equivalent_is_reported_as_error(loops_only):
    def equivalent(self):
        raise ValueError("no such bodies")

    lame = Fake("lame", refusal="unknown joint")
    report = check_joint(mistaken(Revolute, equivalent=equivalent), engines=[lame])
    assert report["loop: native, equivalent"].message == "ValueError: no such bodies"
    assert report["loop: lame"].message == "unknown joint; equivalent() fails, see native"
    assert (
        "there is no equivalent()"
        in check_joint(mistaken(Revolute), engines=[lame])["loop: lame"].message
    )


def test_joint_type_name_in_use_is_refused():
    with pytest.raises(
        MechanismError,
        match=r"Mine: type = 'revolute' is taken by kincheck.core.joints.revolute.Revolute; give",
    ):
        type("Mine", (Revolute,), {"type": "revolute"})
    assert Joint.registry["revolute"] is Revolute
    with pytest.raises(
        MechanismError, match=r"type = 'gear' is taken by kincheck.core.joints.gear.Gear"
    ):
        type("Mine", (Gear,), {"type": "gear"})
    first, second = (
        dataclass(frozen=True, slots=True)(type("Mine", (Revolute,), {"type": "mine"}))
        for _ in range(2)
    )
    assert Joint.registry["mine"] is second is not first


def test_report_names_what_was_not_checked(few):
    report = check_joint(InPlane)
    skipped = {each.check: each.message for each in report.findings if each.verdict is Verdict.SKIP}
    assert set(skipped) == {
        *("exchange", "mixed style", "driver", "loop: simulators", "driven reaction"),
    }
    assert all(skipped.values())
    text = str(report)
    assert all(f"{check}: {message}" in text for check, message in skipped.items())
    assert str(Body("x")) not in text
