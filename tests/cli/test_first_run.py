"""What a first run asks a newcomer to read."""

import subprocess
import sys

MOST = 122
"""Files of kincheck whose code a first run enters; this number only gets smaller."""
COUNT = """
import inspect, sys
entered = set()

def look(frame, event, _):
    if frame.f_code.co_flags & inspect.CO_OPTIMIZED:  # of a function, and no body of a module
        entered.add(frame.f_code.co_filename)

sys.setprofile(look)
from kincheck.core.cli.main import main
status = main(["run", "mcpherson_strut", "--engine", "native"])
sys.setprofile(None)
package = sys.modules["kincheck"].__path__[0]
sys.exit(status or f"{sum(each.startswith(package) for each in entered)} files")
"""


def test_first_run_enters_few_files(tmp_path, monkeypatch):
    """By the interpreter's own profile, without a cache and without a history."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("KINCHECK_HISTORY", raising=False)
    run = subprocess.run(
        [sys.executable, "-c", COUNT], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    said = run.stderr.splitlines()[-1]
    assert 60 < int(said.removesuffix(" files")) <= MOST, said
