"""Frames of SDF: places of links, joints and frames, each in another's."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

from ...algebra import quat, vec
from ...case.io.document import shown
from ...errors import remedy
from ..xml.element import DEEPEST, Element
from .place import ORIGIN, Place, euler_turn, unit_quaternion
from .tree import WORLD

MODEL, PLACED = "__model__", "placement_frame"
SCOPE = "::"


@dataclass(frozen=True)
class Framed:
    """An element with a frame.

    Attributes:
        scope: full name of the model around it; empty for the world.
        default: full name of the base of its pose without relative_to.
        attached: full name of the frame it moves with; empty for a link, or the world.
    """

    element: Element
    scope: str
    default: str
    attached: str = ""


@dataclass
class Frames:
    """All frames of a document, by full name: MODEL::LINK; the world has an empty name."""

    found: dict[str, Framed] = field(default_factory=dict[str, Framed])
    links: dict[str, Framed] = field(default_factory=dict[str, Framed])
    joints: dict[str, Framed] = field(default_factory=dict[str, Framed])
    models: dict[str, Framed] = field(default_factory=dict[str, Framed])
    static: set[str] = field(default_factory=set[str])
    _places: dict[str, Place] = field(default_factory=lambda: {"": ORIGIN})

    def read(self, around: Element, scope: str, depth: int = 0) -> None:
        """Take the frames of a model or world.

        Raises:
            CaseError: a name is missing or given twice, or models nest too deeply.
        """
        if depth > DEEPEST // 10:
            raise around.fault("nests too deeply, expected few models in models; flatten the file")
        for element in around.findall("link"):
            element.require_known(("name",), "SDF")
            full = self._add(element, scope, scope)
            self.links[full] = self.found[full]
        for element in around.findall("model"):
            element.require_known(("name", "canonical_link", PLACED), "SDF")
            full = self._add(element, scope, scope)
            self.models[full] = self.found[full]
            if (static := element.child("static")) is not None:
                static.require_known((), "SDF")
            if flag_of(static):
                self.static.add(full)
            self.read(element, full, depth + 1)
        for element in around.findall("joint"):
            element.require_known(("name", "type"), "SDF")
            child = full_name_of(scope, text_of(element, "child"))
            full = self._add(element, scope, child, child)
            self.joints[full] = self.found[full]
        for element in around.findall("frame"):
            element.require_known(("name", "attached_to"), "SDF")
            element.require_children(("pose",), closed=True)
            base = element.attributes.get("attached_to", "")
            attached = full_name_of(scope, base) if base else scope
            self._add(element, scope, attached, attached)

    def _add(self, element: Element, scope: str, default: str, attached: str = "") -> str:
        name = element.attributes.get("name", "")
        if not name or SCOPE in name or name in (WORLD, MODEL):
            raise element.fault(f"name: found {shown(name)}, expected a name of its own; give one")
        full = _full_name(scope, name)
        if full in self.found:
            raise element.repeated_name(name, "them")
        self.found[full] = Framed(element, scope, default, attached)
        return full

    def add_given(self, name: str, element: Element, place: Place, link: str) -> None:
        """Take a frame of another format, at a place on a link."""
        self.found[name] = Framed(element, "", "", link)
        self._places[name] = place
        if name == link:
            self.links[name] = self.found[name]

    def link_names(self) -> dict[str, str]:
        """Return the links by the names of links and frames, with and without their models.

        Raises:
            CaseError: a frame is attached to none.
        """
        links = {WORLD: WORLD}
        for full, framed in self.found.items():
            if full not in self.models and full not in self.joints:
                link = self.link(framed.element, full) or WORLD
                links |= {name: link for name in endings(full) if name not in links}
        return links

    @cached_property
    def _prefix(self) -> str:
        """What all names have in common: the model, if there is only one at the top."""
        tops = [full for full, each in self.models.items() if not each.scope]
        outside = any(not each.scope for each in (*self.links.values(), *self.joints.values()))
        return f"{tops[0]}{SCOPE}" if len(tops) == 1 and not outside else ""

    def short_name(self, full: str) -> str:
        """Return a full name without the model, if there is only one at the top; not before all are
        read.
        """
        return full.removeprefix(self._prefix)

    def require_known_frame(self, element: Element, full: str) -> str:
        """Return a full name of a frame.

        Raises:
            CaseError: there is none.
        """
        if full and full not in self.found:
            raise element.fault(
                f"found the frame {shown(full)}, expected another one; {remedy(full, self.found)}"
            )
        return full

    def place(self, element: Element, full: str) -> Place:
        """Return the place of a frame, global.

        Raises:
            CaseError: it is unknown, or given in itself by a ring of frames.
        """
        chain: list[str] = []
        name = self.require_known_frame(element, full)
        while name not in self._places:
            chain.append(name)
            if len(chain) > len(self.found):
                raise self.found[name].element.fault(
                    "is given in itself by a ring of frames, expected poses from the model on;"
                    " correct relative_to"
                )
            name = self.require_known_frame(self.found[name].element, self._base(name))
        for name in reversed(chain):
            self._places[name] = self._places[self._base(name)] * self._pose(name)
        return self._places[full]

    def _pose(self, full: str) -> Place:
        """Return the place of a frame in its base; a model may give that of a frame in it."""
        element = self.found[full].element
        pose, name, inside = pose_of(element.child("pose")), full, ORIGIN
        if placed := element.attributes.get(PLACED, "") if full in self.models else "":
            name = self.require_known_frame(element, full_name_of(full, placed))
        for _ in self.found:
            if name == full:
                return pose * inside.inverse
            inside = self._pose(name) * inside
            name = self.require_known_frame(element, self._base(name))
            if not name:
                break
        raise element.fault(
            f"{PLACED}: found {shown(placed)}, which is given outside the model, expected a frame"
            " given in it; correct it"
        )

    def _base(self, full: str) -> str:
        """Return the base of the pose of a frame."""
        framed = self.found[full]
        pose = framed.element.child("pose")
        given = pose.attributes.get("relative_to", "") if pose is not None else ""
        return full_name_of(framed.scope, given) if given else framed.default

    def link(self, element: Element, full: str) -> str:
        """Return the link of a frame; empty for the world.

        Raises:
            CaseError: there is none.
        """
        for _ in range(len(self.found) + 1):
            if not full or full in self.links:
                return full
            self.require_known_frame(element, full)
            full = self._canonical(full) if full in self.models else self.found[full].attached
        raise element.fault(
            f"found the frame {shown(full)}, which is attached to itself; correct attached_to"
        )

    def _canonical(self, model: str) -> str:
        """Return the link of a model's frame: its canonical one, its first, or that of a model
        inside.
        """
        element = self.found[model].element
        if name := element.attributes.get("canonical_link", ""):
            return _full_name(model, name)
        for full, each in (*self.links.items(), *self.models.items()):
            if each.scope == model:
                return full
        raise element.fault("has no link, expected one; give a model with links")

    def is_still(self, full: str) -> bool:
        """Return whether a link is in a static model, or in a model inside it."""
        scope = self.found[full].scope
        while scope and scope not in self.static:
            scope = self.found[scope].scope
        return bool(scope)


def full_name_of(scope: str, name: str) -> str:
    """Return the full name of a name in a scope; whether there is such a frame is asked later, for
    it may follow.
    """
    if name == MODEL:
        return scope
    return "" if name == WORLD else _full_name(scope, name)


def _full_name(scope: str, name: str) -> str:
    return f"{scope}{SCOPE}{name}" if scope else name


def endings(full: str) -> list[str]:
    """Return a full name, and what it is called within its models."""
    parts = full.split(SCOPE)
    return [SCOPE.join(parts[k:]) for k in range(len(parts))]


def text_of(element: Element, tag: str) -> str:
    """Return the text of the only element of a tag."""
    child = element.child(tag)
    if child is None or not child.text:
        raise element.fault(f"<{tag}>: missing, expected a name; add it")
    return child.text


FLAGS = ("true", "false", "1", "0")
TRUE = ("true", "1")


def flag_of(element: Element | None) -> bool:
    """Return the flag in the text of an element; false without one."""
    if element is None:
        return False
    if element.text.lower() not in FLAGS:
        raise element.fault(f"found {shown(element.text)}, expected true or false; correct it")
    return element.text.lower() in TRUE


def pose_of(element: Element | None) -> Place:
    """Return the place of a <pose>; the frame itself without one."""
    if element is None:
        return ORIGIN
    element.require_known(("relative_to", "degrees", "rotation_format", "frame"), "SDF")
    if element.attributes.get("frame"):
        raise element.fault(
            "frame: found an attribute of SDF 1.6, expected relative_to; convert it"
        )
    kind = element.choice("rotation_format", ("euler_rpy", "quat_xyzw"), "euler_rpy")
    if kind == "quat_xyzw":
        numbers = element.text_numbers(7, default=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        if not math.hypot(*numbers[3:]) > 0.0:
            raise element.fault("found a quaternion of zeros, expected a rotation; correct it")
        x, y, z, w = numbers[3:]
        return Place(vec(numbers[:3]), unit_quaternion(quat((w, x, y, z))))
    *at, roll, pitch, yaw = element.text_numbers(6, default=(0.0,) * 6)
    angles = [yaw, pitch, roll]
    if element.choice("degrees", FLAGS, "false") in TRUE:
        angles = [*map(math.radians, angles)]
    return Place(vec(at), euler_turn("zyx", angles))
