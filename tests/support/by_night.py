"""Parameters of which a few are tried by day and all by night."""

from collections.abc import Iterable

import pytest


def sparse_by_day(values: Iterable[object], step: int, first: int = 0) -> list[object]:
    """Return the values as parameters. Every step-th stays in the tests of a change, the others are
    left to the nightly run.
    """
    return [
        value if k % step == first else pytest.param(value, marks=pytest.mark.nightly)
        for k, value in enumerate(values)
    ]
