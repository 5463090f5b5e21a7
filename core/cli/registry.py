"""What commands know of the house they work in, and how they find the cases and engines that a user
has named.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..case.io.reader_options import NOTHING, Supplied
from ..errors import KincheckError, SolveError, unknown

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.io.model_writer import Writer
    from ..harness.engine import Engine


class Status(IntEnum):
    """Exit status: all within tolerance; something deviates, fails or errs; the tool could not do
    its work, or part of it.

    A command that is interrupted ends as shells have it: see `interrupts`.
    """

    WITHIN = 0
    DEVIATES = 1
    FAILED = 2


@dataclass(frozen=True)
class House:
    """The engines and built-in cases there are, loaded when they are asked for.

    Attributes:
        engines: names of the engines in projection mode, in the order of the results.
        engine: the engine of a name, and of a mode unless it is projection.
        cases: names of the built-in cases.
        case: the built-in case of a name, with its truth.
        writers: names of the formats that a mechanism can be written in.
        writer: the writer of a format.
        simulations: names of the engines in simulate mode.
    """

    engines: Sequence[str]
    engine: Callable[..., Any]
    cases: Callable[[], Sequence[str]]
    case: Callable[[str], Case]
    writers: Sequence[str]
    writer: Callable[[str], Writer]
    simulations: Sequence[str] = ()

    def find_case(self, name: str, supplied: Supplied = NOTHING, *, driven: bool = True) -> Case:
        """The case of that name or in that file; `supplied` is what a file of another tool does not
        say.

        Unless it must be driven, its drivers need not match its freedom.

        Raises:
            KincheckError: there is none, its file does not make sense, or its drivers do not match
                its freedom.
        """
        from ..case.models.files import SUFFIXES, load
        from ..kinematics.structure.driver_count import require_driven

        known = self.cases()
        if name in known:
            if supplied.given:
                raise KincheckError(
                    f"{name}: --{supplied.given[0]} is for files, and this is a built-in case:"
                    " leave it out"
                )
            case = self.case(name)
        elif Path(name).suffix in SUFFIXES or os.sep in name or Path(name).exists():
            case = load(Path(name), supplied)
        else:
            raise KincheckError(
                unknown("case", name, known) + "; a case file ends in .toml or .json"
            )
        if not driven:
            return case
        try:
            require_driven(case.mechanism)
        except (
            SolveError
        ) as error:  # it names the mechanism; the file is what the reader has to open
            raise KincheckError(
                f"{name}: {'drivers' if case.mechanism.moving else 'bodies'}: {error}"
            ) from error
        return case

    def find_cases(
        self,
        names: Sequence[str],
        unread: dict[str, str],
        found: Sequence[Case] = (),
        supplied: Supplied = NOTHING,
    ) -> list[Case]:
        """The cases found already and those named; what is wrong with the others is put beside
        their names as given.
        """
        cases = {case.name: case for case in found}
        for name in dict.fromkeys(names):
            try:
                case = self.find_case(name, supplied)
            except KincheckError as error:
                unread[name] = str(error)
                continue
            if case.name in cases:
                unread[name] = (
                    f"{name}: there are two cases named {case.name!r}; results go by name:"
                    " rename one"
                )
            else:
                cases[case.name] = case
        return list(cases.values())

    def find_engines(
        self, names: Sequence[str], problems: list[str], mode: str | None = None
    ) -> list[Engine]:
        """The engines named, each once, in a mode or in the first that they have; what is none is
        added to the problems.
        """
        engines: list[Engine] = []
        for name in dict.fromkeys(names):
            modes = [
                each
                for each, known in (("projection", self.engines), ("simulate", self.simulations))
                if name in known
            ]
            if not modes:
                problems.append(
                    unknown("engine", name, [*dict.fromkeys((*self.engines, *self.simulations))])
                )
            elif mode not in (None, *modes):
                problems.append(
                    f"engine {name!r} has the mode {modes[0]!r}, not {mode!r}: leave out --mode or"
                    " the engine"
                )
            else:
                engines.append(self._loaded(name, mode or modes[0]))
        return engines

    def _loaded(self, name: str, mode: str) -> Engine:
        """The engine, or what stands for it where loading it fails: one broken adapter must not end
        a run of all.
        """
        from ..harness.unloadable import Unloadable

        try:
            return self.engine(name) if mode == "projection" else self.engine(name, mode)
        except Exception as error:
            return Unloadable(name, f"{type(error).__name__}: {error}", mode)


def add_joint_types(command: argparse.ArgumentParser) -> None:
    """Add the option to a command that takes case files; `main` loads what it names."""
    command.add_argument(
        "--joint-type",
        action="append",
        default=[],
        metavar="MODULE:CLASS",
        help=(
            "a joint type of your own, which case files may name then, in a module of this folder"
            " or an installed one; may be repeated; check-joint checks it"
        ),
    )


def given(options: argparse.Namespace, names: Iterable[str]) -> str:
    """Return those of the options that were given, to be named in a message; they have no default,
    or false, or no names.
    """
    found = (
        name
        for name in names
        if getattr(options, name) not in ([], None) and getattr(options, name) is not False
    )
    return ", ".join(f"--{name.replace('_', '-')}" for name in found)


def whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """A whole number of so much or more, and maybe not beyond a limit, as an option gives it."""
    expected = f"of {least} or more" if most is None else f"from {least} to {most}"

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = least - 1
        if number < least or (most is not None and number > most):
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number {expected}; give one")
        return number

    return read
