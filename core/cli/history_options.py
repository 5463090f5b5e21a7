"""Connection of a run to the history: each record is stored at once, and trends are read at the
end. No result is lost if the history fails.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..history.run_recorder import Keeping
    from .destinations import Trends


def keeping(
    options: argparse.Namespace,
    cases: Sequence[Case],
    engines: Sequence[Engine],
    unread: Sequence[str],
    settings: dict[str, Any],
) -> tuple[Keeping | None, list[str]]:
    """Return the run in its history, or None, and the reasons if the history cannot store it."""
    if options.history is None:
        return None, []
    from ..history.run_recorder import keep
    from ..history.store import HistoryError
    from .joint_loading import sources

    about: dict[str, Any] = {"tol": options.tol, "command": options.command, "settings": settings}
    code = [*options.joint_type, *(type(each).__module__ for each in engines)]
    about |= {"unread": unread, "resume": options.resume, "sources": sources(code)}
    try:
        found = keep(Path(options.history), cases, engines, **about)
    except HistoryError as error:
        return None, [f"{error}; the run is not in the history"]
    if options.resume:
        print(
            f"kincheck: run {found.run} is resumed after {len(found.made)} records"
            if found.resumed
            else f"kincheck: no unfinished run to resume: run {found.run} is new",
            file=sys.stderr,
        )
    return found, []


def past(keeping: Keeping, problems: list[str]) -> Trends:
    """Return the runs up to this one by case, for the report, and report unreadable parts."""
    from ..history.queries import NIGHTS, read
    from ..history.store import HistoryError, Store
    from ..report.trends import trends

    if keeping.problems:
        return None
    try:
        with Store(keeping.store.path, writable=False) as store:
            found = trends(read(store, before=keeping.run + 1, last=NIGHTS))
            problems += [each for each in store.damage if each not in problems]
    except HistoryError as error:
        problems.append(str(error))
        return None
    return found
