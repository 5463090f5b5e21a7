"""Engines whose versions are read, in processes that import nothing else."""

import os
import sys
import time
from dataclasses import dataclass

from .fakes import Fake

DEEDS = {
    "tells": lambda: "1.2",
    "prints": lambda: print("loading\nhello") or "3",
    "is_missing": lambda: None,
    "exits": lambda: sys.exit(0),
    "aborts": os.abort,
    "raises": lambda: 1 / 0,
}


@dataclass
class Loading(Fake):
    """Its name says what asking for its version does."""

    def version(self):
        return time.sleep(1000.0) if self.name == "hangs" else DEEDS[self.name]()


@dataclass
class Foreign:
    """Tell by its version in which process it is asked."""

    name: str

    def version(self):
        return str(os.getpid())


class Ours(Foreign):
    in_process = True
