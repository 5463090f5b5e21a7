"""Imports between the folders of core: the table of which imports which is exact, and runs down the
layers.

Files are read, not run.
"""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from .support.case_texts import rows
from .support.sources import SOURCES, folder_of, imported, module_of, tree

LAYERS = (
    (".",),
    ("program",),
    ("primitives",),
    ("joints",),
    ("mechanism",),
    ("kinematics",),
    ("case",),
    ("harness",),
    ("recorded",),
    ("history",),
    ("report",),
    ("studies",),
    ("live",),
    ("cli",),
    ("extensions",),
    ("__init__",),
    ("kincheck",),
)
"""Folders of core from the bottom up: "." is the files at its top, "__init__" its public names,
"kincheck" the package above core, adapters and cases."""

IMPORTS = {
    ".": "",
    "program": ".",
    "program/llvm": ". program",
    "primitives": ". program",
    "joints": ". primitives",
    "mechanism": ". joints",
    "kinematics/formulation": ". primitives program joints mechanism",
    "kinematics/forces": ". primitives program joints mechanism kinematics/formulation",
    "kinematics/structure": ". primitives program/llvm joints mechanism kinematics/formulation",
    "kinematics/compiled": (
        ". primitives program program/llvm joints mechanism kinematics/formulation "
        "kinematics/forces kinematics/structure"
    ),
    "kinematics/statics": (
        ". primitives program program/llvm joints mechanism kinematics/formulation "
        "kinematics/forces kinematics/structure kinematics/compiled"
    ),
    "kinematics/assembly": (
        ". primitives joints mechanism kinematics/formulation "
        "kinematics/structure kinematics/compiled"
    ),
    "kinematics/continuation": (
        ". program mechanism kinematics/formulation kinematics/structure kinematics/compiled"
    ),
    "kinematics/verified": (
        ". primitives program joints mechanism kinematics/formulation kinematics/forces "
        "kinematics/structure kinematics/compiled kinematics/continuation"
    ),
    "kinematics/blocks": (
        ". program mechanism kinematics/formulation kinematics/structure "
        "kinematics/compiled kinematics/continuation"
    ),
    "kinematics/diagnosis": (
        ". primitives mechanism kinematics/formulation kinematics/structure "
        "kinematics/compiled kinematics/continuation"
    ),
    "kinematics": (
        ". primitives program mechanism kinematics/formulation kinematics/forces "
        "kinematics/structure kinematics/compiled kinematics/assembly "
        "kinematics/continuation kinematics/verified kinematics/blocks "
        "kinematics/statics kinematics/diagnosis program/llvm"
    ),
    "case": ". primitives joints mechanism kinematics",
    "case/suspension": ". mechanism case",
    "case/io": ". joints mechanism kinematics case case/suspension",
    "case/models": ". case case/io",
    "case/models/hardpoints": (
        ". joints mechanism kinematics case case/suspension case/io case/models"
    ),
    "case/models/trees": ". joints mechanism kinematics case case/io case/models",
    "case/models/adams": ". joints mechanism kinematics case case/io case/models/trees",
    "extensions": "",
    "extensions/adams": ".",
    "extensions/hardpoints": ".",
    "extensions/trees": ".",
    "extensions/usd": ". mechanism case/io case/models/trees",
    "extensions/osim": ". joints case/io case/models/trees",
    "harness": (". program/llvm joints mechanism kinematics case case/suspension case/io"),
    "harness/workers": ". harness",
    "harness/reporting": "",
    "recorded": ". primitives mechanism kinematics case case/io harness",
    "history": ". case case/io harness",
    "report": ". joints mechanism kinematics case case/io harness history",
    "studies/variation": ". joints mechanism kinematics case case/io",
    "studies/truth": ". program mechanism kinematics case",
    "studies/stress/families": ". joints mechanism case case/io studies/truth",
    "studies": ". program joints mechanism kinematics case case/io harness",
    "studies/checks": (
        ". primitives program joints mechanism kinematics case case/io "
        "harness harness/workers report"
    ),
    "studies/tolerance": (
        ". mechanism kinematics case case/io harness "
        "harness/workers history report studies/variation"
    ),
    "studies/stress": (
        ". joints mechanism kinematics case case/io harness harness/workers report "
        "studies/truth studies/stress/families"
    ),
    "studies/paper": ". primitives program joints mechanism kinematics case harness report",
    "studies/diagnosis": ". joints kinematics case harness report studies/variation",
    "studies/compliance": (". mechanism kinematics case case/suspension harness report"),
    "studies/board": ". mechanism kinematics case case/io harness report",
    "studies/same": ". joints mechanism kinematics case/models/trees",
    "studies/bench": (
        ". program/llvm joints mechanism kinematics case case/io harness report "
        "studies/variation studies studies/tolerance studies/paper studies/compliance"
    ),
    "live": (
        ". program/llvm mechanism kinematics case case/io case/models/hardpoints "
        "harness report studies/variation studies/tolerance studies/diagnosis"
    ),
    "cli": (
        ". program program/llvm joints kinematics case "
        "case/io case/models/hardpoints case/models/trees case/models harness harness/workers "
        "history recorded report studies/variation studies/stress/families studies "
        "studies/checks studies/tolerance studies/stress "
        "studies/paper studies/same studies/diagnosis studies/bench studies/board "
        "studies/compliance live"
    ),
    "__init__": ". joints mechanism kinematics case case/io harness studies/checks",
    "kincheck": (". case case/io harness report studies/compliance cli primitives __init__"),
}
"""Folder of core: the folders it imports besides itself, whenever the import runs."""

MAY_IMPORT = {folder: set(others.split()) for folder, others in IMPORTS.items()}


def imports_against_the_table(path, syntax):
    """core: by the table. adapters and cases: core, and adapters their own folder and shared."""
    here = path.parts[0]
    for target in imported(path, syntax):
        if target[0] == "kincheck":
            yield f"imports {'.'.join(target)}: use a relative import"
        elif target[0] not in ("core", "adapters", "cases"):
            continue
        elif here == "core" and target[0] != "core":
            if path != Path("core/cli/main.py"):
                yield f"imports {'.'.join(target)}: only core/cli/main.py knows {target[0]}"
        elif here == "core":
            mine, module = folder_of(path), module_of(target)
            if mine not in MAY_IMPORT:
                yield f"{mine} is new: give it a row in IMPORTS"
            elif module is None:
                yield f"imports {'.'.join(target)}, which is nowhere"
            elif (other := folder_of(module)) != mine and other not in MAY_IMPORT[mine]:
                yield f"{mine} imports {other}"
        elif target[0] not in ("core", here):
            yield f"imports {'.'.join(target)}"
        elif (
            here == target[0] == "adapters"
            and len(path.parts) > 2
            and target[1] not in (path.parts[1], "shared")
        ):
            yield f"imports {'.'.join(target)}: engines share adapters/shared only"


def test_sources_import_by_table():
    found = {
        str(path): offences
        for path in SOURCES
        if (offences := list(imports_against_the_table(path, tree(path))))
    }
    assert found == {}


OUTSIDE = """
core/algebra.py | from .mechanism.motions import JointAngle
core/primitives/new.py | from ..joints.base import Joint
core/kinematics/new.py | from ..harness import record
core/kinematics/new.py | def f():\\n    from .. import harness
core/kinematics/formulation/new.py | from ..structure.components import Section
core/kinematics/continuation/new.py | from .. import blocks
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
    arrows: dict[str, set[str]] = {
        folder_of(path): set() for path in SOURCES if path.parts[0] == "core"
    }
    for path in SOURCES:
        if path.parts[0] == "core" and folder_of(path) in arrows:
            modules = {module_of(target) for target in imported(path, tree(path))}
            arrows[folder_of(path)] |= {
                folder_of(module) for module in modules if module and module.parts[0] == "core"
            }
    unused = {
        folder: MAY_IMPORT.get(folder, set()) - others - {folder}
        for folder, others in arrows.items()
    }
    assert {folder: others for folder, others in unused.items() if others} == {}
    assert set(MAY_IMPORT) == set(arrows)


def test_import_table_follows_layers():
    level = {folder: k for k, layer in enumerate(LAYERS) for folder in layer}
    up = [
        (folder, other)
        for folder, others in MAY_IMPORT.items()
        for other in others
        if level[other.split("/")[0]] > level[folder.split("/")[0]]
        or (
            level[other.split("/")[0]] == level[folder.split("/")[0]]
            and other.split("/")[0] != folder.split("/")[0]
        )
    ]
    assert up == []
    TopologicalSorter(MAY_IMPORT).prepare()


def test_files_have_no_circular_imports():
    """Imports in functions and for type checkers count too."""
    arrows = {}
    for path in SOURCES:
        modules = {module_of(target) for target in imported(path, tree(path))}
        arrows[path] = {module for module in modules if module not in (None, path)}
    TopologicalSorter(arrows).prepare()
