"""The house keeps its shape: who may import whom, what is packaged, what is loaded when, and how long a file gets.

Files are read, not run: every rule is a function of a file's path and syntax tree, and has an offender below that it must find.
"""

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SIMULATORS = {"mujoco", "pinocchio", "exudyn"}
SHARED_BY_ADAPTERS = {"chains", "closures", "conditions", "floors", "jointed", "poses"}
SHARED_BY_ADAPTERS |= {"simulation", "xml_text", "projection", "own_frame", "projection_model", "projection_engine"}
LONGEST = 300

DESCRIPTION = {"errors", "algebra", "trajectory", "joints", "drivers", "motions", "mechanism", "topology"}
MAY_IMPORT: dict[str, set[str]] = {
    "version": set(),
    "errors": set(),
    "algebra": set(),
    "trajectory": set(),
    "primitives": {"algebra"},
    "program": {"algebra", "errors", "trajectory"},
    "given": {"errors", "trajectory"},
    "motions": {"errors", "given", "trajectory"},
    "joints": {"algebra", "errors", "given", "primitives"},
    "drivers": {"errors", "given", "joints"},
    "mechanism": {"drivers", "errors", "given", "joints"},
    "topology": {"drivers", "joints", "mechanism"},
    "analysis": {"given", "primitives", "program", *DESCRIPTION},
    "jet": {"algebra"},
    "harness": {"analysis", "jet", "primitives", "program", "version", *DESCRIPTION},
    "__init__": {"analysis", "harness", "version", *DESCRIPTION},
}
"""Room of core (a module or a folder) -> the rooms it may import besides itself."""
ROAD = "road"
AMONG_ANALYSIS: dict[str, set[str]] = {
    "equations": set(),
    "structure": {"equations"},
    ROAD: {"equations", "structure"},
    "singular": {"equations", "structure", ROAD},
    "assembly": {"equations", "structure", ROAD},
    "cascade": {"equations", "structure", ROAD, "singular"},
    "sparse": {"equations", "structure", ROAD},
    "diagnosis": {"equations", "structure", ROAD, "singular"},
    "proofs": {"equations", "structure", ROAD, "singular"},
}
"""The same within analysis; the road is what stands beside the rooms. It may turn to others in a function, where few need them."""


def files(*folders):
    return sorted(path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).rglob("*.py"))


SOURCES = files("core", "adapters", "cases")
TESTS = files("tests")


def tree(path):
    return ast.parse((ROOT / path).read_text(encoding="utf-8"))


def imported(path: Path, syntax: ast.AST) -> Iterator[tuple[str, ...]]:
    """What a file imports, as paths from the top: relative ones resolved ("core", "joints", ...), others by their names."""
    for node in ast.walk(syntax):
        if isinstance(node, ast.Import):
            yield from (tuple(alias.name.split(".")) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = tuple(node.module.split(".")) if node.module else ()
            if node.level:
                module = path.parts[: len(path.parts) - node.level] + module
            # "from . import x" may mean the module x
            yield from ((*module, alias.name) for alias in node.names) if not node.module else [module]


def room(parts: tuple[str, ...]) -> str:
    """The room of core that a path or an import is in."""
    return Path(parts[1]).stem if len(parts) > 1 else "__init__"


# The rules: path and syntax tree -> what is wrong


def imports_against_the_stream(path, syntax):
    """core: by the table; adapters and cases: core only, adapters not each other; nobody: kincheck by its absolute name."""
    here = path.parts[0]
    for target in imported(path, syntax):
        if target[0] == "kincheck":
            yield f"imports {'.'.join(target)}: use a relative import"
        elif here == "core" and target[0] in ("adapters", "cases"):
            if path != Path("core/harness/cli.py"):
                yield f"imports {'.'.join(target)}: only core/harness/cli.py knows {target[0]}"
        elif here == "core" and target[0] == "core":
            mine, other = room(path.parts), room(target)
            if mine not in MAY_IMPORT:
                yield f"{mine} is new: give it a place in MAY_IMPORT"
            elif other != mine and other not in MAY_IMPORT[mine]:
                yield f"{mine} imports {other}"
        elif here in ("adapters", "cases") and target[0] in ("adapters", "cases") and target[0] != here:
            yield f"imports {'.'.join(target)}"
        elif here == target[0] == "adapters" and path.stem != "__init__" and not set(target[1:]) & SHARED_BY_ADAPTERS:
            # the modules of one engine begin with its name
            if any(name.split("_")[0] == path.stem.split("_")[0] for name in target[1:]):
                continue
            yield f"imports {'.'.join(target)}: engines share only {sorted(SHARED_BY_ADAPTERS)}"


def turns_within_analysis(path, syntax):
    """analysis: by its own table; the road takes turns in functions only."""
    if path.parts[:2] != ("core", "analysis"):
        return
    mine = path.parts[2] if len(path.parts) > 3 else ROAD
    for target in imported(path, ast.Module(syntax.body if mine != ROAD else _at_import(syntax), [])):
        if target[:2] == ("core", "analysis") and len(target) > 2:
            other = target[2] if target[2] in AMONG_ANALYSIS else ROAD
            if other != mine and other not in AMONG_ANALYSIS[mine]:
                yield f"{mine} imports {other}"


def _at_import(syntax):
    return [node for node in syntax.body if isinstance(node, ast.Import | ast.ImportFrom)]


def simulators_at_import(path, syntax):
    """Simulators named by an import that runs when the module is imported, in a statement or by import_module."""
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
            names = [each.value for each in node.args if isinstance(each, ast.Constant) and isinstance(each.value, str)]
        yield from (f"imports {name} at import" for name in names if name.split(".")[0] in SIMULATORS)
        waiting += ast.iter_child_nodes(node)


def undocumented(path, syntax):
    """Modules, public functions and public classes without a docstring."""
    if not ast.get_docstring(syntax) and ast.unparse(syntax):
        yield "has no docstring"
    for node in syntax.body:
        public = isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
        if public and not ast.get_docstring(node):
            yield f"{node.name} has no docstring"


def bare_packages(path, syntax):
    """Imports of the packages by their folder names, which would load them a second time."""
    for target in imported(path, syntax):
        if target[0] in ("core", "adapters", "cases"):
            yield f"imports {'.'.join(target)}: say kincheck.{target[0]}"


RULES = [imports_against_the_stream, turns_within_analysis, simulators_at_import, undocumented]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_sources(rule):
    assert {str(path): found for path in SOURCES if (found := list(rule(path, tree(path))))} == {}


def test_tests_use_the_installed_package():
    assert {str(path): found for path in TESTS if (found := list(bare_packages(path, tree(path))))} == {}


OFFENDERS = [
    (imports_against_the_stream, "core/algebra.py", "from .errors import MechanismError"),
    (imports_against_the_stream, "core/primitives/new.py", "from ..joints.base import Joint"),
    (imports_against_the_stream, "core/analysis/new.py", "from ..harness import case"),
    (imports_against_the_stream, "core/analysis/new.py", "def f():\n    from .. import harness"),
    (imports_against_the_stream, "core/harness/run.py", "from ... import adapters"),
    (imports_against_the_stream, "core/harness/run.py", "from ...cases import load"),
    (imports_against_the_stream, "core/extra.py", "from .algebra import Vec3"),
    (imports_against_the_stream, "core/mechanism.py", "from kincheck.core.joints import Joint"),
    (imports_against_the_stream, "adapters/mujoco.py", "from .pinocchio import Pinocchio"),
    (imports_against_the_stream, "adapters/exudyn.py", "from .mujoco_spec import Sketch"),
    (imports_against_the_stream, "adapters/mujoco.py", "from ..cases import load"),
    (imports_against_the_stream, "cases/rssr.py", "from ..adapters import engine"),
    (turns_within_analysis, "core/analysis/equations/new.py", "from ..structure.freedom import rank"),
    (turns_within_analysis, "core/analysis/structure/new.py", "def f():\n    from ..model import Model"),
    (turns_within_analysis, "core/analysis/new.py", "from .sparse.model import SparseModel"),
    (turns_within_analysis, "core/analysis/sparse/new.py", "from .. import cascade"),
    (simulators_at_import, "adapters/mujoco.py", "import mujoco"),
    (simulators_at_import, "adapters/mujoco.py", "class A:\n    from mujoco.viewer import launch"),
    (simulators_at_import, "adapters/mujoco.py", "try:\n    import exudyn as exu\nexcept ImportError:\n    exu = None"),
    (simulators_at_import, "adapters/mujoco.py", "mj = importlib.import_module('mujoco')"),
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
        imports_against_the_stream,
        "core/analysis/new.py",
        "from ..program import Tape\nfrom . import march",
    ),
    (imports_against_the_stream, "core/harness/cli.py", "def f():\n    from ... import adapters, cases"),
    (
        turns_within_analysis,
        "core/analysis/new.py",
        "from .structure.freedom import rank\ndef f():\n    from .sparse.model import A",
    ),
    (turns_within_analysis, "core/analysis/cascade/new.py", "from ..march import march\nfrom ..singular.bridge import Bridge"),
    (
        imports_against_the_stream,
        "adapters/mujoco.py",
        "from ..core.mechanism import Body\nfrom .projection import project\nfrom .mujoco_spec import Sketch",
    ),
    (simulators_at_import, "adapters/mujoco.py", "def f():\n    import mujoco\n    return importlib.import_module('exudyn')"),
    (undocumented, "core/new.py", '"""Doc."""\ndef _f(): ...'),
    (bare_packages, "tests/test_new.py", "from kincheck.core.mechanism import Body\nfrom .naive import A"),
]


@pytest.mark.parametrize(("rule", "path", "text"), ALLOWED)
def test_what_is_allowed_passes(rule, path, text):
    assert list(rule(Path(path), ast.parse(text))) == []


def test_the_table_has_no_circle_and_no_dead_entry():
    TopologicalSorter(MAY_IMPORT).prepare()
    TopologicalSorter(AMONG_ANALYSIS).prepare()
    rooms = {room(path.parts) for path in SOURCES if path.parts[0] == "core"}
    assert rooms == set(MAY_IMPORT)
    folders = {path.parts[2] for path in SOURCES if path.parts[:2] == ("core", "analysis") and len(path.parts) > 3}
    assert folders | {ROAD} == set(AMONG_ANALYSIS)


# Files and packages


def test_no_file_is_too_long():
    long = {str(path): n for path in SOURCES if (n := len((ROOT / path).read_text(encoding="utf-8").splitlines())) > LONGEST}
    assert long == {}


def test_nothing_is_called_utils():
    assert [path for path in SOURCES + TESTS if "util" in path.stem or "helper" in path.stem] == []


def test_packages_are_the_folders():
    """What is not listed would be missing from a wheel, though an editable install finds it."""
    setuptools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    own = Path(setuptools["package-dir"]["kincheck"])  # of kincheck itself: without an __init__, which would hide the other parts
    folders = {path.parent for path in SOURCES} - {own}
    assert sorted(setuptools["packages"]) == sorted(["kincheck", *(".".join(["kincheck", *each.parts]) for each in folders)])
    assert all((ROOT / each / "__init__.py").exists() for each in folders)
    assert [path.name for path in SOURCES if path.parent == own] == ["__main__.py"]


def test_packages_are_typed():
    assert all((ROOT / folder / "py.typed").exists() for folder in ("core", "adapters", "cases"))


LOAD_EVERYTHING = """
import importlib, pkgutil, sys
for name in ("core", "adapters", "cases"):
    package = importlib.import_module(f"kincheck.{name}")
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        importlib.import_module(module.name)
print(*sorted({name.split(".")[0] for name in sys.modules}))
"""


def test_importing_everything_loads_no_simulator_and_nothing_twice():
    """In a fresh interpreter, away from the checkout: simulators are optional, and a bare "core" would be a second copy."""
    loaded = subprocess.run(
        [sys.executable, "-c", LOAD_EVERYTHING], cwd=ROOT / "tests", capture_output=True, text=True, check=True
    ).stdout.split()
    assert "kincheck" in loaded
    assert "numpy" in loaded
    assert SIMULATORS & set(loaded) == set()
    assert {"core", "adapters", "cases"} & set(loaded) == set()


def test_the_tests_load_nothing_twice():
    assert {"core", "adapters", "cases"} & set(sys.modules) == set()
