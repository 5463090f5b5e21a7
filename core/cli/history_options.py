"""Connection of a run to the history: each record is stored at once, and trends are read at the
end. No result is lost if the history fails.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import MOST_NAMED, shortened
from ..options import several

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..history.runs import Keeping
    from .destinations import Trends


def selection(options: Any) -> dict[str, Any]:
    """Return the task of a run, as `Results.run["selection"]`: cases, engines, and the given
    options of solution and judgement.
    """
    run = ("joints", "joint_type", "mode", "reference", "require", "static", "reactions")
    run += ("recorded", "engine_command", "fmu", "analysis")
    parts: dict[str, dict[str, Any]] = {
        "run": {name: getattr(options, name) for name in run} | {"tol": options.tol},
        "files": vars(options.supplied) | {"recorded": bool(options.recorded)},
        "curve": vars(options.curve),
    }
    return {
        "cases": sorted({*_words(several(options.cases))}),
        "engines": sorted({*_words(several(options.engines))}),
        "options": {
            part: {name: _words(x) for name, x in each.items() if x} for part, each in parts.items()
        },
    }


def _words(given: Any) -> Any:
    """Return an option's value as plain data; file names may contain undecodable bytes."""
    from ..harness.provenance import readable

    if isinstance(given, list | tuple):
        return [_words(each) for each in given]  # pyright: ignore
    return given if isinstance(given, bool | float) else readable(str(given))


def keeping(
    options: Any,
    cases: Sequence[Case],
    engines: Sequence[Engine],
    unread: Sequence[str],
    settings: dict[str, Any],
    mistyped: Sequence[str],
) -> tuple[Keeping | None, list[str]]:
    """Return the run in its history, or None, and the reasons if the history does not store it.

    Args:
        mistyped: names of cases that do not exist: with one, or if no case can be read at all,
            the run is only stored if an earlier one was asked for the same, which then lacks them.
    """
    if options.history is None:
        return None, []
    from ..history.runs import keep
    from ..history.store import HistoryError
    from .joint_loading import sources

    about: dict[str, Any] = {"tol": options.tol, "command": options.command, "settings": settings}
    code = [*options.joint_type, *(type(each).__module__ for each in engines)]
    about |= {"unread": unread, "resume": options.resume, "sources": sources(code)}
    try:
        if (mistyped or not cases) and not _known(Path(options.history), settings):
            names = shortened(mistyped or unread, MOST_NAMED)
            why = "no such case" if mistyped else "no case could be read"
            return None, [f"{names}: {why}; the run is not in the history"]
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


def _known(path: Path, facts: Mapping[str, Any]) -> bool:
    """Return whether a history has a run that was asked for the same."""
    from ..history.queries import same
    from ..history.store import Store

    if not os.path.exists(path):
        return False
    with Store(path, writable=False) as store:
        return any(same(row.key, facts) for row in store.runs())


def past(keeping: Keeping, problems: list[str]) -> Trends:
    """Return the runs up to this one by case, for the report, and report unreadable parts."""
    from ..history.queries import NIGHTS, read
    from ..history.store import HistoryError, Store
    from ..report.trends import trends

    if keeping.problems:
        return None
    try:
        with Store(keeping.store.path, writable=False) as store:
            found = trends(read(store, before=keeping.run + 1, last=NIGHTS, like=keeping.facts))
            problems += [each for each in store.damage if each not in problems]
    except HistoryError as error:
        problems.append(str(error))
        return None
    return found
