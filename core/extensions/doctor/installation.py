"""Examination of the installation: installed and missing parts, remedies, and a self-check."""

from __future__ import annotations

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ...case.case import Case
from ...doors import offers
from ...extras import how_to_install
from ...harness.engine import PATIENCE, Engine
from ...harness.provenance import circumstances
from ...harness.record import Outcome
from ...harness.run import run
from ...program import disk_cache
from ...program.executor import compiler
from ..environments.environments import how_to_add, python_of

SCHEMA = "kincheck-doctor/1"
# Extras of the package and their purposes, except engines. Requirements without an extra are
# essential.
PURPOSES = {
    "fast": "machine code",
    "proofs": "proved references",
    "parquet": "history as Parquet",
    "xlsx": "tables of spreadsheets",
    "fmu": "functional mock-up units",
    "distributed": "runs on many machines",
    "yaml": "loops of URDF files",
    "usd": "models in USD",
    "live": "live page",
    "pandas": "results as tables",
    "xarray": "results as datasets",
    "matplotlib": "results as figures",
}
# Modules of distributions with another import name; a simulator's module usually has the engine's
# name.
MODULES = {
    "python-flint": "flint",
    "llvmlite": "llvmlite.binding",
    "pyyaml": "yaml",
    "usd-core": "pxr.Usd",
    "drake": "pydrake.multibody.plant",
    "dartpy": "dartpy",
    "opensim": "opensim",
    "mujoco-mjx": "mujoco.mjx",
    "mujoco-warp": "mujoco_warp",
    "genesis-world": "genesis",
}
LIBRARIES = "of Debian: libgomp1 for Pinocchio, libgl1 and libx11-6 for Exudyn"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


class Part(msgspec.Struct, frozen=True):
    """A part of the installation, present or missing.

    Attributes:
        version: null if it is not installed.
        purpose: use of the part.
        essential: the tool cannot work without it.
        problem: the reason why it cannot be used; empty if it can.
        remedy: how to get or repair it; empty if it works.
    """

    name: str
    version: str | None
    purpose: str
    essential: bool
    problem: str
    remedy: str


class Machine(msgspec.Struct, frozen=True):
    """The machine. vector_width: number of doubles in a vector of machine code; null without
    machine code.
    """

    python: str
    platform: str
    processor: str
    processors: int
    executor: str
    vector_width: int | None
    cache: str
    cache_bytes: int
    cache_problem: str


class Check(msgspec.Struct, frozen=True):
    """Result of the self-check. error: position error against the reference, the largest over its
    tolerance [unit of its output], with the tolerance.
    """

    case: str
    outcome: str
    message: str
    error: float | None
    tolerance: float | None
    us_per_step: float | None
    loop: str


class Examination(msgspec.Struct, frozen=True):
    """All findings of the examination."""

    schema: str
    kincheck: str
    parts: list[Part]
    machine: Machine
    check: Check

    @property
    def able(self) -> bool:
        """Return whether all essential parts work and the self-check passes."""
        return self.check.outcome == Outcome.PASS and not any(
            part.essential and part.problem for part in self.parts
        )


def examine(case: Case, native: Engine, tol: float, engines: Collection[str]) -> Examination:
    """Examine the installation, with the named engines, and solve a case with the native engine."""
    problem, compiled = _cache_problem(), compiler()
    (record,) = run([case], [native], tol=tol).records
    found = [each.position for each in record.errors.values() if each.position is not None]
    worst = max(found, key=lambda each: each.ratio, default=None)
    check = Check(
        case.name,
        record.outcome,
        record.message,
        worst and worst.max_abs,
        worst and worst.tolerance,
        record.us_per_step,
        record.loop,
    )
    about = circumstances([], started=datetime.now(UTC), tol=tol, command="kincheck doctor")
    machine = Machine(
        about["python"],
        about["platform"],
        about["processor"],
        os.cpu_count() or 1,
        (
            "machine code"
            if compiled
            else "numpy: with llvmlite that works it is some fifty times faster"
        ),
        compiled.width if compiled else None,
        str(disk_cache.folder() or "nowhere"),
        0 if problem else disk_cache.size(),
        problem,
    )
    return Examination(SCHEMA, about["kincheck"], parts(engines), machine, check)


def parts(engines: Collection[str]) -> list[Part]:
    """Return required and optional parts from kincheck's own metadata, steppers in environments of
    their own, and a browser.

    Args:
        engines: names of engines; the extra of an engine's simulator has the same name.
    """
    purposes, modules = PURPOSES | dict.fromkeys(engines, "engine"), dict(MODULES)
    pythons = dict[str, str]()
    found: list[Part] = []
    for requirement in importlib.metadata.requires("kincheck") or []:
        extra = re.search(r"""extra == ['"]([\w-]+)['"]""", requirement)
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        group = extra[1] if extra else ""
        if group in purposes or not extra:
            if group in engines:
                modules.setdefault(name, group)
            version = _version(name)
            remedy = (
                how_to_install(group)
                if group
                else f"pip install '{requirement.split(';')[0].strip()}'"
            )
            problem = "not installed" if version is None else _age(version, requirement)
            found.append(
                Part(
                    name,
                    version,
                    purposes.get(group, "kincheck"),
                    not extra,
                    problem,
                    remedy if problem else "",
                )
            )
    for engine, stepper in offers("steppers").items():
        requirements: str = stepper.load().apart
        if not requirements:
            continue
        name, python = requirements.split()[0], python_of(engine)
        version, pythons[name] = _version(name, python), python
        problem = "not installed" if version is None else ""
        remedy = how_to_add(engine, requirements) if problem else ""
        found.append(Part(name, version, "board of steppers", False, problem, remedy))
    browser = next((path for path in map(shutil.which, BROWSERS) if path), None)
    missing = ("", "") if browser else ("not installed", "apt install chromium")
    return [
        *_with_import_problems(found, modules, pythons),
        Part("chromium", browser, "tests of the report", False, *missing),
    ]


def _age(version: str, requirement: str) -> str:
    """Return that a version is older than a requirement allows; empty if it is not."""
    bound = re.search(r">=([\d.]+)", requirement)
    old = bound and _release(version) < _release(bound[1])
    return f"older than {bound[1]}" if bound and old else ""


def _release(version: str) -> list[int]:
    """Return the numbers of a version before any letter."""
    return [int(part) for part in re.findall(r"\d+", re.split(r"[^\d.]", version)[0])]


def _version(name: str, python: str = sys.executable) -> str | None:
    """Return the version of a distribution beside a Python."""
    try:
        if python == sys.executable:
            return importlib.metadata.version(name)
        folder = Path(python).parents[1]
        places = *folder.glob("lib/python*/site-packages"), folder / "Lib" / "site-packages"
        every = importlib.metadata.distributions(name=name, path=[*map(str, places)])
        return next((each.version for each in every), None)
    except importlib.metadata.PackageNotFoundError:
        return None


def _with_import_problems(
    found: Sequence[Part], modules: Mapping[str, str], pythons: Mapping[str, str]
) -> list[Part]:
    """Return the parts with the problems of importing their modules. Each import runs in its own
    process, because a broken library can end it.
    """
    running = {
        part.name: subprocess.Popen(
            [
                pythons.get(part.name, sys.executable),
                "-P",
                "-c",
                f"import {modules.get(part.name, part.name)}",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        for part in found
        if part.version is not None
    }
    result: list[Part] = []
    for part in found:
        unusable = _import_problem(running[part.name]) if part.name in running else ""
        problem = unusable or part.problem
        if part.version and not problem and (offer := offers("compilers").get(part.name)):
            problem = offer.load().problem()
        remedy = part.remedy or (_repair(part.name, problem) if problem else "")
        result.append(msgspec.structs.replace(part, problem=problem, remedy=remedy))
    return result


def _repair(name: str, problem: str) -> str:
    """Return the remedy for a part that is installed and cannot be imported."""
    if library := re.search(r"(\S+): cannot open shared object file", problem):
        return f"install the system's package with {library[1]} ({LIBRARIES})"
    return f"pip install --force-reinstall {name}"


def _import_problem(importing: subprocess.Popen[str]) -> str:
    try:
        output = importing.communicate(timeout=PATIENCE)[1].strip().splitlines()
    except subprocess.TimeoutExpired:
        importing.kill()
        importing.communicate()
        return f"its import takes more than {PATIENCE:g} s"
    if importing.returncode == 0:
        return ""
    return (
        "cannot be imported:"
        f" {output[-1] if output else f'the process ended with status {importing.returncode}'}"
    )


def _cache_problem() -> str:
    """Return why compiled code cannot be cached; empty if it can."""
    folder, remedy = disk_cache.folder(), f"every process compiles again: {disk_cache.REMEDY}"
    if folder is None:
        return f"the user has no home directory; {remedy}"
    try:
        if why := disk_cache.doubt(folder):
            return f"{why}; {remedy}"
        with tempfile.TemporaryFile(dir=folder):
            return ""
    except OSError as error:
        return f"{error.strerror}; {remedy}"
