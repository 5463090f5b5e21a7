"""The live page as one file: its solver against `kincheck.curves`, without a server."""

from __future__ import annotations

import csv
import io

import kincheck
import numpy as np
import pytest
from kincheck.core.cli.main import main

from ...support.browser import CHROMIUM, Browser
from .conftest import CAR
from .test_live_page import FIELD, answered, drag, height, text, type_in, until_state

in_browser = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
CLOSE = 1e-12
"""Largest difference [m, rad and per m], a thousand round-offs of steps that differ."""
LARGEST = 1_500_000
"""Bytes of a page that goes by mail."""
QUICK = 50.0
"""Time of an answer of an axle at 161 samples [ms]."""


@pytest.fixture
def saved(car, monkeypatch):
    """Write the page of the table by these options, and return it."""
    monkeypatch.chdir(car.parent)

    def write(*options):
        assert main(["serve", car.name, *options, "--save", "page.html"]) == 0
        page = car.with_name("page.html")
        assert page.stat().st_size < LARGEST
        return page

    return write


@pytest.fixture
def browser(tmp_path):
    browser = Browser(tmp_path / "profile")
    browser("Network.enable")
    yield browser
    asked = [each for each in browser.events if each["method"] == "Network.requestWillBeSent"]
    addresses = {each["params"]["request"]["url"].partition(":")[0] for each in asked}
    complaints = browser.complaints()
    browser.close()
    assert complaints == []
    assert addresses <= {"file", "blob"}


def show(browser, page):
    browser.visit(page.as_uri())
    answered(browser)


def assert_equals_curves(browser, case):
    """Compare all curves of the numbers on the page."""
    moved, found, solved = browser.run(
        "const { outputs, solved } = kincheckLive.answer;"
        "const start = SAVED.opening.points.map(({ position }) => position);"
        "const rows = kincheckLive.rows();"
        "return [rows.map((row, k) => row.map((x, i) => x - start[k][i])), outputs, solved];"
    )
    names = browser.run("return SAVED.opening.points.map(({ name }) => name)")
    places = [f"{name} {axis}" for name in names for axis in "xyz"]
    offsets = [1e-3 * each for row in moved for each in row]
    assert any(offsets)
    expected = kincheck.curves(case, places, [offsets])
    assert expected.solved[0].tolist() == solved
    for name, values in expected.values.items():
        known = np.array(found[name], dtype=float)
        np.testing.assert_allclose(known, values[0], rtol=CLOSE, atol=CLOSE, err_msg=name)


@in_browser
def test_saved_page_equals_curves(saved, browser, car):
    """Dragged, undone, and as CSV as the command writes it."""
    show(browser, saved("--travel", "0.03:21"))
    case = kincheck.load(car, kincheck.Supplied(travel="0.03:21"))
    before = browser.run("return kincheckLive.answer.outputs.toe")
    moved = drag(browser, (9.0, -3.0))
    assert moved[1] != 0.0 != moved[2]
    assert_equals_curves(browser, case)
    assert not browser.run("return document.querySelector('#alone').hidden")
    assert browser.run("return one('#check').getBoundingClientRect().width") == 0
    browser.key("z", ctrl=True)
    answered(browser)
    assert browser.run("return kincheckLive.answer.outputs.toe") == before
    browser.run(
        "window.files = []; const made = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => (files.push(blob), made.call(URL, blob));"
    )
    browser.click("[data-export=csv]")
    browser.until("files.length")
    found = [*csv.reader(io.StringIO(browser.run("return files[0].text()")))]
    argv = ["run", car.name, "--travel", "0.03:21", "--engine", "native", "--csv", "r.csv"]
    assert main(argv) == 2  # nothing to compare with
    expected = [*csv.reader(io.StringIO(car.with_name("r.csv").read_text("utf-8")))]
    assert found[0] == expected[0]
    as_numbers = [np.array([[x or "nan" for x in row] for row in rows[1:]], float)
                  for rows in (found, expected)]  # fmt: skip
    np.testing.assert_allclose(*as_numbers, rtol=CLOSE, atol=1e3 * CLOSE)


@in_browser
def test_saved_axle_answers_quickly(saved, browser, car):
    show(browser, saved("--travel", "0.03:161", "--axle", "heave"))
    browser.click(FIELD)
    times = []
    for _ in range(25):
        browser.key("ArrowUp")
        answered(browser)
        spent = browser.run("return Object.values(kincheckLive.answer.milliseconds)")
        times.append(sum(spent))
    assert height(browser) == 565
    assert min(times) < QUICK
    supplied = kincheck.Supplied(travel="0.03:161", axle="heave")
    assert_equals_curves(browser, kincheck.load(car, supplied))
    browser.until("document.querySelector('#ranking td')")
    assert text(browser, "#ranking td").startswith("tierod")


@in_browser
def test_saved_page_on_phone(saved, served, browser):
    browser("Emulation.setDeviceMetricsOverride", width=400, height=800, deviceScaleFactor=1,
            mobile=False)  # fmt: skip
    wide = (
        "return [...document.querySelectorAll('.plane canvas')].map((each) => each.clientWidth)"
        ".concat(document.documentElement.scrollWidth)"
    )
    for address in (saved("--travel", "0.03:21").as_uri(), served.address):
        browser.visit(address)
        answered(browser)
        *views, page = browser.run(wide)
        assert min(views) >= 360
        assert page <= 400
        browser.events.clear()  # a served page is asked for


@in_browser
def test_saved_page_marks_lock_up(saved, browser, car):
    show(browser, saved("--travel", "0.06:21", "--axle", "steer"))
    case = kincheck.load(car, kincheck.Supplied(travel="0.06:21", axle="steer"))
    browser.until("!document.querySelector('#trouble').hidden")
    assert "lock-up" in text(browser, "#trouble")
    browser.click(FIELD)
    browser.key("ArrowUp")
    browser.until("!document.querySelector('#trouble').hidden")
    assert_equals_curves(browser, case)
    type_in(browser, FIELD, "1e200")
    browser.until("document.querySelector('#trouble').textContent.startsWith('20 samples')", 20)


@in_browser
def test_saved_page_saves_table(saved, browser, car):
    show(browser, saved("--travel", "0.03:5"))
    browser.run(
        "window.files = []; const made = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => (files.push(blob), made.call(URL, blob));"
    )
    browser.click(FIELD)
    browser.key("ArrowUp")
    browser.click("#saving button")
    until_state(browser, "saved as car_2.csv")
    made = car.with_name("made.csv")
    made.write_text(browser.run("return files[0].text()"), "utf-8")
    car.write_text(CAR.replace("uca_outer,-15,540,312", "uca_outer,-15,541,312"), "utf-8")
    supplied = kincheck.Supplied(travel="0.03:5")
    toes = [
        kincheck.run(kincheck.load(each, supplied), "native").records[0].outputs["toe"].position
        for each in (made, car)
    ]
    assert toes[0] == toes[1]


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        ("four_bar --save p.html", "--save: four_bar is no table of hardpoints"),
        ("car.csv --save p.html --port 8000", "--port: a saved page has no server"),
        ("car.csv --save p.html --once", "--once: a saved page has no server"),
        ("car.csv --save no/p.html", "no/p.html"),
    ],
)
def test_page_is_not_saved(argv, said, car, monkeypatch, capsys):
    monkeypatch.chdir(car.parent)
    assert main(["serve", *argv.split()]) == 2
    assert said in capsys.readouterr().err
    assert not car.with_name("p.html").exists()
