"""Files and packages: sizes, names, what is packaged, and what loads when."""

import ast
import re
import subprocess
import sys
from pathlib import Path

from kincheck.core import kinematics

from .support.sources import DOOR, PACKAGE, PAGES, ROOT, SOURCES, TESTS, tree
from .test_source_rules import SIMULATORS

LONGEST = 600
WIDEST = 100


def lines(path: Path) -> int:
    return len((ROOT / path).read_text("utf-8").splitlines())


def test_source_files_are_short():
    assert {str(path): n for path in [*SOURCES, *PAGES] if (n := lines(path)) > LONGEST} == {}


def test_page_lines_are_narrow():
    """As ruff holds it for Python."""
    wide = [
        f"{path}:{number}"
        for path in PAGES
        for number, line in enumerate((ROOT / path).read_text("utf-8").splitlines(), 1)
        if len(line) > WIDEST
    ]
    assert wide == []
    assert {path.suffix for path in PAGES} == {".css", ".html", ".js"}


def test_kinematics_names_match_type_checking_imports():
    """And none of a module, which would take its place once imported."""
    seen = {
        alias.name: node.module
        for node in ast.walk(tree(DOOR))
        if isinstance(node, ast.ImportFrom) and node.level
        for alias in node.names
    }
    assert seen == kinematics._MODULES
    assert all(hasattr(kinematics, name) for name in seen)
    assert {*seen}.isdisjoint(path.stem for path in (ROOT / DOOR).parent.iterdir())


def test_harness_names_native_once():
    """Engines tell by attributes what the harness must know; none is asked for by its name."""
    named = [
        str(path.relative_to(ROOT))
        for path in sorted((ROOT / "core" / "harness").rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Constant) and node.value == "native"
    ]
    assert named == ["core/harness/engine.py"]


def test_no_file_is_named_utils():
    assert [path for path in SOURCES + TESTS if "util" in path.stem or "helper" in path.stem] == []


def test_folders_of_sources_are_packages():
    """setup.py takes each folder of sources for one."""
    setup = (ROOT / "setup.py").read_text("utf-8")
    assert f'Path("{PACKAGE}")' in setup
    assert all((ROOT / path.parent / "__init__.py").exists() for path in SOURCES)


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


def test_importing_all_modules_loads_no_simulator():
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


def test_tests_import_installed_packages():
    assert {"core", "adapters", "cases"} & set(sys.modules) == set()


def test_release_and_image_take_pinned_content():
    """Every installation is by hashes or without dependencies, and the image's base by a digest."""
    release = (ROOT / ".github/workflows/release.yml").read_text("utf-8")
    image = (ROOT / "Containerfile").read_text("utf-8")
    installs = re.findall(r"pip install (.*)", release + image)
    assert len(installs) == 5
    assert [each for each in installs if not re.search("--require-hashes|--no-deps", each)] == []
    assert set(re.findall(r"^FROM (\S+)", image, re.MULTILINE)) == {"${BASE}"}
    assert re.search(r"^ARG BASE=\S+@sha256:[0-9a-f]{64}$", image, re.MULTILINE)
    assert "build --no-isolation" in release  # else it would fetch setuptools itself
    for lock in ROOT.glob("requirements*.lock"):
        assert "--hash=sha256:" in lock.read_text("utf-8")
