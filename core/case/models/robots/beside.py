"""Files beside a URDF, with its loops: NAME.constraints.json, as `kincheck export` writes it,
and NAME.yaml of example-parallel-robots (github.com/Gepetto/example-parallel-robots).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from ....errors import CaseError
from ...io.document import fault, parse, read_text
from ..mjcf.elements import Element
from .conditions import ConstraintsFile, add_constraints
from .robot import Robot
from .yaml_pair import PairedFile, add_pairs, read_pairs, types_of

CONSTRAINTS = ".constraints.json"
YAML = (".yaml", ".yml")
LARGEST_FILE = 4_000_000
SCHEMA = "kincheck-constraints/1"


@dataclass(frozen=True)
class Beside:
    """Content of the files beside a URDF.

    Attributes:
        types: types of joints in place of those of the URDF; letters for a universal joint.
    """

    constraints: tuple[Path, ConstraintsFile] | None = None
    pairs: tuple[Path, PairedFile] | None = None
    types: Mapping[str, str] = field(default_factory=dict[str, str])

    def add(self, robot: Robot) -> None:
        """Add the loops to a robot.

        Raises:
            CaseError: they name unknown links, or do not hold in the zero pose.
        """
        if self.constraints is not None:
            file, found = self.constraints
            add_constraints(file, found, robot)
            robot.beside.append(file.name)
        if self.pairs is not None:
            file, pairs = self.pairs
            add_pairs(file, pairs, robot)
            robot.beside.append(file.name)
            robot.paired = True


def read_beside(file: Path, root: Element) -> Beside:
    """Read the files beside a URDF, of the same name with another ending.

    Raises:
        CaseError: one of them cannot be read.
    """
    constraints = pairs = None
    own = file.with_suffix(CONSTRAINTS)
    if own.exists():
        constraints = own, _constraints(own)
    for ending in YAML:
        paired = file.with_suffix(ending)
        if paired.exists():
            pairs = paired, read_pairs(paired, _text(paired))
            break
    types = types_of(pairs[1]) if pairs else {}
    for name in types:
        if all(each.attributes.get("name") != name for each in root.only("joint")):
            assert pairs is not None
            raise fault(
                pairs[0],
                "joint_name",
                f"found {name!r}, expected a joint of {file.name}; correct it, or remove it with"
                " its joint_type",
            )
    return Beside(constraints, pairs, types)


def _constraints(file: Path) -> ConstraintsFile:
    tables: dict[str, Any] = parse(file, _text(file))
    if tables.get("schema") != SCHEMA:
        raise fault(
            file,
            "schema",
            f"found {tables.get('schema')!r}, expected {SCHEMA!r}, as kincheck export writes it;"
            " rename a file of another kind",
        )
    try:
        return msgspec.convert(tables, ConstraintsFile)
    except msgspec.ValidationError as error:
        raise CaseError(str(fault(file, "constraints", f"{error}; export the case anew"))) from None


def _text(file: Path) -> str:
    return read_text(file, LARGEST_FILE, "it holds the loops of one robot; take out the rest")
