"""The changed term: fields of the simulator in both releases, and a folder to repeat their
comparison without kincheck.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from msgspec.structs import replace

from ...case.io.atomic_files import write_all
from ...case.io.escape import file_name
from ...doors import offers
from ...errors import KincheckError, refuse
from ..exports.model_writer import written
from .releases import run
from .results import Change
from .signature import READER
from .states import States, probe_of, tell

FORMATS = {"mujoco": ("mjcf", ".xml")}
"""Format of the model that a probe reads, and its ending."""

README = """# {package} {earlier} and {later}

The first field that differs is `{field}`. This repeats it, with Python, numpy and pip alone:

    python compare.py

It installs both releases into environments below this folder, and compares all fields of
`{model}` at one state in the order of computation.
{truth}"""
TRUTH = """
Who is right: `python probe.py --read` compares what a release makes of the file with the file.
"""
COMPARE = '''"""Compare the fields of two releases: python compare.py [OLD.npz NEW.npz]."""

import subprocess
import sys
import venv
from pathlib import Path

PACKAGE, RELEASES, MODEL = {package!r}, {releases!r}, {model!r}
# Of a field's largest value; another order of summation changes 1e-15 of it.
ROUND_OFF = 1e-12


def python_of(release):
    windows = sys.platform == "win32"
    return Path("environments", release, "Scripts/python.exe" if windows else "bin/python")


def dump(release):
    python = python_of(release)
    if not python.exists():
        venv.create(Path("environments", release), with_pip=True)
    wanted = ["numpy", f"{{PACKAGE}}=={{release}}"]
    subprocess.run([python, "-m", "pip", "install", "--quiet", *wanted], check=True)
    subprocess.run([python, "probe.py", MODEL, f"{{release}}.npz"], check=True)
    return f"{{release}}.npz"


def compare(old, new):
    import numpy as np

    a, b = np.load(old), np.load(new)
    for name in a.files:
        if name in b.files and a[name].shape == b[name].shape:
            both = np.nan_to_num(a[name]), np.nan_to_num(b[name])
            off, size = np.abs(both[0] - both[1]).max(), max(np.abs(each).max() for each in both)
            if off > ROUND_OFF * size:
                print(name, f"{{off:.3g}} of {{size:.3g}}")


if len(sys.argv) == 3:
    compare(*sys.argv[1:])
else:
    files = [dump(each) for each in RELEASES]
    subprocess.run([python_of(RELEASES[0]), __file__, *files], check=True)
'''


def with_fields(change: Change, states: States, out: Path | None) -> Change:
    """Return a change with its first differing field, and write its reproducer below a folder;
    an engine without a probe has neither.
    """
    engine, package = states.task.engine.partition("-")[0], states.environments.package
    probe = probe_of(engine)
    if probe is None or engine not in FORMATS or change.kind != "result":
        return change
    name = file_name(f"{package}-{change.earlier}-{change.later}")
    with tempfile.TemporaryDirectory() as made:
        folder = out / name if out else Path(made)
        folder.mkdir(parents=True, exist_ok=True)
        file = f"model{FORMATS[engine][1]}"
        texts = {"probe.py": probe.read_text("utf-8")}
        texts["compare.py"] = COMPARE.format(
            package=package, releases=(change.earlier, change.later), model=file
        )
        refuse(write_all([(folder / each, text.encode()) for each, text in texts.items()]))
        pythons = [states.environments.python(each) for each in (change.earlier, change.later)]
        try:
            model = _model(change, states, pythons[1])
        except KincheckError as error:
            tell(f"{name}: no reproducer: {error}")
            return change
        refuse(write_all([(folder / file, model.encode())]))
        field = _first(folder, file, pythons)
        about = {"earlier": change.earlier, "later": change.later, "field": field}
        truth = TRUTH if READER in change.cases else ""
        text = README.format(package=package, model=file, truth=truth, **about)
        refuse(write_all([(folder / "README.md", text.encode())]))
    return replace(change, field=field, reproducer=name if out else None)


def _model(change: Change, states: States, python: str) -> str:
    """Return the model of the most changed case; without one, the reader's."""
    sizes = {
        name: (each.curves[0].difference or 0.0) / (each.curves[0].tolerance or 1.0)
        for name, each in change.cases.items()
        if name != READER and each.kind == "result" and each.curves
    }
    probe, engine = probe_of(states.task.engine), states.task.engine.partition("-")[0]
    if not sizes:
        status, said = run([python, "-P", str(probe), "--model"], states.task.timeout)
        if status:
            raise KincheckError(said.strip()[-300:])
        return said
    worst = max(sizes, key=lambda each: sizes[each])
    case = next(plain for plain, _ in states.task.cases if plain.name == worst)
    kind, ending = FORMATS[engine]
    if (writer := offers("writers").get(kind)) is None:
        raise KincheckError(f"there is no writer of {kind}")
    return written(case, writer.load(), None)[ending]


def _first(folder: Path, file: str, pythons: list[str]) -> str | None:
    """Return the first differing field of two environments."""
    dumps = [str(folder / f"{k}.npz") for k in range(2)]
    said = ""
    try:
        for python, dump in zip(pythons, dumps, strict=True):
            status, said = run(
                [python, "-P", str(folder / "probe.py"), str(folder / file), dump], 120.0
            )
            if status:
                tell(f"{folder.name}: fields cannot be read: {said.strip()[-300:]}")
                return None
        status, said = run([pythons[1], "-P", str(folder / "compare.py"), *dumps], 120.0)
    finally:
        for dump in dumps:
            Path(dump).unlink(missing_ok=True)
    lines = said.strip().splitlines()
    return lines[0].split()[0] if lines and not status else None
