"""Mechanisms with loads: determined and undetermined reactions, efforts and element forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .....algebra import triple
from .....case.case import Quantity
from .....case.measures import DriverEffort, ElementForce, ForceMeasure, JointForce, JointMoment
from .....case.quantity import with_markers
from .....joints import Cylindrical, Joint, RackPinion, Revolute, Screw, Translational
from .....mechanism.body import Body, Inertia
from .....mechanism.loads import (
    Axes,
    Force,
    ForceElement,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)
from .....mechanism.mechanism import GROUND, Mechanism
from .....mechanism.motions import JointAngle, JointDisplacement, Motion, Sine
from .arms import random_arm
from .base import Rng, Specimen, as_case, bodies, direction, family, power
from .linkages import any_plane, crank_rocker, four_bar
from .loops import random_mechanism

LARGEST = 8
# Minimum length of springs [m]: a small error changes the direction of a shorter spring much.
SHORTEST = 0.1
# Fraction of the reach of loops: most specimens meet no singular pose there, near which forces grow
# without limit.
NEAR = 0.1
# Slides are frequent: their drives have a line of action.
OF_ARMS = (Revolute, Translational, Translational, Cylindrical, Screw)
# Tolerance of force outputs, which a case requires. The truth has its own bounds for forces.
TOLERANCE = (1e-6, 1e-9, "the stress truth has bounds of its own")


@family(
    f"loops of 3 to {LARGEST} bodies, arms driven at every slide and hinge, and planar four-bars"
    " with random masses, gravity, springs, dampers and constant loads; some hinges twice, which"
    " leaves forces undetermined",
    samples=11,
)
def forces(rng: Rng, samples: int) -> Specimen:
    """Return a loaded mechanism: a four-bar with four hinges, an arm, or a loop, which has one
    hinge twice in every second specimen.
    """
    draw, motions = rng.random(), dict[str, Motion]()
    along: Sequence[np.ndarray] = ()
    if draw < 1.0 / 3.0:
        plane = any_plane(rng)
        mechanism, reach, name = four_bar(plane, *crank_rocker(rng))[0], 1.0, "four_bar"
        along = (plane.e1, plane.e2, np.array(plane.normal))
    elif draw < 2.0 / 3.0:
        arm, motions = random_arm(rng, int(rng.integers(2, LARGEST)), OF_ARMS)
        # a joint may have the body that it carries first
        joints = [joint.reversed() if rng.random() < 0.5 else joint for joint in arm.joints]
        mechanism, reach = replace(arm, joints=joints), 1.0
        name = f"arm of {len(joints)} bodies"
    else:
        mechanism, reach = random_mechanism(rng, lambda: bodies(rng, LARGEST))
        reach *= NEAR
        name, along = f"loop of {len(mechanism.bodies)} bodies", (direction(rng),)
        if rng.random() < 0.5 and (doubled := _with_second_hinge(rng, mechanism)) is not None:
            mechanism, name = doubled, f"{name}, a hinge twice"
    mechanism = _with_loads(rng, mechanism)
    motions = motions or {d.name: Sine(0.1 * reach, 0.7) for d in mechanism.drivers[1:]}
    rate, outputs = power(rng, -1.0, 1.0), _outputs(rng, mechanism, along)
    values = np.linspace(-reach, reach, samples)
    case = as_case(mechanism, mechanism.drivers[0].name, values, rate=rate, motions=motions)
    watched = with_markers(mechanism, outputs)
    return Specimen(name, replace(case, mechanism=watched, outputs=(*case.outputs, *outputs)))


def _with_second_hinge(rng: Rng, mechanism: Mechanism) -> Mechanism | None:
    """Return the mechanism with a second hinge on the axis of a hinge: five redundant rows."""
    hinges = [joint for joint in mechanism.joints if isinstance(joint, Revolute)]
    if not hinges:
        return None
    hinge = hinges[int(rng.integers(len(hinges)))]
    point = np.array(hinge.point) + rng.uniform(0.2, 0.5) * np.array(hinge.axis)
    twin = replace(hinge, name=f"{hinge.name}_twin", point=triple(point))
    return replace(mechanism, joints=[*mechanism.joints, twin])


def _with_loads(rng: Rng, mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with masses, gravity and force elements. Some bodies have no mass, some
    masses no inertia.
    """
    loaded = [_with_mass(rng, body, mechanism) for body in mechanism.bodies]
    gravity = triple(9.81 * direction(rng)) if rng.random() < 0.9 else (0.0, 0.0, 0.0)
    return replace(mechanism, bodies=loaded, gravity=gravity, forces=_elements(rng, mechanism))


def _place(rng: Rng, mechanism: Mechanism, body: str) -> np.ndarray:
    """Return a place near a joint of a body."""
    near = [p for joint in mechanism.joints if body in joint.bodies for p in joint.points_on(body)]
    start = np.array(near[int(rng.integers(len(near)))]) if near else np.zeros(3)
    return start + rng.uniform(0.05, 0.3) * direction(rng)


def _with_mass(rng: Rng, body: Body, mechanism: Mechanism) -> Body:
    if rng.random() < 0.2:
        return body
    mass, inertia = power(rng, -1.0, 1.0), None
    if rng.random() < 0.8:
        points = 0.1 * rng.normal(size=(6, 3))
        matrix = mass / 6.0 * (np.trace(points.T @ points) * np.eye(3) - points.T @ points)
        inertia = _six(matrix)
    center = triple(_place(rng, mechanism, body.name))
    return replace(body, mass=mass, center_of_mass=center, inertia=inertia)


def _six(matrix: np.ndarray) -> Inertia:
    xx, yy, zz = (float(matrix[k, k]) for k in range(3))
    return xx, yy, zz, float(matrix[0, 1]), float(matrix[1, 2]), float(matrix[0, 2])


def _elements(rng: Rng, mechanism: Mechanism) -> list[ForceElement]:
    """Return force elements: at least one, so that mechanisms without masses are loaded, too."""
    names = [GROUND, *(body.name for body in mechanism.bodies)]
    found: list[ForceElement] = []
    for k in range(int(rng.integers(1, 3))):
        i, j = (str(name) for name in rng.choice(names, 2, replace=False))
        start, end = (_place(rng, mechanism, name) for name in (i, j))
        length = float(np.linalg.norm(end - start))
        if length > SHORTEST:
            stiffness, damping = power(rng, 1.0, 3.0), float(rng.choice([0.0, 1.0, 10.0]))
            free = float(rng.uniform(0.5, 1.5)) * length
            ends = (triple(start), triple(end))
            found.append(SpringDamper(f"spring_{k + 1}", i, j, ends, stiffness, damping, free))
    axes, body = rng.choice(list(Axes), 2), str(rng.choice(names[1:]))
    place = triple(_place(rng, mechanism, body))
    found.append(Force("push", body, place, triple(20.0 * direction(rng)), Axes(axes[0])))
    if rng.random() < 0.5:
        twist = triple(5.0 * direction(rng))
        found.append(Torque("twist", str(rng.choice(names[1:])), twist, Axes(axes[1])))
    driver = mechanism.drivers[0]
    if isinstance(driver, JointAngle):
        stiffness, angle = power(rng, 0.0, 2.0), float(rng.uniform(-0.5, 0.5))
        found.append(TorsionSpringDamper("coil", driver.joint, stiffness, 0.5, angle))
    return found


def _outputs(rng: Rng, mechanism: Mechanism, along: Sequence[np.ndarray]) -> tuple[Quantity, ...]:
    """Return force outputs: two joints, driven or coupled slides before others, a hinge and its
    twin if there is one, all drivers and all force elements.
    """
    twins = [joint for joint in mechanism.joints if joint.name.endswith("_twin")]
    others = [joint for joint in mechanism.joints if joint not in twins]
    slides = {each.joint for each in mechanism.drivers if isinstance(each, JointDisplacement)}
    slides |= {each.joints[1] for each in mechanism.couplers if isinstance(each, RackPinion)}
    mixed: list[Joint] = [others[int(k)] for k in rng.permutation(len(others))]
    chosen = sorted(mixed, key=lambda joint: joint.name not in slides)[:2]
    axes = [*np.eye(3), *along]
    found: list[ForceMeasure] = [
        cls(f"{joint.name}.{what}{k}", *TOLERANCE, joint=joint.name, direction=triple(axis))
        for joint in (*chosen, *twins)
        for cls, what in ((JointForce, "force"), (JointMoment, "moment"))
        for k, axis in enumerate(axes)
    ]
    found += [
        DriverEffort(f"{driver.name}.effort", *TOLERANCE, driver=driver.name)
        for driver in mechanism.drivers
    ]
    found += [
        ElementForce(f"{element.name}.amount", *TOLERANCE, force=element.name)
        for element in mechanism.forces
    ]
    return tuple(output.bound(mechanism) for output in found)
