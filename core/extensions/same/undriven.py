"""Mechanisms of files without drivers, with limits and motors of their joints."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...case.case import Case
from ...case.models.files import load
from ...joints import Revolute, Translational
from ...mechanism.mechanism import Mechanism
from ..closing.reduction import reduce_rows
from ..trees.case import undriven_mechanism
from ..trees.gluing import glue
from ..trees.laws import Laws, laws_of, tendons_of
from ..trees.reader import is_model, read_tree, root_of
from ..trees.tree import NO_LIMIT, Limit, Move, Spring, Strut, Tree
from ..xml.element import Element, printed_digits

# Parts of a half turn that people write in a few digits, as 3.1416 and -1.57.
_PARTS = 12
_ANGLE = re.compile(r"[-+]?\d*\.\d{2,}")
# Elements of SDF and USD that have it.
_SCENES = ("world", "PhysicsScene")
# Cosine of the angle between a spring and a slide, by printed digits.
_PARALLEL = 1e-12
# A name's ends that programs add to those of links.
_ENDS = ("_link", "-link", " link", "link_")


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a joint.

    Attributes:
        turns: it is an angle.
        start: its value at design [rad or m].
        actuated: it has a motor.
    """

    turns: bool
    start: float = 0.0
    limit: Limit = NO_LIMIT
    actuated: bool = False


@dataclass(frozen=True, eq=False)
class Undriven:
    """A mechanism without drivers.

    Attributes:
        name: of its file.
        coordinates: by joint of one coordinate.
        links: moving links with a name in the file; others stand between freedoms of one joint.
        spinning: links whose turn about themselves means nothing.
        error: relative error of its lengths by the digits of the file, of each joint.
        angle_error: error of angles in few digits [rad].
        is_model: whether the file is a model, with limits, motors and frames of links.
        says_gravity: whether the file can say it.
        parts: names of the bodies of the file that are one, by the name of the whole.
        root: tag of the first element of a model, which tells its format.
        laws: numbers of joints beside motion; see `laws_of`.
        struts: springs and bushings between links.
        tendons: what is said of the forces and limits of tendons.
        notes: of its reader.
        without: names by which the user leaves out elements of the file.
    """

    name: str
    mechanism: Mechanism
    coordinates: Mapping[str, Coordinate]
    links: Collection[str]
    spinning: Collection[str] = ()
    error: float = 0.0
    angle_error: float = 0.0
    is_model: bool = False
    says_gravity: bool = True
    parts: Mapping[str, Sequence[str]] = field(default_factory=dict[str, Sequence[str]])
    root: str = ""
    laws: Mapping[str, Laws] = field(default_factory=dict[str, Laws])
    struts: Sequence[Strut] = ()
    tendons: Mapping[str, Mapping[str, str]] = field(default_factory=dict[str, Mapping[str, str]])
    notes: Sequence[str] = ()
    without: Collection[str] = ()

    def is_between(self, link: str) -> bool:
        """Return whether a link only stands between joints: it has no mass, and others have."""
        mechanism = self.mechanism
        weighed = any(body.mass for body in mechanism.moving)
        joints = mechanism.joints_on.get(link, ())
        return weighed and not mechanism.body(link).mass and len(joints) > 1

    @property
    def chain(self) -> int:
        """Largest number of joints between the ground and a link."""
        far = {body.name: 0 for body in self.mechanism.bodies if body.fixed} | {"ground": 0}
        for _ in self.mechanism.moving:
            for joint in self.mechanism.joints:
                for a, b in (joint.bodies, joint.bodies[::-1]):
                    if a in far:
                        far.setdefault(b, far[a] + 1)
        return max(far.values())


def undriven_case(case: Case, name: str) -> Undriven:
    """Return a case without its drivers."""
    given = replace(case.mechanism, joints=case.mechanism.given_joints, reduced=())
    mechanism, parts = glue(given, ())
    if case.closure is not None:
        closure = case.closure
        mechanism = reduce_rows(mechanism, closure.tolerance, closure.carrying).mechanism
    coordinates = {
        joint.name: Coordinate(isinstance(joint, Revolute))
        for joint in mechanism.joints
        if isinstance(joint, Revolute | Translational)
    }
    links = [body.name for body in mechanism.moving]
    return Undriven(name, mechanism, coordinates, links, parts=parts)


def undriven_file(file: Path, without: Collection[str] = ()) -> Undriven:
    """Return the mechanism of a model or case file.

    Args:
        without: see `read_tree`.

    Raises:
        CaseError: it cannot be read.
    """
    if not is_model(file):
        return undriven_case(load(file), file.name)
    root = root_of(file)
    mechanism, tree, spinning, parts = undriven_mechanism(read_tree(file, without))
    coordinates = {
        name: Coordinate(move.kind == "hinge", move.value, move.limit, name in tree.actuated)
        for name, move in tree.joints.items()
        if move.is_axial
    }
    digits = printed_digits(root)
    tendons = tendons_of(tree)
    _give_to_slides(tree)
    return Undriven(
        file.name,
        mechanism,
        coordinates,
        [body.name for body in mechanism.moving if body.name in tree.places],
        spinning,
        10.0**-digits if digits else 0.0,
        max(map(_angle_error, root.descendants()), default=0.0),
        is_model=True,
        says_gravity=root.tag == "mujoco"
        or any(each.tag in _SCENES for each in root.descendants()),
        parts=parts,
        root=root.tag,
        laws=laws_of(tree, root),
        struts=tree.struts,
        tendons=tendons,
        notes=[f"{file.name}: {note}" for note in tree.notes],
        without=tree.without,
    )


def _give_to_slides(tree: Tree) -> None:
    """Make springs between two points along a slide those of its coordinate: formats without
    springs of joints have them so.
    """
    between: dict[frozenset[str], list[Move]] = {}
    for move in tree.moves.values():
        between.setdefault(frozenset((move.outer, move.inner)), []).append(move)
    kept: list[Strut] = []
    for strut in tree.struts:
        moves = between.get(frozenset(strut.links), [])
        first, second = (np.array([*each.at]) for each in strut.places)
        slide, way = moves[0] if len(moves) == 1 else None, second - first
        length = float(np.linalg.norm(way))
        if slide is None or slide.kind != "slide" or not isinstance(strut.spring, Spring):
            kept.append(strut)
            continue
        along = float(way @ np.array([*slide.axis])) * (1 if strut.links[1] == slide.inner else -1)
        if abs(along) < (1.0 - _PARALLEL) * length or not length:
            kept.append(strut)
            continue
        rest = slide.value + math.copysign(1.0, along) * (strut.spring.rest - length)
        own = Spring(strut.spring.stiffness, strut.spring.damping, rest)
        others = tree.springs.get(slide.name)
        tree.springs[slide.name] = own if others is None else own.beside(others)
    tree.struts = kept


def _angle_error(element: Element) -> float:
    """Return the largest error of parts of a half turn in few digits [rad]."""
    texts = [element.attributes.get(name, "") for name in ("rpy", "euler")]
    texts += [element.text] * (element.tag == "pose")
    found = 0.0
    for text in " ".join(texts).split():
        if _ANGLE.fullmatch(text):
            part = float(text) * _PARTS / math.pi
            error = abs(part - round(part)) * math.pi / _PARTS
            last = 10.0 ** -len(text.partition(".")[2])
            found = max(found, error * (round(part) != 0 and error <= last))
    return found


def plain_name(name: str) -> str:
    """Return a name without the ends and signs changed by programs."""
    name = name.rpartition("::")[2].lower()
    for end in _ENDS:
        name = name.removesuffix(end).removeprefix(end)
    return re.sub(r"[\W_]+", "_", name)
