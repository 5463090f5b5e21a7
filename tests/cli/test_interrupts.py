"""Ctrl-C and SIGTERM at any moment: one line, status 130 or 143, no traceback, and what was made is
written.
"""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from kincheck.core.harness import interrupts

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")

# The process sends itself a signal at its so many-th event of a kind with a text in its arguments:
# the same moment however fast the machine is.
AT = """
import os, sys
from kincheck.__main__ import main
kind, text, left, number = *sys.argv[1:3], *map(int, sys.argv[3:5])
def hook(event, arguments):
    global left
    if event == kind and text in str(arguments):
        left -= 1
        if not left:
            os.kill(os.getpid(), number)
sys.addaudithook(hook)
sys.argv[1:] = sys.argv[5:]
sys.exit(main())
"""


def started(*command):
    return subprocess.Popen(
        [sys.executable, *map(str, command)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process):
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err


def stopped_at(kind, count, number, *arguments, text=""):
    return ended(started("-c", AT, kind, text, count, int(number), *arguments))


def lines(err):
    return [line for line in err.splitlines() if not line.startswith("[")]  # progress


INTERRUPT = signal.SIGINT, 130, "interrupted"
TERM = signal.SIGTERM, 143, "terminated"


@pytest.mark.parametrize(
    ("count", "number", "status", "said"),
    [(1, *INTERRUPT), (10, *TERM), (100, *INTERRUPT), (300, *TERM)],
)
def test_interrupt_during_imports_is_one_line(count, number, status, said):
    assert stopped_at("import", count, number, "list") == (status, "", f"kincheck: {said}\n")


@pytest.mark.parametrize("line", ["list", "run rssr --engine native", "trace four_bar", "doctor"])
def test_interrupt_of_command_is_one_line(line):
    """Texts that imports compile, which make Python end by the signal if it is left to itself."""
    for count in (5, 40):
        status, _, err = stopped_at("exec", count, signal.SIGINT, *line.split())
        assert (status, lines(err)) == (130, ["kincheck: interrupted"])


def test_interrupted_run_writes_records(tmp_path):
    """While records come, and once more while they are written."""
    out = tmp_path / "out"
    # the strut and MuJoCo take long enough to be interrupted in time
    line = "-m kincheck run rssr mcpherson_strut --engine native mujoco --jobs 1"
    process = started(*line.split(), "--out", out)
    first = process.stderr.readline()
    process.send_signal(signal.SIGINT)
    status, _, err = ended(process)
    assert first.startswith("[1/")
    assert status == 130
    (said,) = lines(err)
    assert said.startswith("kincheck: interrupted: ")
    assert said.endswith(" records were finished and are kept")
    found = json.loads((out / "results.json").read_text())
    assert found["records"]
    assert found["run"]["missing"]
    assert (out / "report.html").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_while_writing_completes_files(tmp_path, number):
    """A file is renamed when it is whole: the signal comes with the first of three."""
    names = ["junit.xml", "results.json", "report.html"]
    command = "run rssr --engine native".split()
    command += ["--junit", tmp_path / "junit.xml", "--out", tmp_path]
    status, out, err = stopped_at("os.rename", 1, number, *command, text=str(tmp_path))
    assert status == 128 + number
    assert lines(err) == [
        f"kincheck: {'terminated' if number == signal.SIGTERM else 'interrupted'}"
    ]
    assert sorted(each.name for each in tmp_path.iterdir()) == sorted(names)
    assert "1 pass" in out


@pytest.mark.by_day(2)
@pytest.mark.parametrize("seconds", [0.3, 0.7, 1.4])
def test_interrupt_of_run_at_any_time(tmp_path, seconds):
    """From when Python has begun to the end of the run, workers and history included."""
    command = "run rssr --engine native --jobs 1".split()
    command += ["--history", tmp_path / "h.sqlite", "--out", tmp_path]
    begun = tmp_path / "begun"
    code = (
        f"open({str(begun)!r}, 'w').close(); from kincheck.__main__ import main; import sys;"
        " sys.exit(main())"
    )
    process = started("-c", code, *command)
    while not begun.exists():
        time.sleep(0.01)
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    status, _, err = ended(process)
    assert status in (0, 130)
    assert len(lines(err)) == (status == 130), err


def test_second_interrupt_waits_third_stops():
    heard = interrupts.Interrupts()
    with pytest.raises(KeyboardInterrupt):
        heard(signal.SIGINT, None)
    heard(signal.SIGTERM, None)
    assert isinstance(heard.held, interrupts.Terminated)
    with pytest.raises(KeyboardInterrupt):
        heard(signal.SIGINT, None)


def test_deferred_interrupt_waits_for_work():
    heard, done = interrupts.Interrupts(), []

    def work():
        with heard.deferred():
            heard(signal.SIGTERM, None)
            done.append("whole")

    with pytest.raises(interrupts.Terminated):
        work()
    assert done == ["whole"]


def test_ignored_signal_stays_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupts.listening():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
