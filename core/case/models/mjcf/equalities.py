"""Equalities of a model, which close its loops."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from ....algebra import Quat, Vec3, quat, vec
from ....mechanism.mechanism import GROUND
from .classes import MAIN
from .elements import Element
from .frames import Place, unit_quaternion
from .tree import WORLD, Tree

# Their rows are solved together, in some seconds.
MOST_EQUALITIES = 6_000


@dataclass(frozen=True)
class Connect:
    """A point of each of two bodies, which shall coincide, global in the pose of the tree.

    Attributes:
        turns: of a weld, the turns of a frame on each body, which shall coincide too.
    """

    name: str
    i: str
    j: str
    points: tuple[Vec3, Vec3]
    element: Element
    turns: tuple[Quat, Quat] | None = None


@dataclass(frozen=True)
class Relation:
    """Changes of joint coordinates since qpos0 [rad, m]: a weighted sum, by joint, follows a
    polynomial of another.
    """

    name: str
    driven: Mapping[str, float]
    driving: Mapping[str, float]
    coefficients: tuple[float, ...]
    element: Element

    @property
    def linear(self) -> bool:
        """Whether no power above the first takes part."""
        return not (self.driving and any(self.coefficients[2:]))

    @property
    def joints(self) -> set[str]:
        """The joints it ties to one another, or locks."""
        return {*(self.weights if self.linear else (*self.driven, *self.driving))}

    @property
    def weights(self) -> dict[str, float]:
        """Of a linear relation, the weights of the constant sum; without zeros."""
        found = dict(self.driven)
        for joint, weight in self.driving.items():
            found[joint] = found.get(joint, 0.0) - self.coefficients[1] * weight
        return {joint: weight for joint, weight in found.items() if weight}


@dataclass(frozen=True)
class Rod:
    """Two points of two bodies at a length [m], global in the pose of the tree."""

    name: str
    i: str
    j: str
    points: tuple[Vec3, Vec3]
    length: float
    element: Element


Equality: TypeAlias = Connect | Relation | Rod


def read_equalities(root: Element, tree: Tree) -> Iterator[Equality]:
    """Yield the active equalities in order.

    Raises:
        CaseError: an equality refers to a missing element, or has no equivalent joint.
    """
    tendons, names = _tendons(root), set[str]()
    off = any(
        flag.attributes.get("equality") == "disable"
        for option in root.only("option")
        for flag in option.only("flag")
    )
    for section in root.only("equality"):
        for k, bare in enumerate(section.children, 1):
            element = tree.classes.complete(bare, "equality", MAIN)
            if element.tag not in _READERS:
                raise element.fault(
                    "cannot be read: there is no joint for it; expected one of"
                    f" {', '.join(_READERS)}; remove it"
                )
            if off or element.choice("active", ("true", "false"), "true") == "false":
                tree.count("equalities that are not active")
                continue
            name = element.attributes.get("name", f"{element.tag}{k}")
            if name in names:
                raise element.repeated_name(name, "the equalities")
            names.add(name)
            if len(names) > MOST_EQUALITIES:
                raise element.fault(
                    f"found more than the {MOST_EQUALITIES} equalities that are read, expected"
                    " fewer; take out those that are not looked at"
                )
            found = _READERS[element.tag](name, element, tree, tendons)
            if isinstance(found, Connect) and found.i == found.j == GROUND:
                tree.count("equalities of what stands still")
            else:
                yield found


_Tendons = Mapping[str, Element]


def _connect(name: str, element: Element, tree: Tree, _: _Tendons) -> Connect:
    if "site1" in element.attributes:
        (i, here), (j, there) = _sites(element, tree)
        return _of_two(Connect(name, i, j, (here.at, there.at), element))
    first, second = _bodies(element, tree)
    point = tree.places[first].point(vec(element.numbers("anchor", (3,))))
    ends = tree.carriers[first], tree.carriers[second]
    return _of_two(Connect(name, *ends, (point, point), element))


def _weld(name: str, element: Element, tree: Tree, _: _Tendons) -> Connect:
    (scale,) = element.numbers("torquescale", (1,), (1.0,))
    if scale == 0.0:
        raise element.fault(
            "torquescale: found 0, which leaves all turning free, expected more; write it as"
            " <connect>"
        )
    if "site1" in element.attributes:
        (i, here), (j, there) = _sites(element, tree)
        wanted = Place()
    else:
        first, second = _bodies(element, tree)
        here, there = tree.places[first], tree.places[second]
        i, j = tree.carriers[first], tree.carriers[second]
        relpose = element.numbers("relpose", (7,), (0.0,) * 7)
        # zeros for the quaternion mean: as in qpos0
        wanted = (
            Place(vec(relpose[:3]), unit_quaternion(quat(relpose[3:])))
            if any(relpose[3:])
            else there.seen_from(here)
        )
    here = here.then(wanted)
    return _of_two(Connect(name, i, j, (here.at, there.at), element, (here.turn, there.turn)))


def _joint(name: str, element: Element, tree: Tree, _: _Tendons) -> Relation:
    first = _axial(element, "joint1", element.attributes.get("joint1"), tree)
    coefficients = _coefficients(element)
    if "joint2" not in element.attributes:  # there is nothing that higher coefficients could be of
        return Relation(name, {first: 1.0}, {}, coefficients, element)
    second = _axial(element, "joint2", element.attributes["joint2"], tree)
    if first == second:
        raise element.fault(
            f"couples the joint {first!r} with itself, expected two; correct joint2"
        )
    return Relation(name, {first: 1.0}, {second: 1.0}, coefficients, element)


def _tendon(name: str, element: Element, tree: Tree, tendons: _Tendons) -> Relation | Rod:
    single = tendons.get(element.attributes.get("tendon1", ""))
    if single is not None and single.tag == "spatial" and "tendon2" not in element.attributes:
        return _rod(name, element, single, tree)
    sums = [
        _sum(element, key, tree, tendons) if key in element.attributes or key == "tendon1" else {}
        for key in ("tendon1", "tendon2")
    ]
    return Relation(name, sums[0], sums[1], _coefficients(element), element)


def _sum(element: Element, key: str, tree: Tree, tendons: _Tendons) -> dict[str, float]:
    """Return the weights of the joints of a fixed tendon."""
    tendon = element.attributes.get(key, "")
    if tendon not in tendons:
        raise element.unknown_name(key, tendon, tendons, "a tendon")
    found = tendons[tendon]
    if found.tag != "fixed":
        problem = (
            f"{key}: {tendon!r} is a spatial tendon, whose length is not linear in joint"
            " coordinates"
        )
        raise element.fault(
            f"{problem}, expected a fixed one; only alone, and between two sites, is there a"
            " joint for it"
        )
    weights: dict[str, float] = {}
    for wrap in found.only("joint"):
        joint = _axial(wrap, "joint", wrap.attributes.get("joint"), tree)
        (coefficient,) = wrap.numbers("coef", (1,))
        weights[joint] = weights.get(joint, 0.0) + coefficient
    return weights


def _rod(name: str, element: Element, tendon: Element, tree: Tree) -> Rod:
    """Return the rod of a spatial tendon of constant length."""
    if [child.tag for child in tendon.children] != ["site", "site"]:
        way = ", ".join(child.tag for child in tendon.children) or "nothing"
        raise element.fault(
            f"tendon1: {tendon} goes over {way}, expected two sites; there is no joint for others"
        )
    ends: list[tuple[str, Place]] = []
    for child in tendon.children:
        site = child.attributes.get("site", "")
        if site not in tree.sites:
            raise child.unknown_name("site", site, tree.sites, "a site")
        ends.append(tree.sites[site])
    (i, here), (j, there) = ends
    apart = there.at - here.at
    length = math.sqrt(apart @ apart) + _coefficients(element)[0]
    if i == j or not (apart @ apart > 0.0 and length > 0.0):
        what = (
            f"is between two points of {i!r}" if i == j else "has no length in the pose of the file"
        )
        raise element.fault(
            f"tendon1: {tendon} {what}, expected two points of two bodies; remove the equality, or"
            " write <connect>"
        )
    return Rod(name, i, j, (here.at, there.at), length, element)


_READERS = {"connect": _connect, "weld": _weld, "joint": _joint, "tendon": _tendon}


def _tendons(root: Element) -> dict[str, Element]:
    return {
        each.attributes.get("name", ""): each
        for section in root.only("tendon")
        for each in section.children
    }


def _coefficients(element: Element) -> tuple[float, ...]:
    """Return five coefficients; omitted ones of polycoef have their defaults."""
    found = element.numbers("polycoef", (1, 2, 3, 4, 5), (0.0, 1.0))
    return (*found, *(0.0, 1.0, 0.0, 0.0, 0.0)[len(found) :])


def _axial(element: Element, key: str, name: str | None, tree: Tree) -> str:
    if name not in tree.joints:
        raise element.unknown_name(key, name, tree.joints, "a joint")
    joint = tree.joints[name]
    if joint.type == "ball":
        raise element.fault(
            f"{key}: {name!r} is a ball joint, expected a hinge or a slide; couple one of those"
        )
    return name


def _bodies(element: Element, tree: Tree) -> tuple[str, str]:
    if "body1" not in element.attributes:
        raise element.fault(
            "body1: missing, expected two bodies or two sites; add body1 and body2, or site1 and"
            " site2"
        )
    names = element.attributes["body1"], element.attributes.get("body2", WORLD)
    for key, name in zip(("body1", "body2"), names, strict=True):
        if name not in tree.places:
            raise element.unknown_name(key, name, tree.places, "a body")
    return names


def _sites(element: Element, tree: Tree) -> list[tuple[str, Place]]:
    found: list[tuple[str, Place]] = []
    for key in ("site1", "site2"):
        name = element.attributes.get(key, "")
        if name not in tree.sites:
            raise element.unknown_name(key, name, tree.sites, "a site")
        found.append(tree.sites[name])
    return found


def _of_two(connect: Connect) -> Connect:
    if connect.i == connect.j != GROUND:
        raise connect.element.fault(
            f"joins {connect.i!r} with itself, expected two bodies that move otherwise; remove it"
        )
    return connect
