"""A browser without a window."""

import base64
import json
import os
import re
import shutil
import subprocess
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import connect

CHROMIUM = (
    shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
)
AXE = Path(os.environ.get("KINCHECK_AXE", "node_modules/axe-core/axe.min.js"))
"""https://github.com/dequelabs/axe-core, MPL-2.0: `npm install axe-core`, or the path here."""
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run"
    " --disable-background-networking --disable-component-update --disable-sync"
    " --enable-logging=stderr --v=0"
).split()
HELPERS = """
  const pause = (ms = 100) => new Promise((done) => setTimeout(done, ms));
  const all = (what) => [...document.querySelectorAll(what)], one = (what) => document.querySelector(what);
  const keydown = (key) => new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true });
  const press = (key, on = document.body) => on.dispatchEvent(keydown(key));
  const until = async (found) => { while (!found()) await pause(20); };
  // after two frames, sizes are observed and drawn
  const painted = async () => { for (const _ of [0, 1]) await new Promise(requestAnimationFrame); };
  const isSeen = (box) => { const { top, bottom } = box.getBoundingClientRect(); return bottom > top && bottom > 0 && top < innerHeight && !box.closest("details:not([open])"); };
  const settled = async () => { await painted(); await until(() => !all(".plot:not([data-drawn])").some(isSeen)); await painted(); };
"""  # noqa: E501


@contextmanager
def chromium(folder):
    """Run a headless Chromium with its profile in a folder; yields where it listens."""
    command = [str(CHROMIUM), *FLAGS, "--remote-debugging-port=0", f"--user-data-dir={folder}"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        host = next(
            found[1]
            for line in process.stderr
            if (found := re.search(r"listening on ws://([^/]+)/", line))
        )
        # a full pipe would stop it
        reader = Thread(target=process.stderr.read, daemon=True)
        reader.start()
        yield host
        process.terminate()
        reader.join()


class Browser:
    """A page of its own in a running Chromium, without the data of others, and with real mouse and
    key events, by the Chrome DevTools Protocol (https://chromedevtools.github.io/devtools-protocol/).
    """

    def __init__(self, host):
        with urlopen(f"http://{host}/json/version") as told:
            address = json.load(told)["webSocketDebuggerUrl"]
        self.count, self.events = 0, list[dict[str, Any]]()
        self.links = ExitStack()
        self.socket = self.whole = self.links.enter_context(connect(address, max_size=None))
        self.context = self("Target.createBrowserContext")["browserContextId"]
        page = self("Target.createTarget", url="about:blank", browserContextId=self.context)
        own = connect(f"ws://{host}/devtools/page/{page['targetId']}", max_size=None)
        self.socket = self.links.enter_context(own)
        for domain in ("Page", "Runtime", "Log"):
            self(f"{domain}.enable")
        self.resize(1400, 1000)
        scheme = {"name": "prefers-color-scheme", "value": "light"}
        self("Emulation.setEmulatedMedia", features=[scheme])

    def __call__(self, method, **given):
        """Call a method of the protocol."""
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": given}))
        while True:
            message = json.loads(self.socket.recv(timeout=60))
            if message.get("id") == self.count:
                assert "error" not in message, (method, message)
                return message["result"]
            self.events.append(message)

    def resize(self, width, height):
        """Change the size of the window [px]."""
        self(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def violations(self):
        """Return what axe finds on the page."""
        self("Runtime.evaluate", expression=AXE.read_text("utf-8"))
        return self.run(
            "const { violations } = await axe.run();"
            "return violations.map(({ id, nodes }) => [id, ...nodes.map(({ html }) => html)]);"
        )

    def run(self, script):
        """Return what a script returns in the page; it may use the helpers."""
        text = f"(async () => {{ {HELPERS} {script} }})()"
        found = self("Runtime.evaluate", expression=text, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def visit(self, address):
        """Open a page and wait until it is ready."""
        self("Page.navigate", url=address)
        self.until("'ready' in document.documentElement.dataset")

    def reload(self):
        """Load the page again and wait until it is ready; the old one is ready, too."""
        self.run("window.isOld = true")
        self("Page.reload")
        self.until("!window.isOld && 'ready' in document.documentElement.dataset")

    def until(self, condition, seconds=90.0):
        """Wait for a condition in the page."""
        end = monotonic() + seconds
        while not self.run(f"return Boolean(document.documentElement && ({condition}))"):
            assert monotonic() < end, condition
            sleep(0.05)

    def mouse(self, kind, x, y, buttons):
        """Send one event of the mouse with the left button."""
        button = "left" if buttons or kind != "mouseMoved" else "none"
        self(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button=button,
            buttons=buttons,
            clickCount=1,
        )

    def drag(self, start, by, steps=12):
        """Press at a place, move, and release."""
        (x, y), (dx, dy) = start, by
        self.mouse("mouseMoved", x, y, 0)
        self.mouse("mousePressed", x, y, 1)
        for k in range(1, steps + 1):
            self.mouse("mouseMoved", x + dx * k / steps, y + dy * k / steps, 1)
        self.mouse("mouseReleased", x + dx, y + dy, 0)

    def middle(self, selector):
        """Return the middle of an element, scrolled into view [px]."""
        x, y = self.run(
            f"const it = document.querySelector({json.dumps(selector)});"
            "it.scrollIntoView({ block: 'center', behavior: 'instant' });"
            "const { left, top, width, height } = it.getBoundingClientRect();"
            "return [left + width / 2, top + height / 2];"
        )
        return x, y

    def click(self, selector):
        """Click on an element."""
        self.drag(self.middle(selector), (0.0, 0.0), steps=0)

    def key(self, key, *, ctrl=False, shift=False, alt=False):
        """Press and release a key."""
        codes = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
        codes |= {"Enter": 13, "Tab": 9, "Escape": 27}
        code = codes.get(key, ord(key[0].upper()))
        modifiers = alt + 2 * ctrl + 8 * shift
        text = {"text": "\r"} if key == "Enter" else {}  # without it, Enter presses no button
        for kind in ("keyDown" if text else "rawKeyDown", "keyUp"):
            self(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                **text,
                windowsVirtualKeyCode=code,
                modifiers=modifiers,
            )

    def write(self, text):
        """Type a text where the focus is, in place of what is selected."""
        self("Input.insertText", text=text)

    def picture(self, file):
        """Write the page as PNG."""
        data = self("Page.captureScreenshot", format="png", captureBeyondViewport=True)["data"]
        file.write_bytes(base64.b64decode(data))

    def complaints(self):
        """Return what was written to the console or thrown."""
        self.run("return 0")
        named = ("Runtime.exceptionThrown", "Log.entryAdded", "Runtime.consoleAPICalled")
        return [json.dumps(each) for each in self.events if each.get("method") in named]

    def close(self):
        """Close the page and forget its data."""
        self.socket = self.whole
        self("Target.disposeBrowserContext", browserContextId=self.context)
        self.links.close()
