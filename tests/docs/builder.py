"""What builds the documentation: modules of the folder docs."""

import importlib.util

import pytest

from ..support.sources import ROOT


def module(name):
    source = ROOT / "docs" / f"{name}.py"
    if not source.exists():
        pytest.skip("the documentation is not here", allow_module_level=True)
    spec = importlib.util.spec_from_file_location(f"docs_{name}", source)
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found
