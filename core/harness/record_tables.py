"""Records of a run as tables and curves."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..dataset import Dataset, Variable
from ..errors import UnknownNameError, number_of
from ..tabular import Tabular
from ..trajectory import PER_TIME, QUANTITIES


class RecordTable(Tabular):
    """The outputs of a record over its samples."""

    if TYPE_CHECKING:  # the fields of Record
        case: Any
        engine: Any
        mode: Any
        outcome: Any
        message: Any
        driver: Any
        outputs: Any

    __slots__ = ()

    def summary(self) -> str:
        """Return case, engine, outcome and message."""
        message = f": {self.message}" if self.message else ""
        return f"{self.case}, {self.engine} ({self.mode}), {self.outcome.shown}{message}"

    def dataset(self) -> Dataset:
        """Return the outputs and their rates over the driver [units of the output]."""
        coords = {name: Variable("sample", values) for name, values in self.driver.items()}
        variables = dict[str, Variable]()
        for name, output in self.outputs.items():
            for quantity, per_time in zip(QUANTITIES, PER_TIME, strict=True):
                values = getattr(output, quantity)
                if values is not None:
                    key = name if quantity == QUANTITIES[0] else f"{name}.{quantity}"
                    numbers = np.array(values, dtype=np.float64)  # null becomes NaN
                    variables[key] = Variable("sample", numbers, f"{output.unit}{per_time}")
        return Dataset(("sample",), coords, variables, next(iter(coords), ""))


class ResultsTable(Tabular):
    """The records of a run, one per row."""

    if TYPE_CHECKING:  # the field of Results
        records: Any

    __slots__ = ()

    def summary(self) -> str:
        """Return the number of cases and engines, and of each outcome."""
        cases = {each.case for each in self.records}
        engines = {each.engine for each in self.records}
        counts = Counter(each.outcome.shown for each in self.records)
        outcomes = [f"{count} {name}" for name, count in counts.items()]
        whole = [number_of(len(cases), "case"), number_of(len(engines), "engine")]
        return ", ".join([*whole, *outcomes])

    def dataset(self) -> Dataset:
        """Return outcome, errors and time of every record. An error is the largest ratio of an
        output's error to its tolerance.
        """
        records = self.records
        coords = {
            name: Variable("record", np.array([getattr(each, name) for each in records], dtype=str))
            for name in ("case", "engine", "mode")
        }
        outcomes = np.array([each.outcome.shown for each in records], dtype=str)
        variables = {"outcome": Variable("record", outcomes)}
        for quantity in QUANTITIES:
            shares = [_share(each, quantity) for each in records]
            variables[f"{quantity}_error_over_tolerance"] = Variable("record", shares)
        for name, unit in (("residual_max", ""), ("us_per_step", "us")):
            numbers = np.array([getattr(each, name) for each in records], dtype=np.float64)
            variables[name] = Variable("record", numbers, unit)
        return Dataset(("record",), coords, variables)

    def record(self, case: str, engine: str) -> Any:
        """Return the first record of a case and an engine.

        Raises:
            UnknownNameError: there is none.
        """
        for each in self.records:
            if (each.case, each.engine) == (case, engine):
                return each
        known = [f"{each.case} · {each.engine}" for each in self.records]
        raise UnknownNameError("record", f"{case} · {engine}", known)


def _share(record: Any, quantity: str) -> float:
    """Return the largest ratio of a quantity's error to its tolerance; NaN if nothing was
    compared.
    """
    found = [getattr(each, quantity) for each in record.errors.values()]
    shares = [each.ratio for each in found if each is not None]
    return max(shares, default=np.nan)
