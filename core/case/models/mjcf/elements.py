"""Elements of an XML file somebody wrote: attributes and lines, no entities, no document types, a
bounded depth.

Every element is read once, by taking its attributes; attributes unknown to MJCF are refused,
because a mistyped one would silently fall back to its default.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ....errors import CaseError, remedy, similar
from ...io.document import decimal, fault, shown, unknown_name, usable

# Robots are some ten bodies deep; what nests beyond this only exhausts the stack.
DEEPEST = 200
# Each takes some microseconds and a kilobyte.
MOST_ELEMENTS = 200_000
# Two words are alike if a typing error makes one of the other.
ALIKE = 0.75


@dataclass(frozen=True, eq=False)
class Element:
    """An element: its tag, its attributes, the elements and texts in it, and its first line."""

    file: Path
    tag: str
    attributes: Mapping[str, str]
    line: int
    children: Sequence[Element] = field(default_factory=list["Element"])
    texts: list[str] = field(default_factory=list[str])

    @property
    def text(self) -> str:
        """The text in the element, without its ends."""
        return "".join(self.texts).strip()

    def __str__(self) -> str:
        name = self.attributes.get("name")
        return f"line {self.line}: <{self.tag}>" + (f" {name!r}" if name else "")

    def fault(self, problem: str) -> CaseError:
        """The error to raise: 'FILE: line N: <TAG> NAME: PROBLEM'."""
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

    def too_many(self) -> CaseError:
        """Return the error of a document with more elements than are read."""
        return self.fault(
            f"found more than {MOST_ELEMENTS} elements, expected fewer; take out what does not move"
        )

    def only(self, *tags: str) -> Iterator[Element]:
        """The elements of these tags in it."""
        return (child for child in self.children if child.tag in tags)

    def below(self) -> Iterator[Element]:
        """All elements in it, at any depth, in order."""
        for child in self.children:
            yield child
            yield from child.below()

    def require_known(
        self, known: Sequence[str], format_name: str = "MJCF", *, closed: bool = True
    ) -> None:
        """Refuse unknown attributes, but for declarations of prefixes.

        Args:
            closed: refuse all of them, and not only those that are almost known ones.
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

    def numbers(
        self, name: str, counts: Sequence[int], default: Sequence[float] | None = None
    ) -> tuple[float, ...]:
        """Return the numbers of an attribute, in one of the allowed counts.

        Raises:
            CaseError: missing without a default, a wrong count, or an unusable number.
        """
        text = self.attributes.get(name)
        expected = f"{' or '.join(map(str, counts))} numbers"
        if text is None:
            if default is None:
                raise self.fault(f"{name}: missing, expected {expected}; add the attribute")
            return tuple(default)
        try:
            found = tuple(map(decimal, text.split()))
        except ValueError:
            found = (math.nan,)
        if len(found) not in counts or not all(map(usable, found)):
            advice = "expand its macros: xacro FILE" if "${" in text else "correct the attribute"
            raise self.fault(f"{name}: found {shown(text)}, expected {expected}; {advice}")
        return found

    def choice(self, name: str, known: Sequence[str], default: str) -> str:
        """Return an attribute with one of a few values."""
        found = self.attributes.get(name, default)
        if found not in known:
            raise self.unknown_name(name, found, known, f"one of {', '.join(known)}")
        return found


def unlike(wanted: str, *taken: Container[str], again: Counter[str]) -> str:
    """Return a name unlike all that are taken.

    Args:
        again: how often each name was wanted again; it is counted on.
    """
    name = wanted
    while any(name in names for names in taken):
        again[wanted] += 1
        name = f"{wanted}'{again[wanted] if again[wanted] > 1 else ''}"
    return name


def _without_declaration(text: str) -> str:
    """Return a text without its declaration, which other parsers take after white space too."""
    found = re.match(r"\s*<\?xml\b[^>]*\?>", text)
    return text if found is None else "\n" * found[0].count("\n") + text[found.end() :]


def parse_xml(file: Path, text: str) -> Element:
    """The root element of a text.

    Raises:
        CaseError: not well-formed, nested too deeply, of too many elements, or with a document
            type, which MJCF has none of and which may hold entities.
    """
    # a declared encoding is not looked up: the text has been decoded, and Python knows encodings
    # that expat cannot take
    parser = expat.ParserCreate("utf-8")
    roots: list[Element] = []
    open_: list[Element] = []
    inside: list[list[Element]] = []
    count = 0

    def start(tag: str, attributes: Mapping[str, str]) -> None:
        children: list[Element] = []
        element = Element(file, tag, attributes, parser.CurrentLineNumber, children)
        nonlocal count
        count += 1
        if count > MOST_ELEMENTS:
            raise element.too_many()
        if len(open_) >= DEEPEST:
            raise element.fault(
                f"nested more than {DEEPEST} deep, expected the tree of a mechanism; correct the"
                " file"
            )
        for name in (tag, *attributes.values()):
            if not name.isprintable():
                raise element.fault(
                    f"found {shown(name)}, expected printable text; remove the control characters"
                )
        (inside[-1] if open_ else roots).append(element)
        inside.append(children)
        open_.append(element)

    def text_in(part: str) -> None:
        if open_:
            open_[-1].texts.append(part)

    def end(_: str) -> None:
        open_.pop()
        inside.pop()

    def refuse(*_: object) -> None:
        line = f"line {parser.CurrentLineNumber}"
        raise fault(
            file,
            line,
            "found <!DOCTYPE>, expected none: it can hold entities, which are not expanded;"
            " remove it",
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = end
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
    (root,) = roots
    return root
