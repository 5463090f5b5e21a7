"""The live page in a browser, with real events of mouse and keys."""

from __future__ import annotations

from pathlib import Path

import pytest
from kincheck import load, run
from kincheck.core.cli.main import registry
from kincheck.core.cli.serve import judge_by
from kincheck.core.live.model import LiveModel
from kincheck.core.live.server import LiveServer

from ..support.browser import CHROMIUM, Browser
from .conftest import CAR, TRAVEL

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")

BALL_JOINT = 2  # the row of uca_outer
FIELD = "[aria-label='uca_outer y [mm]']"


@pytest.fixture
def browser(tmp_path: Path):
    browser = Browser(tmp_path / "profile")
    yield browser
    complaints = browser.complaints()
    browser.close()
    assert complaints == []


def answered(browser):
    """Wait until the answer to the numbers of the page is drawn."""
    browser.until("!kincheckLive.isDue() && kincheckLive.answer")


def toe(browser):
    """Toe at full jounce, to the last digit."""
    return float(browser.run("return kincheckLive.answer.outputs.toe.at(-1)"))


def text(browser, selector):
    return browser.run(f"return document.querySelector({selector!r}).textContent")


@pytest.fixture
def opened(served, browser):
    browser.visit(served.address)
    answered(browser)
    browser.until("document.querySelector('#ranking td')")  # the page has its final layout
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


def test_dragged_point_gives_what_run_gives(opened, car):
    before = toe(opened)
    moved = drag(opened, (9.0, -3.0))
    assert moved[0] == 0.0
    assert moved[1] != 0.0 != moved[2]
    assert toe(opened) != before
    opened.click("#saving button")
    opened.until("document.querySelector('#state').textContent.startsWith('saved as')")
    (record,) = run(load(car.with_name("car_2.csv"), TRAVEL), "native").records
    expected = record.outputs["toe"].position[-1]
    assert toe(opened) == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert car.read_text("utf-8") == CAR


def test_gesture_is_undone_and_redone_whole(opened):
    before = toe(opened)
    drag(opened, (9.0, -3.0))
    moved = toe(opened)
    opened.key("z", ctrl=True)
    answered(opened)
    assert toe(opened) == before
    opened.key("Z", ctrl=True, shift=True)
    answered(opened)
    assert toe(opened) == moved


def test_arrow_keys_step_a_number(opened):
    opened.click(FIELD)
    for how in ({}, {"shift": True}, {"alt": True}):
        opened.key("ArrowUp", **how)
    answered(opened)
    assert opened.run(f"return kincheckLive.rows()[{BALL_JOINT}][1]") == pytest.approx(551.1)


def test_typed_number_may_have_a_decimal_comma(opened):
    opened.click(FIELD)
    opened.run("document.activeElement.select()")
    opened.write("541,5")
    opened.key("Tab")
    answered(opened)
    assert opened.run(f"return kincheckLive.rows()[{BALL_JOINT}][1]") == 541.5


def test_typed_word_is_refused_and_the_number_stays(opened):
    opened.click(FIELD)
    opened.run("document.activeElement.select()")
    opened.write("54o")
    opened.key("Tab")
    assert "expected a number" in text(opened, "#trouble")
    assert opened.run(f"return kincheckLive.rows()[{BALL_JOINT}][1]") == 540


def test_design_that_the_reader_refuses_marks_its_row(opened):
    before = toe(opened)
    opened.click("[aria-label='uca_outer z [mm]']")
    opened.run("document.activeElement.select()")
    opened.write("12")
    opened.key("Tab")
    opened.until("document.querySelector('tr.wrong th')")
    assert text(opened, "tr.wrong th") == "uca_outer"
    assert "uca_outer" in text(opened, "#trouble")
    assert toe(opened) == before
    opened.key("z", ctrl=True)
    opened.until("!document.querySelector('tr.wrong')")


def test_check_shows_a_verdict_that_an_edit_removes(opened):
    opened.click("#check")
    opened.until("document.querySelector('#state').textContent === 'checked'")
    assert "native" in text(opened, "#verdicts")
    opened.click(FIELD)
    opened.key("ArrowUp")
    assert text(opened, "#verdicts") == ""


def test_limit_marks_the_numbers_beyond(opened):
    opened.click("[aria-label='high limit of toe [°]']")
    opened.write("0.1")
    opened.key("Tab")
    over = "return [...document.querySelectorAll('tr[data-output=toe] .over')].length"
    assert opened.run(over) == 1
    assert opened.run("return document.querySelectorAll('.limit').length") == 1


def test_lost_server_is_told_and_numbers_stay(opened, served):
    served.close()
    opened.until("document.querySelector('#state').textContent.startsWith('connection lost')")
    assert opened.run(f"return kincheckLive.rows()[{BALL_JOINT}][1]") == 540


def test_page_fits_a_narrow_window(served, browser):
    browser("Emulation.setDeviceMetricsOverride", width=900, height=900, deviceScaleFactor=1,
            mobile=False)  # fmt: skip
    browser.visit(served.address)
    answered(browser)
    assert browser.run("return document.documentElement.scrollWidth <= innerWidth")


def test_scene_shows_the_roll_centre_of_the_outputs(opened):
    """The construction is from differences of poses a few millimetres apart."""
    opened.click("[data-layer=centres]")
    drawn, expected = opened.run(
        "const { drawing, frames, outputs } = kincheckLive.answer, motion = motionOf(drawing);"
        "const height = (_, k) =>"
        " centresOf(drawing, motion, k)[0].center[2] - motion.wheels[k][0].contact[2];"
        "return [frames.map(height), frames.map((k) => outputs.roll_center_height[k])]"
    )
    assert drawn == pytest.approx(expected, abs=1e-4)


def test_scene_is_saved_as_picture_and_film(opened):
    opened.run(
        "window.files = []; const made = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => (files.push(blob), made.call(URL, blob));"
    )
    for kind in ("svg", "png", "film"):
        opened.click(f"[data-picture={kind}]")
    opened.until("files.length === 3")
    kinds = opened.run("return files.map(({ type }) => type.split(';')[0])")
    assert kinds == ["image/svg+xml", "image/png", "video/webm"]
    bad, shapes = opened.run(
        "const text = await files[0].text();"
        "const svg = new DOMParser().parseFromString(text, 'image/svg+xml');"
        "return [svg.querySelectorAll('parsererror').length, svg.querySelectorAll('path').length]"
    )
    assert bad == 0
    assert shapes > 100
    assert opened.run("return (await files[2].arrayBuffer()).byteLength") > 10_000


def test_scene_turns_moves_and_enlarges(opened):
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


def test_slider_moves_a_mechanism(tmp_path, browser):
    known = registry()
    file = tmp_path / "rssr"
    server = LiveServer(file, lambda: LiveModel(file, load("rssr")), known.engines, judge_by(known))
    browser.visit(server.address)
    x, y = browser.middle("#sliders input[type=range]")
    browser.drag((x, y), (25.0, 0.0))
    browser.until("document.querySelector('#state').textContent === 'all loops closed'")
    assert "pose of the sliders" in text(browser, "#scene output")
    browser.until("document.querySelector('#sliders .row .quiet').textContent")
    server.close()
    browser.until("document.querySelector('#state').textContent.startsWith('connection lost')")
