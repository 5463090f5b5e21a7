"""Models of links in files: what tells each format, and its tree."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ...case.io.readers import WITHOUT, Reader, ReaderOptions, readers, text_of
from ...doors import Offer
from . import EXTENSION
from .options import ModelOptions

if TYPE_CHECKING:
    from collections.abc import Collection

    from ...case.case import Case
    from ..xml.element import Element
    from .tree import Tree


@dataclass(frozen=True)
class TreeReader(Reader):
    """A reader of models of links in one format.

    Attributes:
        tag: of the root element.
        reads: function for the tree of links of a whole document.
        includes: function for a document with all that it includes; None if it includes nothing.
        opens: function for the root element of a file; None for XML.
    """

    kind: str = "model"
    options: type[ReaderOptions] = ModelOptions
    tag: str = ""
    reads: Offer = field(kw_only=True)
    includes: Offer | None = None
    opens: Offer | None = None

    def root(self, file: Path) -> Element:
        """Return the root element of a file; a format that is no XML makes elements of it.

        Raises:
            CaseError: it is not well-formed.
            KincheckError: a library is missing.
        """
        from ..xml.element import parse_xml

        return self.opens.load()(file) if self.opens else parse_xml(file, text_of(file))

    def tree(self, root: Element) -> Tree:
        """Return the tree of links of a whole document.

        Raises:
            CaseError: something in it makes no sense.
        """
        return self.reads.load()(root)

    def whole(self, root: Element) -> Element:
        """Return a document with all that it includes."""
        return self.includes.load()(root) if self.includes else root

    def read(self, file: Path, options: ModelOptions) -> Case:
        """Return the case of a model, driven and held as the options say."""
        from .case import case_of

        tree = read_tree(file, options.without)
        require_used(file, options.without, tree.without)
        return case_of(tree, options)


@dataclass(frozen=True)
class _Mjcf(TreeReader):
    def claims(self, file: Path, text: str, options: ModelOptions) -> int:
        """Return how surely a text is XML, whose root says more."""
        return 2 * text.lstrip().startswith("<")


_WRITE = "cannot be read; write it out as MJCF, URDF, SDF or USD from the program that made it"
_SHAPES = "holds shapes, which say nothing of joints; give the model that names it"
_PROGRAMS = (".mo", ".slx", ".sldasm", ".iam", ".catproduct")
_MESHES = (
    *(".step", ".stp", ".stl", ".obj", ".dae", ".iges", ".igs", ".fbx", ".glb", ".gltf", ".wrl"),
)
MJCF = _Mjcf(
    suffixes=(".xml", ".mjcf"),
    unread={
        ".mjb": "is compiled; give the MJCF that it is made of",
        **dict.fromkeys(_PROGRAMS, _WRITE),
        **dict.fromkeys(_MESHES, _SHAPES),
    },
    tag="mujoco",
    reads=Offer(EXTENSION, "mjcf:read_mjcf"),
    includes=Offer(EXTENSION, "mjcf:whole_mjcf"),
)
URDF = TreeReader(
    suffixes=(".urdf",),
    unread={
        ".constraints.json": "holds the loops of a URDF beside it; give that file, NAME.urdf",
        ".xacro": "holds macros; expand them: xacro FILE > robot.urdf",
    },
    tag="robot",
    reads=Offer(EXTENSION, "urdf:read_urdf"),
)
SDF = TreeReader(
    suffixes=(".sdf", ".world"),
    tag="sdf",
    reads=Offer(EXTENSION, "sdf:read_sdf"),
    includes=Offer(EXTENSION, "sdf:whole_sdf"),
)


def is_model(file: Path) -> bool:
    """Return whether a file is a model of links."""
    from ...case.models.files import reader_of

    return isinstance(reader_of(file), TreeReader)


def root_of(file: Path) -> Element:
    """Return the root element of a model.

    Raises:
        CaseError: it is no model.
        KincheckError: a library is missing.
    """
    suffix = file.suffix.lower()
    return next((each for each in _formats() if suffix in each.suffixes), MJCF).root(file)


def read_tree(file: Path, without: Collection[str] = ()) -> Tree:
    """Return the links of a model, in the format of its root.

    Args:
        without: elements to leave out, by tag, name or TAG/NAME; the tree has those it found.

    Raises:
        CaseError: it is no such model, or something in it makes no sense.
    """
    from .loop_files import unread_beside

    root = root_of(file)
    reader = next((each for each in _formats() if each.tag == root.tag), MJCF)
    omitted: list[tuple[str, Element]] = []
    tree = reader.tree(reader.whole(root).without_named(without, omitted))
    tree.without = {name for name, _ in omitted}
    if reader is not URDF:
        tree.notes += unread_beside(file)
    if omitted:
        tree.notes.append(f"{WITHOUT}{', '.join(str(each) for _, each in omitted)}")
    return tree


def require_used(file: Path, without: Collection[str], used: Collection[str]) -> None:
    """Refuse names of elements to leave out, of which a model has none.

    Raises:
        CaseError: there is one.
    """
    from ...case.io.document import unknown_name

    for name in without:
        if name not in used:
            elements = [*root_of(file).descendants()]
            known = {each.tag for each in elements}
            known |= {each.attributes.get("name", each.tag) for each in elements}
            raise unknown_name(file, "--without", name, known, "an element of the file")


def _formats() -> list[TreeReader]:
    return [each for each in readers() if isinstance(each, TreeReader)]
