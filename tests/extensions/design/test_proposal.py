"""Proposals of the live page, against `kincheck tune`."""

import kincheck
import numpy as np
import pytest

from ..live.conftest import TRAVEL, car, open_page, page, served  # noqa: F401

TOE, BOX = 5e-4, 0.01
BANDS = {"toe": [-TOE, TOE]}
BOXES = dict.fromkeys(["tierod_inner y", "tierod_inner z", "tierod_outer z"], BOX)


def test_proposal_equals_tune(page, car):  # noqa: F811
    points = page.moved("uca_outer", 1, 3.0)
    page.say(type="propose", points=points, bands=BANDS, boxes=BOXES, id=7)
    found = page.told("proposal")
    assert found["id"] == 7
    assert "reached, norm" in found["message"]
    assert np.abs(found["outputs"]["toe"]).max() <= TOE * (1.0 + 1e-6)
    car.write_text(car.read_text().replace("-15,540,312", "-15,543,312"))
    how = {"goal": [f"toe = 0 +- {TOE} rad"], "supplied": TRAVEL}
    moves = ["tierod_inner: y z +- 10mm", "tierod_outer: z +- 10mm"]
    names = [each["name"] for each in page.opening["points"]]
    moved = kincheck.tune(car, move=moves, **how).moves
    assert len(moved) == 3
    for place, move in moved.items():
        name, axis = place.split()
        k, i = names.index(name), "xyz".index(axis)
        assert found["points"][k][i] - points[k][i] == pytest.approx(1e3 * move, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bands": {}}, "Set the band of an output"),
        ({"bands": {"toe": [TOE, -TOE]}}, "toe: expected an output of motion, and its low end"),
        ({"bands": {"to": [-TOE, TOE]}}, "to: expected an output of motion"),
        ({"boxes": {"tierod_inner": BOX}}, "tierod_inner: expected a point that moves"),
        ({"boxes": {"tierod_inner y": 0.0}}, "and a length"),
    ],
)
def test_bad_proposal_is_refused(page, change, message):  # noqa: F811
    asked = {"points": page.points, "bands": BANDS, "boxes": BOXES}
    assert message in page.refusal(type="propose", **(asked | change))


def test_page_takes_proposal(served, browser):  # noqa: F811
    browser.visit(served.address)
    browser.click("#pick")
    _, y = browser.middle("[data-output=toe]")
    zero = browser.run(
        "return document.querySelector('[data-output=toe] path.zero[d*=V]')"
        ".getBoundingClientRect().left"
    )
    browser.drag((zero - 6.0, y), (12.0, 0.0))
    (name, (low, high)), *_ = browser.run("return [...kincheckLive.limits]")
    assert name == "toe"
    assert low < 0.0 < high < 0.2
    browser.click("[data-tick=tierod_inner]")
    start, first = browser.run(
        "const { answer } = kincheckLive; return [kincheckLive.rows(), answer.outputs.toe]"
    )
    browser.click("#propose")
    browser.until("!document.querySelector('#decide').hidden")
    ghost = browser.run("return kincheckLive.ghost.outputs.toe")
    assert np.degrees(np.abs(ghost)).max() <= high * 1.000001
    assert browser.run("return kincheckLive.rows()") == start
    browser.click("#take")
    browser.until("!kincheckLive.isDue()")
    taken = browser.run("return kincheckLive.answer.outputs.toe")
    assert taken == pytest.approx(ghost, abs=3e-7)  # typed to a tenth of a micrometre
    assert browser.run("return kincheckLive.ghost.outputs.toe") == first
    browser.click("#undo")
    assert browser.run("return kincheckLive.rows()") == start
