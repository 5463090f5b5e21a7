"""The table [equilibrium] of case files: the case rests with gravity and springs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ...case.case import Case
from ...case.io.document import Section
from ...case.io.sections import CaseSection
from ...errors import SolveError


class Resting(msgspec.Struct, forbid_unknown_fields=True):
    """[equilibrium].

    Attributes:
        held: drivers with values; all others are free.
    """

    held: Annotated[tuple[str, ...], Meta(description="a list of names")] = ()


class EquilibriumSection(CaseSection):
    """[equilibrium]."""

    key = "equilibrium"
    keys = Resting
    moves = True

    def defaults(self, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return no drivers, and a single sample."""
        return {"drivers": {}, "sweep": {"start": 1.0, "stop": 1.0, "steps": 1}}

    def read(self, section: Section, case: Case) -> tuple[Case, Resting]:
        """Return the case at rest."""
        from .resting import at_rest  # it takes the solver, and few cases need it

        resting, known = section.typed(Resting), [each.name for each in case.mechanism.drivers]
        for name in resting.held:
            section.at("held").require(name, known, "a driver")
        with section.explained():
            try:
                return at_rest(case, resting.held), resting
            except SolveError as error:
                raise section.fault(str(error)) from None

    def with_derived(self, case: Case, table: Resting) -> Case:
        """Return the case with the efforts of its free drivers."""
        from .resting import with_efforts

        return with_efforts(case, table.held)


SECTION = EquilibriumSection()
