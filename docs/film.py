"""The film of the README's tour and of the site's front page: `make film` writes it again.

A headless Chromium goes through the steps below with real events of the mouse, and each frame is a
picture of its window. The sentence below a frame says what is done; where it is a command, it is
run as it stands.
"""

import base64
import contextlib
import io
import json
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from kincheck.core.cli.main import main as kincheck
from PIL import Image

from tests.support.browser import CHROMIUM, Browser, chromium

FILM = Path(__file__).parent.parent / ".github" / "tour.webp"
WINDOW = 1400, 900  # [px], of which the frames are made smaller
FRAME = 896, 576
PACE, PAUSE = 120, 1800  # how long a frame is shown [ms], and the last one of a step
PLANE, SCENE = ".plane canvas", "#scene canvas"
BALL_JOINT, MOVED = 2, (6.0, 4.0)  # the row of uca_outer, and how far it is dragged [px]
SAID = """
  const said = document.createElement("p");
  said.id = "said";
  said.style = `position: fixed; inset: auto 0 0 0; margin: 0; padding: 14px 28px; z-index: 9;
    background: #1b1f24; color: #fff; font: 24px/1.3 sans-serif; max-width: none`;
  const hand = document.createElement("div");
  hand.style = `position: fixed; left: -99px; width: 26px; height: 26px; margin: -13px;
    border: 3px solid #d55e00; border-radius: 50%; z-index: 9; pointer-events: none`;
  document.body.append(said, hand);
  document.addEventListener("pointermove", ({ clientX, clientY }) => {
    Object.assign(hand.style, { left: `${clientX}px`, top: `${clientY}px` });
  }, true);
"""
"""A line for the sentence, and a ring where the mouse is: headless, it has no arrow."""

Act = Callable[[Browser, float], None]


@dataclass(frozen=True)
class Step:
    """A sentence, what is done before each of its frames, and their number.

    Attributes:
        act: called with the share of the step that is done after it, from 1 / frames to 1.
        page: what the command of the sentence writes, opened at the first frame.
    """

    says: str
    act: Act
    frames: int
    page: str = ""


def drag(browser: Browser, share: float) -> None:
    """Take the ball joint in the front view, and bring it further."""
    left, top, x, y = browser.run(
        f"const {{ left, top }} = one({json.dumps(PLANE)}).getBoundingClientRect();"
        f"window.spot ||= kincheckLive.spots(0)[{BALL_JOINT}];"
        "return [left, top, ...spot];"
    )
    if not browser.run("const held = window.held; window.held = true; return held"):
        browser.mouse("mouseMoved", left + x, top + y, 0)
        browser.mouse("mousePressed", left + x, top + y, 1)
    x, y = left + x + share * MOVED[0], top + y + share * MOVED[1]
    browser.mouse("mouseMoved", x, y, 1)
    if share == 1.0:
        browser.mouse("mouseReleased", x, y, 0)
    browser.until("!kincheckLive.isDue()")


def play(browser: Browser, share: float) -> None:
    """Bring the wheel to jounce and rebound, with its instant centres."""
    browser.run(
        'const centres = one("[data-layer=centres]"); if (!centres.checked) centres.click();'
        'const samples = one("#scene input[type=range]");'
        f"const at = Math.sin({share} * 2 * Math.PI) + 1;"
        "samples.value = Math.round((at * samples.max) / 2);"
        'samples.dispatchEvent(new Event("input", { bubbles: true }));'
    )


def turn(browser: Browser, share: float) -> None:
    """Turn the scene by the mouse, a part for each frame."""
    left, top = browser.run(
        f"const {{ left, top }} = one({json.dumps(SCENE)}).getBoundingClientRect();"
        "return [left, top];"
    )
    browser.drag((left + 200 + 200 * share, top + 60), (12.0, 0.0), steps=2)


def save(browser: Browser, share: float) -> None:
    """Save the design as car_2.csv."""
    browser.click("#saving button")
    browser.until("document.querySelector('#state').textContent.startsWith('saved as')")


def scroll(*places: str) -> Act:
    """Bring the places of a page below each other into view, a frame each; first its top."""

    def act(browser: Browser, share: float) -> None:
        place = ("body", *places)[round(share * (1 + len(places))) - 1]
        browser.run(
            f"one({json.dumps(place)}).scrollIntoView({{ behavior: 'instant' }});"
            "scrollBy({ top: -70, behavior: 'instant' }); await settled();"
        )

    return act


SERVE = "kincheck serve car.csv --travel 0.06:161"
STEPS = (
    Step(SERVE, lambda browser, share: None, 1),
    Step("Drag the upper ball joint. Curves and scene follow, dashed lines are the file.", drag, 9),
    Step("Play the travel, with instant centres and roll centre.", play, 16),
    Step("Turn the scene.", turn, 8),
    Step("Save: the table car.csv stays as it is.", save, 1),
    Step(
        "kincheck run car_2.csv --travel 0.06:161 --engine native mujoco --out run",
        scroll(".case", ".case h3"),
        3,
        "run/report.html",
    ),
    Step(
        "kincheck compare car.csv car_2.csv --out compare",
        scroll(".figures"),
        2,
        "compare/compare.html",
    ),
    Step(
        'kincheck kc car_2.csv --bushings rubber.toml --spring "spring: 35 N/mm, 3 kN" --out kc',
        scroll(".figures"),
        2,
        "kc/kc.html",
    ),
)

TIMES = tuple(
    PAUSE if step.page or k == step.frames - 1 else PACE
    for step in STEPS
    for k in range(step.frames)
)
"""How long each frame is shown [ms]."""


@contextlib.contextmanager
def served() -> Iterator[str]:
    """Serve the live page of car.csv by the command of the first step, and give its address."""
    command = [sys.executable, "-m", *shlex.split(SERVE), "--no-browser", "--once"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            yield server.stdout.readline().split()[-1]
        finally:
            server.terminate()


def write_table() -> None:
    """Write the sample car and its bushings here."""
    for name, more in (("car.csv", []), ("rubber.toml", ["--bushings"])):
        with open(name, "w") as file, contextlib.redirect_stdout(file):
            kincheck(["templates", "double_wishbone", *more])


def frames(browser: Browser, address: str) -> Iterator[Image.Image]:
    """Go through the steps, and give a picture after each act."""
    browser.visit(address)
    browser.until("!kincheckLive.isDue() && document.querySelector('#ranking td')")
    browser.run(SAID)
    for step in STEPS:
        if step.page:
            with contextlib.redirect_stdout(io.StringIO()):
                status = kincheck(shlex.split(step.says)[1:])
            if status:
                raise RuntimeError(f"{step.says}: status {status}")
            browser.visit(Path(step.page).absolute().as_uri())
            browser.run(SAID)
        browser.run(f"one('#said').textContent = {json.dumps(step.says)}")
        for k in range(step.frames):
            step.act(browser, (k + 1) / step.frames)
            browser.run("await painted()")
            taken = browser("Page.captureScreenshot", format="png")["data"]
            picture = Image.open(io.BytesIO(base64.b64decode(taken))).convert("RGB")
            yield picture.resize(FRAME, Image.Resampling.LANCZOS)


def write(film: Path) -> None:
    """Go through the steps and write the film."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        write_table()
        with chromium(Path("profile")) as host, served() as address:
            browser = Browser(host)
            browser.resize(*WINDOW)
            browser("Emulation.setScrollbarsHidden", hidden=True)
            first, *others = frames(browser, address)
            browser.close()
    first.save(
        film, save_all=True, append_images=others, duration=[*TIMES], loop=0, quality=70, method=6
    )


def main() -> None:
    """Write the film where the README has it."""
    if CHROMIUM is None:
        sys.exit("make film: chromium is not installed. Install it: apt install chromium")
    write(FILM)
    print(f"{FILM}: {len(TIMES)} frames, {FILM.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
