"""The errors of kincheck, and how their messages name things: who, what was found, what was
expected and what to do.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Sequence
from itertools import islice

LONGEST_NAME = 200
"""Characters of a name that a message repeats; what is longer hides the rest of it."""
# A message that lists all names of a large file is not read. The search for a similar name is cubic
# in their lengths at worst.
MOST_NAMED, MOST_SEARCHED = 50, 10_000


class KincheckError(Exception):
    """Base of all errors that kincheck raises on purpose."""


class Phrase:
    """A text with lengths in it, which a reader of files can write in the unit of the file; as a
    text it has metres.

    Args:
        parts: texts, and lengths as numbers [m].
    """

    def __init__(self, *parts: str | float) -> None:
        self.parts = parts

    def __str__(self) -> str:
        return self.within(lambda length: f"{length:.10g} m")

    def within(self, written: Callable[[float], str]) -> str:
        """Return the text with the lengths as a function writes them."""
        return "".join(part if isinstance(part, str) else written(part) for part in self.parts)


class MechanismError(KincheckError, ValueError):
    """The description of a mechanism does not make sense.

    Attributes:
        phrase: the message.
        key: of a case file, what is to blame there ("joints.pivot.bodies"); empty where that is not
            known.
    """

    def __init__(self, message: str | Phrase, key: str = "") -> None:
        super().__init__(str(message))
        self.phrase = message if isinstance(message, Phrase) else Phrase(message)
        self.key = key


class CaseError(KincheckError, ValueError):
    """A case file cannot be read or does not follow the schema; the message names file and key."""


class SolveError(KincheckError, RuntimeError):
    """The mechanism cannot be solved as described: freedom left, contradiction, or no assembly at
    the design.
    """


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Say that there is nothing of that kind and name, and what to write instead."""
    return f"there is no {what} {name!r}; {remedy(name, known)}"


def remedy(name: str, known: Iterable[str]) -> str:
    """Say what to write instead of a name that is not known: the most similar one, else all of
    them.
    """
    names = sorted(known)
    close = similar(name, names)
    return (
        f"did you mean {close!r}?"
        if close
        else f"known: {shortened([*map(brief, names)], MOST_NAMED) or 'none'}"
    )


def similar(name: str, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return the known name that is most like another one; an empty text where none is."""
    short = islice((each for each in known if len(each) <= LONGEST_NAME), MOST_SEARCHED)
    return (
        next(iter(difflib.get_close_matches(name, short, 1, cutoff)), "")
        if len(name) <= LONGEST_NAME
        else ""
    )


def brief(text: str) -> str:
    """Return the beginning of a text, as much as a message has room for."""
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 6]} [...]"


def shortened(texts: Sequence[str], most: int) -> str:
    """Return the first so many texts in a row, and how many more there are."""
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return ", ".join(texts[:most]) + more
