"""Options that extensions add to the commands that run engines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import make_dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

from ..doors import offers
from ..errors import KincheckError
from ..options import option_fields, options
from .parser import Command

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..harness.execution import Solver
    from ..harness.resource_limits import Limits

RUN, CHECK_ENGINE, WORKERS = "run", "check-engine", "workers"


class WorkersError(KincheckError):
    """Workers of pairs cannot be reached, or were lost: the results so far are kept."""


@options
class EngineSource(Command):
    """Options that an extension adds to a command, with their meaning. The functions get all
    options of the command, and are called if one of their own is given.

    Attributes:
        FOR: the command, "run" or "check-engine"; or "workers": all commands with worker processes.
        COLUMNS: names of the options whose files have columns, as --map explains them.
        MOTIONS: names of those whose files hold a motion, which may drive a file without one.
    """

    FOR: ClassVar[str] = RUN
    COLUMNS: ClassVar[Sequence[str]] = ()
    MOTIONS: ClassVar[Sequence[str]] = ()

    @staticmethod
    def contradictions(options: Any) -> list[str]:
        """Return the contradictions between the options."""
        return []

    @staticmethod
    def engines(
        options: Any, cases: Sequence[Case], problems: list[str]
    ) -> tuple[list[Case], list[Engine]]:
        """Return the cases as the engines need them, and the engines.

        Args:
            problems: receives the messages of engines that cannot be had.
        """
        return [*cases], []

    @staticmethod
    def efforts(options: Any) -> Any:
        """Return the work-precision data for the report, a list of efforts by case; None without.

        Raises:
            KincheckError: their file cannot be read.
        """
        return None

    @staticmethod
    def unreachable(options: Any) -> list[str]:
        """Return why the workers cannot be reached: the last check before the work, which takes
        time.
        """
        return []

    @staticmethod
    def solver(options: Any, limits: Limits) -> tuple[Solver, dict[str, Any]] | None:
        """Return the solver of pairs on other workers, and its settings for the results; None
        without such an option.
        """
        return None


@cache
def sources(command: str) -> Sequence[type[EngineSource]]:
    """Return the options that extensions add to a command."""
    found: list[type[EngineSource]] = [each.load() for each in offers("sources").values()]
    return [each for each in found if command == each.FOR]


def options_for(command: str) -> Any:
    """Return a class with all options that extensions add to a command."""
    return make_dataclass("Added", (), bases=(*sources(command), Command), frozen=True)


def names_of(source: type[EngineSource]) -> list[str]:
    """Return the names of the options of a source, without destinations of results."""
    return [each.name for each, *_ in option_fields(source) if each.init]


def given(options: Any, which: str) -> bool:
    """Return whether an option is given whose files have columns ("COLUMNS") or a motion
    ("MOTIONS").
    """
    names = [name for source in sources(RUN) for name in getattr(source, which)]
    return any(getattr(options, name) for name in names)
