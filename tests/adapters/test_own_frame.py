"""The simulators' projections of mechanisms of any size, anywhere: they are solved in a frame of
the mechanism's own.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import JointAngle, RackPinion, Revolute, Screw, SolveError, Translational
from kincheck.adapters.shared.equivalents import in_own_frame, own_frame
from kincheck.adapters.shared.projection import Walk
from kincheck.core.joints import Kind

from ..support.engine_motion import installed, mechanism_of, motion_case
from ..support.mechanisms import ORIGIN, X, Z, mcpherson, placed
from .test_projection import Crank

SIMULATORS = ["mujoco", "pinocchio", "exudyn"]
OF_SIMULATORS = pytest.mark.parametrize("engine", SIMULATORS)
STROKES, TURNS = np.linspace(-0.0625, 0.0625, 9), np.linspace(-2.0, 2.0, 9)


def jack():
    """A pinion drives a rack, and carries a nut on its thread: a coupler and a joint with a
    length.
    """
    return mechanism_of(
        [
            Revolute("bearing", "ground", "pinion", (0.5, 0.25, 0.0), Z),
            Translational("rail", "ground", "rack", ORIGIN, X),
            Screw("thread", "ground", "nut", (0.5, 0.25, 0.75), Z, lead=0.125),
        ],
        {"tooth": ("rack", (0.5, 0.0, 0.0)), "mark": ("nut", (1.0, 0.25, 0.75))},
        [JointAngle("turn", "bearing"), JointAngle("nut", "thread")],
        [RackPinion("mesh", ("bearing", "rail"), 0.25)],
    )


def moved(mechanism, factor, offset=ORIGIN):
    """Of another size, then elsewhere, with points rounded to 2^-30 m: sums with whole metres are
    exact.
    """

    def place(point):
        rounded = np.round(np.array(point) * 2.0**30) / 2.0**30
        return tuple(float(factor * x + o) for x, o in zip(rounded, offset, strict=True))

    found = placed(mechanism, place, factor=factor)
    couplers = [replace(each, radius=factor * each.radius) for each in found.couplers]
    return replace(found, couplers=couplers)


def motion(mechanism, values, engine):
    """Position, velocity and acceleration of the first point, shape (3, n, 3)."""
    solver, case = installed(engine), motion_case(mechanism, values)
    found = solver.solve(solver.build(case), case, 1e-12)
    assert found.solved.all(), found.message
    moved, *_ = found.points.values()
    return np.array([moved.position, moved.velocity, moved.acceleration])


@OF_SIMULATORS
@pytest.mark.parametrize("exponent", [-40, -20, 20])
def test_simulator_motion_scales_with_size(engine, exponent):
    """To the last bit: from a picometre to a thousand kilometres, by powers of two."""
    factor = 2.0**exponent
    for mechanism, values, scale in ((mcpherson(), STROKES, factor), (jack(), TURNS, 1.0)):
        # the rate is one: the drives take as much longer as they are longer
        here, there = (
            motion(moved(mechanism, 1.0), values, engine),
            motion(moved(mechanism, factor), scale * values, engine),
        )
        for k, (x, expected) in enumerate(zip(there, here, strict=True)):
            assert (x == factor / scale**k * expected).all()


@OF_SIMULATORS
def test_simulator_motion_at_far_place(engine):
    """Four thousand kilometres away: only the sum with the position rounds."""
    offset = np.array((2.0**22, -(2.0**21), 0.0))
    for mechanism, values in ((mcpherson(), STROKES), (jack(), TURNS)):
        here, there = (
            motion(moved(mechanism, 1.0), values, engine),
            motion(moved(mechanism, 1.0, offset), values, engine),
        )
        assert np.abs(there[0] - (here[0] + offset)).max() <= np.spacing(2.0**22)
        assert (there[1:] == here[1:]).all()


@pytest.mark.parametrize("engine", ["native", *SIMULATORS])
def test_residual_is_in_metres(engine):
    given, residuals = installed(engine), []
    for factor in (1.0, 2.0**-40):
        case = motion_case(moved(mcpherson(), factor), factor * STROKES)
        residuals.append(given.solve(given.build(case), case, 1e-12).residual / factor)
    assert 0.0 < residuals[0] == residuals[1] < 1e-12


def test_own_frame_has_unit_size():
    case = motion_case(moved(jack(), 2.0**-30, (2.0**-9, 0.0, 2.0**-8)), TURNS)
    frame, own = own_frame(case), in_own_frame(case)
    assert frame.unit == 2.0**-30
    assert frame.origin == (2.0**-9, 0.0, 2.0**-8)
    assert own_frame(own).unit == 1.0
    assert own_frame(own).origin == ORIGIN
    wanted = jack()
    assert own.mechanism == wanted
    # what steps are judged by
    assert 0.7 < Walk(Crank(lambda c: 1.0), case, 1e-12, frame=frame).size < 1.5
    assert {kind for joint in wanted.joints for _, kind, _ in joint.parts()} >= {
        Kind.POSITION,
        Kind.LENGTH,
        Kind.DIRECTION,
    }
    assert (own.sweep, own.outputs) == (case.sweep, case.outputs)
    np.testing.assert_array_equal(
        frame.back(np.array(frame.there((1.0, 2.0, 3.0)))), (1.0, 2.0, 3.0)
    )


@OF_SIMULATORS
def test_model_of_other_mechanism_is_refused(engine):
    """The numbers of a model have no names: those of another length of the sweep were wrong."""
    chosen = installed(engine)
    case = motion_case(moved(mcpherson(), 1.0), STROKES)
    model = chosen.build(case)
    shorter = motion_case(moved(mcpherson(), 1.0), STROKES[::2])
    assert chosen.solve(model, shorter, 1e-12).solved.all()
    for other in (
        motion_case(moved(mcpherson(), 1.0), 1e3 * STROKES),
        motion_case(moved(mcpherson(), 3.0), STROKES),
        motion_case(moved(jack(), 1.0), TURNS),
    ):
        with pytest.raises(SolveError, match="build a model for this case"):
            chosen.solve(model, other, 1e-12)
