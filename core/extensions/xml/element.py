"""Elements of an XML file of any origin: attributes, texts and lines, no entities, no
document types, a bounded depth.

Elements note the questions of their reader. `settle` refuses the rest, unless it means nothing for
kinematics: a mistyped attribute or element would silently fall back to its default.
"""

from __future__ import annotations

import math
import re
import statistics
import sys
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast
from xml.parsers import expat

from ...algebra import Vec3, vec
from ...case.io.document import decimal, fault, shown, unknown_name, usable
from ...errors import CaseError, remedy, similar
from .ledger import Asked

# Elements are some ten deep; but bodies of MJCF are in the bodies that carry them.
DEEPEST, DEEPEST_BODY = 200, 5_000
_CARRYING = ("body", "frame")
# Each takes some microseconds and a kilobyte.
MOST_ELEMENTS = 200_000
# Two words are alike if a typing error makes one of the other.
ALIKE = 0.75
ZEROS = (0.0, 0.0, 0.0)
# Error of the length of a unit vector by the rounding of its components.
_ROUND_OFF = 2.0 * sys.float_info.epsilon
USD = "usd"
"""Tag of the root of a stage of USD, whose numbers are in single precision."""
EXTENDED = ("robot", "link", "model", "world", "sdf")
"""Elements in which programs put their own ones."""
TAKEN, LEFT, TEXT = "taken", "left", "text"
"""Marks of a read element, of one listed with all in it, and of a read text."""


def words(text: str) -> tuple[str, ...]:
    """Return the words of a text, for tables of names."""
    return tuple(text.split())


def unit_vector(numbers: Sequence[float]) -> Vec3:
    """Return the direction of three numbers, length one; unchanged if they have it to the last
    digit, so that a file keeps its own numbers. Not for zero.
    """
    length = math.hypot(*numbers)
    if abs(length - 1.0) <= _ROUND_OFF:
        return vec(numbers)
    return vec([each / length for each in numbers])


@dataclass(frozen=True, eq=False)
class Element:
    """An element, or a place in a file beside that is no XML.

    Attributes:
        line: its first one.
        texts: parts of the text in it.
        words: its place in messages, if it is not its line.
        marks: what is read of it: `TAKEN`, `LEFT`, `TEXT`, and each "<TAG>" that is asked for.
    """

    file: Path
    tag: str
    attributes: Mapping[str, str]
    line: int
    children: list[Element] = field(default_factory=list["Element"])
    texts: list[str] = field(default_factory=list[str])
    words: str = ""
    marks: set[str] = field(default_factory=set[str], repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.attributes, Asked):
            object.__setattr__(self, "attributes", Asked(self.attributes))

    @property
    def text(self) -> str:
        """The text in the element, without its ends."""
        self.marks.add(TEXT)
        return "".join(self.texts).strip()

    @property
    def asked(self) -> set[str]:
        """The attributes with a question."""
        return cast("Asked", self.attributes).asked

    @property
    def unasked(self) -> list[str]:
        """The attributes without a question."""
        return cast("Asked", self.attributes).unasked

    def take(self, *attributes: str) -> Element:
        """Mark the element, and attributes of it, as read; return it."""
        self.marks.add(TAKEN)
        self.asked.update(attributes)
        return self

    def leave(self) -> Element:
        """Mark the element and all in it as listed; return it."""
        self.marks.add(LEFT)
        return self

    def __str__(self) -> str:
        name = self.attributes.get("name")
        return self.words or f"line {self.line}: <{self.tag}>" + (f" {name!r}" if name else "")

    def fault(self, problem: str) -> CaseError:
        """Return the error to raise: 'FILE: line N: <TAG> NAME: PROBLEM'."""
        return fault(self.file, str(self), problem)

    def unknown_name(
        self, key: str, name: object, known: Iterable[str], expected: str
    ) -> CaseError:
        """Return the error of a name that is none of the known ones; see `document`."""
        return unknown_name(self.file, f"{self}: {key}", name, known, expected)

    def repeated_name(self, name: str, these: str) -> CaseError:
        """Return the error of a name that another one of these has."""
        return self.fault(
            f"name: found {shown(name)} again, expected a name of its own; rename one of {these}"
        )

    def require_two(self, first: str, second: str) -> None:
        """Refuse a joint, tie or spring of one link, or a coupling of one joint."""
        if first == second:
            raise self.fault(
                f"joins {first!r} with itself, expected two bodies; correct one of the names"
            )

    def too_many(self) -> CaseError:
        """Return the error of a document with more elements than are read."""
        return self.fault(
            f"found more than {MOST_ELEMENTS} elements, expected fewer; take out what does not move"
        )

    def findall(self, *tags: str) -> Iterator[Element]:
        """Yield the elements of these tags in it, each of which is read then."""
        self.marks.update(f"<{tag}>" for tag in tags)
        return (child.take() for child in self.children if child.tag in tags)

    def child(self, tag: str) -> Element | None:
        """Return the element of a tag; None without one.

        Raises:
            CaseError: there are several.
        """
        found = [*self.findall(tag)]
        if len(found) > 1:
            raise found[1].fault("found again, expected one; remove the others")
        return found[0] if found else None

    def descendants(self) -> Iterator[Element]:
        """Yield all elements in it, at any depth, in order."""
        waiting = self.children[::-1]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += element.children[::-1]

    def rebuild(self, change: Callable[[Element], Iterable[Element]]) -> Element:
        """Return the element with all below it changed, at any depth, innermost ones first.

        Args:
            change: returns what takes the place of an element.
        """
        open_: list[tuple[Element, Iterator[Element], list[Element]]]
        open_ = [(self, iter(self.children), [])]
        while True:
            element, inside, changed = open_[-1]
            if (child := next(inside, None)) is not None:
                open_.append((child, iter(child.children), []))
                continue
            open_.pop()
            whole = element if changed == element.children else replace(element, children=changed)
            if not open_:
                return whole
            open_[-1][2].extend(change(whole))

    def without_named(self, names: Collection[str], found: list[tuple[str, Element]]) -> Element:
        """Return the element without those in it of a tag, a name or TAG/NAME; add the names that
        are used, with their elements.
        """

        def kept(element: Element) -> Sequence[Element]:
            own = element.attributes.get("name", "")
            called = (element.tag, own, f"{element.tag}/{own}")
            if name := next((each for each in called if each in names), ""):
                found.append((name, element))
                return ()
            return (element,)

        return self.rebuild(kept) if names else self

    def require_known(
        self, known: Sequence[str], format_name: str = "MJCF", *, closed: bool = True
    ) -> None:
        """Refuse unknown attributes, but for declarations of prefixes.

        Args:
            closed: refuse all of them, and not only misspelt known ones.
        """
        for name in self.attributes:
            if name in known or name.startswith("xmlns:"):
                continue
            if closed or similar(name, known, ALIKE):
                raise self.unknown_attribute(name, known, format_name)

    def require_children(self, known: Sequence[str], *, closed: bool = False) -> None:
        """Refuse a mistyped element, which would silently be left out.

        Args:
            closed: others are no extensions but unknown, unless they have a prefix.

        Raises:
            CaseError: an element is unknown, or almost one of the known ones.
        """
        for child in self.children:
            if child.tag in known:
                continue
            prefix, colon, name = child.tag.rpartition(":")
            alike = [
                each.removeprefix(prefix + colon)
                for each in known
                if each.startswith(prefix + colon) and (colon or ":" not in each)
            ]
            mistyped = similar(name, alike, ALIKE)
            if mistyped or (closed and not (colon and self.tag in EXTENDED)):
                raise self.unknown_child(child, alike)

    def unknown_child(self, child: Element, known: Sequence[str]) -> CaseError:
        """Return the error of an unknown element in it."""
        name = child.tag.rpartition(":")[2]
        foreign = ":" in child.tag or (self.tag in EXTENDED and not similar(name, known, ALIKE))
        leave = f" (--without {child.tag} leaves it out)" * foreign
        return child.fault(f"unknown in <{self.tag}>{leave}; {remedy(name, known)}")

    def unknown_attribute(self, name: str, known: Collection[str], format_name: str) -> CaseError:
        """Return the error of an unknown attribute."""
        return self.fault(
            f"found the attribute {shown(name)}, which {format_name} does not have here;"
            f" {remedy(name, known)}"
        )

    def numbers(
        self, name: str, *counts: int, default: Sequence[float] | None = None
    ) -> tuple[float, ...]:
        """Return the numbers of an attribute, in one of the allowed counts.

        Raises:
            CaseError: missing without a default, a wrong count, or an unusable number.
        """
        text = self.attributes.get(name)
        if text is not None:
            advice = "expand its macros: xacro FILE" if "${" in text else "correct the attribute"
            return self._parse(text, counts, f"{name}: ", advice)
        if default is None:
            raise self.fault(f"{name}: missing, expected {_numbers(counts)}; add the attribute")
        return tuple(default)

    def number(self, name: str, default: float | None = None) -> float:
        """Return the number of an attribute; see `numbers`."""
        return self.numbers(name, 1, default=None if default is None else (default,))[0]

    def text_numbers(
        self, *counts: int, default: Sequence[float] | None = None
    ) -> tuple[float, ...]:
        """Return the numbers in the text, in one of the allowed counts.

        Raises:
            CaseError: a wrong count, or an unusable number.
        """
        if not self.text and default is not None:
            return tuple(default)
        return self._parse(self.text, counts, "", "correct the text")

    def value(
        self, tag: str, count: int, default: Sequence[float] | None = None
    ) -> tuple[float, ...]:
        """Return the numbers of the child of a tag, in its text or its attribute `value`.

        Raises:
            CaseError: it is missing without a default, a wrong count, or an unusable number.
        """
        child = self.child(tag)
        if child is None and default is not None:
            return tuple(default)
        if child is None:
            raise self.fault(f"<{tag}>: missing, expected {count} numbers; add it")
        if "value" in child.attributes:
            return child.numbers("value", count)
        return child.text_numbers(count)

    def child_number(self, tag: str, default: float) -> float:
        """Return the number of the child of a tag; see `value`."""
        return self.value(tag, 1, (default,))[0]

    def child_vector(self, tag: str) -> Vec3:
        """Return the three numbers of the child of a tag, zeros without one; see `value`."""
        return vec(self.value(tag, 3, ZEROS))

    def child_text(self, tag: str) -> str:
        """Return the text of the child of a tag; empty without one."""
        child = self.child(tag)
        return "" if child is None else child.text

    def require(self, name: str) -> str:
        """Return an attribute.

        Raises:
            CaseError: it is missing or empty.
        """
        if not (found := self.attributes.get(name)):
            raise self.fault(f"{name}: missing, expected a name; add the attribute")
        return found

    def _parse(
        self, text: str, counts: Sequence[int], before: str, advice: str
    ) -> tuple[float, ...]:
        try:
            found = tuple(map(decimal, text.split()))
        except ValueError:
            found = (math.nan,)
        if len(found) not in counts or not all(map(usable, found)):
            raise self.fault(f"{before}found {shown(text)}, expected {_numbers(counts)}; {advice}")
        return found

    def direction(self, numbers: Sequence[float], name: str = "xyz") -> Vec3:
        """Return the direction of three numbers, length one.

        Raises:
            CaseError: they are zero.
        """
        self.require_nonzero(numbers, name)
        return unit_vector(numbers)

    def require_nonzero(self, numbers: Sequence[float], name: str) -> None:
        """Refuse a vector or quaternion of zeros."""
        if math.hypot(*numbers) < 1e-10:  # as MuJoCo has it: shorter axes point anywhere
            raise self.fault(f"{name}: found zero, of no direction, expected another; correct it")

    def choice(self, name: str, known: Sequence[str], default: str) -> str:
        """Return an attribute with one of a few values."""
        found = self.attributes.get(name, default)
        if found not in known:
            raise self.unknown_name(name, found, known, f"one of {', '.join(known)}")
        return found

    def flag(self, name: str, *, default: bool) -> bool:
        """Return an attribute that is true or false."""
        return self.choice(name, ("true", "false"), str(default).lower()) == "true"


@dataclass(frozen=True)
class Apart:
    """The names of a format without meaning for kinematics.

    Attributes:
        format_name: for messages.
        names: attributes, and tags of elements in pointed brackets, by the tag of the element they
            are in, or by two tags, "equality joint"; those of "" are anywhere.
        extended: elements in which programs put their own attributes and elements, which are
            counted.
    """

    format_name: str
    names: Mapping[str, Collection[str]]
    extended: Collection[str] = EXTENDED


@dataclass(frozen=True)
class Account:
    """How many elements, attributes and texts of a file are read, and how many are left out.

    Attributes:
        left_out: of those left out, the ones to list, by name.
    """

    read: int
    left: int
    left_out: Counter[str]


def settle(root: Element, apart: Apart) -> Account:
    """Return the account of a document after its reading.

    Raises:
        CaseError: something in it is neither read, nor known to mean nothing for kinematics.
    """
    read, left, left_out = 1, 0, Counter[str]()
    waiting = [("", root)]
    while waiting:
        around, element = waiting.pop()
        own = apart.names.get(f"{around} {element.tag}") or apart.names.get(element.tag, ())
        known = {*apart.names.get("", ()), *own}
        extended = element.tag in apart.extended
        unasked = element.unasked
        read += len(element.attributes) - len(unasked)
        left += len(unasked)
        for name in unasked:
            if name in known or name.partition(":")[0] == "xmlns":
                continue
            alike = sorted({*element.asked, *(each for each in known if each[0] != "<")})
            if not extended or similar(name, alike, ALIKE):
                raise element.unknown_attribute(name, alike, apart.format_name)
            left_out[f"{name} of {element.tag}"] += 1
        if text := "".join(element.texts).strip():
            unread = TEXT not in element.marks
            read, left = read + (not unread), left + unread
            left_out[f"text {shown(text)} of {element.tag}"] += unread
        inside: list[tuple[str, Element]] = []
        for child in element.children:
            tag = f"<{child.tag}>"
            if TAKEN in child.marks and LEFT not in child.marks:
                inside.append((element.tag, child))
                read += 1
                continue
            left += _size(child)
            if LEFT in child.marks:
                continue
            asked = {each for each in element.marks if each[0] == "<"}
            alike = sorted(each[1:-1] for each in {*known, *asked} if each[0] == "<")
            foreign = extended and ":" in child.tag and not similar(child.tag, alike, ALIKE)
            if tag not in known and not foreign:
                raise element.unknown_child(child, alike)
            # a plain setting says nothing that its table of names does not
            left_out[child.tag] += foreign or bool(child.children or child.attributes)
        waiting += inside[::-1]
    return Account(read, left, +left_out)


def _size(element: Element) -> int:
    """Return the number of elements, attributes and texts in an element, itself included."""
    return sum(
        1 + len(each.attributes) + bool("".join(each.texts).strip())
        for each in (element, *element.descendants())
    )


def _numbers(counts: Sequence[int]) -> str:
    return f"{' or '.join(map(str, counts))} numbers"


class Names(set[str]):
    """Names that are taken."""

    def __init__(self, *names: Iterable[str]) -> None:
        super().__init__(*names)
        self._again = Counter[str]()

    def new(self, wanted: str) -> str:
        """Return a name unlike all of them, and take it."""
        name = wanted
        while name in self:
            self._again[wanted] += 1
            count = self._again[wanted]
            name = f"{wanted}'{count if count > 1 else ''}"
        self.add(name)
        return name


def parse_xml(file: Path, text: str) -> Element:
    """Return the root element of a text.

    Raises:
        CaseError: not well-formed, nested too deeply, of too many elements, or with a document
            type, which models have none of and which may hold entities.
    """
    # a declared encoding is not looked up: the text has been decoded, and Python knows encodings
    # that expat cannot take
    parser = expat.ParserCreate("utf-8")
    roots: list[Element] = []
    open_: list[Element] = []
    count, bodies = 0, 0

    def start(tag: str, attributes: Mapping[str, str]) -> None:
        element = Element(file, tag, attributes, parser.CurrentLineNumber)
        nonlocal count, bodies
        count += 1
        if count > MOST_ELEMENTS:
            raise element.too_many()
        bodies += tag in _CARRYING
        for depth, deepest in ((len(open_) - bodies, DEEPEST), (bodies, DEEPEST_BODY)):
            if depth >= deepest:
                raise element.fault(
                    f"nested more than {deepest} deep, expected the tree of a mechanism; correct"
                    " the file"
                )
        for name in (tag, *attributes.values()):
            if not name.isprintable():
                raise element.fault(
                    f"found {shown(name)}, expected printable text; remove the control characters"
                )
        (open_[-1].children if open_ else roots).append(element)
        open_.append(element)

    def text_in(part: str) -> None:
        if open_:
            open_[-1].texts.append(part)

    def refuse(*_: object) -> None:
        raise fault(
            file,
            f"line {parser.CurrentLineNumber}",
            "found <!DOCTYPE>, expected none: it can hold entities, which are not expanded;"
            " remove it",
        )

    def end(tag: str) -> None:
        nonlocal bodies
        bodies -= tag in _CARRYING
        open_.pop()

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = text_in
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(_without_declaration(text).encode("utf-8"), True)
    except expat.ExpatError as error:
        raise fault(
            file,
            f"line {error.lineno}",
            f"not valid XML: {expat.ErrorString(error.code)}; correct the syntax",
        ) from None
    return roots[0]


def file_near(folder: Path, name: str, suffixes: Collection[str]) -> Path | None:
    """Return a file that a model in a folder names: in this folder or below, or with one of these
    suffixes in the folder above or below; None of any other place, whether it is there or not.
    """
    try:
        file = (folder / name).resolve()
    except (OSError, ValueError, RuntimeError):  # a null byte, a loop of links
        return None
    around = folder.parent
    beside = file.suffix.lower() in suffixes and around != around.parent
    near = file.is_relative_to(folder) or (beside and file.is_relative_to(around))
    return file if name and near and not Path(name).is_absolute() else None


def _without_declaration(text: str) -> str:
    """Return a text without its declaration, which other parsers take after white space too."""
    found = re.match(r"\s*<\?xml\b[^>]*\?>", text)
    return text if found is None else "\n" * found[0].count("\n") + text[found.end() :]


# What prints numbers writes six digits and more; fewer are a designer's own numbers.
_FEWEST = 6
# Digits of numbers in single precision.
_SINGLE = 7
_PLACES = words(
    "pos axis anchor relpose fromto xyz rpy quat axisangle xyaxes zaxis euler "
    "physics:localPos0 physics:localPos1 physics:localRot0 physics:localRot1"
)
# Elements of SDF and OpenSim, whose texts are places.
_TEXTS = words("pose xyz translation orientation location_body_1 location_body_2")
_NUMBER = re.compile(r"[-+]?0*\.?0*([0-9][0-9.]*)(?:[eE][-+]?[0-9]+)?")


def significant_digits(root: Element) -> int:
    """Return `printed_digits` of a model; one without any is taken to have six."""
    return printed_digits(root) or _FEWEST


def printed_digits(root: Element) -> int:
    """Return the number of significant digits of the places of a model, without zeros at the end.

    Numbers of six digits and more count, half of which have as many or more; 0 without any, whose
    numbers are a designer's own.
    """
    counts: list[int] = []
    for element in root.descendants():
        texts = [text for name, text in element.attributes.items() if name in _PLACES]
        texts += ["".join(element.texts)] * (element.tag in _TEXTS)
        for found in map(_NUMBER.fullmatch, " ".join(texts).split()):
            if found and (count := len(found[1].replace(".", "").rstrip("0"))) >= _FEWEST:
                counts.append(count)
    digits = int(statistics.median(counts)) if counts else 0
    return min(digits, _SINGLE) if root.tag == USD else digits
