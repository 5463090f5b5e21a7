"""The key of the program cache: a change of any source that tracing runs through must change it."""

import subprocess
import sys

from kincheck.core.kinematics.compiled.compiled_model import source_files

TRACE = """
import sys
from kincheck import cases
from kincheck.core.kinematics.compiled import compiled_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.formulation.constraints import Style

case = cases.load("mcpherson_strut")
for style in Style:
    request = Request(tuple(case.sweep.path.motions), tuple(case.points), style=style)
    compiled_model._trace(case.mechanism, request, None, 4)
for name, module in sys.modules.items():
    if name.startswith("kincheck.core.") and getattr(module, "__file__", None):
        print(name, module.__file__)
"""


def test_program_cache_key_covers_modules():
    done = subprocess.run(
        [sys.executable, "-c", TRACE], capture_output=True, text=True, check=True
    ).stdout
    loaded = dict(line.split(" ", 1) for line in done.splitlines())
    layers = ("kincheck.core.case", "kincheck.core.harness")
    traced = {file for name, file in loaded.items() if not name.startswith(layers)}
    assert len(traced) > 50
    assert traced <= {str(file) for file in source_files()}
