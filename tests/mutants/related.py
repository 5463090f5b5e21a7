"""Which tests enter which block: taken down once for a text of a test file, and kept."""

import ast
import gzip
import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path

from ..support.sources import ROOT, SOURCES, TESTS, imported, module_of, tree
from .entered import blocks, names, outermost
from .sandbox import Sandbox
from .sites import Mutant

AT_ONCE = 8
"""Test files that are run at once."""
FIRST_LOOK = 60.0
"""Seconds of the first tests of a mutant that no test finds."""
LIMIT = 7200.0
"""Seconds in which they end, on a busy machine."""


@dataclass
class Entered:
    """Blocks of functions that tests enter.

    Attributes:
        file: where it is kept.
        texts: test file -> checksum of the text that was run.
        blocks: their names in the order of their bits.
        tests: test -> its seconds, and the bits of the blocks that it enters.
        failing: tests that fail without a change of the sources; they judge nothing.
    """

    file: Path
    texts: dict[str, str] = field(default_factory=dict)
    blocks: list[str] = field(default_factory=list)
    tests: dict[str, tuple[float, str]] = field(default_factory=dict)
    failing: list[str] = field(default_factory=list)

    @classmethod
    def read(cls, file: Path) -> "Entered":
        return (
            cls(file, **json.loads(gzip.decompress(file.read_bytes())))
            if file.exists()
            else cls(file)
        )

    def _keep(self) -> None:
        kept = {name: value for name, value in vars(self).items() if name != "file"}
        beside = self.file.with_suffix(".new")
        beside.write_bytes(gzip.compress(json.dumps(kept).encode(), 5))
        beside.replace(self.file)

    def renew(self, sandbox: Sandbox) -> None:
        """Run the test files that are new or have changed, folder by folder."""
        now = {
            str(path): hashlib.sha256((ROOT / path).read_bytes()).hexdigest()
            for path in TESTS
            if path.name.startswith("test_")
        }
        gone = {path for path, text in self.texts.items() if now.get(path) != text}
        self.tests = {test: of for test, of in self.tests.items() if file_of(test) not in gone}
        self.failing = [test for test in self.failing if file_of(test) not in gone]
        self.texts = {path: text for path, text in self.texts.items() if path not in gone}
        folders: dict[Path, list[str]] = {}
        for path in now:
            if path not in self.texts:
                folders.setdefault(Path(path).parent, []).append(path)
        for files in folders.values():
            for some in (files[k : k + AT_ONCE] for k in range(0, len(files), AT_ONCE)):
                print(f"which test enters which block: {', '.join(some)}", flush=True)
                self._take_down(sandbox, some)
                self.texts |= {path: now[path] for path in some}
                self._keep()

    def _take_down(self, sandbox: Sandbox, files: Sequence[str]) -> None:
        run = sandbox.run(files, LIMIT, marked=True, first=False)
        if run.outcome in ("timeout", "unknown"):
            raise SystemExit(f"{run.output}\n{', '.join(files)}: {run.outcome}")
        bits = {block: 1 << k for k, block in enumerate(self.blocks)}
        entered = {
            test: sum(
                bits.setdefault(name, 1 << len(bits))
                for name in (sandbox.blocks[number] for number in numbers)
            )
            for test, numbers in sandbox.read("entered")
        }
        self.blocks = [*bits]
        seconds: dict[str, float] = {}
        for test, duration, _ in sandbox.read("reports"):
            seconds[test] = seconds.get(test, 0.0) + duration
        for test, duration in seconds.items():
            self.tests[test] = duration, f"{entered.get(test, 0):x}"
        if run.failing:
            again = sandbox.run(run.failing, LIMIT, first=False)
            self.failing += again.failing
            for test in again.failing:
                print(f"fails without a change, and judges nothing: {test}")

    def stages(self, mutant: Mutant, text: str) -> Iterator[list[str]]:
        """Yield the tests of a mutant, those first that most likely see it, each test once.

        Of a line in a block: some that enter the block, or that entered another text of its
        function, then the others. No further test runs the line. Elsewhere, and in a function that
        no test entered: those that enter the function or its module, those in the same files, and
        the rest.

        Args:
            text: of the file, unchanged.
        """
        function, block = mutant.function, block_of(mutant, text)
        own = f"{_inside(mutant.path)} {function} "
        if block and any(name.startswith(own) for name in self.blocks):
            known = block.partition("#")[0] + "#"
            inside = self._entering(
                lambda name: name == block or (name.startswith(own) and not name.startswith(known))
            )
            some = [test for test in self._some(inside) if test not in self.failing]
            yield sorted(some, key=self.seconds)
            rest = {*inside} - {*some} - {*self.failing}
            yield sorted(rest, key=self.seconds)
            return
        if function:
            first = self._entering(lambda name: name.startswith(own))
        else:
            first = self._entering(lambda name: name.split()[0] == _inside(mutant.path))
        files = {file_of(test) for test in first}
        users = {_inside(str(path)) for path in _importing(Path(mutant.path))}
        second = [test for test in self.tests if file_of(test) in files]
        if not function:
            second += self._entering(lambda name: name.split()[0] in users)
        judged = set(self.failing)
        for stage in (self._some(first), first, second, [*self.tests]):
            tests = [test for test in dict.fromkeys(stage) if test not in judged]
            judged.update(tests)
            yield sorted(tests, key=self.seconds)

    def _some(self, tests: Sequence[str]) -> list[str]:
        """Return the short ones of every file in turn, within the time of a first look."""
        by_file: dict[str, list[str]] = {}
        for test in sorted(tests, key=self.seconds):
            by_file.setdefault(file_of(test), []).append(test)
        turns = (test for turn in zip_longest(*by_file.values()) for test in turn if test)
        some, seconds = list[str](), 0.0
        for test in turns:
            seconds += self.seconds(test)
            if some and seconds > FIRST_LOOK:
                break
            some.append(test)
        return some

    def _entering(self, chosen) -> list[str]:
        mask = sum(1 << k for k, name in enumerate(self.blocks) if chosen(name))
        return [test for test, (_, entered) in self.tests.items() if int(entered, 16) & mask]

    def seconds(self, test: str) -> float:
        return self.tests[test][0]


def block_of(mutant: Mutant, text: str) -> str:
    """Return the name of the smallest block with the mutant's line; empty outside of all, as in the
    head of a function.
    """
    line = mutant.start[0]
    for name, function in outermost(ast.parse(text)):
        if name == mutant.function and function.lineno <= line <= function.end_lineno:
            every = zip(blocks(function), names(_inside(mutant.path), name, function), strict=True)
            around = [
                (each[-1].end_lineno - each[0].lineno, block)
                for each, block in every
                if each[0].lineno <= line <= each[-1].end_lineno
            ]
            return min(around, default=(0, ""))[1]
    return ""


def file_of(test: str) -> str:
    """Return the file of a test."""
    return test.partition("::")[0]


def _inside(path: str) -> str:
    """Return the path of a source inside the package."""
    return path.removeprefix("core/kincheck/")


def _importing(path: Path) -> Iterator[Path]:
    for each in SOURCES:
        if any(module_of(target) == path for target in imported(each, tree(each))):
            yield each
