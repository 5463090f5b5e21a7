"""Reports in a browser."""

from __future__ import annotations

import html
import json
import re
import subprocess

import pytest
from kincheck.core.report.report import write_report

from ..support.browser import ACT, CHROMIUM, FLAGS


@pytest.fixture
def visit(tmp_path):
    """Writes a report, opens it, and does something there; what that returned. Anything on the
    console is a failure.
    """

    if CHROMIUM is None:
        pytest.skip("chromium is not installed")

    def opened(run, act, **further):
        path = tmp_path / "report.html"
        write_report(run, path, **further)
        path.write_text(path.read_text("utf-8").replace("</body>", ACT % act), "utf-8")
        command = [
            str(CHROMIUM),
            *FLAGS,
            "--virtual-time-budget=20000",
            f"--user-data-dir={tmp_path / 'profile'}",
            "--dump-dom",
        ]
        done = subprocess.run(
            [*command, path.as_uri()], capture_output=True, text=True, timeout=120, check=True
        )
        assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
        found = re.search(r'data-told="([^"]*)"', done.stdout)
        assert found, "the page did not become ready"
        return json.loads(html.unescape(found[1]))

    return opened
