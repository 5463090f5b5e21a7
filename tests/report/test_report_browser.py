"""The report in a browser: it opens without errors, draws what the results hold, and obeys mouse
and keyboard.
"""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from kincheck import Outcome, Results, cases
from kincheck.core.harness.scene import scene
from kincheck.core.report.figures import Effort, Past
from kincheck.core.report.report import write_report
from msgspec.structs import replace as replaced

from ..support.strut_results import GRID, distances, record, results, series

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


def strut(**changes):
    """Made-up results of a strut, with the mechanism of the built-in one."""
    shown = scene(cases.load("mcpherson_strut"))
    return replaced(results(), scenes={"strut": shown}, **changes)


def several():
    rows = [
        ("good", "one", 1e-12),
        ("good", "two", 1e-11),
        ("bad", "one", 5e-9),
        ("bad", "two", 1e-12),
        ("fine", "one", 1e-13),
    ]
    records = [record(case, "closed_form", engine, error, GRID) for case, engine, error in rows]
    crashed = {"outcome": Outcome.CRASHED, "message": "signal 11", "outputs": {}, "errors": {}}
    records.append(record("fine", "closed_form", "two", 0.0, GRID, **crashed))
    return Results(run={"cases": {"good": {"source": "a yellow book"}}}, records=records)


def test_overview_filters_in_browser(visit):
    told = visit(
        several(),
        """
        const shown = () => ({
          rows: all(".overview tbody tr:not([hidden]) th a").map((each) => each.textContent),
          columns: all(".overview thead th:not([hidden])").slice(1).map((each) => each.textContent),
          sections: all("section.case:not([hidden]) h2").map((each) => each.textContent),
          said: one("#shown").textContent,
        });
        const click = (what) => one(what).click(), states = [shown()];
        const type = (text) => { one("#search").value = text; one("#search").dispatchEvent(new Event("input")); };
        click("button[data-outcome=fail]"); states.push(shown());
        click("button[data-engine=two]"); states.push(shown());
        const none = !one("#none").hidden;
        click("button[data-outcome=fail]"); states.push(shown());
        press("Escape"); type("YELLOW good"); states.push(shown());
        type("signal"); states.push(shown());
        press("Escape"); click("#worst-first"); states.push(shown());
        const slash = press("/", one("#search")); // typed there, it is a letter
        press("/"); const focus = document.activeElement.id;
        const reached = all(".filters button, .filters input").every((each) => each.tabIndex === 0);
        const named = all("button").every((each) => each.textContent.trim() || each.ariaLabel);
        return { states, none, keys: { focus, slash, reached, named } };
        """,  # noqa: E501
    )
    everything, failed, of_two, two, yellow, crashed, sorted_ = told["states"]
    every = ["good", "bad", "fine"]
    assert everything == {"rows": every, "columns": ["one", "two"], "sections": every, "said": ""}
    assert failed == {
        "rows": ["bad"],
        "columns": ["one", "two"],
        "sections": ["bad"],
        "said": "1 of 3 cases",
    }
    assert of_two == {"rows": [], "columns": ["two"], "sections": [], "said": "0 of 3 cases"}
    assert told["none"]
    assert two == {"rows": every, "columns": ["two"], "sections": every, "said": ""}
    assert (yellow["rows"], crashed["rows"]) == (["good"], ["fine"])
    assert told["keys"] == {"focus": "search", "slash": True, "reached": True, "named": True}
    assert sorted_["rows"] == ["fine", "bad", "good"]  # what broke, then by error in tolerances


# The points of a curve, in pixels, and what a figure shows at each sample by the arrow keys.
READ = """
  const points = (plot, series) => [...one(`[data-figure=${plot}] .curve[data-series="${series}"]`).getAttribute("d").matchAll(/[ML](\\S+) ([^ML]+)/g)].map(([, x, y]) => [+x, +y]);
  const readout = (plot) => one(`[data-figure=${plot}] .readout`);
  const told = (plot, count) => Array.from({ length: count }, () => { press("ArrowRight", one(`[data-figure=${plot}]`)); return [...readout(plot).children].map((row) => row.textContent); });
"""  # noqa: E501


def lies_on_a_line(pixels, values):
    """Whether pixels are an affine function of values, to a tenth of a pixel and its rounding."""
    slope, start = np.polyfit(values, pixels, 1)
    return np.abs(slope * np.asarray(values) + start - pixels).max() < 0.1


def test_figures_draw_numbers_in_browser(visit):
    run = results()
    told = visit(
        run,
        READ
        + """
        const drawn = all(".plot[data-drawn]").map((plot) => plot.dataset.figure);
        return { drawn, native: points("case-0-0", "native"), errors: points("case-0-0-position", "one"),
          zeros: one("[data-figure=case-0-0-position] .zeros[data-series=one]").getAttribute("d").split("M").length - 1,
          curves: told("case-0-0", 21), differences: told("case-0-0-position", 21) };
        """,  # noqa: E501
    )
    # the rates' figures are folded, and wait
    assert told["drawn"] == ["case-0-0", "case-0-0-position", "case-0-1", "case-0-1-position"]
    native, other = run.records[:2]
    x, y = np.array(told["native"]).T
    position = np.array(native.outputs["half_track_change"].position, dtype=float)
    assert lies_on_a_line(x, position)
    assert lies_on_a_line(y, GRID)
    deviation = other.errors["half_track_change"].position
    assert deviation is not None
    errors = distances(other.outputs["half_track_change"].position, series(GRID).position)
    above = [(d, e) for d, e in zip(GRID, errors, strict=True) if e]
    assert told["zeros"] == errors.count(0.0) == 21 - len(above)
    x, y = np.array(told["errors"]).T
    assert lies_on_a_line(x, [d for d, _ in above])
    assert lies_on_a_line(y, np.log10([e for _, e in above]))
    for k, (curves, differences) in enumerate(
        zip(told["curves"], told["differences"], strict=True)
    ):
        travel = f"{float(f'{1000 * GRID[k]:.6g}'):g} mm".replace("-", "−")
        assert curves[0] == differences[0] == travel
        assert [row.split()[0] for row in curves[1:]] == ["reference", "native", "one"]
        shown = [float(row.split()[1].replace("−", "-")) for row in curves[1:]]
        assert shown[1] == pytest.approx(1000 * position[k], rel=1e-8)
        [error] = [row.split()[1] for row in differences if row.startswith("one ")]
        assert float(error.replace("−", "-")) == pytest.approx(errors[k], rel=5e-3)


def test_figures_zoom_and_save_in_browser(visit):
    told = visit(
        results(),
        READ
        + """
        const plot = one("[data-figure=case-0-0]"), box = plot.getBoundingClientRect(), seen = [];
        const note = () => seen.push([...new Set([...plot.querySelectorAll("[data-series]")].map((each) => each.dataset.series))]);
        note();
        one("button[data-series=one]").click();
        note();
        const at = (type, x, y) => plot.dispatchEvent(new PointerEvent(type, { clientX: box.left + x, clientY: box.top + y, pointerType: "mouse", pointerId: 1, bubbles: true }));
        plot.setPointerCapture = () => {};
        const reset = plot.parentElement.querySelector("[data-reset]"), whole = points("case-0-0", "native");
        at("pointerdown", 200, 100); at("pointermove", 300, 180); at("pointerup", 300, 180);
        const zoomed = points("case-0-0", "native"), offered = reset.offsetWidth > 0;
        reset.click();
        const again = points("case-0-0", "native");
        let file, name; const made = URL.createObjectURL;
        URL.createObjectURL = (blob) => { file = blob.text(); return made(blob); };
        HTMLAnchorElement.prototype.click = function () { name = this.download; };
        plot.parentElement.querySelector("[data-save]").click();
        one("section.case details:has(.plot)").open = true;
        await settled();
        const rates = all("[data-figure=case-0-0-velocity] .curve").map((each) => each.dataset.series);
        return { seen, pressed: one("button[data-series=one]").ariaPressed, whole, zoomed, again, offered, rates, name, file: await file };
        """,  # noqa: E501
    )
    assert told["seen"] == [["reference", "native", "one"], ["reference", "native"]]
    assert told["pressed"] == "false"
    assert told["again"] == told["whole"] != told["zoomed"]
    assert told["offered"]
    # a hundred pixels fill the width of some 460 now
    (a, _), (b, _) = (np.ptp(told[each], axis=0) for each in ("whole", "zoomed"))
    assert 3 < b / a < 6
    assert told["rates"] == ["native"]
    assert told["name"] == "case-0-0.svg"
    root = ElementTree.fromstring(told["file"])
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert "var(--" not in told["file"]  # it stands by itself, in the colours of the screen


def test_trends_are_drawn_in_browser(visit):
    past = [
        Past(run, "one", errors, 10.0)
        for run, errors in (
            ("2026-11-01", {"velocity": 1e-3}),
            ("2026-11-02", {"velocity": 0.0}),
            ("2026-11-03", {}),
        )
    ]
    efforts = [
        Effort("one", "tol 1e-6", 1e-7, 20.0),
        Effort("gone", "default", 1e-9, 5.0),
        Effort("one", "tol 1e-3", 1e-4, 9.0),
    ]
    read = (
        READ
        + """
        const precision = "case-0-precision-projection";
        const curves = all(`[data-figure=${precision}] .curve`);
        return {
          error: told("case-0-trend-velocity-error", 2),
          time: told("case-0-trend-time", 3),
          zeros: all("[data-figure=case-0-trend-velocity-error] .zeros").length,
          precision: told(precision, 2),
          drawn: curves.map((each) => each.dataset.series),
        };
    """
    )
    told = visit(results(), read, history={"strut": past}, precision={"strut": efforts})
    assert told["error"] == [
        ["2026-11-01", "one 0.001 tolerances"],
        ["2026-11-02", "one 0 tolerances"],
    ]
    assert told["time"] == [[f"2026-11-0{k}", "one 10 µs"] for k in (1, 2, 3)]
    assert told["zeros"] == 1
    assert told["drawn"] == ["one", "gone"]
    assert told["precision"] == [["one tol 1e-3: 9 µs, 0.0001 m"], ["one tol 1e-6: 20 µs, 1e−7 m"]]


def test_hostile_text_in_browser(visit):
    shown = scene(cases.load("mcpherson_strut"))
    joints = [replaced(shown.joints[0], name=HOSTILE, type=HOSTILE), *shown.joints[1:]]
    run = results(case=HOSTILE)
    strange = replaced(run.records[1], engine=HOSTILE, message=HOSTILE, version=HOSTILE)
    run = replaced(
        run,
        records=[run.records[0], strange],
        scenes={HOSTILE: replaced(shown, joints=joints, message=HOSTILE)},
    )
    past, effort = (
        Past(HOSTILE, HOSTILE, {"position": 1e-9}, 1.0, version=HOSTILE),
        Effort(HOSTILE, HOSTILE, 1e-9, 1.0),
    )
    told = visit(
        run,
        """
        for (const plot of all(".plot")) press("ArrowRight", plot);
        return { read: all(".readout").filter((each) => each.textContent.includes("alert(1)")).length, images: all("img").length, scripts: all("script").length, title: one("section.case h2").textContent,
          drawn: all(".plot[data-drawn]").length, links: all(".plot a").length,
          shown: all("section.case")[0].textContent.split("alert(1)").length };
        """,  # noqa: E501
        history={HOSTILE: [past, replace(past, run=f"{HOSTILE} again")]},
        precision={HOSTILE: [effort]},
    )
    assert told["title"] == HOSTILE
    assert told["images"] == told["links"] == 0
    assert told["read"] >= 5
    assert told["scripts"] == 3  # two of data, and ours
    assert told["drawn"] == 7
    assert told["shown"] > 5


def test_curves_are_saved_in_browser(visit):
    name, text = visit(
        strut(),
        """
        let text; const whole = URL.createObjectURL;
        URL.createObjectURL = (blob) => { text = blob.text(); return whole(blob); };
        let name; HTMLAnchorElement.prototype.click = function () { name = this.download; };
        one("[data-curves]").click();
        await until(() => name !== undefined);
        return [name, await text];
        """,
    )
    assert name.endswith(".csv")
    assert text.startswith("case,engine,mode,output,unit,sample,driver,")


def test_eight_engines_fit_narrow_page(visit):
    names = ("native", "mujoco", "pinocchio", "exudyn", "drake", "dart", "simbody", "my_engine")
    slow = {"us_per_step": 12345.0}
    case = "a_case_of_a_rather_long_name"
    records = [record(case, "closed_form", name, 1.234e-12, GRID, **slow) for name in names]
    told = visit(
        Results(run={}, records=records),
        """
        document.body.style.maxWidth = "900px";
        const table = one(".wide");
        return { seen: table.clientWidth, whole: table.scrollWidth };
        """,
    )
    assert told["whole"] <= told["seen"]


@pytest.mark.nightly
def test_printed_pages_are_full(browser, tmp_path):
    """Five outputs with their differences on each page, the rest on four more."""
    run = results()
    names = [f"output_{k}" for k in range(30)]
    records = [
        replaced(
            each,
            outputs=dict.fromkeys(names, each.outputs["half_track_change"]),
            errors=dict.fromkeys(names, each.errors["half_track_change"]),
        )
        for each in run.records[:2]
    ]
    known = dict.fromkeys(names, series(GRID))
    write_report(
        replaced(run, records=records, references={"strut": known}), file := tmp_path / "a.html"
    )
    browser.visit(file.as_uri())
    printed = base64.b64decode(browser("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) <= 30 / 5 + 4
