"""The files of the repository, their syntax trees and their imports. Files are read, not run."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = Path("core/kincheck")
"""Folder of the package kincheck itself, which names its parts in full: they lie elsewhere."""
DOOR = Path("core/kinematics/__init__.py")


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
    return ast.parse((ROOT / path).read_text("utf-8"))


def statements(node):
    """Yield all statements below a node, however deep; expressions are not read."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            yield from statements(child)


@cache
def imported(path, syntax):
    """Return the imports of a file as paths from the top; relative ones are resolved, and those of
    the package kincheck itself.
    """
    return [*_resolved(path, syntax)]


def _resolved(path, syntax):
    for target in _named(path, syntax):
        if path.parent != PACKAGE or target[0] != "kincheck":
            yield target
        elif len(target) > 1 and target[1] in ("core", "adapters", "cases"):
            yield target[1:]
        else:
            yield (*PACKAGE.parts, *target[1:])


def _named(path, syntax):
    for node in statements(syntax):
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


def module_of(target):
    """Return the file that an import loads, or None where it is not one of ours."""
    return MODULES.get(target) or MODULES.get(target[:-1])


def folder_of(path):
    """Return the folder of core that a file belongs to, as the table names it."""
    if path == Path("core/__init__.py"):
        return "__init__"
    return "/".join(path.parts[1:-1]) or "."


EXTENSIONS = frozenset(
    path.parent for path in SOURCES if "\nEXTENSION = " in (ROOT / path).read_text("utf-8")
)
"""Folders of extensions."""
DELETED = "KINCHECK_DELETED"
"""Environment variable: extensions that tests may name though they have no folder."""


def extension_of(path):
    """Return the extension that a file belongs to; None for the kernel."""
    return next((folder.name for folder in path.parents if folder in EXTENSIONS), None)
