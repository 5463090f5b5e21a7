"""YAML read as tables, without references."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

from ...case.io.document import check_values, fault, shown
from ...case.io.lines import join

INSTALL = "pip install 'kincheck[yaml]'"


# The parser takes seconds for a megabyte; geometry and lists of joints are some kilobytes.
LONGEST = 500_000


def parse_yaml(file: Path, text: str) -> Any:
    """Return the data of a YAML text.

    Raises:
        CaseError: PyYAML is missing, or the text is not valid or too long.
    """
    try:
        import yaml
    except ImportError:
        raise fault(
            file, "", f"needs PyYAML, which is not installed; {INSTALL}, or move the file away"
        ) from None
    if len(text) > LONGEST:
        raise fault(
            file,
            "",
            f"found {len(text)} characters, expected {LONGEST} at most; take out what is not"
            " geometry",
        )

    class Plain(yaml.BaseLoader):
        """Makes texts of all scalars, and refuses references, which can multiply without end."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):  # pyright: ignore[reportUnknownMemberType]
                line = cast("Any", self).peek_event().start_mark.line + 1
                raise yaml.YAMLError(f"line {line}: found a reference (*NAME), expected none")
            return super().compose_node(parent, index)

        def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
            keys = set[str]()
            for key in (key for key, _ in node.value if isinstance(key.value, str)):
                if key.value in keys:
                    line = key.start_mark.line + 1
                    raise yaml.YAMLError(f"line {line}: the key {shown(key.value)} is given twice")
                keys.add(key.value)
            return super().construct_mapping(node, deep)

    try:
        data: Any = yaml.load(text, Plain)
        check_values(file, data)
        return data
    except RecursionError:
        what = "nested too deeply"
    except (yaml.YAMLError, ValueError) as error:
        what = " ".join(str(error).split())
    raise fault(file, "", f"not valid YAML: {what}; correct the syntax") from None


def keys_of(text: str) -> Iterator[tuple[str, int]]:
    """Yield the path of each key and item of a YAML text, with its line; nothing without PyYAML."""
    if len(text) > LONGEST:
        return
    try:
        import yaml
    except ImportError:
        return
    untyped: Any = yaml
    with suppress(RecursionError, yaml.YAMLError):
        yield from _keys_below("", untyped.compose(text, yaml.BaseLoader))


def _keys_below(path: str, node: Any) -> Iterator[tuple[str, int]]:
    found: list[tuple[str, Any, Any]] = []
    if node and node.id == "mapping":
        found = [(join(path, str(key.value)), key, value) for key, value in node.value]
    elif node and node.id == "sequence":
        found = [(f"{path}[{k}]", value, value) for k, value in enumerate(node.value)]
    for below, key, value in found:
        yield below, key.start_mark.line + 1
        yield from _keys_below(below, value)
