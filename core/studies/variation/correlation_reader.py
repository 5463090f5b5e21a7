"""Reader of the correlations of a variation file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...case.io.document import fault, join
from ...case.io.typed_tables import typed
from ...errors import unknown
from .correlations import Correlation, problem_of
from .modes import Mode
from .variation_schema import CorrelationKeys, VaryKeys


def read_correlations(
    file: Path, keys: VaryKeys, coordinates: Sequence[str]
) -> tuple[Correlation, ...]:
    """Return the correlations of the file.

    Args:
        coordinates: names of the varied coordinates.

    Raises:
        CaseError: nothing is drawn, a coordinate does not vary or is named twice, or a matrix is
            no correlation matrix.
    """
    if keys.correlations and keys.mode is not Mode.MONTE_CARLO:
        raise fault(
            file,
            "correlations",
            f"found some, expected none, for {keys.mode} draws nothing; leave them out, or set mode"
            ' = "monte_carlo"',
        )
    found: list[Correlation] = []
    owners: dict[str, str] = {}
    for name, table in keys.correlations.items():
        key = join("correlations", name)
        each = typed(file, key, table, CorrelationKeys)
        for coordinate in each.coordinates:
            if coordinate not in coordinates:
                what = unknown("coordinate that varies", coordinate, coordinates)
                raise fault(file, join(key, "coordinates"), what)
            if (owner := owners.get(coordinate)) is not None:
                raise fault(
                    file,
                    join(key, "coordinates"),
                    f"found {coordinate!r} here and in correlations.{owner}, expected each"
                    " coordinate once; write one matrix of all that correlate",
                )
            owners[coordinate] = name
        if problem := problem_of(each.matrix, each.coordinates):
            raise fault(file, join(key, "matrix"), problem)
        rows = tuple(coordinates.index(one) for one in each.coordinates)
        found.append(Correlation(rows, np.array(each.matrix, dtype=np.float64)))
    return tuple(found)
