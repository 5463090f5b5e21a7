"""Elements in place of others: <include> for those of a file beside, <replicate> for copies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from os.path import isfile
from pathlib import Path

from ....algebra import ZERO, vec
from ...io.case_file import LARGEST_FILE
from ...io.document import read_text, shown
from .attributes import KNOWN, WRITE_OUT
from .elements import DEEPEST, MOST_ELEMENTS, Element, parse_xml
from .frames import Compiler, Place, euler_turn, read_compiler

MODELS = (".xml", ".mjcf")
MOST_INCLUDES, MOST_COPIES = 100, 1_000


@dataclass
class Expansion:
    """The elements of a model of several files.

    Attributes:
        root: file of the model; includes are in the folder around its own one, or below.
        compiler: how the model writes angles; without it, copies are not made yet.
        taken: included files; each may be included once.
        bytes: how many were read.
        elements: how many there are.
    """

    root: Path
    compiler: Compiler | None = None
    taken: set[Path] = field(default_factory=set[Path])
    bytes: int = 0
    elements: int = 0

    def children(self, around: Element, depth: int = 0) -> list[Element]:
        """Return the elements in one, expanded at any depth.

        Raises:
            CaseError: a file is missing, elsewhere or taken twice, a replicate makes no sense, or
                there is too much of either.
        """
        if depth > DEEPEST:
            raise around.fault(
                f"nested more than {DEEPEST} deep with its includes, expected the tree of a"
                " mechanism; correct the file"
            )
        found: list[Element] = []
        for child in around.children:
            match child.tag:
                case "include":
                    found += self.children(self._included(child), depth + 1)
                case "replicate" if self.compiler is not None:
                    inside = self.children(child, depth + 1)
                    found += self._copies(child, inside, self.compiler)
                case _ if child.children:
                    found.append(replace(child, children=self.children(child, depth + 1)))
                case _:
                    found.append(child)
            self.elements += 1
            if self.elements > MOST_ELEMENTS:
                raise child.too_many()
        return found

    def _included(self, element: Element) -> Element:
        element.require_known(("file",))
        name = element.attributes.get("file", "")
        folder = self.root.parent.resolve()
        try:
            file = (folder / name).resolve()
            inside = bool(name) and not Path(name).is_absolute() and _near(file, folder)
        except (OSError, ValueError, RuntimeError):  # a null byte, a loop of links
            file, inside = folder, False
        if not inside:
            raise element.fault(
                f"file: found {shown(name)}, expected a file in the folder of the model, in one"
                f" beside it or below, and no other is opened; put it there, or {WRITE_OUT}"
            )
        if file in self.taken or len(self.taken) == MOST_INCLUDES:
            raise element.fault(
                f"file: found {shown(name)} again, and MuJoCo includes each file once; remove it"
                if file in self.taken
                else f"found more than {MOST_INCLUDES} includes, expected fewer; {WRITE_OUT}"
            )
        if not isfile(file):
            raise element.fault(f"file: found {shown(name)}, but there is no such file; check it")
        self.taken.add(file)
        text = read_text(file, LARGEST_FILE - self.bytes, "take out what is not the mechanism")
        self.bytes += len(text)
        return parse_xml(file, text)

    def _copies(
        self, element: Element, inside: list[Element], compiler: Compiler
    ) -> Iterator[Element]:
        """Yield the copies in frames, with names of their own.

        Each is at the offset from the one before, in that one's axes; its Euler angles are as many
        times the given ones as there are copies before it (measured: MuJoCo 4.0).
        """
        element.require_known(KNOWN["replicate"])
        text = element.attributes.get("count", "")
        if not (text.isascii() and text.isdigit() and 0 < int(text[:9]) <= MOST_COPIES):
            raise element.fault(
                f"count: found {shown(text)}, expected a number of copies, 1 to {MOST_COPIES};"
                " correct it"
            )
        count, separator = int(text), element.attributes.get("sep", "")
        offset = element.numbers("offset", (3,), (0.0, 0.0, 0.0))
        turn = element.numbers("euler", (3,), (0.0, 0.0, 0.0))
        self.elements += count * sum(1 + sum(1 for _ in each.below()) for each in inside)
        if self.elements > MOST_ELEMENTS:
            raise element.fault(f"makes more than {MOST_ELEMENTS} elements; lower its count")
        digits, at = len(str(count - 1)), ZERO
        for k in range(count):
            place = Place(at, euler_turn([k * angle for angle in turn], compiler))
            named = [_renamed(each, f"{separator}{k:0{digits}}") for each in inside]
            attributes = {"pos": _numbers(place.at), "quat": _numbers(place.turn)}
            if "childclass" in element.attributes:
                attributes["childclass"] = element.attributes["childclass"]
            yield replace(element, tag="frame", attributes=attributes, children=named)
            at = place.point(vec(offset))


def _near(file: Path, folder: Path) -> bool:
    """Return whether a file is in a folder or below, or a model below the folder above."""
    around = folder.parent
    beside = file.suffix.lower() in MODELS and around != around.parent
    return file.is_relative_to(folder) or (beside and file.is_relative_to(around))


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in values)


def _renamed(element: Element, suffix: str) -> Element:
    own = element.attributes
    name = {"name": own["name"] + suffix} if own.get("name") else {}
    return replace(
        element,
        attributes={**own, **name},
        children=[_renamed(each, suffix) for each in element.children],
    )


def expanded(file: Path, root: Element) -> Element:
    """Return the model without includes and replicates.

    Raises:
        CaseError: see `Expansion.children`, and the settings of the compiler.
    """
    whole = replace(root, children=Expansion(file.resolve()).children(root))
    return replace(whole, children=Expansion(file.resolve(), read_compiler(whole)).children(whole))
