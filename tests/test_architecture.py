"""Imports between the folders of the kernel, whose table is exact and runs down the layers. The
kernel imports no extension.

Files are read, not run.
"""

import ast
import os
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from kincheck.core.doors import extensions

from .support.case_texts import rows
from .support.sources import (
    DELETED,
    MODULES,
    ROOT,
    SOURCES,
    TESTS,
    extension_of,
    files,
    folder_of,
    imported,
    module_of,
    tree,
)

LAYERS = (
    (".",),
    ("program",),
    ("primitives",),
    ("joints",),
    ("mechanism",),
    ("kinematics",),
    ("case",),
    ("harness",),
    ("history",),
    ("report",),
    ("studies",),
    ("cli",),
    ("__init__",),
    ("kincheck",),
)
"""Folders of the kernel in core from the bottom up: "." is the files at its top, "__init__" its
public names, "kincheck" the package above core, adapters and cases."""

IMPORTS = {
    ".": "",
    "__init__": ". case case/io harness joints kinematics mechanism studies/checks",
    "case": ". joints kinematics mechanism primitives",
    "case/io": ". case joints mechanism",
    "case/models": ". case case/io",
    "cli": (
        ". case case/io case/models harness harness/workers history joints kinematics "
        "program report studies studies/checks"
    ),
    "harness": ". case case/io joints kinematics mechanism program",
    "harness/reporting": "",
    "harness/workers": ". harness",
    "history": ". case case/io harness",
    "joints": ". primitives",
    "kincheck": ". __init__ case case/io cli harness primitives report",
    "kinematics": (
        ". kinematics/compiled kinematics/continuation "
        "kinematics/forces kinematics/formulation kinematics/structure "
        "mechanism primitives"
    ),
    "kinematics/compiled": (
        ". joints kinematics/forces kinematics/formulation kinematics/structure mechanism "
        "primitives program"
    ),
    "kinematics/continuation": (
        ". kinematics/compiled kinematics/formulation kinematics/structure mechanism program"
    ),
    "kinematics/forces": ". joints kinematics/formulation mechanism primitives program",
    "kinematics/formulation": ". joints mechanism primitives program",
    "kinematics/structure": ". joints kinematics/formulation mechanism primitives",
    "mechanism": ". joints",
    "primitives": ". program",
    "program": ".",
    "report": ". case case/io harness history joints mechanism",
    "studies": ". case case/io harness mechanism",
    "studies/checks": (
        ". case case/io harness joints kinematics mechanism primitives program report"
    ),
}
"""Folder of the kernel in core: the folders it imports besides itself, whenever the import runs."""

MAY_IMPORT = {folder: set(others.split()) for folder, others in IMPORTS.items()}


def imports_against_the_table(path, syntax):
    """Yield what is wrong with the imports of a file. Core: the kernel by the table, an extension
    the kernel and its needs. Adapters and cases: core, and adapters their own folder and shared.
    """
    here, mine = path.parts[0], extension_of(path)
    for target in imported(path, syntax):
        where = ".".join(target)
        if target[0] == "kincheck":
            yield f"imports {where}: use a relative import"
        elif target[0] not in ("core", "adapters", "cases"):
            continue
        module = module_of(target)
        other = module and extension_of(module)
        if module is None and target[0] == "core":
            yield f"imports {where}, which is nowhere"
        elif other and other != mine:
            if mine is None:
                yield f"imports the extension {other}: the kernel asks core.doors"
            elif other not in extensions()[mine].needs:
                yield f"{mine} imports {other}, which is none of its needs"
        elif here == "core" and target[0] != "core":
            if path != Path("core/cli/main.py"):
                yield f"imports {where}: only core/cli/main.py knows {target[0]}"
        elif here == "core":
            room, its = folder_of(path), folder_of(module)
            if mine is None and room not in MAY_IMPORT:
                yield f"{room} is new: give it a row in IMPORTS"
            elif mine is None and its not in MAY_IMPORT[room] | {room} and not other:
                yield f"{room} imports {its}"
        elif target[0] not in ("core", here):
            yield f"imports {where}"
        elif (
            here == target[0] == "adapters"
            and not mine
            and len(path.parts) > 2
            and target[1] not in (path.parts[1], "shared")
        ):
            yield f"imports {where}: engines share adapters/shared only"


def test_sources_import_by_table():
    found = {
        str(path): offences
        for path in SOURCES
        if (offences := list(imports_against_the_table(path, tree(path))))
    }
    assert found == {}


def test_tests_name_extensions_that_exist():
    """Pages, too. Without an extension a test is skipped: by a slip in its name it would be for
    ever.
    """
    deleted = {*os.environ.get(DELETED, "").split()}
    slips = set()
    for path in (*TESTS, *files("core", "adapters", "docs", ending="md")):
        text = (ROOT / path).read_text("utf-8")
        for names in re.findall(r'(?:mark\.needs\("|<!-- needs: )([a-z_", ]+?)(?:"\)| -->)', text):
            slips |= {*re.findall(r"\w+", names)} - extensions().keys() - deleted
        for module in re.findall(r"(?:importorskip\(.|from )kincheck\.(core\.ext[\w.]+)", text):
            target = tuple(module.split("."))
            if target not in MODULES and target[2] not in deleted:
                slips.add(module)
    assert slips == set()


OUTSIDE = """
core/algebra.py | from .mechanism.motions import JointAngle
core/primitives/new.py | from ..joints.base import Joint
core/kinematics/new.py | from ..harness import record
core/kinematics/new.py | def f():\\n    from .. import harness
core/kinematics/formulation/new.py | from ..structure.redundancy import without
core/kinematics/continuation/new.py | from ...extensions import blocks
core/extensions/free/new.py | from ..board import run
core/harness/run.py | from ... import adapters
core/kincheck/new.py | from kincheck.adapters import engine
core/kincheck/new.py | from kincheck.core.program import Tape
core/harness/run.py | from ...cases import load
core/history/new.py | from ..report import table
core/extra/new.py | from ..algebra import Vec3
core/mechanism/new.py | from kincheck.core.joints import Joint
adapters/mujoco/new.py | from ..pinocchio.dynamics import Dynamics
adapters/shared/new.py | from ..mujoco.mujoco import MuJoCo
adapters/mujoco/new.py | from ...cases import load
cases/rssr.py | from ..adapters import engine
"""
INSIDE = """
core/kinematics/compiled/new.py | from ...program import Tape\\nfrom . import request
core/cli/main.py | def f():\\n    from ... import adapters, cases
adapters/mujoco/new.py
    | from ...core.mechanism.mechanism import Body\\nfrom ..shared.projection import project
"""


@pytest.mark.parametrize(("path", "text"), rows(OUTSIDE, named=False))
def test_import_outside_table_is_found(path, text):
    assert list(imports_against_the_table(Path(path), ast.parse(text)))


@pytest.mark.parametrize(("path", "text"), rows(INSIDE, named=False))
def test_import_inside_table_passes(path, text):
    assert list(imports_against_the_table(Path(path), ast.parse(text))) == []


def test_import_table_is_exact():
    """Every folder has a row, and every arrow of the table is used."""
    kernel = [path for path in SOURCES if path.parts[0] == "core" and not extension_of(path)]
    arrows: dict[str, set[str]] = {
        folder_of(path): set() for path in kernel if path.parent != Path("core/extensions")
    }
    for path in kernel:
        if folder_of(path) in arrows:
            modules = {module_of(target) for target in imported(path, tree(path))}
            arrows[folder_of(path)] |= {folder_of(module) for module in modules if module in kernel}
    assert [
        (folder, other)
        for folder, others in arrows.items()
        for other in MAY_IMPORT.get(folder, set()) - others - {folder}
    ] == []
    assert set(MAY_IMPORT) == set(arrows)


def test_import_table_follows_layers():
    level = {folder: k for k, layer in enumerate(LAYERS) for folder in layer}
    up = [
        (folder, other)
        for folder, others in MAY_IMPORT.items()
        for other in others
        if (one := folder.split("/")[0]) != (two := other.split("/")[0])
        and level[two] >= level[one]
    ]
    assert up == []
    TopologicalSorter(MAY_IMPORT).prepare()


def test_files_have_no_circular_imports():
    """Imports in functions and for type checkers count too."""
    arrows = {
        path: {module_of(target) for target in imported(path, tree(path))} - {None, path}
        for path in SOURCES
    }
    TopologicalSorter(arrows).prepare()
