"""Models that a document of SDF includes, from files and folders beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ...io.case_file import LARGEST_FILE
from ...io.document import read_text, shown
from .element import Element, file_near, parse_xml
from .sdf import AXES_IN_JOINT, FLAGS, TRUE, text_of, version_of

_PLACED = "placement_frame"
MOST_INCLUDES, _SUFFIXES = 100, (".sdf", ".world", ".config")
_WRITE_OUT = "write the whole model out: gz sdf -p FILE > flat.sdf"


def whole_sdf(file: Path, root: Element) -> Element:
    """Return a document with the models that it includes from files beside it.

    Raises:
        CaseError: a model is elsewhere, or an option of its inclusion is not read.
    """
    folder = file.parent.resolve()
    return _Inclusion(folder, folder.parent, version_of(root)).whole(root)


@dataclass
class _Inclusion:
    """The inclusion of models.

    Attributes:
        folder: of the document that includes.
        around: all files are in here.
        version: of SDF.
        count: how many are included so far, at any depth.
    """

    folder: Path
    around: Path
    version: tuple[int, ...]
    count: int = 0

    def whole(self, around: Element) -> Element:
        """Return an element with included models in place of <include>, at any depth."""
        if not any(each.tag == "include" for each in around.below()):
            return around
        found = [
            self._model(each) if each.tag == "include" else self.whole(each)
            for each in around.children
        ]
        return replace(around, children=found)

    def _model(self, element: Element) -> Element:
        element.require_known(("merge",), "SDF")
        if element.choice("merge", FLAGS, "false") in TRUE or any(element.only(_PLACED)):
            raise element.fault(f"has merge or <{_PLACED}>, which are not read; {_WRITE_OUT}")
        element.require_children(("uri", "name", "pose", "static", "plugin"), closed=True)
        self.count += 1
        if self.count > MOST_INCLUDES:
            raise element.fault(f"found more than {MOST_INCLUDES} includes, or a ring of them")
        file = self._file(element, text_of(element, "uri"))
        root = parse_xml(file, read_text(file, LARGEST_FILE, "it holds one model"))
        models = [*root.only("model")]
        if root.tag != "sdf" or len(models) != 1:
            raise element.fault(
                f"{file.name}: found <{root.tag}> with {len(models)} models, expected <sdf> with"
                f" one; {_WRITE_OUT}"
            )
        if (version_of(root) < AXES_IN_JOINT) != (self.version < AXES_IN_JOINT):
            raise element.fault(
                f"{file.name}: is of SDF {root.attributes.get('version')}, whose axes have another"
                f" meaning than those of the file around it; {_WRITE_OUT}"
            )
        folder, self.folder = self.folder, file.parent
        model = self.whole(models[0])
        self.folder = folder
        own = [*element.only("pose", "static", "plugin")]
        given = {each.tag for each in own if each.tag != "plugin"}
        children = [*own, *(each for each in model.children if each.tag not in given)]
        attributes = dict(model.attributes)
        if name := element.child("name"):
            attributes["name"] = name.text
        return replace(model, attributes=attributes, children=children)

    def _file(self, element: Element, uri: str) -> Path:
        """Return the file of a model: the URI's own, or that named by the folder's model.config."""
        kind, _, path = uri.rpartition("://")
        names = [f"../{path}", path] if kind == "model" else [path]
        places = [file_near(self.folder, name, _SUFFIXES) for name in names]
        if kind in ("model", ""):
            # a folder beside the document's has no suffix
            places += [
                file_near(self.folder, f"{name}/{inside}", _SUFFIXES)
                for name in names
                for inside in ("model.config", "model.sdf")
            ]
        near = [each for each in places if each and each.is_relative_to(self.around)]
        found = [each for each in near if each.is_file()]
        if not found or kind not in ("model", "file", ""):
            raise element.fault(
                f"uri: found {shown(uri)}, expected a model in the folder of the file, in one"
                f" beside it or below, and there is none; put it there, or {_WRITE_OUT}"
            )
        if found[0].suffix != ".config":
            return found[0]
        config = parse_xml(found[0], read_text(found[0], LARGEST_FILE, "it describes one model"))
        files = [*config.only("sdf")]
        newest = max(files, key=version_of, default=config)
        file = file_near(found[0].parent, newest.text, _SUFFIXES)
        if file is None or not file.is_file():
            raise newest.fault(f"found {shown(newest.text)}, expected a file beside it; correct it")
        return file
