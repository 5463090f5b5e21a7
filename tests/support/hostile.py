"""Reads hostile files in a process with limits, and prints what came of each; started by
test_hostile_files.py.

Arguments: seconds of processor time, bytes of memory, a folder that must not be read. Standard
input: one list of arguments of kincheck a line, as JSON. Standard output: for each, exit status and
standard error, as JSON.
"""

import contextlib
import io
import json
import resource
import sys

from kincheck.core.cli.main import main

seconds, memory, forbidden = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
opened: list[str] = []


def watch(event, details):
    """Remember what is opened where nothing may be."""
    if event == "open" and isinstance(details[0], str | bytes):
        name = details[0] if isinstance(details[0], str) else details[0].decode(errors="replace")
        if name.startswith((forbidden, "/dev/zero", "/etc/")):
            opened.append(name)


sys.addaudithook(watch)
resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
for line in sys.stdin:
    used = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(used.ru_utime + used.ru_stime) + 1 + seconds
    # beyond it: SIGXCPU ends us
    resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    out, err = io.StringIO(), io.StringIO()
    opened.clear()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(json.loads(line))
    print(json.dumps({"status": status, "said": err.getvalue(), "opened": opened}), flush=True)
