"""Options for recordings, programs and FMUs, and the engines of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ...cli.engine_source import CHECK_ENGINE, EngineSource
from ...errors import KincheckError, collect_errors
from ...options import option, options

if TYPE_CHECKING:
    from ...case.case import Case
    from ...case.io.reader_options import CurveOptions
    from ...harness.engine import Engine

RECORDINGS = "recordings"


@options
class Recordings(EngineSource):
    """Results of other programs, judged beside the engines."""

    COLUMNS = ("recorded", "fmu")
    MOTIONS = ("recorded",)
    HEADINGS: ClassVar[Mapping[str, str]] = {
        RECORDINGS: "Results of other programs, beside the engines. --map and --accuracy say more."
    }
    recorded: Sequence[Path] = option(
        "results of the case as an engine with the file's name: a table, results of Adams"
        " (.res) or OpenSim (.mot, .sto), a MAT-file (.mat)",
        Path,
        "FILE",
        several="repeated",
        heading=RECORDINGS,
        default=(),
    )
    engine_command: Sequence[str] = option(
        'a program as an engine: "prog {case} {samples} {out}" reads the case (TOML) and its'
        " samples (CSV), and writes outputs or poses (CSV)",
        metavar="COMMAND",
        several="repeated",
        heading=RECORDINGS,
        default=(),
    )
    fmu: Sequence[Path] = option(
        "a functional mock-up unit (FMI 2 or 3) as an engine. --map VARIABLE=NAME says which"
        " variables are drivers and outputs of the case",
        Path,
        "FILE",
        several="repeated",
        heading=RECORDINGS,
        default=(),
    )
    analysis: str | None = option(
        "one of several analyses of results of Adams",
        metavar="NAME",
        heading=RECORDINGS,
        default=None,
    )

    @staticmethod
    def contradictions(options: Any) -> list[str]:
        """Return why an FMU cannot run."""
        if options.fmu and options.jobs == 0:
            return ["--fmu runs foreign machine code in workers alone. Leave out --jobs 0."]
        return []

    @staticmethod
    def engines(
        options: Any, cases: Sequence[Case], problems: list[str]
    ) -> tuple[list[Case], list[Engine]]:
        """Return the case at the samples of its recordings, and all programs as engines."""
        found: list[Engine] = []
        cases = [*cases]
        if options.recorded and len(cases) != 1:
            problems.append(
                f"{options.recorded[0]}: found {len(cases)} cases, expected the one that it records"
            )
        elif options.recorded:
            with collect_errors(problems):
                cases[0], found = recorded_engines(
                    options.recorded,
                    cases[0],
                    options.curve,
                    analysis=options.analysis,
                    sheet=getattr(options.supplied, "sheet", None),
                )
        with collect_errors(problems):
            found = [*_foreign_engines(options, cases), *found]
        return cases, found


@options
class Program(EngineSource):
    """A program of the user, to be checked as an engine."""

    FOR = CHECK_ENGINE
    engine_command: str | None = option(
        'a program as an engine, "prog {case} {samples} {out}". See run',
        metavar="COMMAND",
        default=None,
    )

    @staticmethod
    def engines(
        options: Any, cases: Sequence[Case], problems: list[str]
    ) -> tuple[list[Case], list[Engine]]:
        """Return the program as an engine."""
        from .engine import ProgramEngine

        return [*cases], [ProgramEngine(options.engine_command)]


def _foreign_engines(options: Any, cases: Sequence[Case]) -> list[Engine]:
    """Return the programs of --engine-command and the FMUs of --fmu as engines.

    Raises:
        KincheckError: a command has another form, or an FMU cannot run.
    """
    from .engine import ProgramEngine
    from .fmu import read_fmu

    if options.fmu and len(cases) != 1:
        raise KincheckError(
            f"{options.fmu[0]}: found {len(cases)} cases, expected the one of the FMU. Name one."
        )
    return [
        *(ProgramEngine(command) for command in options.engine_command),
        *(read_fmu(file, cases[0], options.curve.columns) for file in options.fmu),
    ]


def recorded_engines(
    files: Sequence[Path],
    case: Case,
    curve: CurveOptions,
    *,
    analysis: str | None = None,
    sheet: str | None = None,
) -> tuple[Case, list[Engine]]:
    """Return the case at the samples of its recordings, and the recordings as engines.

    Args:
        curve: meaning and accuracy of the columns.
        analysis: one of several in results of Adams.
        sheet: of a workbook.

    Raises:
        KincheckError: a recording cannot be read, or two have different samples.
    """
    import numpy as np

    from .engine import RecordedEngine
    from .meaning import Meaning, Reader, read_accuracy
    from .readers import Head, read_recording
    from .samples import samples_of
    from .sweep import at_samples

    engines: list[Engine] = []
    found: Case | None = None
    for file in files:
        meanings: list[Meaning] = []

        def choose(
            heads: Sequence[Head], file: Path = file, meanings: list[Meaning] = meanings
        ) -> list[int]:
            meanings.append(Reader(file, case, heads).read(curve.columns))
            return sorted({use.column for use in meanings[-1].uses})

        recording = read_recording(file, choose, analysis=analysis, sheet=sheet)
        samples = samples_of(case, recording, meanings[-1])
        accuracy = read_accuracy(file, case, curve.accuracy)
        resampled = at_samples(case, samples)
        values = resampled.case.sweep.values
        if found is not None and not np.array_equal(values, found.sweep.values):
            raise KincheckError(
                f"{file}: found other samples than those of {files[0]}. Run recordings"
                " with different samples one by one."
            )
        found = found or resampled.case
        engines.append(RecordedEngine(file.stem, samples, resampled, accuracy))
    return found or case, engines
