"""Reports in a browser."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from kincheck.core.harness.record import Results
from kincheck.core.report.report import write_report

CHROMIUM = (
    shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
)
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
]
FLAGS += [
    "--disable-component-update",
    "--disable-sync",
    "--enable-logging=stderr",
    "--v=0",
    "--window-size=1200,4000",
]

# Waits for the page to be drawn, does what a test asks, and leaves what it returns in the document.
ACT = """<script>
addEventListener("load", async () => {
  const pause = (ms = 100) => new Promise((done) => setTimeout(done, ms));
  const all = (what) => [...document.querySelectorAll(what)], one = (what) => document.querySelector(what);
  const keydown = (key) => new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true });
  const press = (key, on = document.body) => on.dispatchEvent(keydown(key));
  while (!("ready" in document.documentElement.dataset)) await pause();
  await pause(1000);
  let told;
  try { told = await (async () => { %s })(); } catch (error) { told = { error: String(error) }; }
  document.body.dataset.told = JSON.stringify(told);
});
</script></body>"""  # noqa: E501


@pytest.fixture
def visit(tmp_path: Path) -> Any:
    """Writes a report, opens it, and does something there; what that returned. Anything on the
    console is a failure.
    """

    if CHROMIUM is None:
        pytest.skip("chromium is not installed")

    def opened(run: Results, act: str, **further: Any) -> Any:
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
