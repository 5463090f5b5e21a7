"""Equalities of a model, which close its loops. They must hold in the pose qpos0 at the start."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from ....algebra import Vec3, quat, vec
from ....errors import remedy
from ...io.document import shown
from .attributes import KNOWN, WRITE_OUT
from .classes import MAIN
from .elements import Element
from .frames import Place, unit_quaternion
from .tree import WORLD, Tree

# A larger gap [m, rad] is not the rounding of composed frames (1e-15): the motion of kincheck would
# differ by as much from the one on which MuJoCo's residual vanishes.
OPEN = 1e-12


@dataclass(frozen=True)
class Connect:
    """A common point of two bodies, global at qpos0; a weld also fixes the orientation."""

    name: str
    i: str
    j: str
    point: Vec3
    element: Element
    weld: bool = False


@dataclass(frozen=True)
class Relation:
    """Joint coordinates with a constant weighted sum, as at qpos0 [rad, m]; weights by joint."""

    name: str
    weights: Mapping[str, float]
    element: Element


@dataclass(frozen=True)
class Rod:
    """Two points of two bodies at constant distance, global at qpos0."""

    name: str
    i: str
    j: str
    points: tuple[Vec3, Vec3]
    element: Element


Equality: TypeAlias = Connect | Relation | Rod


def read_equalities(root: Element, tree: Tree) -> Iterator[Equality]:
    """Yield the active equalities in order.

    Raises:
        CaseError: an equality refers to a missing element, is open at qpos0, is not linear, or has
            no equivalent joint.
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
            known = KNOWN.get(f"equality {element.tag}") or KNOWN[element.tag]
            element.require_known(known)
            if off or element.choice("active", ("true", "false"), "true") == "false":
                tree.count("equalities that are not active")
                continue
            name = element.attributes.get("name", f"{element.tag}{k}")
            if name in names:
                raise element.fault(
                    f"name: found {shown(name)} again, expected a name of its own; rename one of"
                    " the equalities"
                )
            names.add(name)
            yield _READERS[element.tag](name, element, tree, tendons)


_Tendons = Mapping[str, Element]


def _connect(name: str, element: Element, tree: Tree, _: _Tendons) -> Connect:
    if "site1" in element.attributes:
        (i, here), (j, there) = _sites(element, tree)
        gap = there.at - here.at
        _require_closed(element, math.sqrt(gap @ gap), "m apart")
        return _closed(Connect(name, i, j, here.at, element))
    first, second = _bodies(element, tree)
    point = tree.places[first].point(vec(element.numbers("anchor", (3,))))
    return _closed(Connect(name, tree.carriers[first], tree.carriers[second], point, element))


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
    found = there.seen_from(here)
    gap, turn = found.at - wanted.at, (wanted.turn.conjugate() * found.turn).e
    _require_closed(element, math.sqrt(gap @ gap), "m apart")
    _require_closed(element, 2.0 * math.sqrt(turn @ turn), "rad turned")
    return _closed(Connect(name, i, j, there.at, element, weld=True))


def _joint(name: str, element: Element, tree: Tree, _: _Tendons) -> Relation:
    first = _axial(element, "joint1", element.attributes.get("joint1"), tree)
    if "joint2" not in element.attributes:  # there is nothing that higher coefficients could be of
        _require_closed(element, abs(_coefficients(element)[0]), "rad or m off")
        return Relation(name, {first: 1.0}, element)
    slope = _slope(element)
    second = _axial(element, "joint2", element.attributes["joint2"], tree)
    if first == second:
        raise element.fault(
            f"couples the joint {first!r} with itself, expected two; correct joint2"
        )
    return Relation(name, _nonzero({first: 1.0, second: -slope}), element)


def _tendon(name: str, element: Element, tree: Tree, tendons: _Tendons) -> Relation | Rod:
    single = tendons.get(element.attributes.get("tendon1", ""))
    if single is not None and single.tag == "spatial" and "tendon2" not in element.attributes:
        return _rod(name, element, single, tree)
    slope = _slope(element)
    weights: dict[str, float] = {}
    for key, factor in (("tendon1", 1.0), ("tendon2", -slope)):
        if key == "tendon2" and key not in element.attributes:
            continue
        tendon = element.attributes.get(key, "")
        if tendon not in tendons:
            raise element.fault(
                f"{key}: found {shown(tendon)}, expected a tendon; {remedy(tendon, tendons)}"
            )
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
        for wrap in found.only("joint"):
            joint = _axial(wrap, "joint", wrap.attributes.get("joint"), tree)
            (coefficient,) = wrap.numbers("coef", (1,))
            weights[joint] = weights.get(joint, 0.0) + factor * coefficient
    return Relation(name, _nonzero(weights), element)


def _rod(name: str, element: Element, tendon: Element, tree: Tree) -> Rod:
    """Return the rod of a spatial tendon of constant length."""
    if [child.tag for child in tendon.children] != ["site", "site"]:
        way = ", ".join(child.tag for child in tendon.children) or "nothing"
        raise element.fault(
            f"tendon1: {tendon} goes over {way}, expected two sites; there is no joint for others"
        )
    _require_closed(element, abs(_coefficients(element)[0]), "m off")
    ends: list[tuple[str, Place]] = []
    for child in tendon.children:
        site = child.attributes.get("site", "")
        if site not in tree.sites:
            raise child.fault(
                f"site: found {shown(site)}, expected a site; {remedy(site, tree.sites)}"
            )
        ends.append(tree.sites[site])
    (i, here), (j, there) = ends
    apart = there.at - here.at
    if i == j or not apart @ apart > 0.0:
        what = (
            f"is between two points of {i!r}" if i == j else "has no length in the pose of the file"
        )
        raise element.fault(
            f"tendon1: {tendon} {what}, expected two points of two bodies; remove the equality, or"
            " write <connect>"
        )
    return Rod(name, i, j, (here.at, there.at), element)


_READERS = {"connect": _connect, "weld": _weld, "joint": _joint, "tendon": _tendon}


def _tendons(root: Element) -> dict[str, Element]:
    return {
        each.attributes.get("name", ""): each
        for section in root.only("tendon")
        for each in section.children
    }


def _nonzero(weights: Mapping[str, float]) -> dict[str, float]:
    return {joint: weight for joint, weight in weights.items() if weight}


def _slope(element: Element) -> float:
    """Return the factor of a linear polynomial through the pose of the file."""
    constant, slope, *higher = (*_coefficients(element), 0.0, 0.0)[:5]
    if len(element.attributes.get("polycoef", "0 1").split()) == 1:
        slope = 1.0  # what is left out of polycoef keeps its default
    if any(higher):
        raise element.fault(
            f"polycoef: found {shown(element.attributes['polycoef'])}, expected a linear one; there"
            " is no joint for curves"
        )
    _require_closed(element, abs(constant), "rad or m off")
    return slope


def _coefficients(element: Element) -> tuple[float, ...]:
    return element.numbers("polycoef", (1, 2, 3, 4, 5), (0.0, 1.0))


def _axial(element: Element, key: str, name: str | None, tree: Tree) -> str:
    if name not in tree.joints:
        raise element.fault(
            f"{key}: found {shown(name)}, expected a joint; {remedy(str(name), tree.joints)}"
        )
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
            raise element.fault(
                f"{key}: found {shown(name)}, expected a body; {remedy(name, tree.places)}"
            )
    return names


def _sites(element: Element, tree: Tree) -> list[tuple[str, Place]]:
    found: list[tuple[str, Place]] = []
    for key in ("site1", "site2"):
        name = element.attributes.get(key, "")
        if name not in tree.sites:
            raise element.fault(
                f"{key}: found {shown(name)}, expected a site; {remedy(name, tree.sites)}"
            )
        found.append(tree.sites[name])
    return found


def _require_closed(element: Element, gap: float, what: str) -> None:
    if gap > OPEN:
        raise element.fault(
            f"is open in the pose of the file: {gap:.4g} {what}, expected a model that closes"
            " there; give it the closed pose as pos and quat of its bodies, which are those of"
            f" qpos0; or {WRITE_OUT.removesuffix(')')} after closing it)"
        )


def _closed(connect: Connect) -> Connect:
    if connect.i == connect.j:
        raise connect.element.fault(
            f"joins {connect.i!r} with itself, expected two bodies that move otherwise; remove it"
        )
    return connect
