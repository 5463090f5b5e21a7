"""Elements of an XML file of any origin: attributes, texts and lines, no entities, no
document types, a bounded depth.

A mistyped attribute or element would silently fall back to its default, so unknown ones are
refused.
"""

from __future__ import annotations

import math
import re
import statistics
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.parsers import expat

from ...algebra import Vec3, vec
from ...case.io.document import decimal, fault, shown, unknown_name, usable
from ...errors import CaseError, remedy, similar
from .place import unit_vector

# Elements are some ten deep; but bodies of MJCF are in the bodies that carry them.
DEEPEST, DEEPEST_BODY = 200, 5_000
_CARRYING = ("body", "frame")
# Each takes some microseconds and a kilobyte.
MOST_ELEMENTS = 200_000
# Two words are alike if a typing error makes one of the other.
ALIKE = 0.75
ZEROS = (0.0, 0.0, 0.0)
USD = "usd"
"""Tag of the root of a stage of USD, whose numbers are in single precision."""
EXTENDED = ("robot", "link", "model", "world")
"""Elements in which programs put their own ones."""


def words(text: str) -> tuple[str, ...]:
    """Return the words of a text, for tables of names."""
    return tuple(text.split())


@dataclass(frozen=True, eq=False)
class Element:
    """An element, or a place in a file beside that is no XML.

    Attributes:
        line: its first one.
        texts: parts of the text in it.
        words: its place in messages, if it is not its line.
    """

    file: Path
    tag: str
    attributes: Mapping[str, str]
    line: int
    children: list[Element] = field(default_factory=list["Element"])
    texts: list[str] = field(default_factory=list[str])
    words: str = ""

    @property
    def text(self) -> str:
        """The text in the element, without its ends."""
        return "".join(self.texts).strip()

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
        """Yield the elements of these tags in it."""
        return (child for child in self.children if child.tag in tags)

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
                raise self.fault(
                    f"found the attribute {shown(name)}, which {format_name} does not have"
                    " here;"
                    f" {remedy(name, known)}"
                )

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
            if mistyped or (closed and not colon):
                can_leave = self.tag in EXTENDED and not mistyped
                leave = f" (--without {child.tag} leaves it out)" * can_leave
                raise child.fault(f"unknown in <{self.tag}>{leave}; {remedy(name, alike)}")

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
        texts = [element.attributes.get(name, "") for name in _PLACES]
        texts += [element.text] * (element.tag in _TEXTS)
        for found in map(_NUMBER.fullmatch, " ".join(texts).split()):
            if found and (count := len(found[1].replace(".", "").rstrip("0"))) >= _FEWEST:
                counts.append(count)
    digits = int(statistics.median(counts)) if counts else 0
    return min(digits, _SINGLE) if root.tag == USD else digits
