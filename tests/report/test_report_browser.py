"""The report in a browser: it opens without errors, draws what the results hold, and obeys mouse
and keyboard.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest
from kincheck import cases
from kincheck.core.harness.record import Outcome, Results
from kincheck.core.harness.scene import FRAMES, scene
from kincheck.core.report.figure_data import Effort, Past
from kincheck.core.report.report import write_report

from ..support.made_up import GRID, record, results

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
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"

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

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")


@pytest.fixture
def visit(tmp_path: Path) -> Any:
    """Writes a report, opens it, and does something there; what that returned. Anything on the
    console is a failure.
    """

    def opened(run: Results, act: str, **further: Any) -> Any:
        path = tmp_path / "report.html"
        write_report(run, path, **further)
        path.write_text(path.read_text("utf-8").replace("</body>", ACT % act), "utf-8")
        command = [
            str(CHROMIUM),
            *FLAGS,
            "--virtual-time-budget=20000",
            f"--user-data-dir={tmp_path / 'profile'}",
            "--dump-dom",
        ]
        done = subprocess.run(
            [*command, path.as_uri()], capture_output=True, text=True, timeout=120, check=True
        )
        assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
        found = re.search(r'data-told="([^"]*)"', done.stdout)
        assert found, "the page did not become ready"
        return json.loads(html.unescape(found[1]))

    return opened


def strut(**changes: Any) -> Results:
    """Made-up results of a strut, with the mechanism of the built-in one."""
    shown = scene(cases.load("mcpherson_strut"))
    return msgspec.structs.replace(results(), scenes={"strut": shown}, **changes)


def several() -> Results:
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


def test_the_overview_is_filtered_by_outcome_engine_and_words_and_worked_by_keyboard(
    visit: Any,
) -> None:
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


def test_plots_hold_the_numbers_of_the_results(visit: Any) -> None:
    run = results()
    told = visit(
        run,
        """
        return all(".plot[data-drawn]").map((plot) => [plot.dataset.figure, plot.data.map(({ meta, mode, x, y, uid }) =>
          ({ meta, mode, uid, x: [...x], y: [...y] }))]);
        """,  # noqa: E501
    )
    drawn = dict(told)
    # others wait; no history, no efforts
    assert list(drawn) == ["case-0-0", "case-0-1", "case-0-0-position", "case-0-0-velocity"]
    for each in run.records[:2]:
        [curve] = [
            trace
            for trace in drawn["case-0-0"]
            if (trace["meta"], trace["mode"]) == (each.engine, "lines")
        ]
        assert curve["y"] == pytest.approx([1000 * d for d in GRID], abs=1e-12)
        position = each.outputs["half_track_change"].position
        assert curve["x"] == pytest.approx([1000 * v for v in position if v is not None], rel=1e-9)
    [errors] = [trace for trace in drawn["case-0-0-position"] if trace["uid"] == "s1"]
    deviation = run.records[1].errors["half_track_change"].position
    assert deviation is not None
    assert errors["y"][deviation.worst_step] == pytest.approx(deviation.max_abs, rel=5e-3)
    assert max(e for e in errors["y"] if e) == errors["y"][deviation.worst_step]


def test_curves_are_switched_and_the_other_errors_chosen(visit: Any) -> None:
    told = visit(
        results(),
        """
        const visible = () => all(".plot").filter((each) => each.offsetHeight).map((each) => each.dataset.figure);
        one("button[data-series=one]").click();
        one("select").value = "case-0-1";
        one("select").dispatchEvent(new Event("change"));
        await pause();
        const off = one("[data-figure=case-0-0]").data.filter((trace) => trace.visible === false).map((trace) => trace.meta);
        return { off, pressed: one("button[data-series=one]").ariaPressed, visible: visible(),
          later: one("[data-figure=case-0-1-position]").data.filter((trace) => trace.visible === false).length };
        """,  # noqa: E501
    )
    assert told["off"] == ["one", "one"]  # the line and its markers
    assert told["pressed"] == "false"
    assert told["visible"] == ["case-0-0", "case-0-1", "case-0-1-position", "case-0-1-velocity"]
    assert told["later"] > 0


def test_the_mechanism_is_drawn_turned_and_moved(visit: Any) -> None:
    told = visit(
        strut(),
        """
        const canvas = one("canvas"), slider = one("input[type=range]"), out = one("output"), looks = [];
        const ink = () => canvas.toDataURL();
        const note = (what) => looks.push([what, +slider.value, out.textContent, ink()]);
        note("design");
        press("ArrowLeft", canvas); note("turned");
        canvas.dispatchEvent(new PointerEvent("pointermove", { buttons: 1, movementX: 40, movementY: 10 })); note("dragged");
        press(".", canvas); note("step");
        slider.value = 0; slider.dispatchEvent(new Event("input")); note("first");
        one("[data-view='y z']").click(); note("front");
        press(" ", canvas); await pause(500); const playing = one("[data-act=play]").textContent;
        press(" ", canvas); note("played"); const still = +slider.value; await pause(500);
        one("[data-layer=names]").click(); note("no names");
        return { looks, playing, stopped: still === +slider.value, last: +slider.max };
        """,  # noqa: E501
    )
    looks = {what: (frame, said) for what, frame, said, _ in told["looks"]}
    assert told["last"] == FRAMES - 1
    assert looks["design"][0] == looks["turned"][0] == 30
    assert looks["step"][0] == 31
    assert looks["first"][1].startswith("sample 0 · wheel travel −100 mm")  # the made-up grid's
    assert looks["played"][0] > 2
    assert (told["playing"], told["stopped"]) == ("pause", True)
    pictures = [picture for *_, picture in told["looks"]]
    assert len(set(pictures)) == len(pictures), [what for what, *_ in told["looks"]]


def test_without_poses_the_design_is_drawn_and_nothing_moves(visit: Any) -> None:
    shown = scene(cases.load("mcpherson_strut"), poses=False)
    told = visit(
        msgspec.structs.replace(results(), scenes={"strut": shown}),
        """
        const canvas = one("canvas"), seen = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
        press(" ", canvas);
        const controls = all("[data-act=play], input[type=range]").length;
        return { said: one("output").textContent, controls, drawn: seen.some(Boolean), note: one(".scene .note").textContent };
        """,  # noqa: E501
    )
    assert (told["said"], told["controls"], told["drawn"]) == ("design position", 0, True)
    assert "no answer in this run: this is the design position" in told["note"]


def test_earlier_runs_and_work_precision_are_drawn_where_there_are_any(visit: Any) -> None:
    past = [
        Past(run, "one", error, 10.0)
        for run, error in (("2026-11-01", 1e-12), ("2026-11-02", 0.0), ("2026-11-03", None))
    ]
    efforts = [
        Effort("one", "tol 1e-6", 1e-7, 20.0),
        Effort("gone", "default", 1e-9, 5.0),
        Effort("one", "tol 1e-3", 1e-4, 9.0),
    ]
    read = """
        const traces = (plot) => plot.data.map(({ meta, x, y }) => [meta, [...x], [...y]]);
        return all(".plot[data-drawn]").map((plot) => [plot.dataset.figure, traces(plot)]);
    """
    drawn = dict(visit(results(), read, history={"strut": past}, precision={"strut": efforts}))
    [curve, zeros, _] = drawn["case-0-trend-error"]
    assert curve == ["one", ["2026-11-01", "2026-11-02", "2026-11-03"], [1e-12, None, None]]
    assert zeros[1] == ["2026-11-02"]
    assert drawn["case-0-trend-time"] == [
        ["one", ["2026-11-01", "2026-11-02", "2026-11-03"], [10, 10, 10]]
    ]
    curves = {meta: (x, y) for meta, x, y in drawn["case-0-precision-projection"]}
    assert curves["one"] == ([9, 20], [1e-4, 1e-7])
    assert "gone" in curves


def test_hostile_text_is_text(visit: Any) -> None:
    shown = scene(cases.load("mcpherson_strut"))
    joints = [
        msgspec.structs.replace(shown.joints[0], name=HOSTILE, type=HOSTILE),
        *shown.joints[1:],
    ]
    run = results(case=HOSTILE)
    strange = msgspec.structs.replace(
        run.records[1], engine=HOSTILE, message=HOSTILE, version=HOSTILE
    )
    run = msgspec.structs.replace(
        run,
        records=[run.records[0], strange],
        scenes={HOSTILE: msgspec.structs.replace(shown, joints=joints, message=HOSTILE)},
    )
    past, effort = Past(HOSTILE, HOSTILE, 1e-9, 1.0), Effort(HOSTILE, HOSTILE, 1e-9, 1.0)
    told = visit(
        run,
        """
        const traces = all(".plot[data-drawn]").flatMap((plot) => plot.data);
        const raw = traces.filter(({ name, text, x }) => JSON.stringify([name, text, x]).includes("<")).length;
        return { raw, images: all("img").length, scripts: all("script").length, title: one("section.case h2").textContent,
          drawn: all(".plot[data-drawn]").length, links: all(".plot a").length,
          shown: all("section.case")[0].textContent.split("alert(1)").length };
        """,  # noqa: E501
        history={HOSTILE: [past, replace(past, run=f"{HOSTILE} again")]},
        precision={HOSTILE: [effort]},
    )
    assert told["title"] == HOSTILE
    assert told["raw"] == told["images"] == told["links"] == 0
    assert told["scripts"] == 7  # three of data, two of ours, Plotly unpacked, and this test's
    assert told["drawn"] == 7
    assert told["shown"] > 5


def test_the_curves_of_a_case_are_a_file(visit: Any) -> None:
    name, text = visit(
        strut(),
        """
        let text; const whole = URL.createObjectURL;
        URL.createObjectURL = (blob) => { text = blob.text(); return whole(blob); };
        let name; HTMLAnchorElement.prototype.click = function () { name = this.download; };
        one("[data-curves]").click();
        while (name === undefined) await pause();
        return [name, await text];
        """,
    )
    assert name.endswith(".csv")
    assert text.startswith("case,engine,mode,output,unit,sample,driver,")


def test_eight_engines_fit_into_a_page_of_900_px(visit: Any) -> None:
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
