"""Which tests enter which function: taken down once for a text of a test file, and kept."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path

from ..support.sources import ROOT, SOURCES, TESTS, imported, module_of, tree
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
    """Functions that tests enter.

    Attributes:
        file: where it is kept.
        texts: test file -> checksum of the text that was run.
        functions: "path function" in the order of their bits.
        tests: test -> its seconds, and the bits of the functions that it enters.
        failing: tests that fail without a change of the sources; they judge nothing.
    """

    file: Path
    texts: dict[str, str] = field(default_factory=dict)
    functions: list[str] = field(default_factory=list)
    tests: dict[str, tuple[float, str]] = field(default_factory=dict)
    failing: list[str] = field(default_factory=list)

    @classmethod
    def read(cls, file: Path) -> "Entered":
        return cls(file, **json.loads(file.read_text("utf-8"))) if file.exists() else cls(file)

    def _keep(self) -> None:
        kept = {name: value for name, value in vars(self).items() if name != "file"}
        beside = self.file.with_suffix(".new")
        beside.write_text(json.dumps(kept), encoding="utf-8")
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
                print(f"which test enters which function: {', '.join(some)}", flush=True)
                self._take_down(sandbox, some)
                self.texts |= {path: now[path] for path in some}
                self._keep()

    def _take_down(self, sandbox: Sandbox, files: Sequence[str]) -> None:
        run = sandbox.run(files, LIMIT, marked=True, first=False)
        if run.outcome in ("timeout", "unknown"):
            raise SystemExit(f"{run.output}\n{', '.join(files)}: {run.outcome}")
        bits = {function: 1 << k for k, function in enumerate(self.functions)}
        entered = {
            test: sum(
                bits.setdefault(name, 1 << len(bits))
                for name in (sandbox.functions[number] for number in numbers)
            )
            for test, numbers in sandbox.read("entered")
        }
        self.functions = [*bits]
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

    def stages(self, mutant: Mutant) -> Iterator[list[str]]:
        """Yield the tests of a mutant, those first that most likely see it, each test once: some
        that enter the function, the others, those in the same files, and the rest.
        """
        function = mutant.function
        if function:
            first = self._entering(lambda name: name == f"{_inside(mutant.path)} {function}")
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
        mask = sum(1 << k for k, name in enumerate(self.functions) if chosen(name))
        return [test for test, (_, entered) in self.tests.items() if int(entered, 16) & mask]

    def seconds(self, test: str) -> float:
        return self.tests[test][0]


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
