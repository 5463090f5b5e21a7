"""Datasets of Adams Solver among the files of other programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ...case.io.readers import Reader, text_of
from ..trees.options import DrivingOptions

if TYPE_CHECKING:
    from ...case.case import Case


@dataclass(frozen=True)
class _Dataset(Reader):
    def read(self, file: Path, options: DrivingOptions) -> Case:
        from .read import read_adams

        return read_adams(file, text_of(file, of_spreadsheet=True), options)


DATASET = _Dataset(
    "dataset of Adams Solver",
    DrivingOptions,
    (".adm",),
    unread={
        ".cmd": "is a script of Adams/View; export the dataset of Adams Solver, .adm",
        ".acf": "holds commands of Adams Solver; give the dataset that it names, .adm",
    },
    leaves_freedoms=True,
)
