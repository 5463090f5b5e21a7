"""Where drivers and couplers act in every engine, against free-body diagrams."""

from dataclasses import replace

import pytest
from kincheck import adapters
from kincheck.core.case.case import TIME, Case, Sweep, Truth
from kincheck.core.case.quantity import with_markers
from kincheck.core.joints import Cylindrical, Planar, Revolute, Screw, Translational

from ..support.driven_chains import COUPLINGS, Link, chain, deviation, pushed_slide
from ..support.engine_forces import every_force

# Of the largest force. Exudyn has no acceleration: it is a difference of Jacobians.
AGREE = dict.fromkeys(["native", "mujoco", "pinocchio", "dart", "drake", "simbody"], 1e-12)
AGREE["exudyn"] = 1e-9
HINGE = Link(Revolute)
DRIVEN = {
    "translational": Link(Translational),
    "cylindrical": Link(Cylindrical),
    "screw, by its turn": Link(Screw),
    "screw, by its slide": Link(Screw, screws_by="translation"),
}


def forces(made, engine):
    outputs = every_force(made.mechanism)
    sweep = Sweep(TIME, made.path.times, motions=made.path.motions)
    mechanism = with_markers(made.mechanism, outputs)
    case = Case("chain", "made here", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)
    given = adapters.engine(engine)
    if given.version() is None:
        pytest.skip(f"{engine} is not installed")
    assert given.unsupported(case) is None
    found = given.solve(given.build(case), case, 1e-12)
    assert found.solved.all(), found.message
    return found.forces


@pytest.mark.parametrize("engine", AGREE)
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
@pytest.mark.parametrize("kind", DRIVEN)
def test_a_driven_slide(kind, flipped, engine):
    made = chain([HINGE, replace(DRIVEN[kind], flipped=flipped), HINGE], size=2.0)
    assert deviation(made, forces(made, engine)) < AGREE[engine]


@pytest.mark.parametrize("engine", AGREE)
def test_a_driven_turn_of_a_planar_joint(engine):
    made = chain([Link(Planar, flipped=True), HINGE])
    assert deviation(made, forces(made, engine)) < AGREE[engine]


@pytest.mark.parametrize("engine", AGREE)
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
def test_a_pushed_point(flipped, engine):
    made = pushed_slide(Link(Translational, flipped=flipped))
    assert deviation(made, forces(made, engine)) < AGREE[engine]


@pytest.mark.parametrize("engine", AGREE)
@pytest.mark.parametrize("name", COUPLINGS)
def test_a_coupled_joint(name, engine):
    one, other, coupling = COUPLINGS[name]
    links = [HINGE, replace(one, flipped=True), replace(other, flipped=False)]
    made = chain(links, coupling, size=0.8)
    assert deviation(made, forces(made, engine)) < AGREE[engine]
