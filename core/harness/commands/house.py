"""What commands know of the house they work in, and how they find the cases and engines that a user has named."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import KincheckError, SolveError

if TYPE_CHECKING:
    from ..case import Case
    from ..engine import Engine


class Status(IntEnum):
    """Exit status: all within tolerance; something deviates, fails or errs; the tool could not do its work."""

    WITHIN = 0
    DEVIATES = 1
    FAILED = 2


@dataclass(frozen=True)
class House:
    """The engines and built-in cases there are, loaded when they are asked for.

    Attributes:
        engines: names of the engines, in the order of the results.
        engine: the engine of a name.
        cases: names of the built-in cases.
        case: the built-in case of a name, with its truth.
    """

    engines: Sequence[str]
    engine: Callable[[str], Any]
    cases: Callable[[], Sequence[str]]
    case: Callable[[str], Case]

    def find_case(self, name: str) -> Case:
        """The case of that name or in that file.

        Raises:
            KincheckError: there is none, its file does not make sense, or its drivers do not match its freedom.
        """
        from ...analysis.freedom import require_driven
        from ..reading.casefile import load_case

        known = self.cases()
        if name in known:
            case = self.case(name)
        elif Path(name).suffix in (".toml", ".json") or os.sep in name or Path(name).exists():
            case = load_case(Path(name))
        else:
            raise KincheckError(unknown("case", name, known) + "; a case file ends in .toml or .json")
        try:
            require_driven(case.mechanism)
        except SolveError as error:  # it names the mechanism; the file is what the reader has to open
            raise KincheckError(f"{name}: {error}") from error
        return case

    def find_cases(self, names: Sequence[str], problems: list[str], found: Sequence[Case] = ()) -> list[Case]:
        """The cases found already and those named; what is wrong with any of them is added to the problems."""
        cases = {case.name: case for case in found}
        for name in dict.fromkeys(names):
            try:
                case = self.find_case(name)
            except KincheckError as error:
                problems += str(error).splitlines()
                continue
            if case.name in cases:
                problems.append(f"{name}: there are two cases named {case.name!r}; results go by name: rename one")
            cases[case.name] = case
        return list(cases.values())

    def find_engines(self, names: Sequence[str], problems: list[str]) -> list[Engine]:
        """The engines named, each once; names that are none are added to the problems."""
        problems += [unknown("engine", name, self.engines) for name in dict.fromkeys(names) if name not in self.engines]
        return [self.engine(name) for name in dict.fromkeys(names) if name in self.engines]


def unknown(what: str, name: str, known: Sequence[str]) -> str:
    """What to say of a name that is none of the known ones."""
    close = difflib.get_close_matches(name, known, n=1)
    return f"there is no {what} {name!r}; " + (f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}")
