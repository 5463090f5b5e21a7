"""Runs of one case beside the native engine."""

import json

import pytest
from kincheck.adapters import engine

NATIVE = engine("native")


@pytest.fixture
def last_record(kincheck_main, tmp_path):
    """Returns status and last record of a run with native and these options; None without one."""

    def run(*given, jobs="0"):
        out = tmp_path / "out.json"
        options = ["--json", out, "--quiet"]
        status = kincheck_main("run", *given, *options, engines=[NATIVE], jobs=jobs)
        return status, json.loads(out.read_text())["records"][-1] if out.exists() else None

    return run
