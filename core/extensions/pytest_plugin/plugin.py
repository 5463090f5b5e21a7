"""The pytest plugin: `pytest --kincheck` collects case files as tests, one for each engine.

    pytest --kincheck                                   # every installed engine
    pytest --kincheck --kincheck-engine mujoco          # only this one, which must be installed
    pytest --kincheck arm.toml --kincheck-recorded arm.res  # results of another program beside them

Files are TOML or JSON with the schema kincheck-case/1, anywhere pytest looks. A test fails if an
output is out of tolerance or an engine fails. A test is skipped if an engine is missing or cannot
express the case, or if nothing was compared (not judged). pytest loads this file in every session,
so slow imports wait for --kincheck.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from ...case.case import Case
    from ...cli.registry import Registry
    from ...harness.engine import Engine
    from ...harness.record import Record

SCHEMA = re.compile(rb"""(^\s*|["'])schema["']?\s*[=:]\s*["']kincheck-case/""", re.MULTILINE)
"""Mark of a TOML or JSON case file of any version: an unknown version causes a message."""
SUFFIXES = ".toml", ".json"
RECORDED = {
    "recorded": ("FILE", "results of another program, as an engine of the case files"),
    "map": ("TEXT", "the meaning of their columns, as --map of kincheck run"),
    "accuracy": ("TEXT", "their accuracy, as --accuracy of kincheck run"),
}


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
            "engine to solve them with, which must be installed; may be repeated; default: all"
            " installed engines"
        ),
    )
    for name, (metavar, text) in RECORDED.items():
        group.addoption(
            f"--kincheck-{name}", action="append", default=[], metavar=metavar, help=text
        )


def pytest_configure(config: pytest.Config) -> None:
    """Check the engines before collection."""
    names = _required_engines(config)
    if names and not config.getoption("--kincheck"):
        raise pytest.UsageError("--kincheck-engine: give --kincheck too")
    problems: list[str] = []
    if names:
        _registry().find_engines(names, problems)
    if problems:
        raise pytest.UsageError(f"--kincheck-engine: {'; '.join(problems)}")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect a case file."""
    if (
        parent.config.getoption("--kincheck")
        and file_path.suffix.lower() in SUFFIXES
        and SCHEMA.search(file_path.read_bytes())
    ):
        return CaseFile.from_parent(parent, path=file_path)  # pyright: ignore[reportUnknownMemberType]
    return None


def _required_engines(config: pytest.Config) -> list[str]:
    """Return the engines requested by name."""
    names: Any = config.getoption("--kincheck-engine")
    return [*names]


class CaseFile(pytest.File):
    """A case file with a test for each engine."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the engines' tests; an invalid file is a collection error with its message."""
        from ...case.io.reader_options import CurveOptions
        from ...cli.engine_source import RUN, sources
        from ...cli.run import Run
        from ...errors import KincheckError, refuse
        from ...harness.engine import Engine
        from ...options import asked

        registry, problems = _registry(), list[str]()
        try:
            case = registry.find_case(str(self.path))
            given: dict[str, Any] = {
                name: self.config.getoption(f"--kincheck-{name}") for name in RECORDED
            }
            curve = CurveOptions(columns=given["map"], accuracy=given["accuracy"])
            cases, recorded = [case], list[Engine]()
            if files := given["recorded"]:
                options: Any = Run(recorded=[*map(Path, files)], curve=curve)
                for source in asked(sources(RUN), options):
                    cases, found = source.engines(options, cases, problems)
                    recorded += found
            refuse(problems)
        except KincheckError as error:
            raise self.CollectError(str(error)) from None
        required = _required_engines(self.config)
        for engine in [*registry.find_engines(required or registry.engines, []), *recorded]:
            yield EngineTest.from_parent(  # pyright: ignore[reportUnknownMemberType]
                self, name=engine.name, case=cases[0], engine=engine, required=bool(required)
            )


class EngineTest(pytest.Item):
    """A test of one engine on one case.

    Attributes:
        required: whether the engine was requested by name, so that a missing engine is a failure.
    """

    def __init__(self, *, case: Case, engine: Engine, required: bool, **whole: Any) -> None:
        super().__init__(**whole)  # pyright: ignore[reportUnknownMemberType]
        self.case, self.engine, self.required = case, engine, required

    def runtest(self) -> None:
        """Solve and judge."""
        from ...harness.record import Outcome

        record = _solve(self.case, self.engine)
        if record.outcome is Outcome.UNAVAILABLE and self.required:
            from ...extras import how_to_install

            raise CaseFailedError(f"{record.message}: {how_to_install(record.engine)}")
        if record.outcome.bad:
            raise CaseFailedError(f"{record.outcome}: {record.message}")
        if record.outcome is not Outcome.PASS:
            pytest.skip(f"{record.outcome.shown}: {record.message}")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *_: Any, **__: Any) -> Any:
        """Return the message of the case's record, without a traceback through the harness."""
        if isinstance(excinfo.value, CaseFailedError):
            return f"{self.path.name}: {self.engine.name}: {excinfo.value}"
        return super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return the file and the test's name: pytest prints them as its id, FILE::ENGINE."""
        return self.path, None, self.name


class CaseFailedError(Exception):
    """Failure of an engine on a case."""


def _solve(case: Case, engine: Engine) -> Record:
    """Return the record of the pair. A simulator runs in a separate process, because a crash would
    end the tests.
    """
    from ...cli.shared_options import TOL
    from ...harness.engine import STANDARD, runs_in_process
    from ...harness.execution import solve_in_process
    from ...harness.resource_limits import Limits
    from ...harness.run import run
    from ...harness.workers.pool import in_workers

    native = engine.name == STANDARD
    solver = solve_in_process if runs_in_process(engine) else in_workers(1, Limits())
    (record,) = run(
        [case],
        [engine],
        tol=TOL,
        baseline=None if native else _registry().engine(STANDARD),
        solver=solver,
    ).records
    return record


@cache
def _registry() -> Registry:
    from ...cli.main import registry

    return registry()
