"""Tables of case files that extensions read, with the types of outputs that they give a meaning."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import msgspec

from ...doors import offers
from ..quantity import Quantity, TypedQuantity
from .schema import CaseKeys, Table

if TYPE_CHECKING:
    from ...mechanism.mechanism import Vector
    from ...trajectory import Array
    from ..case import Case
    from .document import Section


class CaseSection:
    """A table of case files and its types of outputs.

    Attributes:
        key: of the table.
        keys: of its content.
        types: classes of outputs by type.
        heading, remark: of the types in `kincheck list --outputs`.
        moves: whether it changes the motion, and is read before others.
    """

    key: ClassVar[str]
    keys: ClassVar[type[msgspec.Struct]]
    heading: ClassVar[str] = ""
    remark: ClassVar[str] = ""
    moves: ClassVar[bool] = False
    types: ClassVar[Mapping[str, type[TypedQuantity]]] = {}

    def defaults(self, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return tables that may be left out beside this one; none if drivers are to move."""
        return {}

    def read(self, section: Section, case: Case) -> tuple[Case, Any]:
        """Return the case with what the table says, and the table for its outputs.

        Raises:
            CaseError: the table is inconsistent.
        """
        raise NotImplementedError

    def output(
        self, name: str, section: Section, cls: type[TypedQuantity], table: Any, case: Case
    ) -> Quantity:
        """Return an output of one of the types.

        Args:
            table: as from `read`; None without one.

        Raises:
            CaseError: an input of the type is missing.
        """
        raise NotImplementedError

    def with_derived(self, case: Case, table: Any) -> Case:
        """Return the case, which has the table, with outputs that follow from its others."""
        return case

    def convention(self, section: Section) -> str:
        """Return the convention of signs that a table names; empty without one."""
        return ""

    def lines(self, case: Case) -> Sequence[str]:
        """Return the lines of the table of a case; none if its outputs need none.

        Raises:
            CaseError: the table cannot say it.
        """
        return []

    def further(self, case: Case, output: TypedQuantity) -> Iterator[tuple[str, Any]]:
        """Yield the keys and values of an output beyond the fields of its class."""
        yield from ()

    def wheels(self, case: Case) -> Mapping[str, Any]:
        """Return the wheels to be drawn, a `SceneWheel` by the name of its centre."""
        return {}

    def springs(self, case: Case) -> Iterator[tuple[tuple[Vector, Vector], tuple[str, str], bool]]:
        """Yield ends and bodies of springs to be drawn, and whether it is a damper."""
        yield from ()

    def definitions(
        self, case: Case, output: str, values: Mapping[str, Array]
    ) -> Iterator[tuple[str, Callable[[Array], Array]]]:
        """Yield other definitions of an output by which a program may compute it: in words, and
        from its values.

        Args:
            values: of other outputs, by name.
        """
        yield from ()


@cache
def sections() -> Sequence[CaseSection]:
    """Return the tables that extensions read."""
    found: list[CaseSection] = [each.load() for each in offers("sections").values()]
    return sorted(found, key=lambda each: not each.moves)


def undriven(keys: Collection[str]) -> bool:
    """Return whether tables of these keys allow a motion without drivers."""
    return any(each.key in keys and each.defaults({}) for each in sections())


@cache
def case_keys() -> Any:
    """Return the keys at the top of a case file, `CaseKeys` with those of all tables."""
    table: Any = Table
    further: list[Any] = [(each.key, table | None, None) for each in sections()]
    return msgspec.defstruct(
        *("CaseKeys", further),
        bases=(CaseKeys,),
        namespace={"__doc__": CaseKeys.__doc__},
        kw_only=True,
        forbid_unknown_fields=True,
    )


def types() -> Mapping[str, type[TypedQuantity]]:
    """Return the classes of outputs of all of them, by type."""
    return {name: cls for each in sections() for name, cls in each.types.items()}
