"""Registry of engines, cases and writers for the commands, with search by name."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from fnmatch import fnmatchcase
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..case.io.reader_options import NOTHING, Supplied
from ..case.io.readers import LEFT_OUT
from ..errors import MOST_NAMED, KincheckError, OpenError, SolveError, shortened, unknown
from ..report.progress import complain
from .class_loading import WHERE, create_engine, load_engine

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..harness.record import Results


class Status(IntEnum):
    """Exit status: all within tolerance (0); something deviates or fails (1); the tool could not do
    all of its work (2).

    An interrupted command exits with the shell's status for the signal; see `interrupts`.
    """

    WITHIN = 0
    DEVIATES = 1
    FAILED = 2

    @classmethod
    def of(cls, results: Results) -> Status:
        """Return the status of complete results."""
        return cls(any(record.outcome.bad for record in results.records))


@dataclass(frozen=True)
class Registry:
    """The available engines and built-in cases, loaded on use.

    Attributes:
        engines: names of the engines in projection mode, in the order of the results.
        engine: returns the engine of a name, and of a mode if it is not projection.
        cases: returns the names of the built-in cases.
        case: returns the built-in case of a name, with its reference.
        summary: returns kind of reference and source of a built-in case by its name, without
            loading it.
        simulations: names of the engines in simulate mode.
    """

    engines: Sequence[str]
    engine: Callable[..., Any]
    cases: Callable[[], Sequence[str]]
    case: Callable[[str], Case]
    summary: Callable[[str], tuple[str, str]]
    simulations: Sequence[str] = ()

    @property
    def every_engine(self) -> list[str]:
        """The names of the engines of both modes."""
        return [*dict.fromkeys((*self.engines, *self.simulations))]

    def case_of(self, options: Any, *, driven: bool = True) -> Case:
        """Return the case that options name, and print what is left out of another tool's file."""
        case = self.find_case(options.case, options.supplied, driven=driven)
        if options.command:
            tell_left_out([case])
        return case

    def find_case(self, name: object, supplied: Supplied = NOTHING, *, driven: bool = True) -> Case:
        """Return the case of a name or in a file, and a case itself.

        Args:
            supplied: facts missing in a file of another tool.
            driven: require drivers for all degrees of freedom.

        Raises:
            KincheckError: there is no such case, a pattern matches several, its file is invalid,
                or its drivers do not match its degrees of freedom.
        """
        from ..case.case import Case
        from ..case.models.files import load, reader_of, suffixes
        from ..kinematics import require_driven

        if isinstance(name, Case):
            return name
        if not isinstance(name, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise KincheckError(f"{name!r} is no case. Give a name, a path, or a kincheck.Case.")
        if not isinstance(supplied, Supplied):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise KincheckError(f"supplied: found {supplied!r}, expected kincheck.Supplied(...)")
        name = str(name)
        matching, known = self.matching_names(name), self.cases()
        if len(matching) > 1:
            raise KincheckError(
                f"{name!r} matches {len(matching)} cases: {shortened(matching, MOST_NAMED)}. Name"
                " one of them."
            )
        (name,) = matching
        if name in known:
            if supplied.given:
                raise KincheckError(
                    f"{name}: --{supplied.given[0]} is for files, and this is a built-in case."
                    " Leave it out."
                )
            case = self.case(name)
        elif Path(name).suffix in suffixes() or os.sep in name or os.path.exists(name):
            case = load(Path(name), supplied)
            if supplied.recorded and reader_of(Path(name), supplied).leaves_freedoms:
                return case  # it says itself what is left to the recording
        else:
            missing = unknown("case", name, known)
            raise KincheckError(
                f"{missing}{'' if missing.endswith('?') else '.'}"
                " Case files end in .toml or .json, tables in .csv or .xlsx, models in .xml,"
                " .urdf, .sdf, .usd, .osim or .adm"
            )
        if not driven:
            return case
        try:
            require_driven(case.mechanism)
        except SolveError as error:  # The error names the mechanism; the user knows the file.
            raise KincheckError(
                f"{name}: {'drivers' if case.mechanism.moving else 'bodies'}: {error}"
            ) from error
        return case

    def matching_names(self, name: str) -> list[str]:
        """Return the built-in cases and files that match a shell-style pattern; return any other
        name unchanged.

        Raises:
            KincheckError: the pattern matches nothing.
        """
        if not set(name) & set("*?[") or os.path.exists(name):
            return [name]
        found = [each for each in self.cases() if fnmatchcase(each, name)] + sorted(glob(name))
        if not found:
            raise KincheckError(
                f"no built-in case and no file matches {name!r}. kincheck list shows the cases."
            )
        return found

    def find_cases(
        self,
        names: Sequence[str],
        unread: dict[str, str],
        found: Sequence[Case] = (),
        supplied: Supplied = NOTHING,
        *,
        driven: bool = True,
    ) -> list[Case]:
        """Return the cases already found, and the cases of names, files and patterns.

        Args:
            unread: receives the messages of unreadable cases, by the given names.
            driven: see `find_case`.
        """
        cases = {case.name: case for case in found}
        wanted: dict[str, None] = {}
        for name in names:
            try:
                wanted |= dict.fromkeys(self.matching_names(name))
            except KincheckError as error:
                unread[name] = str(error)
        for name in wanted:
            try:
                case = self.find_case(name, supplied, driven=driven)
            except KincheckError as error:
                if isinstance(error, OpenError) and len(wanted) == 1:  # the user is asked
                    raise
                unread[name] = str(error)
                continue
            if case.name in cases:
                unread[name] = (
                    f"{name}: there are two cases named {case.name!r}; names identify results:"
                    " rename one"
                )
            else:
                cases[case.name] = case
        return list(cases.values())

    def find_engines(
        self, names: Sequence[str | Engine | None], problems: list[str], mode: str | None = None
    ) -> list[Engine]:
        """Return the engines, each once, of names and MODULE:CLASS, and engines themselves.

        Args:
            problems: receives the messages of unknown names and missing modes.
            mode: the mode; None for the first mode of each engine.
        """
        engines: list[Engine] = []
        for k, name in enumerate(names):
            if not isinstance(name, str):
                engines.append(create_engine(repr(name), name))
                continue
            if name in names[:k]:
                continue
            given, loaded = name, None
            if WHERE.fullmatch(name):
                try:
                    loaded = load_engine(name)
                except KincheckError as error:
                    problems.append(str(error))
                    continue
                modes = [loaded.mode]
            else:
                given = repr(name)
                by_mode = {"projection": self.engines, "simulate": self.simulations}
                modes = [each for each, known in by_mode.items() if name in known]
            if not modes:
                problems.append(unknown("engine", name, self.every_engine))
            elif mode not in (None, *modes):
                problems.append(
                    f"engine {given} has the mode {modes[0]!r}, not {mode!r}. Leave out --mode or"
                    " the engine."
                )
            else:
                engines.append(loaded or self._load_engine(name, mode or modes[0]))
        return engines

    def baseline(self, engines: Sequence[Engine]) -> Engine | None:
        """Return the native engine as the standard; None if it is among the engines."""
        from ..harness.engine import STANDARD

        return None if STANDARD in (each.name for each in engines) else self.engine(STANDARD)

    def _load_engine(self, name: str, mode: str) -> Engine:
        """Return the engine, or a substitute if it cannot be loaded: a broken adapter must not end
        a run of all engines.
        """
        from ..harness.engine import Unloadable

        try:
            return self.engine(name, mode)
        except Exception as error:
            return Unloadable(name, f"{type(error).__name__}: {error}", mode)


def tell_left_out(cases: Iterable[Case]) -> None:
    """Print on standard error the parts of other tools' files that were left out."""
    complain(f"{case.name}: {case.source}" for case in cases if LEFT_OUT in case.source)
