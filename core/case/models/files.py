"""Choice of the reader of a file, by its suffix and content."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import with_article
from ..case import Case
from ..io.case_file import LARGEST_FILE, load_case
from ..io.document import fault, parse, read_text
from ..io.reader_options import NOTHING, Supplied
from ..io.table import WORKBOOKS

if TYPE_CHECKING:
    from .hardpoints.table import HardpointTable

CASE_FILES = (".toml", ".json")
TABLES = (".csv", ".tsv", ".tab", ".dat", ".prn", ".m", ".hpts")
TREES = (".yaml", ".yml")
ADAMS_FILES = (".sub", ".tpl", ".asy", ".hpt")
MODELS = (".xml", ".mjcf", ".urdf", ".sdf", ".world")
SUFFIXES = (*CASE_FILES, *TABLES, *TREES, *WORKBOOKS, *ADAMS_FILES, *MODELS)
"""Suffixes of names that are files, whether they exist or not."""

CASE, CHRONO, ADAMS, TABLE, TREE, WORKBOOK, MODEL = (
    "case file",
    "Project Chrono suspension",
    "Adams/Car hardpoints",
    "hardpoint table",
    "tree of hardpoints",
    "workbook of hardpoints",
    "model",
)
HARDPOINTS = (CHRONO, ADAMS, TABLE)
UNREAD = {
    ".constraints.json": "holds the loops of a URDF beside it; give that file, NAME.urdf",
    ".xacro": "holds macros; expand them: xacro FILE > robot.urdf",
    ".mjb": "is compiled; give the MJCF that it is made of",
    ".osim": "is a model of OpenSim, which kincheck writes and does not read; give MJCF or a case",
    ".adm": "is a model of Adams/View; give its hardpoints (.sub, .csv), or MJCF, URDF or SDF",
    **dict.fromkeys(
        (
            ".usd",
            ".usda",
            ".usdc",
            ".usdz",
            ".mo",
            ".slx",
            ".sldasm",
            ".iam",
            ".catproduct",
        ),
        "cannot be read; write the model out as MJCF, URDF or SDF from the program that made it",
    ),
    **dict.fromkeys(
        (".step", ".stp", ".stl", ".obj", ".dae", ".iges", ".igs", ".fbx", ".glb", ".gltf", ".wrl"),
        "holds shapes, which say nothing of joints; give the model that names it",
    ),
}
"""Files that people have beside their models, and what to do, by suffix."""
_OF_HARDPOINTS = (
    "template",
    "units",
    "axes",
    "travel",
    "rack",
    "names",
    "wheel-radius",
    "wheelbase",
    "axle",
    "position",
    "cg-height",
    "brake-share",
    "drive-share",
)
_OPTIONS = {
    CASE: ("closure",),
    MODEL: ("drive", "hold", "hold-rest", "start", "closure"),
    **dict.fromkeys(HARDPOINTS, _OF_HARDPOINTS),
    **dict.fromkeys((WORKBOOK, TREE, TABLE), (*_OF_HARDPOINTS, "sheet")),
}


def load(file: Path, supplied: Supplied = NOTHING) -> Case:
    """Read a case from a file of any supported kind.

    Raises:
        CaseError: the file is unreadable, inconsistent or incomplete, or an option is not for such
            files.
    """
    for ending in ("".join(file.suffixes[-2:]), file.suffix):
        if advice := UNREAD.get(ending.lower()):
            raise fault(file, "", f"found a {ending} file, which {advice}")
    kind = kind_of(file, supplied)
    for option in supplied.given:
        if option not in _OPTIONS[kind]:
            known = ", ".join(f"--{name}" for name in _OPTIONS[kind]) or "no such option"
            raise fault(
                file,
                f"--{option}",
                f"found for {with_article(kind)}, which takes {known}; leave it out, or name this"
                " file by itself",
            )
    if kind == CASE:
        return load_case(file, supplied.closure)
    if not file.stem.isprintable():  # it becomes the name of the case
        raise fault(
            file,
            "",
            "found a file name with control characters, expected printable ones; rename the file",
        )
    if kind == MODEL:
        return _model(file, _text(file), supplied)
    from .hardpoints.read import case_of_hardpoints

    return case_of_hardpoints(_hardpoints(file, kind, supplied), supplied)


def read_hardpoints(file: Path, supplied: Supplied = NOTHING) -> HardpointTable:
    """Read the table of hardpoints of a file.

    Raises:
        CaseError: the file is unreadable, or no table of hardpoints.
    """
    if not is_table(file, supplied):
        raise fault(file, "", "is no table of hardpoints; give a table, such as car.csv")
    return _hardpoints(file, kind_of(file, supplied), supplied)


def is_table(file: Path, supplied: Supplied = NOTHING) -> bool:
    """Return whether a file is a table of hardpoints."""
    return kind_of(file, supplied) in (*HARDPOINTS, WORKBOOK, TREE)


def _model(file: Path, text: str, supplied: Supplied) -> Case:
    """Return the case of a model in XML: MJCF, URDF or SDF, whatever the file is called."""
    from .mjcf.elements import parse_xml
    from .mjcf.read import Document, case_of, read_mjcf

    root = parse_xml(file, text)
    match root.tag:
        case "robot":
            from .robots.urdf import read_urdf

            robot = read_urdf(file, root)
        case "sdf":
            from .robots.sdf import read_sdf

            robot = read_sdf(root)
        case _:
            return read_mjcf(file, root, supplied)
    from .robots.as_mjcf import as_mjcf

    name = root.attributes.get("name", file.stem)
    beside = f" with {', '.join(robot.beside)}" if robot.beside else ""
    described = f"{robot.format} {name!r} of {file.name}{beside}"
    zero, closed = "its zero pose", not robot.paired
    document = Document(described, as_mjcf(robot), root, robot.left_out, zero, closed)
    return case_of(file, document, supplied)


def _hardpoints(file: Path, kind: str, supplied: Supplied) -> HardpointTable:
    """Return the table of hardpoints of a file."""
    from .hardpoints.programs import read_adams, read_chrono
    from .hardpoints.rows import read_plain, read_spreadsheet
    from .hardpoints.tree import read_tree

    if kind == WORKBOOK:
        return read_spreadsheet(file, supplied.sheet)
    text = _text(file, of_spreadsheet=kind in (TABLE, ADAMS))
    if kind in (TREE, TABLE):
        return {TREE: read_tree, TABLE: read_plain}[kind](file, text, supplied.sheet)
    return {CHRONO: read_chrono, ADAMS: read_adams}[kind](file, text)


def kind_of(file: Path, supplied: Supplied = NOTHING) -> str:
    """Return the kind of a file; an unknown kind is a case file, whose reader states its needs.

    Raises:
        CaseError: a file whose content decides cannot be read.
    """
    suffix = file.suffix.lower()
    if suffix == ".toml":
        return CASE
    if suffix == ".json":
        return _kind_of_json(file, supplied)
    for kind, suffixes in (
        (TABLE, TABLES),
        (TREE, TREES),
        (WORKBOOK, WORKBOOKS),
        (ADAMS, ADAMS_FILES),
        (MODEL, MODELS),
    ):
        if suffix in suffixes:
            return kind
    text = _text(file, of_spreadsheet=True)
    if "[HARDPOINT]" in text:
        return ADAMS
    if text.lstrip().startswith("<"):
        return MODEL
    return TABLE if supplied.template or suffix == ".txt" else CASE


def _kind_of_json(file: Path, supplied: Supplied) -> str:
    from .hardpoints.programs import is_chrono, without_comments
    from .hardpoints.tree import has_points, json_tree

    text = without_comments(_text(file))
    if text.lstrip().startswith("["):
        return TREE
    tables = parse(file, text)
    if "schema" in tables:
        return CASE
    if is_chrono(tables):
        return CHRONO
    return TREE if supplied.template or has_points(json_tree(file, text)) else CASE


def _text(file: Path, *, of_spreadsheet: bool = False) -> str:
    return read_text(
        file,
        LARGEST_FILE,
        "hardpoints and mechanisms need far less; take out what is not geometry",
        of_spreadsheet=of_spreadsheet,
    )
