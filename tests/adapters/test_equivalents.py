"""A joint type declared in one file in every engine: the native one takes its
primitives, the simulators its equivalent.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import Joint, JointAngle, Planar, Revolute, Translational, adapters
from kincheck.cases.jet import cos, sin, sqrt, steady
from kincheck.core import primitives as p
from kincheck.core.doors import offers
from kincheck.core.joints.base import unit
from kincheck.core.mechanism.mechanism import with_equivalents

from ..support.engine_motion import assert_motion, installed, mechanism_of, motion_case, planar
from ..support.mechanisms import ORIGIN, X, Z
from ..user_joints.pin_in_slot import PinInSlot

CRANK, PIVOT, REACH, RATE = 0.3, -1.0, 1.4, 2.0


Slotted = Joint.registry.pop(PinInSlot.type)  # case files of other tests do not know it


def quick_return(joint=Slotted):
    """Whitworth's mechanism: the pin of a crank slides in the slot of a rocker."""
    joints = [
        Revolute("pivot", "ground", "crank", ORIGIN, Z),
        Revolute("bearing", "ground", "rocker", (PIVOT, 0.0, 0.0), Z),
        joint("slot", "rocker", "crank", (CRANK, 0.0, 0.0), (X, Z)),
    ]
    points = {"tip": ("rocker", (PIVOT + REACH, 0.0, 0.0))}
    mechanism = mechanism_of(joints, points, [JointAngle("turn", "pivot")])
    return motion_case(mechanism, np.linspace(-1.5, 2.0, 36), RATE)


def motion():
    """Position, velocity and acceleration of the tip, by jets."""
    turn = steady(np.linspace(-1.5, 2.0, 36), RATE)
    x, y = CRANK * cos(turn) - PIVOT, CRANK * sin(turn)
    length = sqrt(x * x + y * y)
    return planar(PIVOT + REACH * x / length, REACH * y / length)


def solved(engine):
    case = quick_return()
    assert engine.unsupported(case) is None
    found = engine.solve(engine.build(case), case, 1e-12)
    assert found.solved.all(), found.message
    return found


@pytest.mark.parametrize("name", adapters.ENGINES)
def test_user_joint_solved_by_every_engine(name):
    found = solved(installed(name))
    assert_motion(found.points["tip"], *motion(), atol=(1e-12, 1e-11, 1e-10))
    expected = None if name == "native" else {"slot": ["translational", "revolute"]}
    assert found.details.get("equivalents") == expected


@pytest.mark.needs("simulate")
@pytest.mark.parametrize(("name", "atol"), [("mujoco", 1e-4), ("exudyn-static", 1e-9)])
def test_user_joint_equivalent_is_simulated(name, atol):
    found = solved(installed(name, "simulate"))
    assert_motion(found.points["tip"], motion()[0], atol=(atol,))


@pytest.mark.parametrize("name", offers("writers"))
def test_written_model_holds_joint_equivalent(name):
    written = pytest.importorskip("kincheck.core.extensions.exports.model_writer").written
    writer_of = pytest.importorskip("kincheck.core.extensions.exports.command").writer_of
    assert "slot_block" in "".join(written(quick_return(), writer_of(name)).values())


def test_subclass_with_other_primitives_is_refused():
    class Narrow(Slotted):
        """A pin that does not turn in the slot."""

        def primitives(self, i, j):
            return *super().primitives(i, j), p.Dot10(*map(unit, self.axes))

    class Renamed(Slotted):
        """The same joint under another name."""

    engine = adapters.engine("mujoco")
    assert "has no counterpart in MuJoCo" in engine.unsupported(quick_return(Narrow))
    assert engine.unsupported(quick_return(Renamed)) is None


def test_nested_equivalents_are_expanded():
    class Nested(Slotted):
        """A slot whose equivalent is a slot."""

        def equivalent(self):
            return [], [Slotted(self.name, self.i, self.j, self.point, self.axes)]

    class Circular(Slotted):
        """A slot whose equivalent is itself."""

        def equivalent(self):
            return [], [replace(self, name=f"{self.name}_again")]

    known = {Revolute, Translational}
    types = [
        [each.type for each in with_equivalents(quick_return(kind).mechanism, known).joints[2:]]
        for kind in (Nested, Circular)
    ]
    assert types == [["translational", "revolute"], ["pin_in_slot"]]


def test_known_joints_keep_their_type():
    mechanism = quick_return().mechanism
    assert with_equivalents(mechanism, {Slotted, Revolute}) is mechanism
    unlike = quick_return(lambda *given: Planar(*given[:4], Z)).mechanism
    assert with_equivalents(unlike, {Revolute}) is unlike
