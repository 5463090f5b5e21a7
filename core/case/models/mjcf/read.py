"""From an MJCF model to a case: joints and equalities as joints of a mechanism, one of them driven,
others held.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ....errors import MOST_NAMED, remedy, shortened
from ....joints import Revolute
from ....kinematics import degrees_of_freedom
from ....mechanism.loads import ForceElement
from ....mechanism.mechanism import Mechanism, Point
from ....mechanism.motions import (
    Absolute,
    JointAngle,
    JointDisplacement,
    JointDriver,
    Motion,
    Table,
)
from ...case import Case, Sweep, Truth
from ...closing import within_digits
from ...io.document import explained, fault
from ...io.outputs import with_all_motions
from ...io.reader_options import LEFT_OUT, Supplied
from .assembly import Assembled, assemble, size_of
from .attributes import EXPANDED, MAKE_BODIES, ROOT, WRITE_OUT, require_known_attributes
from .bodies import bodies_of, gravity_of
from .classes import read_classes
from .digits import Digits, digits_of
from .driving import Driving, read_driving
from .elements import Element
from .equalities import read_equalities
from .expand import expanded
from .frames import coordinates, read_compiler
from .freedom import taken
from .parts import Parts, parts_of, require_coupled
from .rods import Spin, spins
from .springs import springs_of
from .start import QPOS0, read_start
from .tree import Tree, read_tree

# What these hold is for looks, actuators and measurements.
_LEFT_OUT = (
    "contact",
    "actuator",
    "sensor",
    "keyframe",
    "custom",
    "extension",
    "deformable",
    "asset",
)
OTHERS = {
    "mujocoinclude": "is a part of a model; give the file that includes it",
    "OpenSimDocument": (
        "is a model of OpenSim, which kincheck writes and does not read; give MJCF or a case file"
    ),
    "COLLADA": "holds shapes, which say nothing of joints; give the model that names it",
    "launch": "starts programs of ROS; give the URDF that it names",
    "model": "describes a package of Gazebo; give the SDF beside it",
}
"""Other documents in XML, and what to do, by their root."""
NO_GRAVITY = (0.0, 0.0, 0.0)


def read_mjcf(file: Path, root: Element, supplied: Supplied) -> Case:
    """The case of a model; outputs are the coordinates of the origins of bodies and of sites, those
    of joints, and the rotations of bodies.

    Raises:
        CaseError: not a readable model, or the options do not say how it moves.
    """
    _require_model(root)
    root = expanded(file, root)
    _require_model(root)
    require_known_attributes(root)
    _require_rigid(root)
    model = root.attributes.get("model", file.stem)
    return case_of(file, Document(f"MJCF model {model!r} of {file.name}", root, root), supplied)


@dataclass(frozen=True)
class Document:
    """A document of MJCF, as a file has it or as another format is translated to.

    Attributes:
        described: the model and its file, for the source of the case.
        original: root of the file, whose numbers have its digits.
        left_out: number of omitted items of the file, by name; None to count those of the
            document.
        zero: its own start, in words.
        closed: whether that is meant to close.
    """

    described: str
    root: Element
    original: Element
    left_out: Mapping[str, int] | None = None
    zero: str = QPOS0
    closed: bool = True


def case_of(file: Path, document: Document, supplied: Supplied) -> Case:
    """Return the case of a document; see `read_mjcf`."""
    root = document.root
    tree = read_tree(root, read_classes(root), read_compiler(root))
    if not tree.moving:
        raise root.fault("has no body with a joint, expected a mechanism; give a model that moves")
    for section in root.only(*_LEFT_OUT):
        for element in section.children:
            tree.count(f"{section.tag}: {element.tag}")
    driving = read_driving(file, tree, supplied)
    equalities = [*read_equalities(root, tree)]
    require_coupled(equalities)
    start = read_start(file, root, tree, supplied.start, zero=document.zero, closed=document.closed)
    digits = _digits(document.original, size_of(start.pose, equalities), supplied.closure)
    model = assemble(file, equalities, start, digits, driving.joints)
    free = spins(model.tree, model.equalities, driving.fixed)
    axes = {name: spin.axis for name, spin in free.items()}
    driving = taken(file, root, model, driving, axes, hold_rest=supplied.hold_rest)
    parts = parts_of(model.tree, model.equalities, driving, free)
    springs = springs_of(root, tree, model.tree, parts, driving, model.size)
    return _case(file, document, model, driving, parts, free, springs)


def _digits(root: Element, size: float, closure: float | None) -> Digits:
    """Return the user's tolerance, or the file's own."""
    return digits_of(root, size) if closure is None else Digits(closure, "--closure")


def _case(
    file: Path,
    document: Document,
    model: Assembled,
    driving: Driving,
    parts: Parts,
    free: Mapping[str, Spin],
    springs: Sequence[ForceElement],
) -> Case:
    """Return the case of the parts, without rows that are redundant within the digits."""
    tree, digits = model.tree, model.digits
    points = _points(tree, parts)
    found = bodies_of(tree, parts, free)
    gravity = gravity_of(document.root) if found.weighed else NO_GRAVITY
    with explained(file):
        drivers = [_driver(parts, name) for name in driving.joints]
        joints, couplers = list(parts.joints.values()), list(parts.couplers.values())
        mechanism = Mechanism(
            *(file.stem, found.bodies, joints, points, drivers, couplers),
            gravity=gravity,
            forces=springs,
        )
    counted = tree.left_out if document.left_out is None else document.left_out
    others = [
        *parts.left_out,
        *found.left_out,
        *(f"{what} ({count})" for what, count in counted.items()),
    ]
    heavy = ", with the masses of its bodies" * found.weighed
    source = (
        f"{document.described}, from {model.start}{heavy}{LEFT_OUT}{', '.join(others) or 'nothing'}"
    )
    sweep = _sweep(tree, driving)
    case = Case(file.stem, source, Truth.CONSENSUS_ONLY, mechanism, sweep, (), assembly=model.notes)
    dof = degrees_of_freedom(mechanism)
    if dof != len(drivers) or not model.exact:
        with explained(file):
            case = within_digits(case, digits.tolerance, digits.why, [*tree.joints])
        dof = degrees_of_freedom(case.mechanism)
    if dof != len(drivers):
        raise fault(
            file,
            "",
            f"its joints and equalities leave {len(drivers)} freedoms within {digits.tolerance:.2g}"
            f" m ({digits.why}), but {dof} as exact ones, expected as many; start farther from a"
            " singular pose by --start, or give another tolerance by --closure",
        )
    return with_all_motions(case)


def _sweep(tree: Tree, driving: Driving) -> Sweep:
    """Return the sweep of the first driven joint; the others move with it, straight."""
    (swept, values), *others = driving.driven.items()
    design = tree.joints[swept].value
    first, last = values[0] - design, values[-1] - design  # times, at a rate of one
    motions: dict[str, Motion] = {}
    for name, each in others:
        ends = [(first, each[0]), (last, each[-1])]
        times, there = zip(*sorted((float(t), float(x)) for t, x in ends), strict=True)
        motions[name] = Absolute(Table(times, there), tree.joints[name].value)
    return Sweep(swept, values, design=design, motions=motions)


def _require_model(root: Element) -> None:
    """Refuse other documents, and elements in place of parts elsewhere."""
    if root.tag in OTHERS:
        raise root.fault(OTHERS[root.tag])
    if root.tag != "mujoco":
        raise root.fault(
            "found another document, expected a model <mujoco>, <robot> or <sdf>; give a file of"
            " MJCF, URDF or SDF"
        )
    for element in root.children:
        if element.tag in MAKE_BODIES:
            raise element.fault(f"cannot be read, because {MAKE_BODIES[element.tag]}; {WRITE_OUT}")
        if element.tag not in (*ROOT, *EXPANDED):
            raise element.fault(f"unknown in a model; {remedy(element.tag, ROOT)}")


def _require_rigid(root: Element) -> None:
    """Refuse soft bodies between bodies."""
    for section in root.only("deformable"):
        for flex in section.only("flex"):
            names = {
                name for key in ("body", "node") for name in flex.attributes.get(key, "").split()
            }
            if len(names) > 1:
                raise flex.fault(
                    f"holds the bodies {shortened(sorted(names), MOST_NAMED)} together as a soft"
                    " one, expected rigid bodies; remove it, or write what joins them as <equality>"
                )


def _driver(parts: Parts, joint: str) -> JointDriver:
    cls = JointAngle if isinstance(parts.joints[joint], Revolute) else JointDisplacement
    return cls(joint, joint)


def _points(tree: Tree, parts: Parts) -> list[Point]:
    """The origins of the moving bodies of the file, and the sites on them."""
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
