"""Standard output that lacks letters, is full, closed or no longer read."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from kincheck.core.harness.record import from_json

ROOT = Path(__file__).parents[2]
KINCHECK = "import sys; from tests.support.fake_command import main; sys.exit(main())"
RUN = "run first --engine native --jobs 0"


def kincheck(line, out=subprocess.PIPE, **env):
    """The command line in a process of its own, with a case and an engine that need no time."""
    arguments = [sys.executable, "-c", KINCHECK, *line.split()]
    env = os.environ | env
    env.pop("PYTHONUNBUFFERED", None)  # or nothing would be left to be written in the end
    return subprocess.run(
        arguments, cwd=ROOT, stdout=out, stderr=subprocess.PIPE, env=env, check=False
    )


@pytest.mark.by_day(2)
@pytest.mark.parametrize("encoding", ["utf-16", "ascii"])
def test_run_output_in_limited_encodings(encoding):
    done = kincheck(RUN, PYTHONIOENCODING=encoding)
    assert done.returncode == 0, done.stderr
    assert "1 pass" in done.stdout.decode(encoding)
    done = kincheck(f"{RUN} --json -", PYTHONIOENCODING=encoding)
    assert done.returncode == 0, done.stderr
    assert len(from_json(done.stdout).records) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
@pytest.mark.parametrize("line", ["list", RUN, f"{RUN} --json -"])
def test_full_standard_output_has_status_2(line):
    with open("/dev/full", "wb") as full:
        done = kincheck(line, out=full)
    assert done.returncode == 2
    assert (
        done.stderr.decode()
        .splitlines()[-1]
        .startswith("kincheck: standard output cannot be written (No space left")
    )
    assert b"Traceback" not in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="closes a stream as a POSIX shell does")
def test_closed_standard_output_is_no_failure(tmp_path):
    code = (
        "import os, sys; os.close(1); os.execv(sys.executable, [sys.executable, '-c',"
        f" {KINCHECK!r}, *sys.argv[1:]])"
    )
    file = tmp_path / "r.json"
    done = subprocess.run(
        [sys.executable, "-c", code, *RUN.split(), "--json", str(file)], cwd=ROOT, check=False
    )
    assert done.returncode == 0
    assert len(from_json(file.read_bytes()).records) == 1


@pytest.mark.skipif(os.name != "posix", reason="closes a pipe as a shell does")
@pytest.mark.parametrize(
    "line", ["list", RUN, pytest.param("explain first", marks=pytest.mark.needs("explain"))]
)
def test_broken_pipe_is_no_failure(line):
    """As for `kincheck list | head`, whose head has what it wanted."""
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as gone:
        done = kincheck(line, out=gone)
    assert done.returncode == 0
    # progress, and no complaint
    assert all(line.startswith(b"[") for line in done.stderr.splitlines()), done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="has /dev/stdout")
def test_file_behind_standard_output_is_refused(tmp_path):
    for name in ("/dev/stdout", str(tmp_path / "printed")):
        with open(tmp_path / "printed", "w") as printed:
            done = kincheck(f"{RUN} --junit {name}", out=printed)
        assert done.returncode == 2
        expected = (
            f"kincheck: --junit {name}: found the file that standard output goes to, expected one"
            " of its own. Give another\n"
        )
        assert done.stderr.decode() == expected
    # a pipe takes both
    done = kincheck(f"{RUN} --junit /dev/stdout")
    assert b"</testsuites>" in done.stdout
    assert b"1 pass" in done.stdout
