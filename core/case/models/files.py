"""Choice of the reader of a file, by its suffix and content."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import with_article
from ..case import Case
from ..io.case_file import LARGEST_FILE, load_case
from ..io.document import fault, parse, read_text, unknown_name
from ..io.reader_options import NOTHING, OF_HARDPOINTS, OF_SEVERAL, WITHOUT, Supplied
from ..io.table import WORKBOOKS

if TYPE_CHECKING:
    from ...extensions.hardpoints.table import HardpointTable
    from ...extensions.trees.element import Element
    from ...extensions.trees.tree import Tree

CASE, CHRONO, ADAMS, ASSETTO, TABLE, TREE, WORKBOOK, MODEL, DATASET = (
    "case file",
    "Project Chrono suspension",
    "Adams/Car hardpoints",
    "Assetto Corsa suspension",
    "hardpoint table",
    "tree of hardpoints",
    "workbook of hardpoints",
    "model",
    "dataset of Adams Solver",
)
STAGES, DATASETS = (".usd", ".usda", ".usdc", ".usdz"), (".adm",)
_SUFFIXES = {
    TABLE: (".csv", ".tsv", ".tab", ".dat", ".prn", ".m", ".hpts"),
    TREE: (".yaml", ".yml", ".py"),
    WORKBOOK: WORKBOOKS,
    ADAMS: (".sub", ".tpl", ".asy", ".hpt"),
    MODEL: (".xml", ".mjcf", ".urdf", ".sdf", ".world", ".osim", *STAGES),
    DATASET: DATASETS,
}
_KINDS = {suffix: kind for kind, suffixes in _SUFFIXES.items() for suffix in suffixes}
SUFFIXES = (".toml", ".json", ".ini", ".pm", *_KINDS)
"""Suffixes of names that are files, whether they exist or not."""
UNREAD = {
    ".constraints.json": "holds the loops of a URDF beside it; give that file, NAME.urdf",
    ".pm": "is a suspension of rFactor, whose bars have no names of points; write their ends into a"
    " table, name,x,y,z, with --units m --axes left,up,rearward",
    ".xacro": "holds macros; expand them: xacro FILE > robot.urdf",
    ".mjb": "is compiled; give the MJCF that it is made of",
    ".cmd": "is a script of Adams/View; export the dataset of Adams Solver, .adm",
    ".acf": "holds commands of Adams Solver; give the dataset that it names, .adm",
    **dict.fromkeys(
        (
            ".mo",
            ".slx",
            ".sldasm",
            ".iam",
            ".catproduct",
        ),
        "cannot be read; write it out as MJCF, URDF, SDF or USD from the program that made it",
    ),
    **dict.fromkeys(
        (".step", ".stp", ".stl", ".obj", ".dae", ".iges", ".igs", ".fbx", ".glb", ".gltf", ".wrl"),
        "holds shapes, which say nothing of joints; give the model that names it",
    ),
}
"""Files that people have beside their models, and what to do, by suffix."""
_OF_CASE = re.compile(r"^\s*(?:schema\s*=|\[+\s*(?:bodies|joints|drivers|sweep)\b)", re.MULTILINE)
_OPTIONS = {
    CASE: ("closure",),
    MODEL: ("drive", "hold", "hold-rest", "start", "without", "closure"),
    DATASET: ("drive", "hold", "hold-rest", "without", "closure"),
    **dict.fromkeys((CHRONO, ADAMS), OF_HARDPOINTS),
    **dict.fromkeys((WORKBOOK, TREE, TABLE, ASSETTO), (*OF_HARDPOINTS, *OF_SEVERAL)),
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
    if kind == DATASET:
        from ...extensions.adams.read import read_adams

        return read_adams(file, _text(file, of_spreadsheet=True), supplied)
    if kind == MODEL:
        from ...extensions.trees.case import case_of

        tree = read_tree(file, supplied.without)
        require_used(file, supplied.without, tree.without)
        return case_of(tree, supplied)
    from ...extensions.hardpoints.read import case_of_hardpoints

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
    return kind_of(file, supplied) in (CHRONO, ADAMS, ASSETTO, TABLE, WORKBOOK, TREE)


def read_tree(file: Path, without: Collection[str] = ()) -> Tree:
    """Return the links of a model: USD by its suffix; MJCF, URDF, SDF and OpenSim by their content.

    Args:
        without: elements to leave out, by tag, name or TAG/NAME; the tree has those it found.

    Raises:
        CaseError: it is no such model, or something in it makes no sense.
    """
    root = root_of(file)
    match root.tag:
        case "robot":
            from ...extensions.trees.urdf import read_urdf as read
        case "sdf":
            from ...extensions.trees.sdf import read_sdf as read
            from ...extensions.trees.sdf import whole_sdf

            root = whole_sdf(root)
        case "OpenSimDocument":
            from ...extensions.trees.osim import read_osim as read
            from ...extensions.trees.osim import whole_osim

            root = whole_osim(root)
        case "usd":
            from ...extensions.trees.usd import read_usd as read
        case _:
            from ...extensions.trees.mjcf import read_mjcf as read
            from ...extensions.trees.mjcf import whole_mjcf

            root = whole_mjcf(root)
    omitted: list[tuple[str, Element]] = []
    tree = read(root.without_named(without, omitted))
    tree.without = {name for name, _ in omitted}
    if omitted:
        tree.notes.append(f"{WITHOUT}{', '.join(str(each) for _, each in omitted)}")
    return tree


def require_used(file: Path, without: Collection[str], used: Collection[str]) -> None:
    """Refuse names of elements to leave out that a model does not have.

    Raises:
        CaseError: there is one.
    """
    for name in without:
        if name not in used:
            elements = [*root_of(file).descendants()]
            known = {each.tag for each in elements}
            known |= {each.attributes.get("name", each.tag) for each in elements}
            raise unknown_name(file, "--without", name, known, "an element of the file")


def root_of(file: Path) -> Element:
    """Return the root element of a model in XML, or the stage of USD as an element.

    Raises:
        CaseError: it is neither.
        KincheckError: usd-core is not installed.
    """
    if file.suffix.lower() in STAGES:
        from ...extensions.trees.usd_stage import root_of_usd

        return root_of_usd(file)
    from ...extensions.trees.element import parse_xml

    return parse_xml(file, _text(file))


def _hardpoints(file: Path, kind: str, supplied: Supplied) -> HardpointTable:
    """Return the table of hardpoints of a file."""
    from ...extensions.hardpoints.programs import read_adams, read_assetto, read_chrono
    from ...extensions.hardpoints.rows import read_plain, read_spreadsheet
    from ...extensions.hardpoints.tree import read_python, read_tree

    if kind == WORKBOOK:
        return read_spreadsheet(file, supplied)
    text = _text(file, of_spreadsheet=kind in (TABLE, ADAMS))
    if kind == TABLE and "[BAR]" in text:
        raise fault(file, "", f"found a text with [BAR], which {UNREAD['.pm']}")
    if kind == TREE and file.suffix.lower() == ".py":
        return read_python(file, text, supplied)
    if kind in (TREE, TABLE, ASSETTO):
        readers = {TREE: read_tree, TABLE: read_plain, ASSETTO: read_assetto}
        return readers[kind](file, text, supplied)
    return {CHRONO: read_chrono, ADAMS: read_adams}[kind](file, text)


def kind_of(file: Path, supplied: Supplied = NOTHING) -> str:
    """Return the kind of a file; an unknown kind is a case file, whose reader states its needs.

    Raises:
        CaseError: a file whose content decides cannot be read.
    """
    suffix = file.suffix.lower()
    if suffix == ".toml":
        return _kind_of_toml(file)
    if suffix == ".json":
        return _kind_of_json(file, supplied)
    if suffix in _KINDS:
        return _KINDS[suffix]
    from ...extensions.hardpoints.programs import is_assetto

    text = _text(file, of_spreadsheet=True)
    if "[HARDPOINT]" in text:
        return ADAMS
    if text.lstrip().startswith("<"):
        return MODEL
    if suffix == ".ini":
        if is_assetto(text):
            return ASSETTO
        problem = "found an .ini file without points such as WBCAR_TOP_FRONT or STRUT_CAR"
        raise fault(file, "", f"{problem}; give the suspensions.ini of Assetto Corsa")
    return TABLE if supplied.template or suffix == ".txt" else CASE


def _kind_of_toml(file: Path) -> str:
    text = _text(file)
    if _OF_CASE.search(text):
        return CASE
    from ...extensions.hardpoints.tree import has_points, toml_tree

    return TREE if has_points(toml_tree(file, text)) else CASE


def _kind_of_json(file: Path, supplied: Supplied) -> str:
    from ...extensions.hardpoints.programs import is_chrono, without_comments
    from ...extensions.hardpoints.tree import has_points, json_tree

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
