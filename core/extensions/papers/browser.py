"""A Chromium without a window, which makes a PDF of a page and PNG of figures."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

NAMES = "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "msedge"
FLAGS = (
    "--headless",
    # a sandbox needs rights that containers lack; the pages are our own, and load nothing
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
)
SECONDS = 120.0
"""Longest time of one call [s]: a hundred figures take ten seconds."""
SCALE = 2
"""Pixels of a PNG per pixel of its figure."""
_DRAW = """
Promise.all([...document.images].map(async (image) => {
  await image.decode();
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width: SCALE * image.width, height: SCALE * image.height });
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return canvas.toDataURL("image/png");
})).then((found) => { document.body.textContent = JSON.stringify(found); });
"""


def pdf(page: str) -> bytes:
    """Return a page as PDF.

    Raises:
        OSError: there is no browser, or it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder, "page.pdf")
        _call(folder, page, "--no-pdf-header-footer", f"--print-to-pdf={made}")
        return made.read_bytes()


def png(pictures: Mapping[str, str]) -> dict[str, bytes]:
    """Return pictures in SVG as PNG, by their names.

    Raises:
        OSError: there is no browser, or it fails.
    """
    images = "".join(
        f'<img src="data:image/svg+xml;base64,{base64.b64encode(each.encode()).decode()}">'
        for each in pictures.values()
    )
    page = f"<body>{images}<script>{_DRAW.replace('SCALE', str(SCALE))}</script></body>"
    with tempfile.TemporaryDirectory() as folder:
        answer = _call(folder, page, "--virtual-time-budget=60000", "--dump-dom")
    found = re.search(r"<body>(\[.*\])</body>", answer, re.DOTALL)
    if found is None:
        raise OSError("the browser draws no pictures")
    drawn: Sequence[str] = json.loads(html.unescape(found[1]))
    data = (base64.b64decode(each.partition(",")[2]) for each in drawn)
    return dict(zip(pictures, data, strict=True))


def _call(folder: str, page: str, *flags: str) -> str:
    """Return what the browser prints about a page."""
    browser = next(filter(None, map(shutil.which, NAMES)), None)
    if browser is None:
        raise OSError("no Chromium is installed")
    file = Path(folder, "page.html")
    file.write_text(page, "utf-8")
    own = f"--user-data-dir={folder}/profile"
    try:
        done = subprocess.run(
            [browser, *FLAGS, own, *flags, file.as_uri()],
            capture_output=True,
            timeout=SECONDS,
            check=True,
        )
    except subprocess.SubprocessError as error:
        raise OSError(str(error)) from None
    return done.stdout.decode(errors="replace")
