"""From an MJCF model to a case: joints and equalities as joints of a mechanism, one of them driven,
others held.
"""

from __future__ import annotations

from pathlib import Path

from ....algebra import Quat
from ....errors import remedy
from ....joints import Fixed, Revolute
from ....kinematics import degrees_of_freedom
from ....mechanism.drivers import JointAngle, JointDisplacement, JointDriver
from ....mechanism.mechanism import Body, Mechanism, Point
from ...case import Case, Sweep, Truth
from ...io.coordinates import with_all_motions
from ...io.document import explained, fault
from ...io.reader_options import LEFT_OUT, Supplied
from .attributes import MAKE_BODIES, ROOT, WRITE_OUT
from .classes import read_classes
from .driving import read_driving, undriven
from .elements import Element, parse_xml
from .equalities import read_equalities
from .frames import coordinates, read_compiler
from .parts import Parts, parts_of
from .tree import Tree, read_tree

# What these hold is for looks, forces and measurements. Tendons are read where an equality holds
# one.
_LEFT_OUT = (
    "contact",
    "actuator",
    "sensor",
    "keyframe",
    "tendon",
    "custom",
    "extension",
    "deformable",
    "asset",
)


def read_mjcf(file: Path, text: str, supplied: Supplied) -> Case:
    """The case of a model; outputs are the coordinates of the origins of bodies and of sites, those
    of joints, and the rotations of bodies.

    Raises:
        CaseError: not a readable model, or the options do not say how it moves.
    """
    root = parse_xml(file, text)
    _require_model(root)
    tree = read_tree(root, read_classes(root), read_compiler(root))
    if not tree.moving:
        raise root.fault("has no body with a joint, expected a mechanism; give a model that moves")
    for section in root.only(*_LEFT_OUT):
        for element in section.children:
            tree.count(f"{section.tag}: {element.tag}")
    driving = read_driving(file, tree, supplied)
    parts = parts_of(tree, [*read_equalities(root, tree)], driving)
    for name in driving.joints:
        if isinstance(parts.joints[name], Fixed):
            option, advice = (
                ("--drive", "name another") if name == driving.joint else ("--hold", "leave it out")
            )
            raise fault(
                file,
                option,
                f"found {name!r}, which an equality of the file locks, expected a joint that moves;"
                f" {advice}",
            )
    points = _points(tree, parts)
    bodies = [
        Body(name, coordinates(at.at), _euler_parameters(at.turn), name in parts.fixed)
        for name, at in parts.bodies.items()
    ]
    with explained(file):
        drivers = [_driver(parts, name) for name in driving.joints]
        joints, couplers = list(parts.joints.values()), list(parts.couplers.values())
        mechanism = Mechanism(file.stem, bodies, joints, points, drivers, couplers)
    dof = degrees_of_freedom(mechanism)
    if driving.joint is None or dof != len(drivers):
        raise undriven(file, root, tree, driving, dof)
    others = [*parts.left_out, *(f"{what} ({count})" for what, count in tree.left_out.items())]
    model = root.attributes.get("model", file.stem)
    source = (
        f"MJCF model {model!r} of {file.name}, from its pose"
        f" qpos0{LEFT_OUT}{', '.join(others) or 'nothing'}"
    )
    sweep = Sweep(driving.joint, driving.values, design=tree.joints[driving.joint].ref)
    return with_all_motions(Case(file.stem, source, Truth.CONSENSUS_ONLY, mechanism, sweep, ()))


def _require_model(root: Element) -> None:
    """Refuse a file without a model, or with parts in other files."""
    if root.tag != "mujoco":
        raise root.fault("found another document, expected a model <mujoco>; give an MJCF file")
    for element in root.children:
        if element.tag in MAKE_BODIES:
            raise element.fault(f"cannot be read, because {MAKE_BODIES[element.tag]}; {WRITE_OUT}")
        if element.tag not in ROOT:
            raise element.fault(f"unknown in a model; {remedy(element.tag, ROOT)}")


def _euler_parameters(turn: Quat) -> tuple[float, float, float, float]:
    e0, e1, e2, e3 = turn
    return float(e0), float(e1), float(e2), float(e3)


def _driver(parts: Parts, joint: str) -> JointDriver:
    cls = JointAngle if isinstance(parts.joints[joint], Revolute) else JointDisplacement
    return cls(joint, joint)


def _points(tree: Tree, parts: Parts) -> list[Point]:
    """Return the origins of the moving bodies of the file, and their sites."""
    moving = [name for name in parts.bodies if name not in parts.fixed]
    points = [
        Point(name, name, coordinates(parts.bodies[name].at))
        for name in moving
        if name in tree.places
    ]
    taken = {point.name for point in points}
    for site, (body, place) in tree.sites.items():
        if body in moving:
            points.append(
                Point(f"site {site}" if site in taken else site, body, coordinates(place.at))
            )
    return points
