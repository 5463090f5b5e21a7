"""Places of links, joints and frames of an SDF model, which may be given in each other.

A pose is in the frame named by `relative_to`. Without it, the pose of a link or a nested model is
in the model's frame, a joint's pose in its child, and a frame's pose in its `attached_to`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from ....algebra import quat, vec
from ....errors import remedy
from ...io.document import shown
from ..mjcf.elements import DEEPEST, Element
from ..mjcf.frames import HERE, Place, unit_quaternion
from .values import numbers_of, only_child, roll_pitch_yaw

WORLD = "world"
MODEL = "__model__"
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
    _places: dict[str, Place] = field(default_factory=lambda: {"": HERE})

    def read(self, around: Element, scope: str, depth: int = 0) -> None:
        """Take the frames of a model or world.

        Raises:
            CaseError: a name is missing or given twice, or models nest too deeply.
        """
        if depth > DEEPEST // 10:
            raise around.fault("nests too deeply, expected few models in models; flatten the file")
        for element in around.only("link"):
            element.require_known(("name",), "SDF")
            full = self._add(element, scope, scope)
            self.links[full] = self.found[full]
        for element in around.only("model"):
            element.require_known(("name", "canonical_link"), "SDF")
            full = self._add(element, scope, scope)
            self.models[full] = self.found[full]
            if flag(only_child(element, "static")):
                self.static.add(full)
            self.read(element, full, depth + 1)
        for element in around.only("joint"):
            element.require_known(("name", "type"), "SDF")
            child = self.within(element, scope, text_of(element, "child"))
            full = self._add(element, scope, child, child)
            self.joints[full] = self.found[full]
        for element in around.only("frame"):
            element.require_known(("name", "attached_to"), "SDF")
            base = element.attributes.get("attached_to", "")
            attached = self.within(element, scope, base) if base else scope
            self._add(element, scope, attached, attached)

    def _add(self, element: Element, scope: str, default: str, attached: str = "") -> str:
        name = element.attributes.get("name", "")
        if not name or SCOPE in name or name in (WORLD, MODEL):
            raise element.fault(f"name: found {shown(name)}, expected a name of its own; give one")
        full = joined(scope, name)
        if full in self.found:
            raise element.repeated_name(name, "them")
        self.found[full] = Framed(element, scope, default, attached)
        return full

    def put(self, name: str, element: Element, place: Place, link: str) -> None:
        """Take a frame of another format, at a place on a link."""
        self.found[name] = Framed(element, "", "", link)
        self._places[name] = place
        if name == link:
            self.links[name] = self.found[name]

    def named(self) -> dict[str, str]:
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

    def within(self, element: Element, scope: str, name: str) -> str:
        """Return the full name of a name in a scope; whether there is such a frame is asked later,
        for it may follow.
        """
        if name == MODEL:
            return scope
        return "" if name == WORLD else joined(scope, name)

    def known(self, element: Element, full: str) -> str:
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
        here = self.known(element, full)
        while here not in self._places:
            chain.append(here)
            if len(chain) > len(self.found):
                raise self.found[here].element.fault(
                    "is given in itself by a ring of frames, expected poses from the model on;"
                    " correct relative_to"
                )
            here = self.known(self.found[here].element, self._base(here))
        for name in reversed(chain):
            framed = self.found[name]
            base = self._places[self._base(name)]
            self._places[name] = base.then(read_pose(only_child(framed.element, "pose")))
        return self._places[full]

    def _base(self, full: str) -> str:
        """Return the base of the pose of a frame."""
        framed = self.found[full]
        pose = only_child(framed.element, "pose")
        given = pose.attributes.get("relative_to", "") if pose is not None else ""
        return self.within(framed.element, framed.scope, given) if given else framed.default

    def link(self, element: Element, full: str) -> str:
        """Return the link of a frame; empty for the world.

        Raises:
            CaseError: there is none.
        """
        for _ in range(len(self.found) + 1):
            if not full or full in self.links:
                return full
            self.known(element, full)
            full = self._canonical(full) if full in self.models else self.found[full].attached
        raise element.fault(
            f"found the frame {shown(full)}, which is attached to itself; correct attached_to"
        )

    def _canonical(self, model: str) -> str:
        """Return the link of a model's frame: its canonical one, or its first."""
        element = self.found[model].element
        if name := element.attributes.get("canonical_link", ""):
            return joined(model, name)
        first = next((full for full, each in self.links.items() if each.scope == model), None)
        if first is None:
            inner = next((full for full, each in self.models.items() if each.scope == model), None)
            if inner is None:
                raise element.fault("has no link, expected one; give a model with links")
            return inner
        return first

    def still(self, full: str) -> bool:
        """Return whether a link is in a static model, or in a model inside it."""
        scope = self.found[full].scope
        while scope:
            if scope in self.static:
                return True
            scope = self.found[scope].scope
        return False


class Short:
    """Full names without the model, if there is only one at the top."""

    def __init__(self, frames: Frames) -> None:
        tops = [full for full, each in frames.models.items() if not each.scope]
        outside = any(not each.scope for each in (*frames.links.values(), *frames.joints.values()))
        self.prefix = f"{tops[0]}{SCOPE}" if len(tops) == 1 and not outside else ""

    def __call__(self, full: str) -> str:
        return full.removeprefix(self.prefix)


def endings(full: str) -> list[str]:
    """Return a full name, and what it is called within its models."""
    parts = full.split(SCOPE)
    return [SCOPE.join(parts[k:]) for k in range(len(parts))]


def joined(scope: str, name: str) -> str:
    """Return the full name of a name in a scope."""
    return f"{scope}{SCOPE}{name}" if scope else name


def text_of(element: Element, tag: str) -> str:
    """Return the text of the only element of a tag.

    Raises:
        CaseError: it is missing or empty.
    """
    child = only_child(element, tag)
    if child is None or not child.text:
        raise element.fault(f"<{tag}>: missing, expected a name; add it")
    return child.text


def read_pose(element: Element | None) -> Place:
    """Return the place of a <pose>; the frame itself without one.

    Raises:
        CaseError: a wrong count of numbers, an unknown attribute, or a zero quaternion.
    """
    if element is None:
        return HERE
    element.require_known(("relative_to", "degrees", "rotation_format", "frame"), "SDF")
    if element.attributes.get("frame"):
        raise element.fault(
            "frame: found an attribute of SDF 1.6, expected relative_to; convert it"
        )
    kind = element.choice("rotation_format", ("euler_rpy", "quat_xyzw"), "euler_rpy")
    if kind == "quat_xyzw":
        numbers = numbers_of(element, (7,), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        if not math.hypot(*numbers[3:]) > 0.0:
            raise element.fault("found a quaternion of zeros, expected a rotation; correct it")
        x, y, z, w = numbers[3:]
        return Place(vec(numbers[:3]), unit_quaternion(quat((w, x, y, z))))
    numbers = numbers_of(element, (6,), (0.0,) * 6)
    in_degrees = element.choice("degrees", ("true", "false", "1", "0"), "false") in ("true", "1")
    convert: Callable[[float], float] = math.radians if in_degrees else float
    return Place(vec(numbers[:3]), roll_pitch_yaw([*map(convert, numbers[3:])]))


def flag(element: Element | None) -> bool:
    """Return the flag in the text of an element; false without one.

    Raises:
        CaseError: not a flag.
    """
    if element is None:
        return False
    if element.text.lower() not in ("true", "false", "1", "0"):
        raise element.fault(f"found {shown(element.text)}, expected true or false; correct it")
    return element.text.lower() in ("true", "1")
