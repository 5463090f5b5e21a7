"""Files of every option of every command: written whole or not, or refused in one message."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from kincheck.core.cli.main import every_command, main

from ..support.examples import examples

VARY, COMMANDS = examples(__file__, "vary", "commands")

SWEEP = "sweep mcpherson_strut --vary vary.json --samples 8".split()
OPTIONS = [
    (line.split(), option)
    for line, options in COMMANDS.items()
    for option in options.split()
    if line.split()[0] in every_command()
]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a link to itself, a link into no folder, and a table of what varies."""
    monkeypatch.chdir(tmp_path)
    Path("loop.csv").symlink_to("loop.csv")
    Path("gone.csv").symlink_to("no/such/file.csv")
    Path("vary.json").write_text(json.dumps(VARY))
    return tmp_path


@pytest.mark.skipif(os.name == "nt", reason="Windows lets few users make links")
@pytest.mark.parametrize("name", ["loop.csv", "gone.csv", f"{'x' * 300}.csv"], ids=lambda x: x[:4])
@pytest.mark.parametrize(("command", "option"), OPTIONS, ids=lambda x: "".join(x[:1]))
def test_impossible_output_file_is_refused(here, capsys, command, option, name):
    assert main([*command, option, name]) == 2
    captured = capsys.readouterr()
    (message,) = captured.err.splitlines()
    assert message.startswith(f"kincheck: {option} {name}: cannot be written")
    assert captured.out == ""


@pytest.mark.needs("explain", "assemblies")
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize(
    ("command", "said"),
    [(("explain", "five_bar"), "five_bar: "), (("assemblies", "five_bar"), "assemblies from")],
)
def test_full_disk_still_prints_answer(capsys, command, said):
    assert main([*command, "--json", "/dev/full"]) == 2
    captured = capsys.readouterr()
    assert said in captured.out
    assert captured.err.startswith("kincheck: --json /dev/full: cannot be written (No space left")


@pytest.mark.needs("proofs")
def test_reference_continues_after_failed_file(here, capsys):
    Path("out").mkdir()
    Path("out", "five_bar.reference.json").symlink_to("/dev/full")
    assert main("reference five_bar rssr --digits 17 --out out -q".split()) == 2
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 2
    assert captured.err.count("cannot be written") == 1
    assert Path("out", "rssr.reference.json").is_file()


def test_replaced_file_stays_whole_for_readers(here):
    Path("all.json").write_text("an earlier answer")
    with Path("all.json").open() as old:
        assert main("run five_bar --engine native --json all.json".split()) == 0
        assert old.read() == "an earlier answer"
    assert json.loads(Path("all.json").read_text())["schema"].startswith("kincheck-results/")


LIMITED = """
import resource, sys
from kincheck.core.cli.main import every_command, main
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
sys.exit(main())
"""


@pytest.fixture
def stopped_sweep(here):
    """Call to sweep by a program that does not end its store; the earlier one is kept."""
    pytest.importorskip("pyarrow.parquet")

    def sweep(program, samples):
        Path("all.parquet").write_bytes(b"an earlier study")
        # without bytecode, whose files a limit would cut
        command = [sys.executable, "-B", "-c", program, *SWEEP[:-1], samples]
        ran = subprocess.run(
            [*command, "--store", "all.parquet"], capture_output=True, text=True, check=False
        )
        assert Path("all.parquet").read_bytes() == b"an earlier study"
        return ran

    return sweep


@pytest.mark.needs("sweep")
@pytest.mark.skipif(sys.platform == "win32", reason="no limit of file sizes")
def test_full_disk_keeps_previous_store(here, stopped_sweep):
    ran = stopped_sweep(LIMITED, "400")
    assert ran.returncode == 2
    assert "400 variants of mcpherson_strut, all solved" in ran.stdout
    assert ran.stderr.splitlines()[-1].startswith(
        "kincheck: --store all.parquet: cannot be written"
    )
    assert "Traceback" not in ran.stderr
    assert not [*here.glob("*.part")]


KILLED = """
import os, signal, sys
from kincheck.core.cli.main import every_command, main
from kincheck.core.extensions.sweep.chunk_files import ParquetStore

write = ParquetStore.write


def once(store, chunk):
    write(store, chunk)
    os.kill(os.getpid(), signal.SIGKILL)


ParquetStore.write = once
sys.exit(main())
"""


@pytest.mark.needs("sweep")
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_killed_sweep_keeps_previous_store(stopped_sweep):
    assert stopped_sweep(KILLED, SWEEP[-1]).returncode == -9


@pytest.mark.needs("explain", "trees")
def test_overlong_case_names_are_refused(here, capsys):
    name = "x" * 300
    Path("model.xml").write_text(f'<mujoco><include file="{name}"/></mujoco>')
    for command in (["run", name], ["explain", name], ["report", name], ["run", "model.xml"]):
        assert main(command) == 2
        assert "there is no" in capsys.readouterr().err
