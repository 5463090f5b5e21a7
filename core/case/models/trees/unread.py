"""Elements of a robot's file that are not read: those that may join links are refused, because
without them the mechanism is another one.

Programs add elements of their own to URDF and SDF, so it is not their names that tell what they do,
but the links and joints that they name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ...io.document import decimal, shown
from .element import Element

# What is seen, touched or measured joins nothing.
APART = (
    *("visual", "collision", "material", "sensor", "light", "camera", "projector"),
    *("audio", "particle", "contact", "geometry", "state", "physics"),
)
# Plugins that publish where links are.
PUBLISHERS = ("p3d", "imu", "camera", "laser", "gps", "publisher", "odometry", "ft_sensor")
# Elements whose attribute `name` is their own.
NAMED = ("plugin", "param", "controller", "hardware", "system", "joint", "link", "frame")
CLOSING = ("loop", "equality", "constraint", "closure")
MIMIC, TRANSMISSION, ACTUATOR = "mimic", "transmission", "actuator"
_OF_LINK = ("link", "body", "parent", "child", "frame", "member")
_SEPARATOR = re.compile(r"[\s,;]+")


@dataclass(frozen=True)
class Unread:
    """What the elements of a file that are not read may name.

    Attributes:
        links: links by their names, and by those of frames on them.
        joints: joints by what they are called.
        followers: joints that follow another one, and this one.
        advice: what to write in place of a joint that is not read.
    """

    links: Mapping[str, str]
    joints: Mapping[str, str]
    followers: Sequence[tuple[str, str]]
    advice: str

    def require_apart(self, element: Element, around: str = "") -> None:
        """Refuse an element that names two links, or couples joints.

        Args:
            around: the link or joint that the element around it names.

        Raises:
            CaseError: it does.
        """
        found = dict.fromkeys([*filter(None, [self.links.get(around)]), *self._links(element)])
        if len(found) > 1:
            first, second, *more = found
            others = f" and {len(more)} more" if more else ""
            raise element.fault(
                f"names the links {shown(first)} and {shown(second)}{others}, which it may join,"
                f" and is not read, expected {self.advice}; write what joins them so, or remove it"
            )
        if any(word in _bare(element.tag) for word in CLOSING) and not _apart(element):
            raise element.fault(
                f"may close a loop, and is not read, expected {self.advice}; write it so, or"
                " remove it"
            )
        self._uncoupled(element)

    def _uncoupled(self, element: Element) -> set[str]:
        """Return the joints that an element and those in it name, if it couples none."""
        joints = {*self._joints(element)}
        for child in element.children:
            joints |= self._uncoupled(child)
        if len(joints) < 2 or any(joints <= {*pair} for pair in self.followers):
            return joints
        why = ""
        if any(map(_says_mimic, (element, *element.children))):
            why = "couples the joints"
        elif _bare(element.tag) == TRANSMISSION:
            free = joints - {follower for follower, _ in self.followers}
            motors = sum(ACTUATOR in _bare(each.tag) for each in element.children)
            why = "with fewer actuators than joints may couple" if len(free) > motors > 0 else ""
        if why:
            raise element.fault(
                f"{why} {' and '.join(map(shown, sorted(joints)))}, and is not read, expected"
                " <mimic> in one of them; write it so, or remove it"
            )
        return joints

    def _links(self, element: Element) -> Iterator[str]:
        """Yield the links that an element and those in it name."""
        if _apart(element):
            return
        for hint, word in _words(element):
            link = self.links.get(word)
            if link is None or (word in self.joints and "joint" in hint):
                continue
            if _is_number(word) and not any(each in hint for each in _OF_LINK):
                continue
            yield link
        for child in element.children:
            yield from self._links(child)

    def _joints(self, element: Element) -> Iterator[str]:
        own = element.attributes.get("name", "")
        if "joint" in _bare(element.tag) and own in self.joints:
            yield self.joints[own]
        for hint, word in _words(element):
            if word in self.joints and (word not in self.links or "joint" in hint or MIMIC in hint):
                yield self.joints[word]


def _bare(tag: str) -> str:
    """Return a tag in small letters, without its prefix."""
    return tag.rpartition(":")[2].lower()


def _apart(element: Element) -> bool:
    tag = _bare(element.tag)
    if tag == "plugin":
        said = " ".join(element.attributes.values()).lower()
        return any(word in said for word in PUBLISHERS)
    words = tag.split("_")
    return any(word in (*APART, *(f"{each}s" for each in APART)) for word in (words[0], words[-1]))


def _says_mimic(element: Element) -> bool:
    tag = _bare(element.tag)
    said = [tag, *element.attributes]
    if tag in ("plugin", "param"):
        said += element.attributes.values()
    return any(MIMIC in text.lower() for text in said)


def _words(element: Element) -> Iterator[tuple[str, str]]:
    """Yield the words of an element's attributes and text, each with what it is called."""
    tag, own = _bare(element.tag), element.attributes.get("name", "")
    for key, value in element.attributes.items():
        if key != "name":
            yield from ((_bare(key), word) for word in _split(value))
        elif tag not in NAMED:
            yield from ((tag, word) for word in _split(value))
    hint = f"{tag} {own}".lower() if tag == "param" else tag
    yield from ((hint, word) for word in _split(element.text))


def _split(text: str) -> Iterator[str]:
    """Yield a text, and the words in it."""
    yield from dict.fromkeys((text.strip(), *_SEPARATOR.split(text)))


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(decimal(word))
    except ValueError:
        return False
