"""Delete an extension, and see that the rest works: python -m tests.deletion [NAME ...] [--tests]

For each name, by default for each extension: a copy of the sources without its folder and its tests
lists commands and engines, solves a case in native, and imports every module whose extension is
still there. With --tests it also deletes what needs the extension, collects all tests that are
left, and runs those that walk over commands, documents and sources.

With --alone a copy has an extension and its needs alone, and runs its tests; NAME kernel has no
extension, and runs the tests of the kernel. Together they take as long as the suite, and tests that
ask for no more than their extension needs are right without any other. Where each of its tests asks
for a further one, none is run.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import pytest
from kincheck.core.doors import extensions

from .support.sources import DELETED, EXTENSIONS, PACKAGE, ROOT

COPIED = "core", "adapters", "cases", "tests", "docs", ".github", ".ci"
ENDS = {0: "works", pytest.ExitCode.NO_TESTS_COLLECTED: "no test asks for it alone"}
FILES = "*.toml", "*.py", "*.md", "*.in", "*.lock", "*.cff", "Makefile", "Containerfile"
KERNEL = "kernel"
NAMES = sorted(each.name for each in EXTENSIONS)
WALKS = (
    *("tests/test_architecture.py", "tests/test_doors.py", "tests/test_packages.py"),
    *("tests/test_public_names.py", "tests/test_source_rules.py", "tests/docs"),
    *("tests/case/test_catalogue.py", "tests/cli/test_cli.py", "tests/cli/test_options.py"),
)
WORKS = """
import importlib, pkgutil, sys
import kincheck
from kincheck.core.cli.main import main
from kincheck.core.doors import extensions
there = extensions()
assert sys.argv[1] not in there, sys.argv[1]
for top in ("core", "adapters", "cases"):
    package = importlib.import_module(f"kincheck.{top}")
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        parts = module.name.split(".")
        own = parts[3] if parts[2] == "extensions" and len(parts) > 3 else parts[2]
        if own in sys.argv[2:] and own not in there:
            continue
        importlib.import_module(module.name)
for command in (["--help"], ["list"], ["run", "mcpherson_strut", "--engine", "native"]):
    try:
        status = main(command)
    except SystemExit as end:
        status = end.code
    assert status == 0, command
"""


def copy_without(names: Iterable[str], folder: Path) -> None:
    """Copy the sources without extensions, laid out as an installation has them."""
    for each in COPIED:
        shutil.copytree(
            ROOT / each, folder / each, ignore=shutil.ignore_patterns("__pycache__", ".hypothesis")
        )
    for file in (file for pattern in FILES for file in ROOT.glob(pattern)):
        shutil.copy(file, folder)
    for name in names:
        delete(name, folder)
    package = folder / "site" / "kincheck"
    shutil.copytree(folder / PACKAGE, package)
    for each in COPIED[:3]:
        (package / each).symlink_to(folder / each)


def delete(name: str, folder: Path) -> None:
    """Delete an extension and its tests in a copy."""
    (extension,) = (each for each in EXTENSIONS if each.name == name)
    shutil.rmtree(folder / extension)
    shutil.rmtree(folder / "tests" / "extensions" / name, ignore_errors=True)


def those_that_need(name: str) -> set[str]:
    """Return the extensions that are not there without another one."""
    found = {each.name for each in extensions().values() if name in each.needs}
    return found.union(*map(those_that_need, found))


def needed(name: str) -> set[str]:
    """Return the extensions that one needs, directly or by another."""
    needs = set(extensions()[name].needs) if name in extensions() else set[str]()
    return needs.union(*map(needed, needs))


def steps(name: str, folder: Path, options: argparse.Namespace) -> Iterator[Sequence[str]]:
    """Make the copy of a name, and yield the commands to run in it, each when it is ready."""
    run = (sys.executable, "-m", "pytest")
    if options.alone:
        copy_without(set(NAMES) - {name, *needed(name)}, folder)
        own = "tests" if name == KERNEL else f"tests/extensions/{name}"
        if (folder / own).exists():
            yield *run, "--numprocesses", "auto", own
        return
    copy_without([name], folder)
    yield sys.executable, "-c", WORKS, name, *NAMES
    if options.tests:
        for each in those_that_need(name):
            delete(each, folder)
        yield *run, "--collect-only"
        yield *run, "--numprocesses", "auto", *WALKS


def main() -> int:
    """Print a line for each step; return 1 if something broke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", choices=[KERNEL, *NAMES, []])
    parser.add_argument("--tests", action="store_true", help="collect and walk, too")
    parser.add_argument("--alone", action="store_true", help="with its needs alone: its tests")
    options = parser.parse_args()
    failed = False
    for name in options.names or ([KERNEL, *NAMES] if options.alone else NAMES):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            own = {"PYTHONPATH": str(folder / "site"), DELETED: " ".join(NAMES)}
            for command in steps(name, folder, options):
                done = subprocess.run(
                    command, cwd=folder, env=os.environ | own, capture_output=True, text=True
                )
                found = ENDS.get(done.returncode, "broke")
                lines = (done.stdout + done.stderr).splitlines() if found == "broke" else []
                failed |= found == "broke"
                print(f"{name}: {found}", *lines[-40:], sep="\n", flush=True)
    return failed


if __name__ == "__main__":
    raise SystemExit(main())
