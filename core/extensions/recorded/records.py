"""Records of JSON as a table: a list of records, or columns by their names, on their own or below a
key, as programs and data frames write them; or a record on each line (.jsonl, .ndjson).

A record in a record is named with a point, `crank.x`, and the numbers of a list with their places,
`crank(1)`. The digits of numbers count as they are printed. Units are in the names, `turn [deg]`,
or by name in a table `units` beside the records.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias, cast

from ...case.io.document import DEEPEST, fault, parse_json, read_text, shown
from ...case.io.table import Table, is_number
from ...errors import MOST_NAMED, shortened

LINES = (".jsonl", ".ndjson")
JSON = (".json", *LINES)
_FORM = 'expected records such as [{"time": 0, "x": 0.1}, ...], or columns {"time": [0, ...], ...}'

Record: TypeAlias = dict[str, str]


def table_of_json(file: Path, limit: int, why_limit: str) -> tuple[Table, list[str]]:
    """Return the only table in a file of JSON, and notes on what else it has.

    Args:
        limit, why_limit: see `read_text`.

    Raises:
        CaseError: the syntax is wrong, or there is no table, or several.
    """
    text = read_text(file, limit, why_limit)
    if file.suffix.lower() in LINES:
        text = f"[{','.join(filter(str.strip, text.splitlines()))}]"
    found = _Content(file)
    found.search((), parse_json(file, text, parse_float=str, parse_int=str, parse_constant=str))
    tables = {**found.tables, **found.columns_as_table()}
    if len(tables) != 1:
        listed = shortened([shown(name) for name in tables], MOST_NAMED)
        several = f"found the tables {listed}, expected one. Write a file for each"
        raise fault(file, "", several if tables else f"found no records, {_FORM}. Write them so")
    ((key, records),) = tables.items()
    names = [*dict.fromkeys(name for record in records for name in record)]
    units = found.units
    heads = [f"{name} [{units[name]}]" if name in units else name for name in names]
    rows = [
        (f"{key or 'record'}[{k}]", [record.get(name, "") for name in names])
        for k, record in enumerate(records)
    ]
    left = shortened([*map(shown, found.others)], MOST_NAMED)
    notes = [f"{file}: left out what is no column: {left}"] if left else []
    # a decimal sign is a point, as between fields with commas
    return Table(file, delimiter=",", sheet=[("keys", heads), *rows]), notes


@dataclass
class _Content:
    """What a file has: tables, lists of numbers by their paths, units, and names of the rest."""

    file: Path
    tables: dict[str, Sequence[Record]] = field(default_factory=dict[str, Sequence[Record]])
    columns: dict[tuple[str, ...], list[Any]] = field(default_factory=dict[tuple[str, ...], Any])
    units: dict[str, str] = field(default_factory=dict[str, str])
    others: list[str] = field(default_factory=list[str])

    def search(self, path: tuple[str, ...], value: Any) -> None:
        """Take a value and all inside it."""
        name = ".".join(path)
        rows = _rows(value)
        if rows is not None:
            self.tables[name] = [self._flat("", row) for row in rows]
        elif path[-1:] == ("units",) and isinstance(value, dict):
            self.units |= self._flat("", value)
        elif isinstance(value, dict):
            self._require_shallow(path)
            for key, each in cast("dict[str, Any]", value).items():
                self.search((*path, key), each)
        elif isinstance(value, list) and any(map(_has_number, cast("list[Any]", value))):
            self.columns[path] = value
        elif path:
            self.others.append(name)

    def columns_as_table(self) -> Mapping[str, Sequence[Record]]:
        """Return the lists of numbers as one table, without the path that all have in common."""
        paths = [*self.columns]
        if not paths:
            return {}
        lengths = {".".join(path): len(each) for path, each in self.columns.items()}
        if len({*lengths.values()}) > 1:
            listed = ", ".join(f"{shown(name)} {n}" for name, n in [*lengths.items()][:MOST_NAMED])
            problem = f"found columns of different lengths ({listed}), expected one length"
            raise fault(self.file, "", f"{problem}. Write a file for each")
        common = 0
        while all(len(path) > common + 1 for path in paths) and len({p[common] for p in paths}) < 2:
            common += 1
        records = [
            self._flat("", dict(zip((".".join(p[common:]) for p in paths), row, strict=True)))
            for row in zip(*self.columns.values(), strict=True)
        ]
        return {".".join(paths[0][:common]): records}

    def _flat(self, name: str, value: Any, depth: int = 0) -> Record:
        """Return the texts of a value by their names; a gap is empty."""
        self._require_shallow((name,) * depth)
        if isinstance(value, dict):
            parts = [
                (f"{name}.{key}" if name else key, each)
                for key, each in cast("dict[str, Any]", value).items()
            ]
        elif isinstance(value, list):
            parts = [(f"{name}({k})", x) for k, x in enumerate(cast("list[Any]", value), 1)]
        else:
            return {name: "" if value is None else str(value).strip()}
        return {
            k: text for key, each in parts for k, text in self._flat(key, each, depth + 1).items()
        }

    def _require_shallow(self, path: tuple[str, ...]) -> None:
        if len(path) > DEEPEST:
            problem = f"nested more than {DEEPEST} deep, {_FORM}"
            raise fault(self.file, path[0], f"{problem}. Write them so")


def _rows(value: Any) -> list[dict[str, Any]] | None:
    """Return the records of a value; None if it is something else."""
    if isinstance(value, list):
        found = cast("list[Any]", value)
        if found and all(isinstance(each, dict) for each in found):
            return found
        head, *rows = found or [None]
        if _is_head(head) and rows and all(isinstance(row, list) for row in rows):
            return [dict(zip(head, row, strict=False)) for row in rows]
    if not isinstance(value, dict):
        return None
    table = cast("dict[str, Any]", value)
    if _is_head(table.get("columns")) and isinstance(rows := table.get("data"), list):
        return _rows([table["columns"], *cast("list[Any]", rows)])
    # of data frames: rows by their index, or columns
    if not table or not all(each and isinstance(each, dict) for each in table.values()):
        return None
    inner: list[dict[str, Any]] = [*table.values()]
    if all(key.isdecimal() for key in table):
        return inner
    if all(key.isdecimal() for each in inner for key in each):
        index = [*dict.fromkeys(key for each in inner for key in each)]
        return [{name: each.get(key) for name, each in table.items()} for key in index]
    return None


def _is_head(value: Any) -> bool:
    """Return whether a value is a list of names."""
    names = cast("list[Any]", value) if isinstance(value, list) else []
    return bool(names) and all(isinstance(name, str) and not is_number(name) for name in names)


def _has_number(value: Any) -> bool:
    """Return whether a value is a number, as its text, or a list with one."""
    if isinstance(value, list):
        return any(map(_has_number, cast("list[Any]", value)))
    return isinstance(value, str) and is_number(value)
