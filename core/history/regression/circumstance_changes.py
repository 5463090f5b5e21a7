"""Changes of circumstances between two runs: versions, machine, commit, settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .findings import Change

CIRCUMSTANCES = ("kincheck", "python", "numpy", "tol", "host", "processor", "platform")


def changes(now: Mapping[str, Any], before: Mapping[str, Any]) -> list[Change]:
    """Return the differences in versions, machine and settings: engines first, then kincheck and
    its dependencies.
    """
    old: dict[str, Any] = before.get("engines") or {}
    new: dict[str, Any] = now.get("engines") or {}
    # an engine in only one of the runs was not requested in the other
    pairs: list[tuple[str, Any, Any]] = [
        (name, old[name], new[name]) for name in new if name in old
    ]
    pairs += [(name, before.get(name), now.get(name)) for name in CIRCUMSTANCES]
    pairs.append(("commit", _git(before, "commit"), _git(now, "commit")))
    pairs.append(("uncommitted edits", _edits(before), _edits(now)))
    return [Change(what=what, before=a, now=b) for what, a, b in pairs if a != b]


def _git(facts: Mapping[str, Any], what: str) -> Any:
    git: Mapping[str, Any] = facts.get("git") or {}
    return git.get(what)


def _edits(facts: Mapping[str, Any]) -> str | None:
    """Return the mark of uncommitted edits: a digest, or True without a digest."""
    return _git(facts, "edits") or ("some" if _git(facts, "changed") else None)


def same_machine(now: Mapping[str, Any], before: Mapping[str, Any]) -> bool:
    """Return whether both runs had equal processors, so that their times can be compared by the
    clock.

    Names of machines do not count: a hosted runner has another name every night.
    """
    return now.get("processor") == before.get("processor")
