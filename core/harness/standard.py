"""Standards: values and refusals of the native engine, which complete a reference."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..case.case import Case, Series
from .compare import as_array
from .record import Record

STANDARD = "native"
"""Name of the standard engine, for cases without a complete reference."""


UNCERTAIN = "uncertain_samples"
"""Key of a record's details: samples that were reached, but refused as uncertain."""


@dataclass(frozen=True, eq=False)
class Standard:
    """The native engine's answer to a case.

    Attributes:
        outputs: outputs by name; empty without an answer.
        absent: the reason for a missing answer, which ends a sentence on the missing reference.
        refused: samples that the native engine cannot reach, shape (n,); None without such samples.
            Samples near a singular pose that it refuses for an uncertain pose or rate are not
            included: they contradict no other engine.
        why: the native engine's own message.
        dof: its number of degrees of freedom without drivers; None if it is not known.
    """

    outputs: Mapping[str, Series]
    absent: str = ""
    refused: NDArray[np.bool_] | None = None
    why: str = ""
    dof: int | None = None

    def refuses(self, case: Case) -> NDArray[np.bool_] | None:
        """Return the samples that neither native nor the reference reaches, shape (n,)."""
        if self.refused is None:
            return None
        return self.refused & ~known(case.reference.values(), len(self.refused))


def standard_of(native: Record) -> Standard:
    """Return the standard from a record of the native engine."""
    if not native.outputs:
        why = f", and the native engine has no answer ({native.outcome.shown}: {native.message})"
        return Standard({}, why)
    outputs = {
        name: Series(
            np.array(output.position, dtype=np.float64),
            as_array(output.velocity),
            as_array(output.acceleration),
        )
        for name, output in native.outputs.items()
    }
    if native.solved == native.samples:
        return Standard(outputs, dof=native.dof)
    refused = ~known(outputs.values(), native.samples or 0)
    refused[native.details.get(UNCERTAIN, [])] = False
    return Standard(outputs, refused=refused, why=native.message, dof=native.dof)


def has_everything(case: Case) -> bool:
    """Return whether the reference has a value of every comparable quantity at every sample."""
    return all(
        (series := case.reference.get(output.name)) is not None
        and all(
            each is not None
            for each in (series.position, series.velocity, series.acceleration)[: output.orders]
        )
        and np.isfinite(series.position).all()
        for output in case.outputs
    )


def known(outputs: Iterable[Series], samples: int) -> NDArray[np.bool_]:
    """Return the samples where any output has a value, shape (samples,)."""
    known = np.zeros(samples, dtype=np.bool_)
    for each in outputs:
        known |= np.isfinite(each.position)
    return known
