"""Values as text in TOML, and YAML read as tables."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from ...errors import LONGEST_NAME, CaseError, brief
from .document import SMALLEST, check_values, fault, shown

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


def toml_table(values: Mapping[str, Any], *path: str) -> list[str]:
    """Return the lines of a table of a TOML file, with a heading if it has a path.

    Raises:
        CaseError: a name of the path is not one that a file can hold.
    """
    heading = ["", f"[{'.'.join(map(_toml_key, path))}]"] if path else []
    return [*heading, *(f"{key} = {_toml_value(value)}" for key, value in values.items())]


def _toml_key(name: str) -> str:
    """Return a name as a key, without quotes if TOML allows it."""
    if not (name and name.isprintable() and len(name) <= LONGEST_NAME):
        raise CaseError(
            f"name {brief(name)!r}: found {len(name)} characters, expected 1 to {LONGEST_NAME}"
            " printable ones, which a case file can hold; rename it"
        )
    bare = name.replace("_", "a").replace("-", "a").isalnum() and name.isascii()
    return name if bare else json.dumps(name)


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # a JSON string is a basic string of TOML
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_toml_value, cast('Sequence[Any]', value)))}]"
    if isinstance(value, int):
        return repr(value)
    # the reader refuses smaller numbers; they are the round-off of zeros
    return repr(float(value) if abs(value) >= SMALLEST else 0.0)
