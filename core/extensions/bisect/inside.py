"""The run inside a release's environment: `python -m ...inside TASK OUT`."""

from __future__ import annotations

import faulthandler
import importlib.util
import inspect
import os
import pickle
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import msgspec

from ...case.case import Case
from ...errors import KincheckError, refuse
from ...harness.engine import STANDARD
from ...harness.record import Outcome, Record, to_json


@dataclass(frozen=True)
class Task:
    """Cases for one engine.

    Attributes:
        package: of the release.
        cases: each as its file has it, and with all its reactions.
        native: the native engine's records of both, the standard of a case without truth.
        timeout: of a case, and of the engine's import [s].
    """

    engine: str
    package: str
    cases: Sequence[tuple[Case, Case]]
    native: tuple[Sequence[Record], Sequence[Record]]
    tol: float
    timeout: float


class Done(msgspec.Struct, frozen=True):
    """The records, or why there are none.

    Attributes:
        file: of the engine's class.
        shadow: another copy of a module of the release, which would be loaded.
    """

    records: list[Record] = []
    file: str = ""
    problem: str = ""
    shadow: str = ""


def shadow_of(package: str) -> str:
    """Return the file of another copy of a package's module, found first by Python, or nothing."""
    distribution = metadata.distribution(package)
    folders = {os.path.realpath(each) for each in sys.path}
    for file in distribution.files or ():
        own = Path(os.path.realpath(str(distribution.locate_file(file))))
        module = own.parent if own.name == "__init__.py" else own
        name = module.name.partition(".")[0]
        if str(module.parent) in folders and own.suffix in (".py", ".so", ".pyd"):
            spec = importlib.util.find_spec(name) if name.isidentifier() else None
            found = os.path.realpath(spec.origin) if spec and spec.origin else str(own)
            if not Path(found).is_relative_to(module.parent):
                return found
    return ""


def solved(task: Task) -> Done:
    """Return the engine's answers to the cases.

    Raises:
        KincheckError: there is no such engine.
    """
    from ...cli.main import registry
    from ...harness.resource_limits import Limits
    from ...harness.run import run
    from ...harness.workers.pool import in_workers

    if shadow := shadow_of(task.package):
        return Done(shadow=shadow)
    problems: list[str] = []
    known = registry()
    # an import that never ends stops here
    faulthandler.dump_traceback_later(task.timeout, exit=True)
    engines = known.find_engines([task.engine], problems)
    faulthandler.cancel_dump_traceback_later()
    refuse(problems)
    solver = in_workers(1, Limits(timeout=task.timeout))

    standard = known.engine(STANDARD)

    def records(cases: Sequence[Case], native: Sequence[Record]) -> dict[str, Record]:
        names = {each.name for each in cases}
        made = [each for each in native if each.case in names]
        found = run(cases, [standard, *engines], tol=task.tol, made=made, solver=solver)
        return {each.case: each for each in found.records if each.engine != STANDARD}

    found = records([whole for _, whole in task.cases], task.native[1])
    # an engine without these reactions keeps its curves
    less = [
        plain
        for plain, whole in task.cases
        if whole is not plain and found[plain.name].outcome is Outcome.UNSUPPORTED
    ]
    if less:
        found |= records(less, task.native[0])
    return Done([*found.values()], _file(engines[0]))


def _file(engine: object) -> str:
    try:
        return inspect.getfile(type(engine))
    except TypeError:
        return ""


def main(task: str, out: str) -> None:
    """Write the engine's answers to the cases of a task."""
    try:
        done = solved(pickle.loads(Path(task).read_bytes()))
    except KincheckError as error:
        done = Done(problem=str(error))
    Path(out).write_bytes(to_json(done))


if __name__ == "__main__":
    main(*sys.argv[1:])
