"""Tests of the structure: which folder imports which, what is packaged, what loads when, file
sizes.

Each rule is a function of a file's path and syntax tree; files are read, not run. Every rule finds
an offender below.
"""

import ast
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from kincheck.core import kinematics

ROOT = Path(__file__).parent.parent
PACKAGE = Path("core/kincheck")
"""Folder of the package kincheck itself, which names its parts in full: they lie elsewhere."""
SIMULATORS = {"mujoco", "pinocchio", "exudyn", "opensim", "pydrake", "dartpy"}
LONGEST = 300
WIDEST = 100
LARGEST_SHARE = 0.25

LAYERS = (
    (".",),
    ("primitives", "program"),
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
"""Folders of core from the bottom up: "." is the files at its top, "__init__" its public names,
"kincheck" the package above core, adapters and cases."""

IMPORTS = {
    ".": "",
    "primitives": ".",
    "program": ".",
    "program/llvm": ". program",
    "joints": ". primitives",
    "mechanism": ". joints",
    "kinematics/formulation": ". primitives program joints mechanism",
    "kinematics/forces": ". primitives joints mechanism kinematics/formulation",
    "kinematics/structure": ". primitives joints mechanism kinematics/formulation",
    "kinematics/compiled": (
        ". primitives program program/llvm joints mechanism kinematics/formulation "
        "kinematics/forces kinematics/structure"
    ),
    "kinematics/assembly": (
        ". primitives program joints mechanism kinematics/formulation "
        "kinematics/structure kinematics/compiled"
    ),
    "kinematics/continuation": (
        ". program mechanism kinematics/formulation kinematics/structure kinematics/compiled"
    ),
    "kinematics/verified": (
        ". primitives program joints mechanism kinematics/formulation kinematics/forces "
        "kinematics/structure kinematics/compiled kinematics/continuation"
    ),
    "kinematics/by_components": (
        ". program mechanism kinematics/formulation kinematics/structure "
        "kinematics/compiled kinematics/continuation"
    ),
    "kinematics/sparse": (
        ". primitives program program/llvm mechanism kinematics/formulation "
        "kinematics/structure kinematics/compiled kinematics/continuation"
    ),
    "kinematics/diagnosis": (
        ". primitives joints mechanism kinematics/formulation kinematics/structure "
        "kinematics/compiled kinematics/continuation"
    ),
    "kinematics": (
        ". primitives program joints mechanism kinematics/formulation kinematics/forces "
        "kinematics/structure kinematics/compiled kinematics/assembly "
        "kinematics/continuation kinematics/verified kinematics/by_components "
        "kinematics/sparse kinematics/diagnosis"
    ),
    "case/models/hardpoints/templates": "joints mechanism",
    "case": ". joints mechanism kinematics",
    "case/suspension": ". mechanism case",
    "case/measures": ". joints mechanism kinematics case",
    "case/io": ". joints mechanism kinematics case case/suspension case/measures",
    "case/models/hardpoints": (
        ". joints mechanism case/models/hardpoints/templates case case/suspension case/io"
    ),
    "case/models/mjcf": ". joints mechanism kinematics case case/io",
    "case/models/robots": ". joints mechanism case/io case/models/mjcf",
    "case/models": ". case case/io case/models/hardpoints case/models/mjcf case/models/robots",
    "harness": (
        ". program/llvm joints mechanism kinematics case case/suspension case/measures case/io"
    ),
    "harness/workers": ". harness",
    "harness/reporting": "",
    "history": ". case case/io harness",
    "history/regression": ". case case/io harness history",
    "report": ". joints mechanism case case/io harness history history/regression",
    "studies/variation": ". joints mechanism kinematics case case/io",
    "studies/stress/truth": ". program joints mechanism kinematics case case/measures",
    "studies/stress/families": ". joints mechanism case case/measures case/io studies/stress/truth",
    "studies": ". program joints kinematics case case/measures case/io harness report",
    "studies/joint_check": (
        ". primitives program joints mechanism kinematics case case/measures case/io "
        "harness studies"
    ),
    "studies/engine_check": (
        ". primitives joints case harness harness/workers studies studies/joint_check"
    ),
    "studies/tolerance": (
        ". program program/llvm mechanism kinematics case case/measures case/io harness "
        "harness/workers history report studies/variation"
    ),
    "studies/stress": (
        ". joints mechanism kinematics case case/io harness harness/workers report "
        "studies/stress/truth studies/stress/families"
    ),
    "studies/paper": ". primitives program joints mechanism kinematics case harness report",
    "studies/diagnosis": ". joints kinematics case harness report",
    "studies/bench": (
        ". program/llvm joints mechanism kinematics case case/io harness report "
        "studies/variation studies studies/tolerance studies/paper"
    ),
    "cli": (
        ". program program/llvm joints kinematics case/models/hardpoints/templates case "
        "case/io case/models/hardpoints case/models harness harness/workers history "
        "history/regression report studies/variation studies/stress/families studies "
        "studies/joint_check studies/engine_check studies/tolerance studies/stress "
        "studies/paper studies/diagnosis studies/bench"
    ),
    "__init__": ". joints mechanism kinematics case case/io harness studies/joint_check",
    "kincheck": "case case/io harness harness/workers studies cli __init__",
}
"""Folder of core: the folders it imports besides itself, whenever the import runs."""

MAY_IMPORT = {folder: set(others.split()) for folder, others in IMPORTS.items()}


def files(*folders, ending="py"):
    return sorted(
        path.relative_to(ROOT)
        for folder in folders
        for path in (ROOT / folder).rglob(f"*.{ending}")
    )


SOURCES = files("core", "adapters", "cases")
PAGES = [path for ending in ("css", "html", "js") for path in files("core", ending=ending)]
"""Scripts, style sheets and templates of the pages."""
TESTS = files("tests")


@cache
def tree(path):
    return ast.parse((ROOT / path).read_text(encoding="utf-8"))


@cache
def imported(path: Path, syntax: ast.AST) -> list[tuple[str, ...]]:
    """Return the imports of a file as paths from the top; relative ones are resolved, and those of
    the package kincheck itself.
    """
    return [*_resolved(path, syntax)]


def _resolved(path: Path, syntax: ast.AST) -> Iterator[tuple[str, ...]]:
    for target in _named(path, syntax):
        if path.parent != PACKAGE or target[0] != "kincheck":
            yield target
        elif len(target) > 1 and target[1] in ("core", "adapters", "cases"):
            yield target[1:]
        else:
            yield (*PACKAGE.parts, *target[1:])


def _named(path: Path, syntax: ast.AST) -> Iterator[tuple[str, ...]]:
    for node in ast.walk(syntax):
        if isinstance(node, ast.Import):
            yield from (tuple(alias.name.split(".")) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = tuple(node.module.split(".")) if node.module else ()
            if node.level:
                module = path.parts[: len(path.parts) - node.level] + module
            # "from .x import y" may mean the module y
            yield from ((*module, alias.name) for alias in node.names)


MODULES = {
    path.parent.parts if path.name == "__init__.py" else path.with_suffix("").parts: path
    for path in SOURCES
}


def module_of(target: tuple[str, ...]) -> Path | None:
    """Return the file that an import loads, or None where it is not one of ours."""
    return MODULES.get(target) or MODULES.get(target[:-1])


def folder_of(path: Path) -> str:
    """Return the folder of core that a file belongs to, as the table names it."""
    if path == Path("core/__init__.py"):
        return "__init__"
    return "/".join(path.parts[1:-1]) or "."


# The rules: path and syntax tree -> offences


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


DOOR = Path("core/kinematics/__init__.py")


def past_the_door(path, syntax):
    """Yield imports of the files behind core/kinematics: its public names are those of the folder
    itself.
    """
    for target in imported(path, syntax):
        own = target[1:] if target[0] == "kincheck" else target
        if own[:2] == DOOR.parts[:2] != path.parts[:2] and module_of(own) != DOOR:
            yield f"imports {'.'.join(target)}: say core.kinematics"


def simulators_at_import(path, syntax):
    """Yield simulators imported when the module loads, by a statement or by import_module."""
    waiting = list(ast.iter_child_nodes(syntax))
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            continue
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [node.module or ""]
        elif isinstance(node, ast.Call) and "import" in ast.unparse(node.func):
            constants = [each.value for each in node.args if isinstance(each, ast.Constant)]
            names = [value for value in constants if isinstance(value, str)]
        yield from (
            f"imports {name} at import" for name in names if name.split(".")[0] in SIMULATORS
        )
        waiting += ast.iter_child_nodes(node)


def undocumented(path, syntax):
    """Yield the module, public functions and public classes without a docstring."""
    if not ast.get_docstring(syntax) and ast.unparse(syntax):
        yield "has no docstring"
    for node in syntax.body:
        public = isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
        if public and not ast.get_docstring(node):
            yield f"{node.name} has no docstring"


def bare_packages(path, syntax):
    """Yield imports of the packages by their folder names, which would load them a second time."""
    for target in imported(path, syntax):
        if target[0] in ("core", "adapters", "cases"):
            yield f"imports {'.'.join(target)}: say kincheck.{target[0]}"


RULES = [imports_against_the_table, past_the_door, simulators_at_import, undocumented]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_sources(rule):
    found = {str(path): offences for path in SOURCES if (offences := list(rule(path, tree(path))))}
    assert found == {}


INSIDE = {"kinematics", "program", "test_probe.py"}
"""Below tests: those of the inside of kinematics, and of its programs."""


def test_tests_of_anything_else_enter_kinematics_by_its_door():
    found = {
        str(path): offences
        for path in TESTS
        if INSIDE.isdisjoint(path.parts) and (offences := list(past_the_door(path, tree(path))))
    }
    assert found == {}


def test_tests_use_the_installed_package():
    found = {str(path): each for path in TESTS if (each := list(bare_packages(path, tree(path))))}
    assert found == {}


OFFENDERS = [
    (imports_against_the_table, "core/algebra.py", "from .mechanism.drivers import JointAngle"),
    (imports_against_the_table, "core/primitives/new.py", "from ..joints.base import Joint"),
    (imports_against_the_table, "core/kinematics/new.py", "from ..harness import record"),
    (imports_against_the_table, "core/kinematics/new.py", "def f():\n    from .. import harness"),
    (
        imports_against_the_table,
        "core/kinematics/formulation/new.py",
        "from ..structure.components import Section",
    ),
    (imports_against_the_table, "core/kinematics/sparse/new.py", "from .. import by_components"),
    (imports_against_the_table, "core/harness/run.py", "from ... import adapters"),
    (imports_against_the_table, "core/kincheck/new.py", "from kincheck.adapters import engine"),
    (imports_against_the_table, "core/kincheck/new.py", "from kincheck.core.program import Tape"),
    (imports_against_the_table, "core/harness/run.py", "from ...cases import load"),
    (imports_against_the_table, "core/history/new.py", "from ..report import table"),
    (imports_against_the_table, "core/extra/new.py", "from ..algebra import Vec3"),
    (imports_against_the_table, "core/mechanism/new.py", "from kincheck.core.joints import Joint"),
    (
        imports_against_the_table,
        "adapters/mujoco/new.py",
        "from ..pinocchio.dynamics import Dynamics",
    ),
    (imports_against_the_table, "adapters/shared/new.py", "from ..mujoco.spec import Sketch"),
    (imports_against_the_table, "adapters/mujoco/new.py", "from ...cases import load"),
    (imports_against_the_table, "cases/rssr.py", "from ..adapters import engine"),
    (past_the_door, "core/case/new.py", "from ..kinematics.solver_selection import prepare"),
    (past_the_door, "core/case/io/new.py", "from ...kinematics import compiled"),
    (past_the_door, "core/cli/new.py", "def f():\n    from ..kinematics.one_design import solve"),
    (past_the_door, "core/kincheck/new.py", "import kincheck.core.kinematics.sparse.sweep"),
    (past_the_door, "adapters/new.py", "from ..core.kinematics.compiled.request import Request"),
    (simulators_at_import, "adapters/new.py", "import mujoco"),
    (simulators_at_import, "adapters/new.py", "class A:\n    from mujoco.viewer import launch"),
    (
        simulators_at_import,
        "adapters/new.py",
        "try:\n    import exudyn as exu\nexcept ImportError:\n    exu = None",
    ),
    (simulators_at_import, "adapters/new.py", "mj = importlib.import_module('mujoco')"),
    (undocumented, "core/new.py", "x = 1"),
    (undocumented, "core/new.py", '"""Doc."""\ndef f(): ...'),
    (undocumented, "core/new.py", '"""Doc."""\nclass A: ...'),
    (bare_packages, "tests/test_new.py", "from core.mechanism import Body"),
    (bare_packages, "tests/test_new.py", "import adapters.native"),
]


@pytest.mark.parametrize(("rule", "path", "text"), OFFENDERS)
def test_offenders_are_found(rule, path, text):
    assert list(rule(Path(path), ast.parse(text)))


ALLOWED = [
    (
        imports_against_the_table,
        "core/kinematics/compiled/new.py",
        "from ...program import Tape\nfrom . import request",
    ),
    (
        imports_against_the_table,
        "core/cli/main.py",
        "def f():\n    from ... import adapters, cases",
    ),
    (
        imports_against_the_table,
        "adapters/mujoco/new.py",
        "from ...core.mechanism.mechanism import Body\nfrom ..shared.projection import project",
    ),
    (
        past_the_door,
        "adapters/shared/new.py",
        "from ...core.kinematics import NativeSolver, solve\nfrom ...core import kinematics",
    ),
    (past_the_door, "core/kinematics/new.py", "from .compiled.request import Request"),
    (
        simulators_at_import,
        "adapters/new.py",
        "def f():\n    import mujoco\n    return importlib.import_module('exudyn')",
    ),
    (undocumented, "core/new.py", '"""Doc."""\ndef _f(): ...'),
    (
        bare_packages,
        "tests/test_new.py",
        "from kincheck.core.algebra import Vec3\nfrom .oracles.naive import A",
    ),
]


@pytest.mark.parametrize(("rule", "path", "text"), ALLOWED)
def test_allowed_code_passes(rule, path, text):
    assert list(rule(Path(path), ast.parse(text))) == []


def test_the_table_is_exact():
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


def test_imports_run_down_the_layers_and_never_in_a_circle():
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


def test_no_files_import_each_other_in_a_circle():
    """Imports in functions and for type checkers count too."""
    arrows = {}
    for path in SOURCES:
        modules = {module_of(target) for target in imported(path, tree(path))}
        arrows[path] = {module for module in modules if module not in (None, path)}
    TopologicalSorter(arrows).prepare()


# Files and packages


def lines(path: Path) -> int:
    return len((ROOT / path).read_text(encoding="utf-8").splitlines())


def test_no_file_is_too_long():
    assert {str(path): n for path in [*SOURCES, *PAGES] if (n := lines(path)) > LONGEST} == {}


def test_no_line_of_a_page_is_too_wide():
    """As ruff holds it for Python."""
    wide = [
        f"{path}:{number}"
        for path in PAGES
        for number, line in enumerate((ROOT / path).read_text("utf-8").splitlines(), 1)
        if len(line) > WIDEST
    ]
    assert wide == []
    assert {path.suffix for path in PAGES} == {".css", ".html", ".js"}


def test_no_layer_is_too_large():
    sizes = Counter()
    for path in SOURCES:
        if path.parts[0] == "core":
            sizes[folder_of(path).split("/")[0]] += lines(path)
    whole = sum(sizes.values())
    assert {name: n / whole for name, n in sizes.items() if n > LARGEST_SHARE * whole} == {}


def test_the_door_has_the_names_that_type_checkers_see():
    """And none of a module, which would take its place once imported."""
    seen = {
        alias.asname: node.module
        for node in ast.walk(tree(DOOR))
        if isinstance(node, ast.ImportFrom) and node.level
        for alias in node.names
    }
    assert seen == kinematics._MODULES
    assert all(hasattr(kinematics, name) for name in seen)
    assert [
        name for name in seen if (ROOT / DOOR).with_name(name).with_suffix(".py").exists()
    ] == []
    assert [name for name in seen if (ROOT / DOOR).with_name(name).is_dir()] == []


def test_the_harness_names_the_standard_in_one_place():
    """Engines tell by attributes what the harness must know; none is asked for by its name."""
    named = [
        str(path.relative_to(ROOT))
        for path in sorted((ROOT / "core" / "harness").rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value == "native"
    ]
    assert named == ["core/harness/standard.py"]


def test_nothing_is_called_utils():
    assert [path for path in SOURCES + TESTS if "util" in path.stem or "helper" in path.stem] == []


def test_packages_are_the_folders():
    """A folder that is not listed would be missing from a wheel, though an editable install finds
    it.
    """
    setuptools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "setuptools"
    ]
    assert Path(setuptools["package-dir"]["kincheck"]) == PACKAGE
    folders = {path.parent for path in SOURCES}
    expected = [".".join(["kincheck", *each.parts]) for each in folders - {PACKAGE}]
    assert sorted(setuptools["packages"]) == sorted(["kincheck", *expected])
    assert all((ROOT / each / "__init__.py").exists() for each in folders)


def test_packages_are_typed():
    folders = (PACKAGE, "core", "adapters", "cases")
    assert all((ROOT / folder / "py.typed").exists() for folder in folders)


LOAD_EVERYTHING = """
import importlib, pkgutil, sys
for name in ("core", "adapters", "cases"):
    package = importlib.import_module(f"kincheck.{name}")
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        importlib.import_module(module.name)
print(*sorted({name.split(".")[0] for name in sys.modules}))
"""


def test_importing_everything_loads_no_simulator_and_nothing_twice():
    """In a fresh interpreter, away from the checkout: a bare "core" would be a second copy."""
    loaded = subprocess.run(
        [sys.executable, "-c", LOAD_EVERYTHING],
        cwd=ROOT / "tests",
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert "kincheck" in loaded
    assert "numpy" in loaded
    assert SIMULATORS & set(loaded) == set()
    assert {"core", "adapters", "cases"} & set(loaded) == set()


def test_the_tests_load_nothing_twice():
    assert {"core", "adapters", "cases"} & set(sys.modules) == set()
