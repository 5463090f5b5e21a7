"""The table [free] of case files: the start and the samples of a free motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ...case.case import Case
from ...case.io.document import Section
from ...case.io.schema import MOST_SAMPLES
from ...case.io.sections import CaseSection
from ...case.io.toml_text import toml_table
from ...mechanism.mechanism import coordinates

KEY = "free"


class Free(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The start and the samples of a free motion, without drivers.

    Attributes:
        duration: of the motion from the design position [s].
        samples: number of samples, both ends included.
        rates: at the start by driver or joint [m/s or rad/s], in a file in its units; see
            `free_motion`.
    """

    duration: Annotated[float, Meta(gt=0.0, description="a number of seconds greater than zero")]
    samples: Annotated[
        int,
        Meta(ge=2, le=MOST_SAMPLES, description=f"a whole number of samples, 2 to {MOST_SAMPLES}"),
    ]
    rates: Annotated[
        dict[str, float], Meta(description="a table of numbers by driver or joint")
    ] = {}


def free_in(case: Case) -> Free | None:
    """Return the free motion that a case asks for; None without one."""
    return case.tables.get(KEY)


def with_free(case: Case, free: Free) -> Case:
    """Return the case with this free motion."""
    return replace(case, tables={**case.tables, KEY: free})


class FreeSection(CaseSection):
    """[free]."""

    key = KEY
    keys = Free

    def defaults(self, table: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return no drivers, and the samples of the motion as the sweep."""
        sweep = {"start": 0.0, "stop": table.get("duration"), "steps": table.get("samples")}
        return {"drivers": {}, "sweep": sweep}

    def read(self, section: Section, case: Case) -> tuple[Case, Free]:
        """Return the case with its free motion, in SI."""
        given, rates = section.typed(Free), dict[str, float]()
        known, units = coordinates(case.mechanism), section.units
        for name, rate in given.rates.items():
            expected = "a driver or a joint with a rotation or translation"
            section.at("rates").require(name, known, expected)
            rates[name] = (units.angle if known[name].turns else units.length)(rate)
        free = Free(given.duration, given.samples, rates)
        return with_free(case, free), free

    def lines(self, case: Case) -> Sequence[str]:
        """Return the lines of the table."""
        if (free := free_in(case)) is None:
            return []
        rates = toml_table(free.rates, KEY, "rates") if free.rates else []
        return [*toml_table({"duration": free.duration, "samples": free.samples}, KEY), *rates]


SECTION = FreeSection()
