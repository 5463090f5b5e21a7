"""A browser without a window, and the script by which a test acts on a page."""

import shutil

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
