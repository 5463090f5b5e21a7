"""Files with points of suspensions: what tells each kind, and its table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...case.io.readers import WORKBOOKS, Reader, ReaderOptions
from ...doors import Offer
from ...errors import CaseError, OpenError
from . import EXTENSION
from .options import NOTHING, HardpointOptions, WheelOptions

if TYPE_CHECKING:
    from ...case.case import Case
    from .table import HardpointTable


@dataclass(frozen=True)
class HardpointReader(Reader):
    """A reader of hardpoints.

    Attributes:
        where: module and name of the function from a file and its options to its table.
        claim: see `Reader.claims`.
    """

    options: type[ReaderOptions] = WheelOptions
    where: str = field(kw_only=True)
    claim: Callable[[Path, str, WheelOptions], int] | None = None

    def table(self, file: Path, options: WheelOptions) -> HardpointTable:
        """Return the table of a file."""
        return Offer(EXTENSION, self.where).load()(file, options)

    def claims(self, file: Path, text: str, options: WheelOptions) -> int:
        """Return how surely a file holds such points."""
        return self.claim(file, text, options) if self.claim else 0

    def read(self, file: Path, options: WheelOptions) -> Case:
        """Return the case of the points of a file."""
        from .read import case_of_hardpoints

        try:
            return case_of_hardpoints(self.table(file, options), options)
        except OpenError as error:  # of a corner or a sheet; the rest is asked with it
            try:
                stated: dict[str, Any] = dict(error.stated)
                if not stated.keys() & {"corner", "sheet"}:
                    raise
                self.read(file, replace(options, **stated))
            except OpenError as other:
                if other is error:
                    raise
                raise OpenError(  # one question of two
                    file,
                    [*error.why, *other.why],
                    {**error.stated, **other.stated},
                    {**error.writes, **other.writes},
                ) from None
            except CaseError:
                pass
            raise


def is_table(file: Path, supplied: WheelOptions) -> bool:
    """Return whether a file is a table of hardpoints."""
    from ...case.models.files import reader_of

    return isinstance(reader_of(file, supplied), HardpointReader)


def read_hardpoints(file: Path, supplied: WheelOptions = NOTHING) -> HardpointTable:
    """Read the table of hardpoints of a file.

    Raises:
        CaseError: the file is unreadable, or no table of hardpoints.
    """
    from ...case.io.document import fault
    from ...case.models.files import reader_of

    reader = reader_of(file, supplied)
    if not isinstance(reader, HardpointReader):
        raise fault(file, "", "is no table of hardpoints. Give a table, such as car.csv")
    return reader.table(file, supplied)


def _is_chrono(file: Path, text: str, supplied: WheelOptions) -> int:
    from .programs import is_chrono

    if file.suffix.lower() != ".json" or _is_list(text):
        return 0
    return 3 * is_chrono(_tables(file, text) or {})


def _tables(file: Path, text: str) -> Mapping[str, Any] | None:
    """Return what a text of JSON holds by name; None of a case file."""
    from ...case.io.document import parse
    from .programs import without_comments

    tables = parse(file, without_comments(text))
    return None if "schema" in tables else tables


def _is_adams(file: Path, text: str, supplied: WheelOptions) -> int:
    return 3 * ("[HARDPOINT]" in text)


def _is_assetto(file: Path, text: str, supplied: WheelOptions) -> int:
    from ...case.io.document import fault
    from .programs import is_assetto

    if file.suffix.lower() != ".ini":
        return 0
    if not is_assetto(text):
        raise fault(
            file,
            "",
            "found an .ini file without points such as WBCAR_TOP_FRONT or STRUT_CAR. Give the"
            " suspensions.ini of Assetto Corsa",
        )
    return 1


def _may_be_plain(file: Path, text: str, supplied: WheelOptions) -> int:
    return bool(supplied.template) or file.suffix.lower() == ".txt"


def _may_be_tree(file: Path, text: str, supplied: WheelOptions) -> int:
    from .programs import without_comments
    from .tree import has_points, json_tree, toml_tree

    suffix = file.suffix.lower()
    if suffix == ".toml":
        return 2 * has_points(toml_tree(file, text))
    if suffix != ".json":
        return 0
    if _is_list(text):
        return 2
    if _tables(file, text) is None:
        return 0
    return 2 * bool(supplied.template or has_points(json_tree(file, without_comments(text))))


def _is_list(text: str) -> bool:
    from .programs import without_comments

    return without_comments(text).lstrip().startswith("[")


CHRONO = HardpointReader(
    "Project Chrono suspension",
    HardpointOptions,
    others=(".json",),
    where="programs:read_chrono",
    claim=_is_chrono,
)
ADAMS = HardpointReader(
    "Adams/Car hardpoints",
    HardpointOptions,
    (".sub", ".tpl", ".asy", ".hpt"),
    where="programs:read_adams",
    claim=_is_adams,
)
ASSETTO = HardpointReader(
    "Assetto Corsa suspension", others=(".ini",), where="programs:read_assetto", claim=_is_assetto
)
TABLE = HardpointReader(
    "hardpoint table",
    suffixes=(".csv", ".tsv", ".tab", ".dat", ".prn", ".m", ".hpts"),
    unread={
        ".pm": "is a suspension of rFactor, whose bars have no names of points. Write their ends"
        " into a table, name,x,y,z, with --units m --axes left,up,rearward"
    },
    where="rows:read_plain",
    claim=_may_be_plain,
)
TREE = HardpointReader(
    "tree of hardpoints",
    suffixes=(".yaml", ".yml", ".py"),
    others=(".json", ".toml"),
    where="scripts:read_names",
    claim=_may_be_tree,
)
WORKBOOK = HardpointReader(
    "workbook of hardpoints", suffixes=WORKBOOKS, where="rows:read_spreadsheet"
)
