"""Results of engines that report outputs, and do not solve for the motion of points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..case.case import Series
from ..trajectory import Trajectory


class Reported(Trajectory):
    """Outputs as an engine reports them: of a recording, of a foreign program.

    Attributes:
        outputs: by name; NaN at samples without a value. Their uncertainty is that of printed
            digits, and adds to the tolerance.
        faults: what the engine finds wrong with them by itself, in sentences.
        judged: whether it judged them by itself, so that they can pass without a standard.
    """

    outputs: Mapping[str, Series]
    faults: Sequence[str]
    judged: bool

    def __init__(
        self,
        count: int,
        outputs: Mapping[str, Series],
        residual: float = 0.0,
        *,
        faults: Sequence[str] = (),
        judged: bool = False,
        details: Mapping[str, Any] | None = None,
        solved: NDArray[np.bool_] | None = None,
        message: str = "",
    ) -> None:
        known = np.ones(count, dtype=np.bool_) if solved is None else solved
        none = np.zeros(count, dtype=np.int64)
        super().__init__({}, known, none, residual, message=message, details=details)
        self.__dict__.update(outputs=outputs, faults=faults, judged=judged)
