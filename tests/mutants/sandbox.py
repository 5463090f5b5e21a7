"""A copy of the repository with an interpreter that imports kincheck from it."""

import ast
import json
import os
import resource
import shutil
import signal
import site
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import cache_from_source
from pathlib import Path

from ..support.sources import ROOT
from .entered import names, outermost
from .sites import Mutant

MEMORY = 12 * 2**30
"""Bytes of addresses that tests of a mutant may take."""
PARTS = ("core", "adapters", "cases")


@dataclass(frozen=True)
class Run:
    """How a run of tests ends.

    Attributes:
        outcome: "passed", "failed", "timeout" or "unknown": some tests do not exist.
        failing: tests that fail.
        output: of pytest.
    """

    outcome: str
    failing: tuple[str, ...]
    output: str


class Sandbox:
    """A temporary copy in which one file at a time is changed.

    Attributes:
        blocks: names of the blocks of all functions, in the order of their marks.
    """

    def __init__(self, folder: Path, sources: Mapping[str, str]) -> None:
        self.root = folder / "tree"
        self.reports = folder / "reports"
        self._work = folder / "work"
        self._python = folder / "venv" / "bin" / "python"
        listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listing = subprocess.run(
            listed, cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout
        for name in filter(None, listing.split("\0")):
            if (ROOT / name).is_file():
                (self.root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.root / name)
        package = folder / "site" / "kincheck"
        package.mkdir(parents=True)
        for part in PARTS:
            (package / part).symlink_to(self.root / part)
        for file in (self.root / "core/kincheck").iterdir():
            (package / file.name).symlink_to(file)
        self._install(folder)
        self.blocks = [
            block
            for path, text in sources.items()
            for name, function in outermost(ast.parse(text))
            for block in names(path.removeprefix("core/kincheck/"), name, function)
        ]
        self._numbers = folder / "blocks.json"
        self._numbers.write_text(
            json.dumps({name: k for k, name in enumerate(self.blocks)}), encoding="utf-8"
        )

    def _install(self, folder: Path) -> None:
        """Make an interpreter with the packages and commands of this one, kincheck apart."""
        venv.create(folder / "venv", symlinks=True)
        (own,) = (folder / "venv").glob("lib/python*/site-packages")
        (others,) = (each for each in site.getsitepackages() if each.startswith(sys.prefix))
        (own / "mutants.pth").write_text(
            f"{folder / 'site'}\nimport site; site.addsitedir({others!r})\n"
        )
        shutil.copy(Path(__file__).with_name("entered.py"), own / "sitecustomize.py")
        commands = self._python.parent
        for command in Path(sys.executable).parent.iterdir():
            if not (commands / command.name).exists():
                (commands / command.name).symlink_to(command)
        for name in ("kincheck", "pytest"):
            (commands / name).unlink()
            module = f"from runpy import run_module; run_module({name!r}, run_name='__main__')"
            (commands / name).write_text(f"#!{self._python}\n{module}\n")
            (commands / name).chmod(0o755)

    @contextmanager
    def changed(self, mutant: Mutant) -> Iterator[None]:
        """Have the file of a mutant changed."""
        file = self.root / mutant.path
        text = file.read_text(encoding="utf-8")
        try:
            self._write(file, mutant.applied(text))
            yield
        finally:
            self._write(file, text)

    @staticmethod
    def _write(file: Path, text: str) -> None:
        """Bytecode knows its source by size and second: it is removed."""
        file.write_text(text, encoding="utf-8")
        Path(cache_from_source(str(file))).unlink(missing_ok=True)

    def run(
        self, tests: Sequence[str], limit: float, marked: bool = False, first: bool = True
    ) -> Run:
        """Run tests in the order given, with a cache of their own.

        Args:
            limit: seconds.
            marked: whether blocks that are entered are taken down.
            first: whether the run ends with the first test that fails.
        """
        for each in (self._work, self.reports, self.root / ".hypothesis"):
            shutil.rmtree(each, ignore_errors=True)
        self._work.mkdir()
        self.reports.mkdir()
        (self.reports / "marks").write_bytes(bytes(len(self.blocks)))
        (self._work / "tests").write_text("\n".join(tests), encoding="utf-8")
        environment = {
            **os.environ,
            "PATH": f"{self._python.parent}{os.pathsep}{os.environ['PATH']}",
            "XDG_CACHE_HOME": str(self._work / "cache"),
            "TMPDIR": str(self._work),
            "KINCHECK_TESTS_ENTER": str(self.reports),
        }
        if marked:  # with bytecode of its own
            environment |= {
                "KINCHECK_FUNCTIONS": str(self._numbers),
                "PYTHONPYCACHEPREFIX": str(self._numbers.with_name("bytecode")),
            }
        command = [self._python, "-m", "pytest", "-n0", "-psitecustomize", "-pno:cacheprovider"]
        command += ["-m", "", "--hypothesis-seed=0", "--tb=short", f"@{self._work / 'tests'}"]
        with (
            tempfile.TemporaryFile("w+", encoding="utf-8") as output,
            subprocess.Popen(
                [*map(str, command), *(["-x"] if first else [])],
                cwd=self.root,
                env=environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=_bound,
            ) as process,
        ):
            try:
                status = process.wait(limit)
            except BaseException as error:
                os.killpg(process.pid, signal.SIGKILL)
                if not isinstance(error, subprocess.TimeoutExpired):
                    raise
                status = None
            output.seek(0)
            text = output.read()
        outcome = {None: "timeout", 0: "passed", 4: "unknown"}.get(status, "failed")
        failing = {test: None for test, _, end in self.read("reports") if end == "failed"}
        return Run(outcome, tuple(failing), text)

    def read(self, kind: str) -> Iterator[list]:
        """Yield what the last run has written of a kind."""
        if (file := self.reports / kind).exists():
            for line in file.read_text(encoding="utf-8").splitlines():
                yield json.loads(line)


def _bound() -> None:
    """Bound the memory of the process of tests, before they need that of the machine."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
