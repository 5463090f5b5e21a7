"""Rules of source files, each a function of a file's path and syntax tree. Every rule finds an
offender below.
"""

import ast
import re
from pathlib import Path

import pytest

from .support.case_texts import rows
from .support.sources import (
    DOOR,
    EXTENSIONS,
    MODULES,
    SOURCES,
    TESTS,
    extension_of,
    imported,
    module_of,
    tree,
)

SIMULATORS = {"mujoco", "pinocchio", "exudyn", "opensim", "pydrake", "dartpy"}


NUMERICS = {
    *(
        "assemblies",
        "blocks",
        "closing",
        "code",
        "designs",
        "explain",
        "free",
        "laboratory",
        "llvm",
        "proofs",
    ),
    *("residuals", "statics", "trace"),
}
"""Extensions that walk or prove the equations in another way, and see the inside of kinematics."""


def past_the_door(path, syntax):
    """Yield imports of the files behind core/kinematics: its public names are those of the folder
    itself.
    """
    if not NUMERICS.isdisjoint(path.parts):
        return
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


MOST_WORDS = 6


def long_test_names(path, syntax):
    """Yield tests whose names are sentences: a name says feature, situation and result."""
    for node in ast.walk(syntax):
        name = getattr(node, "name", None) or ""
        if name.startswith("test_") and name.count("_") > MOST_WORDS:
            yield f"{name} has more than {MOST_WORDS} words"


IN_EXTENSION = re.compile(r"kincheck((?:\.core\.extensions|\.adapters)\.\w+)((?:\.\w+)*)")
SHARED = {"extensions", "oracles", "support"}


def bound_to_extensions(path, syntax):
    """Yield extensions that a test of the kernel imports, so that it goes with them, and misspelt
    modules that a test is skipped without.
    """
    for target in imported(path, syntax):
        module = module_of(target[1:]) if target[0] == "kincheck" else None
        if module and extension_of(module) and path.parts[1] not in SHARED:
            yield f"imports {module}: move the test, or use pytest.importorskip in it"
    for node in ast.walk(syntax):
        name = isinstance(node, ast.Constant) and IN_EXTENSION.fullmatch(str(node.value))
        folder = name and tuple(name[1].strip(".").split("."))
        if folder and Path(*folder) in EXTENSIONS:
            target = (*folder, *filter(None, name[2].split(".")))
            if (
                target not in MODULES
                and getattr(module_of(target), "stem", "__init__") == "__init__"
            ):
                yield f"names {node.value}, which is nowhere"


RULES = {
    rule.__name__: rule
    for rule in (
        past_the_door,
        simulators_at_import,
        undocumented,
        bare_packages,
        long_test_names,
        bound_to_extensions,
    )
}
OF_TESTS = {"bare_packages", "long_test_names", "bound_to_extensions"}


@pytest.mark.parametrize("rule", RULES)
def test_sources_follow_rules(rule):
    paths = TESTS if rule in OF_TESTS else SOURCES
    found = {str(path): each for path in paths if (each := list(RULES[rule](path, tree(path))))}
    assert found == {}


INSIDE = {"designs", "kinematics", "llvm", "program", "test_joint_probe.py"}
"""Below tests: those of the inside of kinematics, and of its programs."""


def test_tests_import_public_names_of_kinematics():
    found = {
        str(path): offences
        for path in TESTS
        if INSIDE.isdisjoint(path.parts) and (offences := list(past_the_door(path, tree(path))))
    }
    assert found == {}


OFFENDERS = """
past_the_door | core/case/new.py | from ..kinematics.one_design import prepare
past_the_door | core/case/io/new.py | from ...kinematics import compiled
past_the_door | core/cli/new.py | def f():\\n    from ..kinematics.one_design import solve
past_the_door | core/kincheck/new.py | import kincheck.core.kinematics.followed
past_the_door | adapters/new.py | from ..core.kinematics.compiled.request import Request
simulators_at_import | adapters/new.py | import mujoco
simulators_at_import | adapters/new.py | class A:\\n    from mujoco.viewer import launch
simulators_at_import | adapters/new.py
    | try:\\n    import exudyn as exu\\nexcept ImportError:\\n    exu = None
simulators_at_import | adapters/new.py | mj = importlib.import_module('mujoco')
undocumented | core/new.py | x = 1
undocumented | core/new.py | "Doc."\\ndef f(): ...
undocumented | core/new.py | "Doc."\\nclass A: ...
bare_packages | tests/test_new.py | from core.mechanism import Body
bare_packages | tests/test_new.py | import adapters.native
long_test_names | tests/test_new.py | def test_what_is_left_of_it_is_told(): ...
"""
ALLOWED = """
past_the_door | adapters/shared/new.py
    | from ...core.kinematics import NativeSolver, solve\\nfrom ...core import kinematics
past_the_door | core/kinematics/new.py | from .compiled.request import Request
simulators_at_import | adapters/new.py
    | def f():\\n    import mujoco\\n    return importlib.import_module('exudyn')
undocumented | core/new.py | "Doc."\\ndef _f(): ...
bare_packages | tests/test_new.py
    | from kincheck.core.algebra import Vec3\\nfrom .oracles.naive import A
"""


if EXTENSIONS:
    ANY = ".".join(min(EXTENSIONS).parts)
    OFFENDERS += f"""\
bound_to_extensions | tests/test_new.py | def f():\\n    from kincheck.{ANY} import EXTENSION
bound_to_extensions | tests/test_new.py | x = 'kincheck.{ANY}.nowhere'
"""
    ALLOWED += f"""\
bound_to_extensions | tests/extensions/new/test_new.py | import kincheck.{ANY}
bound_to_extensions | tests/test_new.py | x = 'kincheck.{ANY}', 'kincheck.core.extensions.gone.new'
"""


@pytest.mark.parametrize(("rule", "path", "text"), rows(OFFENDERS, named=False))
def test_source_rule_finds_offender(rule, path, text):
    assert list(RULES[rule](Path(path), ast.parse(text)))


@pytest.mark.parametrize(("rule", "path", "text"), rows(ALLOWED, named=False))
def test_source_rule_passes_allowed_code(rule, path, text):
    assert list(RULES[rule](Path(path), ast.parse(text))) == []
