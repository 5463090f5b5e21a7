"""Where drivers and couplers act: every joint type, freedom, order of bodies and coupler, against
free-body diagrams.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck import Cylindrical, Planar, Revolute, Screw, Translational
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, vec
from kincheck.core.joints import AxialJoint
from kincheck.core.joints.base import triad
from kincheck.core.kinematics import NativeSolver, styles, with_forces

from ..support.driven_chains import COUPLINGS, SLOW, Link, chain, deviation, pushed_slide

# Of the largest force or moment: some hundred operations, over a smallest singular value of 0.1,
# and ten times that.
ROUND_OFF = 1e-12
KINDS = {
    "revolute": Link(Revolute),
    "translational": Link(Translational),
    "cylindrical": Link(Cylindrical),
    "screw, by its turn": Link(Screw),
    "screw, by its slide": Link(Screw, screws_by="translation"),
    "planar": Link(Planar),
}
HINGE = Link(Revolute)


def native(made, style="native"):
    mechanism, names = made.mechanism, [body.name for body in made.mechanism.moving]
    solver = NativeSolver(style=style, compiled=False)
    motion = solver.prepare(mechanism, made.path, bodies=names)(1e-12)
    assert motion.solved.all(), motion.message
    return with_forces(mechanism, made.path, motion).forces


@pytest.mark.parametrize(
    "motion",
    [{}, {"slow": SLOW}, {"size": 6.0}],
    ids=["moving", "at rest", "metres and more than a turn"],
)
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
@pytest.mark.by_day(3)
@pytest.mark.parametrize("kind", KINDS)
def test_forces_of_driven_joint_on_ground(kind, flipped, motion):
    made = chain([replace(KINDS[kind], flipped=flipped), HINGE], **motion)
    assert deviation(made, native(made)) < ROUND_OFF


@pytest.mark.parametrize("slow", [1.0, SLOW], ids=["moving", "at rest"])
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
@pytest.mark.by_day(3)
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "planar"])
def test_forces_of_driven_joint_between_bodies(kind, flipped, slow):
    link = replace(KINDS[kind], flipped=flipped)
    made = chain([replace(HINGE, flipped=not flipped), link, HINGE], slow=slow)
    assert deviation(made, native(made)) < ROUND_OFF


@pytest.mark.parametrize("other_end", [False, True], ids=["", "driven from its other end"])
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
@pytest.mark.by_day(8)
@pytest.mark.parametrize("name", COUPLINGS)
def test_forces_of_coupled_joints(name, flipped, other_end):
    one, other, coupling = COUPLINGS[name]
    links = [HINGE, replace(one, flipped=flipped), replace(other, flipped=not flipped)]
    made = chain(links, replace(coupling, drive_driven=other_end), size=0.8)
    assert deviation(made, native(made)) < ROUND_OFF


@pytest.mark.parametrize("kind", ["translational", "cylindrical"])
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
def test_forces_of_pushed_point(kind, flipped):
    """Its force acts at the point, so that the slide carries a couple."""
    made = pushed_slide(replace(KINDS[kind], flipped=flipped))
    assert deviation(made, native(made)) < ROUND_OFF


@pytest.mark.by_day(3)
@pytest.mark.parametrize("style", styles())
@pytest.mark.parametrize("kind", ["translational", "screw, by its slide"])
def test_line_of_action_in_row_styles(kind, style):
    made = chain([HINGE, replace(KINDS[kind], flipped=True), HINGE])
    assert deviation(made, native(made, style)) < ROUND_OFF


def test_line_of_action_far_from_origin():
    """Ten kilometres from the global origin: coordinates have lost four digits."""
    made = chain([HINGE, Link(Translational, flipped=True), HINGE], origin=(6e3, -8e3, 1e3))
    assert deviation(made, native(made)) < 1e4 * ROUND_OFF


@pytest.mark.usefixtures("own_joint_types")
@pytest.mark.parametrize("flipped", [False, True], ids=["", "flipped"])
def test_forces_of_user_slide(flipped):
    @dataclass(frozen=True)
    class Rail(AxialJoint):
        type = "rail"
        freedoms = ("translation",)

        def primitives(self, i, j):
            P, (f, g, _) = vec(self.point), triad(self.axis)
            return p.Dot12(), *(p.Dot20(a, i.arm(P), j.arm(P), ZERO) for a in (f, g))

    made = chain([HINGE, Link(Rail, flipped), HINGE])
    assert deviation(made, native(made)) < ROUND_OFF


def test_slide_moment_of_offset_weight():
    """(com - P) x W at every sample, as by hand on paper."""
    made = chain([Link(Translational, flipped=True)], slow=SLOW)
    (body,), (joint,) = made.mechanism.bodies, made.mechanism.joints
    still = replace(body, center_of_mass=(0.0, 0.0, 0.0), mass=1.0)
    guide = replace(joint, point=(0.4, -0.2, 0.3), axis=(0.3, 0.5, 1.0))
    mechanism = replace(made.mechanism, bodies=[still], joints=[guide], gravity=(0.0, 0.0, -10.0))
    found = native(replace(made, mechanism=mechanism)).joints[joint.name]
    # of the block on the ground, about a point of the ground that the block passes
    h = np.array(guide.axis) / np.linalg.norm(guide.axis)
    shifts = -made.coordinates[joint.name, "translation"].at(made.path.times)[0]
    for moment, shift in zip(found.moment, shifts, strict=True):
        weight = np.array([0.0, 0.0, -10.0])
        about = np.cross(shift * h - np.array(guide.point), weight)
        assert moment == pytest.approx(about, abs=1e-12)
