"""Errors of kincheck. Their messages name the subject, found and expected values, and a remedy."""

from __future__ import annotations

import difflib
import shlex
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

from .failures import FailureKind

MARKER = "~"
"""Prefix of the points that the case reader adds, to measure a body's rotation or for forces; no
hardpoints, and not shown.
"""
LONGEST_NAME = 200
"""Characters of a name that a message repeats; a longer one hides the rest of the message."""
# A message that lists all names of a large file is not read. The search for a similar name is cubic
# in their lengths at worst.
MOST_NAMED, MOST_SEARCHED = 50, 10_000


class KincheckError(Exception):
    """Base of all errors raised by kincheck on purpose.

    Attributes:
        kind: of a failure with a kind of its own; None for any other.
    """

    kind: FailureKind | None = None


def refuse(problems: Iterable[str]) -> None:
    """Raise the problems as one KincheckError, if there are any."""
    if lines := [*problems]:
        raise KincheckError("\n".join(lines))


@contextmanager
def collect_errors(problems: list[str]) -> Generator[None]:
    """Add the lines of a KincheckError to the problems, and go on behind the block."""
    try:
        yield
    except KincheckError as error:
        problems += str(error).splitlines()


class Phrase:
    """A text with lengths; readers of files write them in the unit of the file, `str` in metres.

    Args:
        parts: texts, and lengths as numbers [m].
    """

    def __init__(self, *parts: str | float) -> None:
        self.parts = parts

    def __str__(self) -> str:
        return self.within(lambda length: f"{length:.10g} m")

    def within(self, written: Callable[[float], str]) -> str:
        """Return the text with the lengths formatted by a function."""
        return "".join(part if isinstance(part, str) else written(part) for part in self.parts)


class MechanismError(KincheckError, ValueError):
    """The description of a mechanism is not valid.

    Attributes:
        phrase: the message.
        key: the faulty key of a case file ("joints.pivot.bodies"); empty if unknown.
    """

    def __init__(
        self, message: str | Phrase, key: str = "", kind: FailureKind | None = None
    ) -> None:
        super().__init__(str(message))
        self.phrase = message if isinstance(message, Phrase) else Phrase(message)
        self.key, self.kind = key, kind


class CaseError(KincheckError, ValueError):
    """A case file cannot be read or does not follow the schema; the message names file and key."""


class OpenError(CaseError):
    """A file leaves facts open, and options of its reader state them.

    Attributes:
        why: the guess of each option, and why, a line each.
        stated: the guess by the options' fields; reading goes on with it.
        writes: texts of new files, named by the options.
    """

    def __init__(
        self, file: Path, why: Sequence[str], stated: Mapping[str, str], writes: Mapping[Path, str]
    ) -> None:
        self.file, self.why, self.stated, self.writes = file, why, stated, writes
        told = " ".join(map(str.strip, why))
        add = shlex.join(self.options)
        super().__init__(f"{file} leaves open what options state. Guess: {told} Add: {add}")

    @property
    def options(self) -> list[str]:
        """The guess as arguments of the command line."""
        found = [(f"--{name.replace('_', '-')}", text) for name, text in self.stated.items()]
        return [each for pair in found for each in pair]


class SolveError(KincheckError, RuntimeError):
    """The mechanism cannot be solved as described: freedom left, contradiction, or no assembly."""

    def __init__(self, message: str, kind: FailureKind | None = None) -> None:
        super().__init__(message)
        self.kind = kind


class UnsupportedError(KincheckError):
    """An engine refuses a case while it solves; the message gives the reason."""


class UnknownNameError(KincheckError, KeyError):
    """There is nothing of a name that is looked up; the message suggests another one."""

    def __init__(self, what: str, name: object, known: Iterable[str]) -> None:
        super().__init__(what, name, tuple(known))

    def __str__(self) -> str:  # only now, for a mapping is also asked whether it has a name
        what, name, known = self.args
        return unknown(what, str(name), known)


def with_article(noun: str) -> str:
    """Return a noun with its indefinite article: a joint, an output, a universal joint."""
    vowel = noun[:1].lower() in {*"aeiou"} and not noun.lower().startswith("uni")
    return f"{'an' if vowel else 'a'} {noun}"


def number_of(count: int, one: str, several: str = "") -> str:
    """Return a number of things: 1 case, 2 cases.

    Args:
        several: the plural, by default with an s.
    """
    return f"{count} {one if count == 1 else several or f'{one}s'}"


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Return the message for an unknown name of a kind, with a remedy."""
    known = [each for each in known if not each.startswith(MARKER)]
    return f"there is no {what} {name!r}; {remedy(name, known)}"


def sentence(text: str) -> str:
    """Return a text that begins as a sentence does."""
    return f"{text[:1].upper()}{text[1:]}"


def remedy(name: str, known: Iterable[str]) -> str:
    """Return the remedy for an unknown name: the most similar known one, else all of them."""
    names = sorted(known)
    if not names:
        return "there is none here: define it, or leave it out"
    close = similar(name, names)
    return (
        f"did you mean {close!r}?"
        if close
        else f"known: {shortened([*map(brief, names)], MOST_NAMED)}"
    )


def similar(name: str, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return the most similar known name; an empty text if there is none."""
    short = islice((str(each) for each in known if len(each) <= LONGEST_NAME), MOST_SEARCHED)
    return (
        next(iter(difflib.get_close_matches(name, short, 1, cutoff)), "")
        if len(name) <= LONGEST_NAME
        else ""
    )


def brief(text: str) -> str:
    """Return the text, cut to the length of a name in a message."""
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 6]} [...]"


def shortened(texts: Sequence[str], most: int, between: str = ", ") -> str:
    """Return the first `most` texts, and the number of further ones."""
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return between.join(texts[:most]) + more


WARNING = "warning: "
"""Begin of a note on input more likely wrong than meant."""


def labelled(note: str, case: str = "") -> str:
    """Return a note on a case for a line of its own, with its kind and the case."""
    own = f"{case}: " if case else ""
    if note.startswith(WARNING):
        return f"{WARNING}{own}{note.removeprefix(WARNING)}"
    return f"note: {own}{note}"
