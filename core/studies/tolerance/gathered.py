"""Results of the finished chunks of a study."""

from __future__ import annotations

from itertools import islice

import numpy as np

from ...trajectory import Array
from .chunk import COUNTS, Chunk, Unsolved
from .reduce import merged, nothing
from .study import Study

# Unsolved variants listed in the results; all are counted.
LISTED = 50


class Gathered:
    """Results of the finished chunks."""

    def __init__(self, study: Study) -> None:
        self.summary = nothing(len(study.rows), len(study.case.sweep.values))
        self.kept: list[Array] = []
        self.picked: dict[int, Array] = {}
        self.unsolved: list[Unsolved] = []
        self.effects: dict[int, Array] = {}
        self.limited = np.zeros((len(study.limits) + 1, COUNTS), dtype=np.int64)
        self.done = self.chunks = self.failures = self.retried = 0

    def add(self, chunk: Chunk) -> None:
        """Add a chunk; chunks come in order."""
        self.summary = merged(self.summary, chunk.summary)
        self.kept.append(chunk.kept)
        self.picked |= chunk.picked
        self.limited += chunk.limited
        self.unsolved += islice(chunk.unsolved, LISTED - len(self.unsolved))
        if chunk.effects is not None:  # the first variant is the nominal design
            self.effects |= {
                self.done + k: each for k, each in enumerate(chunk.effects.T) if self.done + k
            }
        self.done += chunk.count
        self.chunks += 1
        self.failures += chunk.failures
        self.retried += chunk.retried
