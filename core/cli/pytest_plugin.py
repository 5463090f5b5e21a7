"""The pytest plugin: `pytest --kincheck` collects case files as tests, one for each engine.

    pytest --kincheck                                   # every engine that is installed
    pytest --kincheck --kincheck-engine mujoco          # this one only, and it must be there

Files are TOML or JSON with the schema kincheck-case/1, anywhere pytest looks. A test fails where an
output is out of tolerance or an engine breaks, and is skipped where an engine is missing, cannot
express the case, or where nothing was compared (not judged). pytest loads this file every time: all
that is slow to import waits for --kincheck.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..harness.record import Record
    from .registry import House

SCHEMA = re.compile(rb"""(^\s*|["'])schema["']?\s*[=:]\s*["']kincheck-case/""", re.MULTILINE)
"""What makes a TOML or JSON file a case file, of whatever version: an unknown one is to be told,
not passed by.
"""
SUFFIXES = ".toml", ".json"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("kincheck", "kinematic case files as tests")
    group.addoption(
        "--kincheck",
        action="store_true",
        help="collect case files (TOML or JSON, schema kincheck-case/1) as tests",
    )
    group.addoption(
        "--kincheck-engine",
        action="append",
        default=[],
        metavar="NAME",
        help=(
            "an engine to solve them with, which must be installed; may be repeated; default: all,"
            " skipped where not installed"
        ),
    )


def pytest_configure(config: pytest.Config) -> None:
    """Find out about the engines before anything is collected."""
    names = _required(config)
    if names and not config.getoption("--kincheck"):
        raise pytest.UsageError("--kincheck-engine: give --kincheck too")
    problems: list[str] = []
    if names:
        _house().find_engines(names, problems)
    if problems:
        raise pytest.UsageError(f"--kincheck-engine: {'; '.join(problems)}")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take what is a case file."""
    if (
        parent.config.getoption("--kincheck")
        and file_path.suffix.lower() in SUFFIXES
        and SCHEMA.search(file_path.read_bytes())
    ):
        return CaseFile.from_parent(parent, path=file_path)  # pyright: ignore[reportUnknownMemberType]
    return None


def _required(config: pytest.Config) -> list[str]:
    """The engines asked for by name."""
    names: Any = config.getoption("--kincheck-engine")
    return [*names]


class CaseFile(pytest.File):
    """A case file: a test for each engine."""

    def collect(self) -> Iterator[pytest.Item]:
        """The engines' tests; a file that makes no sense is an error of the collection, with its
        message.
        """
        from ..errors import KincheckError

        house = _house()
        try:
            case = house.find_case(str(self.path))
        except KincheckError as error:
            raise self.CollectError(str(error)) from None
        required = _required(self.config)
        for engine in house.find_engines(required or house.engines, []):
            yield EngineTest.from_parent(
                self, name=engine.name, case=case, engine=engine, required=bool(required)
            )  # pyright: ignore[reportUnknownMemberType]


class EngineTest(pytest.Item):
    """One engine on one case.

    Attributes:
        required: it was asked for by name: to be missing is a failure.
    """

    def __init__(self, *, case: Case, engine: Engine, required: bool, **whole: Any) -> None:
        super().__init__(**whole)  # pyright: ignore[reportUnknownMemberType]
        self.case, self.engine, self.required = case, engine, required

    def runtest(self) -> None:
        """Solve and judge."""
        from ..harness.record import Outcome

        record = _solved(self.case, self.engine)
        if record.outcome is Outcome.UNAVAILABLE and self.required:
            from ..report.progress import how_to_install

            raise CaseFailedError(f"{record.message}: {how_to_install(record.engine)}")
        if record.outcome.bad:
            raise CaseFailedError(f"{record.outcome}: {record.message}")
        if record.outcome is not Outcome.PASS:
            pytest.skip(f"{record.outcome.shown}: {record.message}")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *_: Any, **__: Any) -> Any:
        """What the case's record says; where in the harness it was found is of no interest."""
        if isinstance(excinfo.value, CaseFailedError):
            return f"{self.path.name}: {self.engine.name}: {excinfo.value}"
        return super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The file, and the test in it: pytest prints them as the id that it takes,
        FILE::ENGINE.
        """
        return self.path, None, self.name


class CaseFailedError(Exception):
    """An engine has failed a case."""


def _solved(case: Case, engine: Engine) -> Record:
    """The record of the pair; a simulator is kept in a process of its own: it may take the tests
    down with it.
    """
    from ..harness.execution import here
    from ..harness.resource_limits import Limits
    from ..harness.run import NATIVE, run
    from ..harness.workers.pool import in_workers
    from .run import TOL

    native = engine.name == NATIVE
    solver = here if native else in_workers(1, Limits())
    (record,) = run(
        [case],
        [engine],
        tol=TOL,
        baseline=None if native else _house().engine(NATIVE),
        solver=solver,
    ).records
    return record


@cache
def _house() -> House:
    from .main import house

    return house()
