"""Files made to harm: each ends within bounds of time and memory, with one clear message and exit
status 2, and opens nothing else.

The bounds are the kernel's: a process that exceeds them is ended, and the test fails.
"""

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from kincheck.core.case.io.document import LONGEST_MESSAGE
from kincheck.core.cli.main import main

from ..support import hostile_texts
from ..support.case_texts import CSV

# A file of 4 MB, the largest that is read, takes some seconds to be parsed in Python and some
# hundred bytes a character; what is refused for what it holds takes less. On a slow machine too, no
# file needs ten times that.
SECONDS, MEMORY = 60, 3 << 30
TEXTS = dict(hostile_texts.TEXTS)
for each in sorted(Path(__file__).parents[1].glob("extensions/*/hostile_texts.py")):
    TEXTS |= importlib.import_module(f"tests.extensions.{each.parent.name}.{each.stem}").TEXTS
TEMPLATE = ("--template", "double_wishbone")
OPTIONS = {".csv": (*TEMPLATE, "--units", "mm", "--axes", "adams"), ".sub": TEMPLATE}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A folder of what the case files name, and one outside it with a file that would do."""
    inside, outside = tmp_path_factory.mktemp("inside"), tmp_path_factory.mktemp("outside")
    (inside.parent / "outside").symlink_to(outside)
    (outside / "tip.csv").write_text(CSV)
    (inside / "below").mkdir()
    (inside / "link.csv").symlink_to(outside / "tip.csv")
    (inside / "linked").symlink_to(outside)
    (inside / "loop.csv").symlink_to("loop.csv")
    os.mkfifo(inside / "pipe.csv")
    with (inside / "large.csv").open("wb") as file:
        file.truncate(1 << 40)  # a terabyte of nothing
    (inside / "lines.csv").write_text("\n" * 2_000_001)
    (inside / "wide.csv").write_text(",".join(map(str, range(50_000))))
    (inside / "deep.json").write_text('{"a": ' + "[" * 1_000_000)
    (inside / "words.json").write_text(hostile_texts.proved("1_5"))
    return inside, outside


@pytest.fixture(scope="module")
def results(folders):
    """What came of all the files, read one after the other in one process with limits."""
    inside, outside = folders
    lines: list[str] = []
    for k, (name, content, _) in enumerate(TEXTS.values()):
        beside = isinstance(content, str) and "[reference]" in content
        file = inside / (f"a{k}.toml" if beside else f"{k}/{name}")
        file.parent.mkdir(exist_ok=True)
        if isinstance(content, str):
            text = content.replace("{outside}", str(outside)).replace('"a.toml"', f'"{file.name}"')
            content = text.encode()
        file.write_bytes(content)
        lines.append(json.dumps(["run", str(file), *OPTIONS.get(file.suffix, ())]))
    program = Path(__file__).parents[1] / "support" / "hostile.py"
    command = [sys.executable, str(program), str(SECONDS), str(MEMORY), str(outside)]
    ran = subprocess.run(
        command, input="\n".join(lines), capture_output=True, text=True, check=False
    )
    answers = ran.stdout.splitlines()
    assert ran.returncode == 0, (
        f"ended at {[*TEXTS][len(answers)]!r}: {ran.returncode} {ran.stderr[-2000:]}"
    )
    return dict(zip(TEXTS, map(json.loads, answers), strict=True))


@pytest.mark.parametrize("kind", TEXTS)
def test_hostile_file_is_refused(kind, results):
    found, (_, _, fragment) = results[kind], TEXTS[kind]
    said = str(found["said"])
    assert found["status"] == 2, said[-2000:]
    assert fragment in said, said[:2000]
    assert said.startswith("kincheck: /")
    assert said.count("\n") == 1
    assert said.rstrip("\n").isprintable()
    assert len(said) < LONGEST_MESSAGE + 100
    assert "; " in said or ". " in said  # what to type
    assert found["opened"] == []


PLACES: dict[str, tuple[Callable[[Path], object], str]] = {
    "pipe": (os.mkfifo, "not a regular file"),
    "folder": (Path.mkdir, "not a regular file"),
    "device": (lambda path: path.symlink_to("/dev/zero"), "not a regular file"),
    "loop": (lambda path: path.symlink_to(path), "no such file"),
    "nothing": (lambda path: None, "no such file"),
}


@pytest.mark.parametrize("kind", PLACES)
@pytest.mark.parametrize("end", [".toml", ".json", ".csv", ".sub", ".xml"])
def test_pipe_folder_or_device_is_refused(kind, end, tmp_path, capsys):
    make, said = PLACES[kind]
    make(tmp_path / f"a{end}")
    assert main(["run", str(tmp_path / f"a{end}")]) == 2
    assert said in capsys.readouterr().err
