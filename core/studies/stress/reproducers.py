"""Reduction of bad cases to case files, and judgement of case files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace as replaced
from pathlib import Path

from msgspec.structs import replace

from ...case.case import MARKER, Case
from ...case.io.atomic_files import written
from ...case.io.case_file import case_text
from ...case.io.outputs import with_all_coordinates
from ...errors import KincheckError
from ...harness.engine import Engine
from ...harness.execution import Pair
from ..truth.motion import Truth, followed
from .families import Specimen
from .results import Finding
from .run import Example
from .shrink import fewer_samples, reduced
from .solving import solve_all
from .verdicts import Judgement, Verdict, judged


def judge(
    case: Case, engine: Engine, tol: float, truth: Callable[[Case], Truth] | None = followed
) -> Judgement:
    """Judge a case of any origin with an engine; by default its reference is followed
    from the design.

    Raises:
        KincheckError: the reference cannot be computed.
    """
    forces = tuple(each for each in case.outputs if each.forces)
    moved = [name for name in case.points if not name.startswith(MARKER)]
    watched = with_all_coordinates(case, moved or None)
    watched = replaced(watched, outputs=(*watched.outputs, *forces))
    return judge_as(Specimen(case.name, lambda: watched, truth, tol), watched, engine)


def judge_as(specimen: Specimen, case: Case, engine: Engine) -> Judgement:
    """Judge a case in place of a specimen's case, by the specimen's reference and excuses."""
    (answer,) = solve_all([Pair(case, engine, specimen.tol)])
    return judged(specimen, case, specimen.truth(case) if specimen.truth else None, answer)


def save(example: Example, folder: Path, problems: list[str]) -> Finding:
    """Reduce an example and write it as a case file; return the finding with the name of the file.

    Args:
        problems: receives the reason if the file cannot be written.
    """
    specimen, engine, finding = example.specimen, example.engine, example.finding

    def bad(case: Case) -> bool:
        return bool(judge_as(specimen, case, engine).counts[example.verdict])

    def bad_by_itself(case: Case) -> bool:
        return bool(judge(case, engine, specimen.tol).counts[example.verdict])

    case, words = fewer_samples(example.case, finding.sample, bad), list[str]()
    if len(case.sweep.values) < len(example.case.sweep.values):
        words.append(f"samples {len(example.case.sweep.values)} to {len(case.sweep.values)}")
    if example.verdict is Verdict.SILENTLY_WRONG or not specimen.excused:
        # a reduced case has no closed form: its reference is the followed motion
        try:
            known = bad_by_itself(case)
        except KincheckError:
            known = False
        if known:
            case, more = reduced(case, bad_by_itself)
            words += more
        else:
            words.append(
                "judged only by the truth of the family: following the motion does not lead there"
            )
    verdict = str(example.verdict).replace(",", "").replace(" ", "_")
    name = f"{finding.family}_{finding.engine}_{finding.mode}_{finding.number}_{verdict}.toml"
    comments = [
        (
            f"{finding.verdict} in {finding.engine} ({finding.mode}), tolerance {finding.tol!r}:"
            f" {finding.specimen}"
        ),
        (
            f"kincheck stress --replay {name} --engine {finding.engine} --mode {finding.mode} --tol"
            f" {finding.tol!r}"
        ),
        *words,
        *finding.message.splitlines(),
    ]
    problems += written(folder / name, case_text(case, comments).encode())
    return replace(finding, file=name, reduced=words)
