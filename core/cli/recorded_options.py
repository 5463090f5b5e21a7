"""Recordings of other programs as engines of `kincheck run`: options and what comes of them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import KincheckError

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine


def add_options(run: argparse.ArgumentParser) -> None:
    """Add the options to the parser of the command."""
    group = run.add_argument_group(
        "recordings",
        "Results of other programs, beside the engines. --map and --accuracy say more.",
    )
    group.add_argument(
        "--recorded",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help=(
            "results of the case as an engine with the file's name: a table, results of Adams"
            " (.res) or OpenSim (.mot, .sto), a MAT-file (.mat)"
        ),
    )
    group.add_argument(
        "--engine-command",
        action="append",
        default=[],
        metavar="COMMAND",
        help=(
            'a program as an engine: "prog {case} {samples} {out}" reads the case (TOML) and its'
            " samples (CSV), and writes outputs or poses (CSV)"
        ),
    )
    group.add_argument(
        "--fmu",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help=(
            "a functional mock-up unit (FMI 2 or 3) as an engine; --map VARIABLE=NAME says which"
            " variables are drivers and outputs of the case"
        ),
    )
    group.add_argument(
        "--analysis", metavar="NAME", help="one of several analyses of results of Adams"
    )


def foreign_engines(options: argparse.Namespace, cases: Sequence[Case]) -> list[Engine]:
    """Return the programs of --engine-command and the FMUs of --fmu as engines.

    Raises:
        KincheckError: a command has another form, or an FMU cannot run.
    """
    if not (options.engine_command or options.fmu):
        return []
    from ..recorded.fmu import read_fmu
    from ..recorded.program import ProgramEngine

    if options.fmu and len(cases) != 1:
        raise KincheckError(
            f"{options.fmu[0]}: found {len(cases)} cases, expected the one of the FMU"
        )
    if options.fmu and options.jobs == 0:
        raise KincheckError("--fmu runs foreign machine code in workers alone; leave out --jobs 0")
    return [
        *(ProgramEngine(command) for command in options.engine_command),
        *(read_fmu(file, cases[0], options.map) for file in options.fmu),
    ]


def recorded_engines(options: argparse.Namespace, case: Case) -> tuple[Case, list[Engine]]:
    """Return the case at the samples of its recordings, and the recordings as engines.

    Raises:
        KincheckError: a recording cannot be read, or two have different samples.
    """
    import numpy as np

    from ..recorded.engine import RecordedEngine
    from ..recorded.meaning import Meaning, Reader, read_accuracy
    from ..recorded.readers import read_recording
    from ..recorded.recording import Head
    from ..recorded.samples import samples_of
    from ..recorded.sweep import at_samples

    engines: list[Engine] = []
    found: Case | None = None
    for file in options.recorded:
        meanings: list[Meaning] = []

        def choose(
            heads: Sequence[Head], file: Path = file, meanings: list[Meaning] = meanings
        ) -> list[int]:
            meanings.append(Reader(file, case, heads).read(options.map))
            return sorted({use.column for use in meanings[-1].uses})

        sheet = options.sheet
        recording = read_recording(file, choose, analysis=options.analysis, sheet=sheet)
        samples = samples_of(case, recording, meanings[-1])
        accuracy = read_accuracy(file, case, options.accuracy)
        resampled = at_samples(case, samples)
        values = resampled.case.sweep.values
        if found is not None and not np.array_equal(values, found.sweep.values):
            raise KincheckError(
                f"{file}: found other samples than those of {options.recorded[0]}, expected the"
                " same for recordings beside each other; run them one by one"
            )
        found = found or resampled.case
        engines.append(RecordedEngine(file.stem, samples, resampled, accuracy))
    return found or case, engines


def undriven(case: Case) -> bool:
    """Return whether a case has freedoms without a driver, so that no engine can solve it."""
    from ..kinematics import degrees_of_freedom

    return degrees_of_freedom(case.mechanism) > len(case.mechanism.drivers)
