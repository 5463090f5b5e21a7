"""Delete an extension, and see that the rest works: python -m tests.deletion [NAME ...] [--tests]

For each name, by default for each extension: a copy of the sources without its folder and its tests
lists commands and engines, solves a case in native, and imports every module whose extension is
still there. With --tests it also deletes what needs the extension, and runs the tests that are
left.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from kincheck.core.doors import extensions

from .support.sources import EXTENSIONS, PACKAGE, ROOT

COPIED = "core", "adapters", "cases", "tests", "docs", ".github", ".ci"
FILES = "*.toml", "*.py", "*.md", "*.in", "*.lock", "*.cff", "Makefile", "Containerfile"
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


def copy_without(name: str, folder: Path) -> None:
    """Copy the sources without an extension, laid out as an installation has them."""
    for each in COPIED:
        shutil.copytree(
            ROOT / each, folder / each, ignore=shutil.ignore_patterns("__pycache__", ".hypothesis")
        )
    for file in (file for pattern in FILES for file in ROOT.glob(pattern)):
        shutil.copy(file, folder)
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


def main() -> int:
    """Print a line for each extension; return 1 if something broke without one."""
    names = sorted(each.name for each in EXTENSIONS)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", choices=[*names, []])
    parser.add_argument("--tests", action="store_true", help="run the tests that are left, too")
    options = parser.parse_args()
    failed = False
    for name in options.names or names:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            copy_without(name, folder)
            environment = {**os.environ, "PYTHONPATH": str(folder / "site")}
            commands = [[sys.executable, "-c", WORKS, name, *names]]
            if options.tests:
                commands.append([sys.executable, "-m", "pytest", "--numprocesses", "auto"])
            for k, command in enumerate(commands):
                for each in those_that_need(name) if k else ():
                    delete(each, folder)
                done = subprocess.run(
                    command, cwd=folder, env=environment, capture_output=True, text=True
                )
                broken = done.returncode != 0
                failed = failed or broken
                lines = (done.stdout + done.stderr).splitlines() if broken else []
                print(
                    f"{name}: {'broke' if broken else 'works without it'}", *lines[-20:], sep="\n"
                )
    return failed


if __name__ == "__main__":
    raise SystemExit(main())
