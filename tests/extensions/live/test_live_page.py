"""The live page in a browser, with real events of mouse and keys."""

from __future__ import annotations

from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from time import monotonic, sleep

import kincheck
import pytest
from kincheck import load, run
from kincheck.core.cli.main import registry
from kincheck.core.extensions.live.command import judge_by
from kincheck.core.extensions.live.model import LiveModel
from kincheck.core.extensions.live.server import LiveServer
from kincheck.core.extensions.live.table import LiveTable

from ...support.browser import AXE
from .conftest import CAR, TRAVEL

BALL_JOINT = 2  # the row of uca_outer
FIELD = "[aria-label='uca_outer y [mm]']"


def answered(browser):
    """Wait until the answer to the numbers of the page is drawn."""
    browser.until("!kincheckLive.isDue() && kincheckLive.answer")


def toe(browser):
    """Toe at full jounce, to the last digit."""
    return float(browser.run("return kincheckLive.answer.outputs.toe.at(-1)"))


def height(browser):
    """The y of the ball joint [mm]."""
    return browser.run(f"return kincheckLive.rows()[{BALL_JOINT}][1]")


def type_in(browser, field, text):
    """Type a text in place of what a field has, and leave it."""
    browser.click(field)
    browser.run("document.activeElement.select()")
    browser.write(text)
    browser.key("Tab")


def until_state(browser, text):
    """Wait for the line of state to begin with a text, or to have done so: the next may be soon."""
    said = "[...(window.said || []), document.querySelector('#state').textContent]"
    browser.until(f"{said}.some((each) => each.startsWith({text!r}))")


def saved_toe(browser, car):
    """Save the table; the toe that `run` gives for the new file."""
    browser.click("#saving button")
    until_state(browser, "saved as")
    (record,) = run(load(car.with_name("car_2.csv"), TRAVEL), "native").records
    return record.outputs["toe"].position


def text(browser, selector):
    return browser.run(f"return document.querySelector({selector!r}).textContent")


@pytest.fixture
def opened(served, browser):
    browser.visit(served.address)
    answered(browser)
    browser.until("document.querySelector('#ranking td')")  # the page has its final layout
    browser.run(
        "window.said = []; const state = one('#state');"
        "const heard = new MutationObserver(() => said.push(state.textContent));"
        "heard.observe(state, { childList: true, characterData: true, subtree: true });"
    )
    return browser


def drag(browser, by):
    """Drag the ball joint in the front view by pixels; return the millimetres that it went."""
    browser.middle(".plane canvas")
    left, top, x, y = browser.run(
        "const { left, top } = document.querySelector('.plane canvas').getBoundingClientRect();"
        f"return [left, top, ...kincheckLive.spots(0)[{BALL_JOINT}]]"
    )
    before = browser.run(f"return kincheckLive.rows()[{BALL_JOINT}]")
    browser.drag((left + x, top + y), by)
    answered(browser)
    after = browser.run(f"return kincheckLive.rows()[{BALL_JOINT}]")
    return [b - a for a, b in zip(before, after, strict=True)]


def test_dragged_point_equals_run(opened, car):
    before = toe(opened)
    moved = drag(opened, (9.0, -3.0))
    assert moved[0] == 0.0
    assert moved[1] != 0.0 != moved[2]
    assert toe(opened) != before
    assert toe(opened) == pytest.approx(saved_toe(opened, car)[-1], rel=1e-12, abs=1e-15)
    assert car.read_text("utf-8") == CAR


def test_ball_joint_dragged_by_millimetres(opened, car):
    """What the page shows, and what `run` gives for the saved table, agree in all digits but the
    last three, which the order of sums decides.
    """
    middle = "return [0, 1].map((k) => kincheckLive.spots(0)[k * 5 + 3][0])"  # lca_front, wheel
    inner, outer = opened.run(middle)
    millimetre = (outer - inner) / (612 - 210)
    moved = drag(opened, (10.0 * millimetre, 0.0))
    assert moved == pytest.approx([0.0, 10.0, 0.0], abs=0.051)  # tenths of millimetres
    shown = opened.run("return kincheckLive.answer.outputs.toe")
    assert shown == pytest.approx(saved_toe(opened, car), rel=1e-13, abs=1e-15)


def test_locked_axis_is_kept(opened):
    opened.click("[aria-label='lock y of all points']")
    moved = drag(opened, (9.0, -3.0))
    assert moved[1] == 0.0 != moved[2]
    opened.click(FIELD)
    opened.key("ArrowUp")
    assert height(opened) == 540


def test_reload_keeps_numbers(opened):
    opened.click(FIELD)
    opened.key("ArrowUp")
    answered(opened)
    moved = toe(opened)
    opened.reload()
    answered(opened)
    assert height(opened) == 541
    assert toe(opened) == moved
    opened.key("z", ctrl=True)
    assert height(opened) == 540


def test_live_page_by_keys_alone(opened, car):
    """Every control has a name and a mark of its focus, in the order of the page."""
    seen = []
    for _ in range(100):
        opened.key("Tab")
        kind, name, mark = opened.run(
            "const at = document.activeElement;"
            "const name = at.getAttribute('aria-label') || (at.labels || [])[0]?.textContent"
            " || at.textContent;"
            "return [at.tagName, name.trim(), getComputedStyle(at).outlineStyle];"
        )
        if kind == "BODY":
            break
        assert name
        assert mark == "solid", name
        seen.append(name)
        if name == "uca_outer y [mm]":
            opened.key("ArrowUp")
    answered(opened)
    assert height(opened) == 541
    order = ["CSV", "save", "play", "front", "centres", "film", "uca_front x [mm]", "check"]
    assert [name for name in seen if name in order] == order
    opened.run("document.querySelector('#name').focus()")
    opened.key("Tab")
    opened.key("Enter")
    until_state(opened, "saved as")
    assert "uca_outer,-15,541,312" in car.with_name("car_2.csv").read_text("utf-8")


@pytest.mark.skipif(not AXE.is_file(), reason="axe is not installed: npm install axe-core")
def test_live_page_passes_axe(opened):
    opened.run("for (const each of document.querySelectorAll('[data-layer]')) each.checked = true")
    assert opened.violations() == []


def test_hidden_figures_are_drawn_later(opened):
    last = "[...document.querySelectorAll('#figures .curve')].at(-1).getAttribute('d')"
    before = opened.run(f"return {last}")
    opened.click(FIELD)
    opened.key("ArrowUp", shift=True)
    opened.until(f"{last} !== {before!r}")


def test_gesture_is_undone_whole(opened):
    before = toe(opened)
    drag(opened, (9.0, -3.0))
    moved = toe(opened)
    opened.key("z", ctrl=True)
    answered(opened)
    assert toe(opened) == before
    opened.key("Z", ctrl=True, shift=True)
    answered(opened)
    assert toe(opened) == moved


def test_arrow_keys_step_number(opened):
    opened.click(FIELD)
    for how in ({}, {"shift": True}, {"alt": True}):
        opened.key("ArrowUp", **how)
    answered(opened)
    assert height(opened) == pytest.approx(551.1)


def test_typed_number_with_decimal_comma(opened):
    type_in(opened, FIELD, "541,5")
    answered(opened)
    assert height(opened) == 541.5


def test_typed_word_is_refused(opened):
    type_in(opened, FIELD, "54o")
    opened.until("document.querySelector('#trouble').textContent.includes('coordinate')")
    assert height(opened) == 540


def test_refused_design_marks_row(opened):
    before = toe(opened)
    type_in(opened, "[aria-label='uca_outer z [mm]']", "12")
    opened.until("document.querySelector('tr.wrong th')")
    assert text(opened, "tr.wrong th") == "uca_outer"
    assert "uca_outer" in text(opened, "#trouble")
    assert toe(opened) == before
    opened.key("z", ctrl=True)
    opened.until("!document.querySelector('tr.wrong')")


def test_edit_removes_verdict(opened):
    opened.click("#check")
    until_state(opened, "checked")
    assert "native" in text(opened, "#verdicts")
    opened.click(FIELD)
    opened.key("ArrowUp")
    assert text(opened, "#verdicts") == ""


def test_limit_marks_exceeding_numbers(opened):
    type_in(opened, "[aria-label='high limit of toe [°]']", "0.1")
    over = "return [...document.querySelectorAll('tr[data-output=toe] .over')].length"
    assert opened.run(over) == 1
    assert opened.run("return document.querySelectorAll('.limit').length") == 1


def test_lost_server_keeps_numbers(opened, served):
    served.close()
    until_state(opened, "connection lost")
    assert height(opened) == 540


def test_live_page_fits_narrow_window(served, browser):
    browser.resize(900, 900)
    browser.visit(served.address)
    answered(browser)
    assert browser.run("return document.documentElement.scrollWidth <= innerWidth")


def test_live_page_measures_edits(served, browser):
    served.measuring = True
    browser.visit(f"{served.address}&measure=3")
    assert served.ended.wait(60)
    assert len(served.measured) == 3
    assert min(served.measured) > 0.0


def test_mirrored_point_moves_along(browser, tmp_path):
    head, _, rows = CAR.partition("name,x,y,z,meaning\n")
    fields = [row.split(",") for row in rows.splitlines()]
    sides = (("FL", 1.0), ("FR", -1.0))
    both = [f"{s}_{n},{x},{k * float(y)},{z}" for s, k in sides for n, x, y, z, _ in fields]
    file = tmp_path / "both sides.csv"
    file.write_text(head + "name,x,y,z\n" + "\n".join(both), "utf-8")
    server = kincheck.live(file, kincheck.Supplied(travel="0.03:5", corner="FL"))
    browser.visit(server.address)
    answered(browser)
    field = "[aria-label='FL_uca_outer y [mm]']"
    rows = f"return [2, {2 + len(fields)}].map((k) => kincheckLive.rows()[k])"
    browser.click(field)
    browser.key("ArrowUp")
    assert browser.run(rows) == [[-15, 541, 312], [-15, -541, 312]]
    browser.click("#points caption input")
    browser.click(field)
    browser.key("ArrowUp")
    assert browser.run(rows) == [[-15, 542, 312], [-15, -541, 312]]
    browser.key("z", ctrl=True)
    browser.key("z", ctrl=True)
    assert browser.run(rows) == [[-15, 540, 312], [-15, -540, 312]]
    server.close()


def test_unreached_travel_is_marked(browser, car):
    server = kincheck.live(car, kincheck.Supplied(travel="0.06:21", axle="steer"))
    browser.visit(server.address)
    answered(browser)
    assert "rack travel [mm] is not reached: −60 to −54, 54 to 60" in text(browser, "#unreached")
    browser.until("document.querySelector('#trouble').textContent.includes('singular pose')")
    marks = "#figures figure:first-child rect[fill^='rgba(213']"
    assert browser.run(f"return document.querySelectorAll({marks!r}).length") == 2
    server.close()


@pytest.mark.parametrize("framed", [True, False])
def test_live_page_in_notebook_frame(browser, car, framed):
    known = registry()
    server = LiveServer(
        car, lambda: LiveTable(car, TRAVEL), known.engines, judge_by(known), framed=framed
    )
    page = f"<!doctype html><link rel=icon href=data:>{server._repr_html_()}".encode()

    class Notebook(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, *_):
            pass

    notebook = ThreadingHTTPServer(("127.0.0.1", 0), Notebook)
    Thread(target=notebook.serve_forever, daemon=True).start()
    browser("Page.navigate", url=f"http://localhost:{notebook.server_port}/")
    end = monotonic() + 60
    while not (refused := browser.complaints()) and server.points is None:
        assert monotonic() < end
        sleep(0.05)
    assert (server.points is not None, bool(refused)) == (framed, not framed)
    if not framed:
        assert "frame-ancestors" in refused[0]
        browser.events.clear()
    notebook.shutdown()
    notebook.server_close()
    server.close()


def test_live_scene_shows_roll_centre(opened):
    """The construction is from differences of poses a few millimetres apart."""
    opened.click("[data-layer=centres]")
    drawn, expected = opened.run(
        "const { drawing, frames, outputs } = kincheckLive.answer, motion = motionOf(drawing);"
        "const height = (_, k) =>"
        " centresOf(drawing, motion, k)[0].center[2] - motion.wheels[k][0].contact[2];"
        "return [frames.map(height), frames.map((k) => outputs.roll_center_height[k])]"
    )
    assert drawn == pytest.approx(expected, abs=1e-4)


def test_scene_saved_as_picture_and_film(opened):
    opened.run(
        "window.files = []; const made = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => (files.push(blob), made.call(URL, blob));"
    )
    for kind in ("svg", "png", "film"):
        opened.click(f"[data-picture={kind}]")
    opened.until("files.length === 3")
    # in the order in which they are finished
    sizes, bad, shapes = opened.run(
        "const sizes = files.map(({ type, size }) => [type.split(';')[0], size]);"
        "const text = await files.find(({ type }) => type.startsWith('image/svg')).text();"
        "const svg = new DOMParser().parseFromString(text, 'image/svg+xml');"
        "const count = (what) => svg.querySelectorAll(what).length;"
        "return [Object.fromEntries(sizes), count('parsererror'), count('path')];"
    )
    assert {*sizes} == {"image/svg+xml", "image/png", "video/webm"}
    assert sizes["video/webm"] > 10_000
    assert bad == 0
    assert shapes > 100


def test_live_scene_turns_and_enlarges(opened):
    look = "return document.querySelector('#scene canvas').toDataURL()"
    seen = [opened.run(look)]
    x, y = opened.middle("#scene canvas")
    opened.drag((x, y), (40.0, 10.0))
    seen.append(opened.run(look))
    for key, shift in (("ArrowLeft", False), ("ArrowLeft", True), ("+", False)):
        opened.key(key, shift=shift)
        seen.append(opened.run(look))
    opened("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-200)
    opened.until(f"(() => {{ {look} }})() !== {seen[-1]!r}")
    assert len({*seen}) == len(seen)


def test_slider_moves_mechanism(tmp_path, browser):
    known = registry()
    file = tmp_path / "rssr"
    server = LiveServer(file, lambda: LiveModel(file, load("rssr")), known.engines, judge_by(known))
    browser.visit(server.address)
    x, y = browser.middle("#sliders input[type=range]")
    browser.drag((x, y), (25.0, 0.0))
    until_state(browser, "all loops closed")
    assert "pose of the sliders" in text(browser, "#scene output")
    browser.until("document.querySelector('#sliders .row .quiet').textContent")
    server.close()
    until_state(browser, "connection lost")
