"""The live page as one file: its solver against `kincheck.curves`, without a server."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import subprocess

import kincheck
import numpy as np
import pytest
from kincheck import cases
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.live.model import LiveModel
from kincheck.core.extensions.live.protocol import Move, Solve
from kincheck.core.extensions.live.saved import saved_page
from kincheck.core.extensions.live.table import LiveTable
from kincheck.core.report.curves import write_curves

from ...support.examples import examples
from .conftest import CAR
from .test_live_page import FIELD, answered, drag, height, text, type_in, until_state

(OPEN,) = examples(__file__, "open")

CLOSE = 1e-12
"""Largest difference [m, rad and per m], a thousand round-offs of steps that differ."""
LARGEST = 1_500_000
"""Bytes of a page that goes by mail, without the curves of a case, which may have 0.8 million."""
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
def browser(browser):
    """A page that asks for nothing from a network."""
    browser("Network.enable")
    yield browser
    asked = [each for each in browser.events if each["method"] == "Network.requestWillBeSent"]
    addresses = {each["params"]["request"]["url"].partition(":")[0] for each in asked}
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


def test_saved_page_on_phone(saved, served, browser):
    browser.resize(400, 800)
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
        ("open.json --save p.html", "--save: open.json has no pose to move from"),
        ("car.csv --save p.html --port 8000", "--port: a saved page has no server"),
        ("car.csv --save p.html --once", "--once: a saved page has no server"),
        ("car.csv --save no/p.html", "no/p.html"),
    ],
)
def test_page_is_not_saved(argv, said, car, monkeypatch, capsys):
    monkeypatch.chdir(car.parent)
    car.with_name("open.json").write_text(json.dumps(OPEN))
    assert main(["serve", *argv.split()]) == 2
    assert said in capsys.readouterr().err
    assert not car.with_name("p.html").exists()


def test_saved_page_moves_drivers(browser, tmp_path, monkeypatch):
    """By sliders, with the curves as the command writes them."""
    monkeypatch.chdir(tmp_path)
    assert main(["serve", "planar_slider_crank", "--save", "page.html"]) == 0
    page = tmp_path / "page.html"
    browser.visit(page.as_uri())
    x, y = browser.middle("#sliders input[type=range]")
    browser.drag((x, y), (25.0, 0.0))
    until_state(browser, "all loops closed")
    browser.until("document.querySelector('#sliders .travel').checkVisibility()")
    seen = browser.run(
        "return [all('meter').length, one('#alone').innerText, all('#numbers td')[0].textContent]"
    )
    assert seen[:2] == [0, "This page has no engines, so it has no check and no distance from"
                           " singular poses: kincheck serve with the file has."]  # fmt: skip
    browser.run(
        "window.files = []; const made = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => (files.push(blob), made.call(URL, blob));"
    )
    browser.click("[data-export=csv]")
    browser.until("files.length")
    found = kincheck.run(kincheck.load("planar_slider_crank"), "native")
    write_curves(found, tmp_path / "r.csv", kind="csv", long=False)
    assert browser.run("return files[0].text()") == (tmp_path / "r.csv").read_bytes().decode()


ANSWERS = """
import { readFileSync } from "fs";
const page = readFileSync("page.html", "utf8");
const script = page.slice(page.indexOf("<script>") + 8, page.lastIndexOf("</script>"));
const asked = JSON.parse(readFileSync("asked.json", "utf8"));
const part = (from, to) => script.slice(script.indexOf(from), script.indexOf(to));
const parts = [
  part("const SAVED", '"use strict"'), // and the solver
  script.match(/^const direction = .*$/m)[0],
  part(script.includes("const WAY") ? "const WAY" : "const MOST_FRAMES", "function linkTo"),
];
const link = (0, eval)(`${parts.join("\\n")}; answererOf`);
const told = [];
const send = link((message) => told.push(message));
for (const each of asked) await send(each);
console.log(JSON.stringify(told.filter(({ type }) => type !== "opening")));
"""


def answers(page, asked, folder):
    """Return the answers of a page to messages."""
    curves = re.search(r'"csv":\{.*?\}', page)
    assert len(page.encode()) - len(curves[0] if curves else "") < LARGEST
    (folder / "page.html").write_text(page, "utf-8")
    (folder / "asked.json").write_text(json.dumps(asked))
    (folder / "ask.mjs").write_text(ANSWERS)
    said = subprocess.run(["node", "ask.mjs"], cwd=folder, capture_output=True, check=True)
    return json.loads(said.stdout)


def assert_answers_as_server(template, folder, **supplied):
    """Compare with the answers of the server, to whom the reader says where all points go."""
    table = folder / "car.csv"
    table.write_text(sample_table(TEMPLATES[template]), "utf-8")
    live = LiveTable(table, kincheck.Supplied(travel="0.02:9", **supplied))
    rng = np.random.default_rng(1)
    edits = [(np.array(live.positions) + rng.uniform(-2, 2, (len(live.names), 3))).tolist()
             for _ in range(2)]  # fmt: skip
    asked = [{"type": "solve", "points": points, "whole": True} for points in edits]
    for points, found in zip(edits, answers(saved_page(live), asked, folder), strict=True):
        expected = live.solve(Solve(points=[tuple(row) for row in points]))
        assert found["solved"] == expected.solved
        assert found["frames"] == expected.frames
        for name, values in expected.outputs.items():
            pair = (np.array(each, dtype=float) for each in (found["outputs"][name], values))
            np.testing.assert_allclose(*pair, rtol=CLOSE, atol=10.0 * CLOSE, err_msg=name)
        seen, drawn = found["drawing"], expected.drawing
        np.testing.assert_allclose(seen["nodes"], drawn["nodes"], atol=1e-9)
        assert (seen["steps"], seen["start"]) == (drawn["steps"], drawn["start"])
        for one, other in zip(seen["bodies"], drawn["bodies"], strict=True):
            for key in "rp":
                np.testing.assert_allclose(one[key], other[key], atol=1e-9)


in_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node")


@in_node
def test_saved_page_answers_as_server(tmp_path):
    assert_answers_as_server("pushrod_upper_arm", tmp_path, axle="roll")


@in_node
@pytest.mark.nightly
@pytest.mark.parametrize("template", TEMPLATES)
@pytest.mark.parametrize("axle", [None, "heave", "roll", "steer"])
def test_saved_pages_of_all_templates(template, axle, tmp_path):
    if axle == "steer" and "tierod_inner" not in {each.name for each in TEMPLATES[template].roles}:
        pytest.skip(f"{template} is not steered")
    assert_answers_as_server(template, tmp_path, axle=axle)


def assert_moves_as_server(name, folder):
    """Compare poses at values of the drivers, at rest, with those of the server."""
    live = LiveModel(folder / name, kincheck.load(name))
    rng = np.random.default_rng(4)
    values = [
        {
            driver: each.design + share * float(rng.uniform(each.low, each.high) - each.design)
            for driver, each in live.drivers.items()
        }
        for share in (0.0, 0.05, 0.3)
    ]
    asked = [{"type": "move", "drivers": each, "measured": True} for each in values]
    for drivers, found in zip(values, answers(saved_page(live), asked, folder), strict=True):
        expected = live.move(Move(drivers=drivers, measured=True))
        assert found["share"] == expected.share
        assert {*found["outputs"]} == {*expected.outputs}
        for kind in ("bodies", "outputs", "reactions"):
            for part, numbers in getattr(expected, kind).items():
                pair = (np.array(each, dtype=float) for each in (found[kind][part], numbers))
                np.testing.assert_allclose(*pair, rtol=CLOSE, atol=CLOSE, err_msg=part)


@in_node
@pytest.mark.parametrize("name", ["bennett", "planar_slider_crank"])
def test_saved_page_moves_as_server(name, tmp_path):
    """Rows are exchanged on the way of the first; the second has reactions."""
    assert_moves_as_server(name, tmp_path)


@in_node
@pytest.mark.nightly
@pytest.mark.parametrize("name", cases.names())
def test_saved_pages_of_all_cases(name, tmp_path):
    assert_moves_as_server(name, tmp_path)
