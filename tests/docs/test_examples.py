"""Every command and every Python example of the README and of the documentation runs as printed."""

import os
import re
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from ..support.sources import ROOT, files
from .page import LANGUAGES, blocks, commands, differences

README = ROOT / "README.md"
PAGES = [ROOT / path for path in files("docs", "core", "adapters", ending="md")]
SHELL = """
set -eu -o pipefail
if [ -e "$SAVED" ]; then . "$SAVED"; fi
{script}
export -p > "$SAVED"
"""
SERVER = Path(__file__).with_name("command_server.py")


@pytest.fixture(scope="module")
def commands_folder(tmp_path_factory):
    """A folder with the command kincheck, which a server executes."""
    folder = tmp_path_factory.mktemp("commands")
    address = str(folder / "socket")
    command = folder / "kincheck"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -ISE {SERVER} {address} "$@"\n')
    command.chmod(0o755)
    with subprocess.Popen(
        [sys.executable, SERVER, "serve", address], cwd=folder, stdout=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout.readline() == "ready\n"
            yield folder
        finally:
            server.kill()


def needs(page):
    """The extensions without which the examples of a page do not run."""
    named = re.search(r"^<!-- needs: (.*) -->$", page.read_text("utf-8"), re.MULTILINE)
    return pytest.mark.needs(*(named[1].split() if named else ()))


class Reader:
    """Someone who works through a page in an empty folder.

    The shell of a block has the variables of the blocks before.
    """

    def __init__(self, folder, commands):
        self.folder = folder / "work"
        self.folder.mkdir()
        self.environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith("KINCHECK")},
            "PATH": os.pathsep.join(
                [str(commands), str(Path(sys.executable).parent), os.environ["PATH"]]
            ),
            "SAVED": str(folder / "variables"),
            "COLUMNS": "100",
        }
        self.names = {"__name__": "__main__"}

    def types(self, script):
        """Run a script; return exit status, standard output and standard error."""
        done = subprocess.run(
            ["bash", "-c", SHELL.format(script=script)],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
        return done.returncode, done.stdout, done.stderr

    def executes(self, text, where):
        """Execute Python and its tests; return the printed text."""
        known = set(self.names)
        with redirect_stdout(StringIO()) as printed:
            exec(compile(text, where, "exec"), self.names)
            for name in sorted(set(self.names) - known):
                if name.startswith("test_"):
                    self.names[name]()
        return printed.getvalue()


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(page, marks=[needs(page), *([] if page == README else [pytest.mark.nightly])])
        for page in (README, *PAGES)
    ],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_documentation_examples_run_as_printed(
    path, tmp_path, commands_folder, monkeypatch, own_joint_types
):
    reader = Reader(tmp_path, commands_folder)
    monkeypatch.chdir(reader.folder)
    monkeypatch.syspath_prepend(str(reader.folder))
    modules = set(sys.modules)
    try:
        for block in blocks(path.read_text("utf-8")):
            follow(reader, block, f"{path.relative_to(ROOT)}:{block.line}")
        check_regressions(reader.folder)
    finally:
        for name in set(sys.modules) - modules:
            if str(reader.folder) in (getattr(sys.modules[name], "__file__", None) or ""):
                del sys.modules[name]


def check_regressions(folder):
    """Equal runs regress by their times at most: only those depend on the load of the machine."""
    for file in folder.glob("*.md"):
        for headline in re.findall("^## run .*", file.read_text("utf-8"), re.MULTILINE):
            assert re.search(r": (nothing regressed|\d+ slower)(;|$)", headline), headline


def follow(reader, block, where):
    """Do what one block says."""
    assert block.language in LANGUAGES, f"{where}: a block of language {block.language!r}"
    if block.excuse:
        return
    if block.title:
        target = reader.folder / block.title
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(block.text, "utf-8")
    elif block.language == "python":
        printed = reader.executes(block.text, where)
        if block.shown is not None:
            lacks = differences(block.shown, printed)
            assert not lacks, f"{where}: no line {lacks!r} in\n{printed}"
    elif block.language in ("sh", "console"):
        scripts = [(block.text, "")] if block.language == "sh" else [*commands(block.text)]
        for k, (script, shown) in enumerate(scripts, 1):
            status, output, errors = reader.types(script)
            expected = block.status if k == len(scripts) else 0
            assert status == expected, f"{where}: status {status}\n{script}\n{output}\n{errors}"
            lacks = differences(shown, f"{output}\n{errors}")
            assert not lacks, f"{where}: no line {lacks!r} in\n{output}\n{errors}"
